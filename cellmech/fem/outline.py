"""A named boundary line of the mesh as numpy arrays: where its edges are now, and where obstacles stand to them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from cellmech.fem.crossing import crossing_of
from cellmech.fem.domain import Domain
from cellmech.mechanics.obstacles import Obstacle, depth_and_normal

GAUSS_POINTS = 8
SAMPLES = 9  # of an edge, its ends among them
CLOSER_LOOKS, ZOOMS = 4, 3  # edges whose depth is looked for more closely, each time at a quarter of the distance
# Where an edge's nodes lie between its ends, by their number: Basix's Gauss-Lobatto points.
INNER_NODES = {2: (), 3: (0.5,), 4: (0.5 - 0.05**0.5, 0.5 + 0.05**0.5)}
ROUNDS, HALVINGS = 8, 4  # of an eighth of an edge, bisected so often in one round: in the end 1e-11 µm


def depth(obstacle: Obstacle, x: np.ndarray) -> np.ndarray:
    """Depth [µm] of points inside an obstacle (`obstacles.depth_and_normal`).

    Args:
        obstacle: the obstacle.
        x: points [µm], shape (..., 2).
    """
    found, _ = depth_and_normal(obstacle, np.moveaxis(x, -1, 0), np.sqrt, np.maximum)
    return np.asarray(found)


def deepest(obstacles: Iterable[Obstacle], x: np.ndarray) -> np.ndarray:
    """Largest depth over the obstacles [µm], -inf without any; shape x.shape[:-1]."""
    result = np.full(x.shape[:-1], -np.inf)
    for obstacle in obstacles:
        np.maximum(result, depth(obstacle, x), out=result)
    return result


def owned_dofs(domain: Domain, space: fem.FunctionSpace, name: str) -> np.ndarray:
    """Dofs of the facets of a group that this rank owns, shape (n_facets, n_nodes): of ends, then sides, then inside.

    Args:
        domain: the mesh, of triangles or tetrahedra.
        space: of Lagrange functions.
        name: facet group, on the boundary or between cells; an absent one has no facets.
    """
    topology, tags, layout = domain.mesh.topology, domain.facet_tags, space.dofmap.dof_layout
    dim = topology.dim
    facets = tags.indices[tags.values == domain.facets[name]] if name in domain.facets else np.empty(0, np.int32)
    facets = facets[facets < topology.index_map(dim - 1).size_local]
    topology.create_connectivity(dim - 1, dim)
    topology.create_connectivity(dim, dim - 1)
    to_cell, to_facet = topology.connectivity(dim - 1, dim), topology.connectivity(dim, dim - 1)
    closures = [layout.entity_closure_dofs(dim - 1, local) for local in range(dim + 1)]
    dofs = []
    for facet in facets:
        cell = to_cell.links(facet)[0]
        local = int(np.nonzero(to_facet.links(cell) == facet)[0][0])
        dofs.append(space.dofmap.cell_dofs(cell)[closures[local]])
    return np.array(dofs, dtype=np.int64).reshape(-1, len(closures[0]))


class Outline:
    """The edges of one facet group that this rank owns.

    Args:
        domain: the mesh.
        space: displacement space, of order 1, 2 or 3 on the edges.
        name: facet group; an absent one gives an empty outline.
    """

    def __init__(self, domain: Domain, space: fem.FunctionSpace, name: str) -> None:
        self.comm: MPI.Comm = domain.mesh.comm
        self.dofs = owned_dofs(domain, space, name)
        self.dofs = self._counter_clockwise(space.tabulate_dof_coordinates()[:, :2])
        self.reference = space.tabulate_dof_coordinates()[self.dofs, :2]

    def _counter_clockwise(self, coordinates: np.ndarray) -> np.ndarray:
        """The edges' dofs in the order that runs counter-clockwise about the mean point: ends, then inside."""
        ends = coordinates[self.dofs[:, :2]]
        total = self.comm.allreduce(np.append(ends.sum(axis=(0, 1)), ends.shape[0] * 2))
        a, b = np.moveaxis(ends - total[:2] / max(total[2], 1.0), 1, 0)
        clockwise = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] < 0
        dofs = self.dofs.copy()
        dofs[clockwise, :2] = dofs[clockwise, 1::-1]
        along_edge = np.linalg.norm(coordinates[dofs[:, 2:]] - coordinates[dofs[:, :1]], axis=-1)
        dofs[:, 2:] = np.take_along_axis(dofs[:, 2:], np.argsort(along_edge, axis=1), axis=1)
        return dofs

    def displacement(self, u: fem.Function) -> np.ndarray:
        """Displacement of the edges' nodes [µm], shape (n_edges, n_nodes, 2): ends, then inside."""
        return u.x.array.reshape(-1, 2)[self.dofs]

    def nodes(self, u: fem.Function) -> np.ndarray:
        """Positions of the edges' nodes [µm], shape (n_edges, n_nodes, 2)."""
        return self.reference + self.displacement(u)

    def extent(self, u: fem.Function) -> tuple[float, float]:
        """Length of the deformed outline [µm] and the area int x dy it encloses [µm^2]. Collective.

        A half cell's outline is closed by its axis, which lies on x = 0 and adds nothing to the integral.
        """
        x = self.nodes(u)
        s, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
        position, tangent = along(x, (s + 1) / 2), slope(x, (s + 1) / 2)
        length = float(np.sum(np.linalg.norm(tangent, axis=-1) * weight / 2))
        area = float(np.sum(position[..., 0] * tangent[..., 1] * weight / 2))
        return self.comm.allreduce(length), self.comm.allreduce(area)

    def crossing(self, u: fem.Function, planes: tuple[int, ...] = ()) -> tuple[float, float] | None:
        """A place where the deformed outline crosses itself [µm], None where it does not. Collective.

        Args:
            u: displacement [µm].
            planes: coordinates whose plane through 0 mirrors it: with x, past 0 is its other half.
        """
        axis = 0.0 if 0 in planes else None
        edges = np.concatenate([np.empty((0, self.dofs.shape[1], 2)), *self.comm.allgather(self.nodes(u))])
        order = [0, *range(2, edges.shape[1]), 1]
        return crossing_of(np.stack([edges[:, order[:-1]], edges[:, order[1:]]], axis=2).reshape(-1, 2, 2), axis)

    def max_depth(self, u: fem.Function, obstacles: Iterable[Obstacle]) -> float:
        """Largest depth of the outline in the obstacles [µm], at nodes and between them; -inf if empty. Collective."""
        obstacles = list(obstacles)
        return self.highest(self.nodes(u), lambda at: deepest(obstacles, at)) if obstacles else -np.inf

    def highest(self, x: np.ndarray, value: Callable[[np.ndarray], np.ndarray]) -> float:
        """Largest value of a function of points on edges, at nodes and between them; -inf without any. Collective."""
        mine = float(np.max(_highest_of_edges(x, value)[1], initial=-np.inf))
        return self.comm.allreduce(mine, op=MPI.MAX)

    def contact_length_x(self, u: fem.Function, obstacles: Iterable[Obstacle], threshold: float) -> float:
        """Length along x of the part of the deformed outline deeper than the threshold [µm]. Collective.

        Args:
            u: displacement.
            obstacles: what is touched.
            threshold: depth at which the pressure falls to zero [µm].
        """
        obstacles, x = list(obstacles), self.nodes(u)
        if not obstacles or not len(x):
            return self.comm.allreduce(0.0)
        s = np.tile(np.linspace(0.0, 1.0, SAMPLES), (len(x), 1))
        deep = _highest_of_edges(x, lambda at: deepest(obstacles, at))[0]
        s = np.sort(np.hstack([s, deep[:, None]]), axis=1)
        sampled = _on_each(x, s)
        inside = deepest(obstacles, sampled) > threshold
        a, b = inside[:, :-1], inside[:, 1:]
        run = np.abs(np.diff(sampled[..., 0], axis=1))
        total = float(np.sum(run[a & b]))
        edge, k = np.nonzero(a != b)
        nodes, start, left, right = x[edge], a[edge, k], s[edge, k], s[edge, k + 1]
        for _ in range(ROUNDS if len(edge) else 0):
            left, right = _bisected(left, right, lambda s: (deepest(obstacles, _at(nodes, s)) > threshold) == start)
        touching_end = np.where(start, s[edge, k], s[edge, k + 1])
        total += float(np.sum(np.abs(_at(nodes, left) - _at(nodes, touching_end))[:, 0]))
        return self.comm.allreduce(total)


