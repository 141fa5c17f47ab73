"""Sheets of the deformed cell of each case, to scale and, where that shows too little, magnified."""

from __future__ import annotations

import math
import string
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from cellmech.cell.outlines import cell_outline, nucleus_outline, points_of
from cellmech.figures.body import SUBDIVISIONS, rim_of
from cellmech.figures.parameters import parameter
from cellmech.figures.render import Colour, Shape, View, picture, read_shape
from cellmech.figures.results import StudyResult
from cellmech.figures.sheet import UNDEFORMED, Caption, Sheet
from cellmech.figures.space import FIELD_COLOURS, Paint, beyond, scale_of
from cellmech.figures.style import FADED, FAULT_COLOUR, LAWS, SMALL, SUBSTRATE, TINY, field_label
from cellmech.figures.substrate import behind, polygons, section_words
from cellmech.results.result import Result
from cellmech.scene.placement import placement
from cellmech.scene.variants import value_text

SEEN = 0.1  # a displacement above this share of the diameter needs no magnification
AIM = 0.2  # a magnified one should not exceed this share
FACTORS = (1000, 500, 200, 100, 50, 30, 20, 10, 5, 4, 3, 2)
PX_PER_IN = 214  # of the pictures
MOST_PANELS = 64
LARGE, FEW_PIECES = 4, 2  # panels up to which all are large; into which edges of elements are cut in smaller ones
MOST_COMPLAINT = 600  # characters on what is missing
MOST_SETTINGS = 4  # of a case that are named above its panel

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


def read_pose(case: Result, quantity: str | None = None, pieces: int = SUBDIVISIONS) -> Pose:
    """Read a case's last field file, and a scalar of it; `pieces` as a `Body` has them."""
    t_s, path = case.last_fields()
    shape = read_shape(path, case.scene, quantity, pieces)
    corners, moves = shape.reference.reshape(-1, 2), shape.displacement.reshape(-1, 2)
    lowest = int(np.argmin(corners[:, 1]))
    centre = np.array([placement(case.scene).centre[0], corners[lowest, 1] + case.scene.semi_axes_um[1]])
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


def draw_shapes(
    study: StudyResult,
    report: Report | None = None,
    quantity: str | None = None,
    magnify: bool = False,
    px_per_in: int = PX_PER_IN,
    count: int = 0,
) -> Figure:
    """Draw the deformed cell of each case, true to scale.

    Args:
        study: its cases; of more than `MOST_PANELS` the first are drawn, and the figure says so.
        report: lines to stand below a case's panel.
        quantity: a scalar of the field files to colour by, on one scale for all; None to colour the layers.
        magnify: whether a second panel shows each case's displacements magnified, where true ones show too little.
        px_per_in: resolution of the panels.
        count: how many cases there are, if more than in the study.

    Raises:
        InputError: for a field file that is missing or broken.
    """
    names = list(study.varied)[:MOST_PANELS]
    cases = {name: case for name, case in study.holding("fields.pvd").items() if name in names}
    pieces = SUBDIVISIONS if len(names) <= LARGE else FEW_PIECES
    poses = {name: read_pose(case, quantity, pieces) for name, case in cases.items()}
    factor = magnification(list(poses.values())) if magnify else 1
    paint = Paint()
    if quantity is not None:
        norm = scale_of(np.concatenate([pose.shape.values.ravel() for pose in poses.values()]), quantity)
        paint = Paint(norm, matplotlib.colormaps[FIELD_COLOURS])
    shared = shared_words(poses.values())
    captions = [_caption(study, index, name, poses.get(name), shared) for index, name in enumerate(names)]
    reports = [report(cases[name]) if name in cases else () for name in names] if report else ()
    view = _view(list(poses.values()), factor)
    lead, notes = ",  ".join(shared), _notes(study, factor, max(count, len(study.varied)))
    sheet = Sheet(study.title, lead, captions, view, factor, reports, notes, with_bar=quantity is not None)
    for index, name in enumerate(names):
        for row in range(sheet.rows):
            axes = sheet.panel(index, row)
            if name in poses:
                _draw_panel(axes, poses[name], sheet, factor if row else 1, paint, px_per_in)
            if sheet.rows == 2 and index % sheet.columns == 0:
                label = "true scale" if row == 0 else f"displacements × {factor}"
                axes.set_ylabel(label, fontsize=sheet.size, weight="bold", labelpad=8)
    sheet.finish(study, None if quantity is None else lambda axes: colour_bar(axes, paint, quantity))
    return sheet.figure


