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
    name = nucleus["outline_csv"]
    if "outline_um" in nucleus:
        raise InputError(where, KEY, "must not stand beside nucleus.outline_um", name, "Write one of the two.")
    points = read_points(Path(where).parent / name, where, name)
    rest = {key: value for key, value in nucleus.items() if key != "outline_csv"}
    return {**data, "nucleus": {**rest, "outline_um": points}}


def read_points(path: Path, where: str, name: str) -> list[list[float]]:
    """x and y of a file's rows [µm]: of its columns x_um and y_um, else of the first two; a line of words may head it.

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
        head = [cell.strip() for cell in rows[0]]
        columns = (head.index("x_um"), head.index("y_um")) if {"x_um", "y_um"} <= set(head) else columns
        start = 1
    points = []
    for line, row in enumerate(rows[start:], start + 1):
        point = _numbers(row, columns)
        if point is None:
            raise wrong(f"must hold two numbers in each line, x and y in µm; line {line} does not", ",".join(row)[:60])
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


def centred(points: Sequence[tuple[float, float]]) -> Points:
    """A polygon about its centroid, counter-clockwise [µm]; one without an area stays as it is."""
    ends = [(a, b, a[0] * b[1] - b[0] * a[1]) for a, b in pairwise([*points, points[0]])] if points else []
    area = sum(cross for _, _, cross in ends) / 2
    if area == 0.0:
        return tuple(points)
    x, y = (sum((a[k] + b[k]) * cross for a, b, cross in ends) / (6 * area) for k in (0, 1))
    if math.hypot(x, y) > CENTRED_UM:
        points = [(round(at - x, 6), round(up - y, 6)) for at, up in points]
    return tuple(points) if area > 0 else tuple(reversed(points))


def turns_once(points: Points) -> bool:
    """True if each ray from (0, 0) meets a polygon once."""
    ways = [a[0] * b[1] - b[0] * a[1] for a, b in pairwise([*points, points[0]])]
    angles = [math.atan2(y, x) for x, y in points]
    turns = [math.remainder(b - a, 2 * math.pi) for a, b in pairwise([*angles, angles[0]])]
    return min(ways) > 0 and math.isclose(sum(turns), 2 * math.pi)
