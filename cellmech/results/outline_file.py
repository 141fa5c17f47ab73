"""Outlines of cell and nucleus as points, to lay over a microscope's picture: `outline.csv`.

One row a point, in order around the body, the first not repeated. `body` is nucleus or cell, `state` reference (before
the load, where the cell begins) or deformed, `view` section (in x and y: of a ball the one square to z through the
nucleus's centroid) or above (its shadow, in x and z, of a ball only). Outside a section's plane a column is empty.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from dolfinx import fem

from cellmech.cell.observables import Observer
from cellmech.fem.boundary import boundary
from cellmech.fem.outline import Outline, along
from cellmech.results.records import OUTLINE, CaseFolder

POINT = 1e-9  # of the curve's size: a shorter edge is a point, as where a section meets a corner of a facet
COLUMNS = "body,state,view,x_um,y_um,z_um"


def write_outlines(folder: CaseFolder, observer: Observer) -> None:
    """Write the outlines of the present state. Collective."""
    rows = [COLUMNS]
    for body, state, view, points in _outlines(observer):
        cells = [[f"{value:.9g}" for value in point] for point in points]
        if view == "above":
            cells = [[x, "", z] for x, z in cells]
        rows += [",".join([body, state, view, *row, *[""] * (3 - len(row))]) for row in cells]
    folder.write_text(OUTLINE, "\n".join([*rows, ""]))


def _outlines(observer: Observer) -> Iterator[tuple[str, str, str, np.ndarray]]:
    body, mirrored, nucleus = observer.run.body, observer.layout.mirrored, observer.nucleus
    bounds = {"nucleus": nucleus, "cell": boundary(body.domain, body.space, "outer", mirrored)}
    for name, bound in bounds.items():
        for state, u in (("reference", fem.Function(body.space)), ("deformed", observer.run.state.u)):
            if isinstance(bound, Outline) or isinstance(nucleus, Outline):
                edges = bound.comm.allgather(bound.nodes(u))
                yield name, state, "section", around(np.concatenate(edges), observer.layout.half)
                continue
            level = float(nucleus.content(u)[2][2])
            edges = bound.comm.allgather(bound.section(u, 2, level))
            flat = around(np.concatenate(edges), observer.layout.half)
            yield name, state, "section", np.column_stack([flat, np.full(len(flat), level)])
            yield name, state, "above", _points(bound.shadow(u))


def around(edges: np.ndarray, half: bool) -> np.ndarray:
    """Points of a closed curve in order [µm], shape (n, 2).

    Args:
        edges: in any order, as `curves` has them, each counter-clockwise, shape (n_edges, n_nodes, 2).
        half: whether x = 0 mirrors them; else they are the whole curve.
    """
    edges = edges[np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1) > POINT * np.ptp(edges[:, :2])]
    if half:
        image = edges[:, [1, 0, *range(edges.shape[1] - 1, 1, -1)]] * [-1.0, 1.0]
        edges = np.concatenate([edges, image])
    order = [int(np.argmin(edges[:, 0, 1]))]
    left = np.delete(np.arange(len(edges)), order)
    while len(left):
        ways = edges[left, 0] - edges[order[-1], 1]
        following = int(np.argmin(np.einsum("nk,nk->n", ways, ways)))
        order.append(int(left[following]))
        left = np.delete(left, following)
    return _points(edges[order])


def _points(edges: np.ndarray) -> np.ndarray:
    """Points of edges in order, as many on each as its order [µm], shape (n, 2)."""
    count = edges.shape[1] - 1
    return along(edges, np.arange(count) / count).reshape(-1, 2)