def shared_words(poses: Iterable[Pose]) -> list[str]:
    """What is said of all cases at once: law, time, plane of the section, where these are the same."""
    found = [
        (", ".join(LAWS[law].label for law in pose.case.scene.laws()), _time(pose), section_words(pose.case.scene))
        for pose in poses
    ]
    return [next(iter(words)) for words in map(set, zip(*found, strict=True)) if len(words) == 1 and words != {""}]


def _time(pose: Pose) -> str:
    return f"FAILED: last state, t = {pose.t_s:,.0f} s" if pose.case.failure else f"t = {pose.t_s:,.0f} s"


def _notes(study: StudyResult, factor: int, count: int) -> list[tuple[str, str]]:
    notes = [(study.complaint(MOST_COMPLAINT), FAULT_COLOUR)] if study.faults() else []
    if count > MOST_PANELS:
        notes.append((f"The first {MOST_PANELS} of {count} cases.", FAULT_COLOUR))
    if factor > 1:
        note = f"displacements from the lowest point of the cell are drawn {factor} times too large, without substrate."
        notes.append((f"Lower panels: {note}", "black"))
    return notes


def _caption(study: StudyResult, index: int, name: str, pose: Pose | None, shared: Sequence[str]) -> Caption:
    """The case, and the state that is shown."""
    head, settings = caption(name, study.varied[name])
    if settings and _made_of_settings(study, name):
        head, settings = settings, ""  # of which the name is made
    count = min(len(study.varied), MOST_PANELS)
    if count == 1 and study.title:
        head = ""
    elif count > 1:
        number = string.ascii_lowercase[index] if count <= len(string.ascii_lowercase) else str(index + 1)
        head = f"({number})  {head}"
    if pose is None:
        return Caption(head, ";  ".join(filter(None, [settings, "no result: see below"])), True)
    case = pose.case
    laws = ", ".join(LAWS[law].label for law in case.scene.laws())
    own = [laws if laws != caption(name, study.varied[name])[0] else "", _time(pose), section_words(case.scene)]
    words = [settings, *(word for word in own if word not in shared)]
    words.append(f"largest displacement {pose.largest():.2f} µm")
    if math.isfinite(stress := case.get("nucleus.sigma_mises_max_Pa")):
        words.append(f"σ in the nucleus up to {stress:.3g} Pa")
    return Caption(head, ";  ".join(filter(None, words)), bool(case.failure))


def case_name(study: StudyResult, name: str) -> str:
    """A case in a legend: what sets it apart, or its name where that says more."""
    head, settings = caption(name, study.varied.get(name, {}))
    return settings if settings and _made_of_settings(study, name) else head


def _made_of_settings(study: StudyResult, name: str) -> bool:
    """Whether a case has its name from what is varied, as sweeps name theirs."""
    values = study.varied.get(name, {}).values()
    return "=" in name or name in [value_text(value) for value in values if isinstance(value, bool | int | float | str)]


def caption(name: str, varied: Mapping[str, object]) -> tuple[str, str]:
    """The name of a case, and what else sets it apart."""
    law = LAWS.get(str(varied.get("cell.law", name)))
    rest = {key: value for key, value in varied.items() if key != "cell.law"}
    few = rest if len(rest) <= MOST_SETTINGS else {}
    settings = ",  ".join(parameter(key).setting(value) for key, value in few.items())
    return (law.label if law else name), settings


