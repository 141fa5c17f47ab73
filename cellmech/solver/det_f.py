"""The watch on det F, and the points of an element that it and the observables look at."""

from __future__ import annotations

from typing import Any

import basix
import numpy as np
import ufl
from dolfinx import fem

from cellmech.fem.jit import PointValues
from cellmech.fem.subdivision import lattice
from cellmech.mechanics.balance import Body
from cellmech.mechanics.kinematics import deformation_gradient
from cellmech.solver.state import State

REPORTED = {1: 1, 2: 2, 3: 4}  # subdivisions of an edge into reported points, by the displacement's order


class DetFWatch:
    """det F where forms are integrated and numbers reported: no state with det F <= 0 at such a point is accepted."""

    def __init__(self, body: Body, state: State) -> None:
        mesh = body.domain.mesh
        inside = quadrature(mesh, body.bulk_degree)[0]
        points = np.vstack([inside, lattice(REPORTED[order_of(body.space)], mesh.topology.dim)[0]])
        det_F = ufl.det(deformation_gradient(state.u, body.kinematics))
        self._everywhere, self._inside = (PointValues(det_F, at, mesh.comm) for at in (points, inside))
        self._cells = body.domain.own_cells
        self._place = PointValues(ufl.SpatialCoordinate(mesh), points, mesh.comm)(self._cells)
        self._comm = mesh.comm
        self.worst: tuple[float, ...] | None = None  # value and place [µm]

    def admissible(self, least: float = 0.0, on_the_way: bool = False) -> bool:
        """True if det F > least at every point on every rank (collective); remembers the worst point if not.

        On the way to a solution the quadrature points are enough.
        """
        values = (self._inside if on_the_way else self._everywhere)(self._cells)[..., 0]
        mine: tuple[float, ...] = (np.inf, 0.0)
        if values.size:
            k = np.unravel_index(np.argmin(values), values.shape)  # a NaN counts as the least
            value = float(values[k]) if np.isfinite(values[k]) else -np.inf
            mine = (value, *map(float, self._place[k]))
        if self._comm.size > 1:
            mine = min(self._comm.allgather(mine))
        if mine[0] > least:
            return True
        self.worst = mine
        return False


def quadrature(mesh: Any, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Points, shape (n, d), and weights, shape (n,), on the reference cell (sum of weights 1/2 or 1/6)."""
    kind = basix.CellType.triangle if mesh.topology.dim == 2 else basix.CellType.tetrahedron
    points, weights = basix.make_quadrature(kind, degree)
    return np.asarray(points), np.asarray(weights)


def order_of(space: fem.FunctionSpace) -> int:
    """Order of a displacement on the edges of its elements."""
    return len(space.dofmap.dof_layout.entity_closure_dofs(1, 0)) - 1


def node_points(space: fem.FunctionSpace) -> np.ndarray:
    """Reference coordinates of an element's nodes, shape (n_nodes, 2)."""
    return np.asarray(space.element.interpolation_points())
