"""A measured outline: points of a closed curve from a CSV file."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from cellmech.errors import InputError

MOST_POINTS = 2000
KEY = "nucleus.outline_csv"
NAMED = ("x_um", "y_um", "z_um")
VIEWS = {"xy": "those of an outline from the side", "xz": "as in 3-D the outline is the one seen from above"}
STEP_BACK = math.radians(5.0)  # about a pixel of 0.35 um at a radius of 4 um
CENTRED_UM = 1e-5  # points so near about their centroid stay where they are

Points = tuple[tuple[float, float], ...]


def with_points(data: Mapping[str, Any], where: str) -> Mapping[str, Any]:
    """The data of a scene file with the points of its `nucleus.outline_csv` in the place of the file's name.

    The name counts from the folder of the scene file.

    Raises:
        InputError: for a file that is missing, or holds no such points.
    """
    nucleus = data.get("nucleus")
    if not isinstance(nucleus, Mapping) or not isinstance(nucleus.get("outline_csv"), str):
        return data
    name, cell = nucleus["outline_csv"], data.get("cell")
    if "outline_um" in nucleus:
        raise InputError(where, KEY, "must not stand beside nucleus.outline_um", name, "Write one of the two.")
    in_space = isinstance(cell, Mapping) and cell.get("geometry") == "3d"
    points = read_points(Path(where).parent / name, where, name, "xz" if in_space else "xy")
    rest = {key: value for key, value in nucleus.items() if key != "outline_csv"}
    return {**data, "nucleus": {**rest, "outline_um": points}}


def read_points(path: Path, where: str, name: str, axes: str) -> list[list[float]]:
    """Two coordinates of a file's rows [µm]: of the columns x_um and y_um, else of the first two.

    A line of words may head it. One that names columns of other axes is that of another view.

    Args:
        path: of the file.
        where, name: for messages: the scene file, and the file as it is named there.
        axes: "xy" for an outline from the side, "xz" for one from above.

    Raises:
        InputError: naming what is wrong.
    """

    def wrong(rule: str, got: object = name, hint: str = "") -> InputError:
        return InputError(where, KEY, rule, got, hint)

    try:
        rows = [row for row in csv.reader(path.read_text(encoding="utf-8-sig").splitlines()) if any(row)]
    except FileNotFoundError:
        raise wrong(f"there is no such file: {path}") from None
    except (OSError, ValueError, csv.Error) as error:
        raise wrong(f"cannot be read ({error})") from None
    columns, start = (0, 1), 0
    if rows and not _numbers(rows[0], columns):
        head, wanted = [cell.strip() for cell in rows[0]], [f"{axis}_um" for axis in axes]
        if set(wanted) <= set(head):
            columns = head.index(wanted[0]), head.index(wanted[1])
        elif known := [cell for cell in head if cell in NAMED]:
            raise wrong(f"must have the columns {' and '.join(wanted)}, {VIEWS[axes]}", ", ".join(known))
        start = 1
    points = []
    for line, row in enumerate(rows[start:], start + 1):
        point = _numbers(row, columns)
        if point is None:
            raise wrong(
                f"must hold two numbers in each line, {' and '.join(axes)} in µm; line {line} does not",
                ",".join(row)[:60],
            )
        points.append(point)
    if points and points[0] == points[-1]:
        points.pop()
    if not 8 <= len(points) <= MOST_POINTS:
        raise wrong(f"must hold 8 to {MOST_POINTS} points, in order around the outline", f"{len(points)} points")
    return points


def _numbers(row: list[str], columns: tuple[int, int]) -> list[float] | None:
    try:
        return [float(row[column]) for column in columns]
    except (IndexError, ValueError):
        return None


def area_um2(points: Sequence[tuple[float, float]]) -> float:
    """Of a polygon, > 0 if it runs counter-clockwise [µm²]."""
    return sum(cross for _, _, cross in _edges(points)) / 2


def _edges(points: Sequence[tuple[float, float]]) -> list[tuple[tuple[float, float], tuple[float, float], float]]:
    """Ends of a polygon's edges, and twice the area that each has with (0, 0)."""
    return [(a, b, a[0] * b[1] - b[0] * a[1]) for a, b in pairwise([*points, points[0]])] if points else []


def centred(points: Sequence[tuple[float, float]]) -> Points:
    """A polygon about its centroid, counter-clockwise [µm]; one without an area stays as it is."""
    ends, area = _edges(points), area_um2(points)
    if area == 0.0:
        return tuple(points)
    x, y = (sum((a[k] + b[k]) * cross for a, b, cross in ends) / (6 * area) for k in (0, 1))
    if math.hypot(x, y) > CENTRED_UM:
        points = [(round(at - x, 6), round(up - y, 6)) for at, up in points]
    return tuple(points) if area > 0 else tuple(reversed(points))


def turns_once(points: Points) -> bool:
    """True if each ray from (0, 0) meets a polygon once, but for steps back as small as those of pixels."""
    angles = [math.atan2(y, x) for x, y in points]
    turns = [math.remainder(b - a, 2 * math.pi) for a, b in pairwise([*angles, angles[0]])]
    if not math.isclose(sum(turns), 2 * math.pi):
        return False
    on, farthest = 0.0, 0.0
    for turn in (*turns, *turns):  # twice around: a step back may lie where the points begin
        on += turn
        farthest = max(farthest, on)
        if farthest - on > STEP_BACK:
            return False
    return True