def _highest_of_edges(x: np.ndarray, value: Callable[[np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Where on each edge a function of points is largest, and its value there; shape (n_edges,) each.

    About the highest sample of an edge that comes near to the highest of all it is looked for more closely: a contact
    may be narrower than the samples are apart.
    """
    s = np.linspace(0.0, 1.0, SAMPLES)
    sampled = value(along(x, s))
    places, largest = s[np.argmax(sampled, axis=1)], np.max(sampled, axis=1)
    near = np.argsort(largest)[-CLOSER_LOOKS:]
    nodes, step = x[near], s[1]
    for _ in range(ZOOMS):
        looked = np.clip(places[near, None] + step * np.linspace(-1.0, 1.0, SAMPLES), 0.0, 1.0)
        found = value(_on_each(nodes, looked))
        best, step = np.argmax(found, axis=1)[:, None], step / 4
        places[near] = np.take_along_axis(looked, best, axis=1)[:, 0]
        largest[near] = np.maximum(largest[near], np.max(found, axis=1))
    return places, largest


def _on_each(x: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Points of each edge at parameters of its own, shape (n_edges, m, 2) for s of shape (n_edges, m)."""
    return np.stack([_at(x, column) for column in s.T], axis=1)


def along(x: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Points of the edges at parameters s in [0, 1], shape (n_edges, len(s), 2)."""
    return np.einsum("sn,enc->esc", _shape(s, x.shape[1]), x)


def slope(x: np.ndarray, s: np.ndarray) -> np.ndarray:
    """dx/ds of the edges at parameters s, shape (n_edges, len(s), 2)."""
    powers = np.arange(1, x.shape[1])
    derivative = powers * s[..., None] ** (powers - 1) @ _coefficients(x.shape[1])[1:]
    return np.einsum("sn,enc->esc", derivative, x)


def _bisected(
    left: np.ndarray, right: np.ndarray, same: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Intervals halved `HALVINGS` times towards where `same` changes, which is asked once for all middles there may be.

    Args:
        left, right: ends, shape (n,).
        same: whether the state at parameters of shape (m, n) is that at the left end.
    """
    parts = 2**HALVINGS
    middles = left + (right - left) * (np.arange(1, parts) / parts)[:, None]
    like_left, n = same(middles), np.arange(len(left))
    first = np.zeros(len(left), dtype=int)
    for level in range(1, HALVINGS + 1):
        step = parts >> level
        first += step * like_left[first + step - 1, n]
    ends = np.vstack([left, middles, right])
    return ends[first, n], ends[first + 1, n]


def _at(x: np.ndarray, s: np.ndarray) -> np.ndarray:
    """A point on each edge, at its own parameter; shape (..., n_edges, 2) for s of shape (..., n_edges)."""
    return np.einsum("...en,enc->...ec", _shape(s, x.shape[1]), x)


def _shape(s: np.ndarray, n_nodes: int) -> np.ndarray:
    """Lagrange functions of an edge (ends, then nodes inside) at s, shape (len(s), n_nodes)."""
    return s[..., None] ** np.arange(n_nodes) @ _coefficients(n_nodes)


@lru_cache
def _coefficients(n_nodes: int) -> np.ndarray:
    """Coefficients of the Lagrange functions in the powers of s, shape (n_nodes, n_nodes): a power a row."""
    return np.linalg.inv(np.vander([0.0, 1.0, *INNER_NODES[n_nodes]], increasing=True))
