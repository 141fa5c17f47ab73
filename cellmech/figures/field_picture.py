"""One field of one case, on the deformed cell."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from cellmech.errors import InputError
from cellmech.figures.style import SUBSTRATE
from cellmech.figures.substrate import polygons
from cellmech.result import Result

MARGIN = 0.08  # of the cell's diameter, around it


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
    grid = result.fields()
    scalars = [name for name, values in grid.point_data.items() if values.ndim == 1]
    if quantity not in scalars:
        rule = f"must be one of {', '.join(scalars)}"
        raise InputError(str(result.last_fields()[1]), quantity, rule)
    points, moves = np.asarray(grid.points)[:, :2], np.asarray(grid.point_data["displacement_um"])[:, :2]
    pivot = moves[np.argmin(points[:, 1])]
    points = points + pivot + magnify * (moves - pivot)
    triangles, values = _flat(grid), np.asarray(grid.point_data[quantity])
    if result.scene.cell.shape == "half":
        triangles = np.concatenate([triangles, triangles[:, ::-1] + len(points)])
        points, values = np.concatenate([points, points * [-1.0, 1.0]]), np.concatenate([values, values])
    if axes is None:
        axes = Figure(figsize=(6.4, 5.2), layout="constrained").add_subplot()
    figure = axes.get_figure()
    low, high = points.min(axis=0), points.max(axis=0)
    margin = MARGIN * (high - low).max()
    (x0, y0), (x1, y1) = low - margin, high + margin
    for ground in polygons(result.scene, (x0, x1, y0, y1)):
        axes.add_collection(PolyCollection(list(ground), facecolor=SUBSTRATE, edgecolor=SUBSTRATE, lw=0.8, zorder=0))
    image = axes.tripcolor(Triangulation(*points.T, triangles), values, shading="gouraud", zorder=1)
    axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xlabel="x [µm]", ylabel="y [µm]")
    times = f", displacements × {magnify:g}" if magnify != 1 else ""
    axes.set_title(f"{result.scene.title or result.name}, t = {result.number('t_s'):,.0f} s{times}")
    figure.colorbar(image, ax=axes, label=quantity)
    return figure


def _flat(grid: Any) -> np.ndarray:
    """Corners of flat triangles, four for an element of six points; shape (n, 3)."""
    cells = np.concatenate([nodes for _, nodes in sorted(grid.cells_dict.items())])
    if cells.shape[1] == 3:
        return cells
    parts = [cells[:, corners] for corners in ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))]
    return np.concatenate(parts)
