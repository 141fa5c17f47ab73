"""One field of one case on the deformed cell: a picture of its last state, or a film of all that were written."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from cellmech.errors import InputError
from cellmech.figures.body import START, read_body, rim_of
from cellmech.figures.film import write_film
from cellmech.figures.space import beyond, scale_of
from cellmech.figures.style import FADED, SUBSTRATE, field_label
from cellmech.figures.substrate import behind, polygons, section_words
from cellmech.results.result import Result, modelled

MARGIN, BELOW = 0.08, 3.0  # of the cell's diameter, around it; of this, below it where the substrate is drawn
FRAME_MS, LAST_MS = 120, 1500


class FieldFigure(Figure):
    """A figure that a notebook shows where it is the last word of a cell, without `%matplotlib inline`."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=110)
        return stream.getvalue()


@dataclass(frozen=True)
class State:
    """A field at one time, on flat triangles of the whole cell, or in space of its section through its centre.

    Args:
        t_s: the time [s].
        points: deformed corners [µm], shape (n, 2).
        triangles: their corners, shape (m, 3).
        values: of the field at the points, shape (n,).
        rim: edges of the nucleus's outline [µm], shape (k, 2, 2).
    """

    t_s: float
    points: np.ndarray
    triangles: np.ndarray
    values: np.ndarray
    rim: np.ndarray


def read_state(result: Result, t_s: float, file: Path, quantity: str, magnify: float) -> State:
    """Read a field file.

    Raises:
        InputError: for a field that is not there, or a broken file.
    """
    if not isinstance(magnify, int | float) or not 0 < magnify < math.inf:
        raise InputError("magnify", "", "must be a number above 0", magnify)
    grid = modelled(result.fields(file))
    scalars = [name for name, values in grid.point_data.items() if values.ndim == 1]
    if quantity not in scalars:
        raise InputError(str(file), quantity, f"must be one of {', '.join(scalars)}")
    points, moves, values, triangles, layer = _parts(grid, result, file, quantity)
    pivot = moves[np.argmin(points[:, 1])]
    points = points + pivot + magnify * (moves - pivot)
    if result.scene.cell.shape == "half" and result.scene.cell.geometry != "3d":
        triangles = np.concatenate([triangles, triangles[:, ::-1] + len(points)])
        points, values = np.concatenate([points, points * [-1.0, 1.0]]), np.concatenate([values, values])
        layer = np.tile(layer, 2)
    return State(t_s, points, triangles, values, rim_of(points[triangles], layer))


def _parts(grid: Any, result: Result, file: Path, quantity: str) -> tuple[np.ndarray, ...]:
    """Points of the plane, their displacements and values, triangles, their layers: of what was solved or a section."""
    if result.scene.cell.geometry == "3d":
        section = read_body(file, result.scene, quantity).section(part=START)
        points, now = (at.reshape(-1, 3)[:, :2] for at in (section.start, section.now))
        triangles = np.arange(len(points)).reshape(-1, 3)
        return points, now - points, section.values.ravel(), triangles, section.layer
    points, moves = np.asarray(grid.points)[:, :2], np.asarray(grid.point_data["displacement_um"])[:, :2]
    triangles, layer = _flat(grid), np.asarray(grid.cell_data["layer"])
    return points, moves, np.asarray(grid.point_data[quantity]), triangles, np.tile(layer, len(triangles) // len(layer))


def _flat(grid: Any) -> np.ndarray:
    """Corners of flat triangles, four for an element of six points; shape (n, 3)."""
    cells = np.concatenate([nodes for _, nodes in sorted(grid.cells_dict.items())])
    if cells.shape[1] == 3:
        return cells
    parts = [cells[:, corners] for corners in ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))]
    return np.concatenate(parts)


def draw_field(result: Result, quantity: str, magnify: float = 1.0, axes: Axes | None = None) -> Figure:
    """Draw a field of the last field file on the deformed cell, every element with its own values.

    Args:
        result: the case.
        quantity: a scalar of the field file, such as "sigma_mises_Pa".
        magnify: displacements are drawn so many times as large, but for that of the cell's lowest point.
        axes: where to draw; a figure of its own if None.

    Returns:
        The figure.

    Raises:
        InputError: for a field that is not there, or a broken file.
    """
    state = read_state(result, *result.last_fields(), quantity, magnify)
    return _draw(
        result,
        state,
        quantity,
        magnify,
        _view([state], BELOW if magnify == 1 else 1.0),
        scale_of(state.values, quantity),
        axes,
    )


def make_film(result: Result, path: Path, quantity: str, magnify: float = 1.0) -> int:
    """Write an animated GIF of a field over all field files, of one scale; the number of its pictures is returned.

    Raises:
        InputError: for a case with one field file only, a field that is not there, a file that is broken or cannot be
            written.
    """
    series = result.series()
    if len(series) < 2:
        hint = "Ask for more with output.times_s, such as studies/movie.toml."
        raise InputError(str(result.folder / "fields.pvd"), "", "must list several times for a film", None, hint)
    states = [read_state(result, *entry, quantity, magnify) for entry in series]
    view = _view(states, BELOW if magnify == 1 else 1.0)
    norm = scale_of(np.concatenate([state.values for state in states]), quantity)
    pictures = (_draw(result, state, quantity, magnify, view, norm) for state in states)
    return write_film(pictures, path, FRAME_MS, LAST_MS)


def _view(states: list[State], below: float) -> tuple[float, float, float, float]:
    """x and y limits [µm] that hold the cell in all its states, and so many margins below it."""
    low = np.min([state.points.min(axis=0) for state in states], axis=0)
    high = np.max([state.points.max(axis=0) for state in states], axis=0)
    margin = MARGIN * float((high - low).max())
    return float(low[0]) - margin, float(high[0]) + margin, float(low[1]) - below * margin, float(high[1]) + margin


def _draw(
    result: Result,
    state: State,
    quantity: str,
    magnify: float,
    view: tuple[float, float, float, float],
    norm: Normalize,
    axes: Axes | None = None,
) -> Figure:
    if axes is None:
        axes = FieldFigure(figsize=(6.4, 5.2), layout="constrained").add_subplot()
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    true, scene = magnify == 1, result.scene
    parts = [(ground, FADED) for ground in behind(scene)] + [(ground, SUBSTRATE) for ground in polygons(scene, view)]
    for ground, colour in parts if true else []:
        axes.add_collection(PolyCollection(list(ground), facecolor=colour, edgecolor=colour, lw=0.8, zorder=0))
    triangulation = Triangulation(*state.points.T, state.triangles)
    axes.add_collection(LineCollection(list(state.rim), color="black", lw=0.8, zorder=2))
    image = axes.tripcolor(triangulation, state.values, shading="gouraud", zorder=1, norm=norm)
    axes.set(xlim=view[:2], ylim=view[2:], aspect="equal", xlabel="x [µm]", ylabel="y [µm]")
    notes = [section_words(scene), "" if true else f"displacements × {magnify:g}, substrate not drawn"]
    below = ";  ".join(filter(None, notes))
    axes.set_title(f"{result.scene.title or result.name}, t = {state.t_s:,.0f} s" + f"\n{below}" * bool(below))
    figure.colorbar(image, ax=axes, label=field_label(quantity), extend=beyond(norm))
    return figure