def _view(poses: list[Pose], factor: int) -> View:
    """x and y limits [µm] that hold every cell, before and after, and the substrate around."""
    corners = np.concatenate([p.shape.moved(p.pivot, n).reshape(-1, 2) for p in poses for n in {1, factor}])
    starts = np.concatenate([p.shape.reference.reshape(-1, 2) for p in poses])
    both = np.concatenate([corners, starts])
    r = max(pose.case.scene.radius_um for pose in poses)
    (x0, y0), (x1, y1) = both.min(axis=0), both.max(axis=0)
    return float(x0 - 0.3 * r), float(x1 + 0.3 * r), float(y0 - 0.55 * r), float(y1 + 0.1 * r)


def _draw_panel(axes: Axes, pose: Pose, sheet: Sheet, factor: int, paint: Paint, px_per_in: int) -> None:
    scene, true, view = pose.case.scene, factor == 1, sheet.view
    corners = pose.shape.moved(pose.pivot, factor)
    parts: list[tuple[np.ndarray, Colour]] = []
    if true:
        parts = [(of, FADED) for of in behind(scene)] + [(of, SUBSTRATE) for of in polygons(scene, view)]
    parts.append((corners, paint(pose.shape)))
    image = picture(parts, view, round(px_per_in * sheet.wide))
    axes.imshow(image, extent=view, interpolation="antialiased", aspect="equal")
    if paint.norm is not None:
        axes.add_collection(LineCollection(list(rim_of(corners, pose.shape.layer)), color="black", lw=0.8))
    for outline in (cell_outline(scene), nucleus_outline(scene)):
        axes.plot(*(pose.centre + (0.0 if true else pose.pivot) + points_of(outline)).T, **UNDEFORMED)
    axes.set(xlim=view[:2], ylim=view[2:])
    scale_bar(axes, view, factor, sheet.wide)


def colour_bar(axes: Axes, paint: Paint, quantity: str) -> None:
    """A field's scale, lying, its name above it."""
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    mapped = ScalarMappable(paint.norm, paint.colours)
    figure.colorbar(mapped, cax=axes, orientation="horizontal", extend=beyond(paint.norm)).minorticks_off()
    axes.tick_params(labelsize=SMALL - 1, pad=1)
    axes.set_title(field_label(quantity), fontsize=SMALL, pad=4)


def scale_bar(axes: Axes, view: View, factor: int, wide_in: float) -> None:
    """Lengths at the lower left: of places, and of displacements where these are magnified.

    Args:
        axes: to draw on.
        view: what they show [µm].
        factor: of the displacements.
        wide_in: width of the axes [inches].
    """
    width = view[1] - view[0]
    inch = width / wide_in
    length = _round_length(width / 5)
    bars = [(length, f"{length:g} µm")]
    if factor > 1:
        moved = _round_length(1.2 * length / factor)
        bars = [(length, f"{length:g} µm"), (moved * factor, f"{moved:g} µm displaced")]
    for index, (drawn, text) in enumerate(bars):
        x, y = view[0] + 0.09 * inch, view[2] + (0.12 + 0.19 * (len(bars) - 1 - index)) * inch
        axes.plot([x, x + drawn], [y, y], color="black", lw=3.2 if wide_in > 2.2 else 2.2, solid_capstyle="butt")
        box = dict(boxstyle="square,pad=0.1", fc="white", ec="none", alpha=0.7)
        size = SMALL if wide_in > 2.2 else TINY - 1
        axes.text(x + drawn + 0.06 * inch, y, text, va="center", fontsize=size, bbox=box)


def _round_length(most: float) -> float:
    power = 10.0 ** np.floor(np.log10(most))
    return float(next(n for n in (5, 2, 1) if n * power <= most) * power)
