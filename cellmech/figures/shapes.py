"""Figures 3, 5 and 7: the deformed cell of each case, to scale and, where that shows too little, magnified."""

from __future__ import annotations

import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cellmech.figures.parameters import parameter
from cellmech.figures.render import Colour, Shape, View, by_layer, picture, probe, read_shape
from cellmech.figures.results import StudyResult
from cellmech.figures.sheet import UNDEFORMED, Sheet
from cellmech.figures.style import FADED, FAULT_COLOUR, LAWS, SMALL, SUBSTRATE, TINY
from cellmech.figures.substrate import behind, magnified, polygons, section_words
from cellmech.results.result import Result
from cellmech.scene.placement import placement

SEEN = 0.1  # a displacement above this share of the diameter needs no magnification
AIM = 0.2  # a magnified one should not exceed this share
FACTORS = (1000, 500, 200, 100, 50, 30, 20, 10, 5, 4, 3, 2)
PX_PER_IN = 214  # of the pictures

Report: TypeAlias = Callable[[Result], Sequence[str]]


@dataclass(frozen=True)
class Pose:
    """One case's cell, where it was and where it is.

    Args:
        case: the case.
        t_s: time of the field file [s].
        shape: the whole cell.
        centre: of the cell at the start [µm].
        pivot: displacement of the cell's lowest point [µm], about which displacements are magnified.
    """

    case: Result
    t_s: float
    shape: Shape
    centre: np.ndarray
    pivot: np.ndarray

    def largest(self, origin: np.ndarray | float = 0.0) -> float:
        """Largest displacement [µm], less that of an origin."""
        return float(np.max(np.linalg.norm(self.shape.displacement - origin, axis=-1)))


def read_pose(case: Result) -> Pose:
    """Read a case's last field file."""
    t_s, path = case.last_fields()
    shape = read_shape(path, case.scene)
    corners, moves = shape.reference.reshape(-1, 2), shape.displacement.reshape(-1, 2)
    lowest = int(np.argmin(corners[:, 1]))
    centre = np.array([placement(case.scene).centre[0], corners[lowest, 1] + case.scene.radius_um])
    return Pose(case, t_s, shape, centre, moves[lowest])


def magnification(poses: list[Pose]) -> int:
    """One factor for all cases, 1 when the deformation shows without; no element turns over at it."""
    factor = 1
    largest = max(pose.largest(pose.pivot) / (2 * pose.case.scene.radius_um) for pose in poses)
    if 0 < largest < SEEN:
        fitting = (n for n in FACTORS if n * largest <= AIM and all(_sound(pose, n) for pose in poses))
        factor = next(fitting, 1)
    return factor


def _sound(pose: Pose, factor: int) -> bool:
    a, b, c = np.moveaxis(pose.shape.moved(pose.pivot, factor), 1, 0)
    d, e, f = np.moveaxis(pose.shape.reference, 1, 0)
    return bool(np.all(_cross(b - a, c - a) * _cross(e - d, f - d) > 0))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def draw_shapes(study: StudyResult, report: Report | None = None) -> Figure:
    """Draw the figure: a column for each case; true shapes above, magnified ones below.

    Args:
        study: its cases.
        report: lines to stand below a case's column.

    Raises:
        InputError: for a field file that is missing or broken.
        CellmechError: when pictures cannot be drawn on this machine.
    """
    cases = study.holding("fields.pvd")
    probe()
    poses = {name: read_pose(case) for name, case in cases.items()}
    factor = magnification(list(poses.values()))
    words = {name: report(case) for name, case in cases.items()} if report else {}
    lines = max(map(len, words.values()), default=0)
    sheet = Sheet(len(study.varied), _view(list(poses.values()), factor), factor, lines)
    for column, name in enumerate(study.varied):
        pose = poses.get(name)
        for row in range(sheet.rows):
            axes = sheet.panel(row, column)
            if pose is not None:
                _draw_panel(axes, pose, sheet, factor if row else 1)
            if row == 0:
                _name(axes, caption(name, study.varied[name]), string.ascii_lowercase[column % 26], pose)
            if column == 0:
                label = "true scale" if row == 0 else f"displacements × {factor}"
                axes.set_ylabel(label, fontsize=13, weight="bold", labelpad=8)
        sheet.write_below(column, words.get(name, ()))
    sheet.finish(study)
    return sheet.figure


def caption(name: str, varied: Mapping[str, object]) -> tuple[str, str]:
    """The name of a case, and what else sets it apart."""
    law = LAWS.get(str(varied.get("cell.law", name)))
    rest = {key: value for key, value in varied.items() if key != "cell.law"}
    settings = ",  ".join(parameter(key).setting(value) for key, value in rest.items())
    return (law.label if law else name), settings


def _view(poses: list[Pose], factor: int) -> View:
    """x and y limits [µm] that hold every cell, before and after, and the substrate around."""
    corners = np.concatenate([p.shape.moved(p.pivot, n).reshape(-1, 2) for p in poses for n in {1, factor}])
    starts = np.concatenate([p.shape.reference.reshape(-1, 2) for p in poses])
    both = np.concatenate([corners, starts])
    r = max(pose.case.scene.radius_um for pose in poses)
    (x0, y0), (x1, y1) = both.min(axis=0), both.max(axis=0)
    return float(x0 - 0.3 * r), float(x1 + 0.3 * r), float(y0 - 0.55 * r), float(y1 + 0.1 * r)


def _draw_panel(axes: Axes, pose: Pose, sheet: Sheet, factor: int) -> None:
    scene, true, view = pose.case.scene, factor == 1, sheet.view
    ground = polygons(scene, view) if true else [magnified(scene, pose.centre + pose.pivot, view, factor)]
    corners = pose.shape.moved(pose.pivot, factor)
    parts: list[tuple[np.ndarray, Colour]] = [(of, FADED) for of in behind(scene) if true]
    parts += [(of, SUBSTRATE if true else FADED) for of in ground]
    parts.append((corners, by_layer(pose.shape.layer)))
    image = picture(parts, view, round(PX_PER_IN * sheet.wide))
    axes.imshow(image, extent=view, interpolation="antialiased", aspect="equal")
    angle = np.linspace(0, 2 * np.pi, 361)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    for radius in (scene.radius_um, scene.nucleus_radius_um):
        axes.plot(*(pose.centre + (0.0 if true else pose.pivot) + radius * circle).T, **UNDEFORMED)
    axes.set(xlim=view[:2], ylim=view[2:])
    scale_bar(axes, view, factor)
    if not true:
        note: dict[str, Any] = dict(ha="right", fontsize=TINY, color="#555555")
        axes.text(0.975, 0.035, "substrate:\nsee note", transform=axes.transAxes, **note)


def scale_bar(axes: Axes, view: View, factor: int) -> None:
    """Lengths at the lower left: of places, and of displacements where these are magnified."""
    width = view[1] - view[0]
    length = _round_length(width / 5)
    bars = [(length, f"{length:g} µm")]
    if factor > 1:
        moved = _round_length(1.2 * length / factor)
        bars = [(length, f"{length:g} µm, cell"), (moved * factor, f"{moved:g} µm, displacement")]
    for index, (drawn, text) in enumerate(bars):
        x, y = view[0] + 0.035 * width, view[2] + (0.04 + 0.062 * (len(bars) - 1 - index)) * width
        axes.plot([x, x + drawn], [y, y], color="black", lw=3.2, solid_capstyle="butt")
        box = dict(boxstyle="square,pad=0.1", fc="white", ec="none", alpha=0.7)
        axes.text(x + drawn + 0.02 * width, y, text, va="center", fontsize=SMALL, bbox=box)


def _round_length(most: float) -> float:
    power = 10.0 ** np.floor(np.log10(most))
    return float(next(n for n in (5, 2, 1) if n * power <= most) * power)


def _name(axes: Axes, captions: tuple[str, str], letter: str, pose: Pose | None) -> None:
    """The case, and the state that is shown."""
    name, settings = captions
    settings = ",  ".join(filter(None, [settings, section_words(pose.case.scene) if pose else ""]))
    text, colour = "no result: see below", FAULT_COLOUR
    if pose is not None and pose.case.failure:
        text = f"FAILED: last state, t = {pose.t_s:,.0f} s"
    elif pose is not None:
        law = pose.case.scene.cell.law
        which = "" if name == LAWS[law].label else f"{LAWS[law].label},  "
        text, colour = f"{which}t = {pose.t_s:,.0f} s;  largest displacement {pose.largest():.2f} µm", "black"
    place: dict[str, Any] = dict(xycoords="axes fraction", textcoords="offset points", ha="center")
    axes.set_title(f"({letter})  {name}", fontsize=13, weight="bold", pad=38 if settings else 22)
    axes.annotate(settings, (0.5, 1.0), (0, 22), fontsize=SMALL + 1, **place)
    axes.annotate(text, (0.5, 1.0), (0, 6), fontsize=SMALL, color=colour, **place)
