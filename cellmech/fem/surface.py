"""A named boundary surface of a 3-D mesh as numpy arrays: the counterpart of `outline.Outline` in space."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from cellmech.fem import facets
from cellmech.fem.crossing import crossing_of_triangles
from cellmech.fem.curves import Moments, arcs, moments
from cellmech.fem.domain import Domain
from cellmech.fem.outline import deepest, owned_dofs
from cellmech.mechanics.obstacles import Obstacle

DIRECTIONS = 64  # around, in which the shadow's outermost points are looked for; a multiple of 4
TILT = 1e-9 * np.array([1.0, 0.6, 0.3])  # of directions: of two points equally far, round-off would choose one
SPLITS, LONG = 6, 1.5  # of directions whose points lie farther apart than the mean by this factor: flat sides, corners


@dataclass(frozen=True)
class ContactPatch:
    """The part of the deformed surface deeper than a threshold, of the whole body.

    Args:
        area_um2: its area on the deformed surface [µm^2].
        along_x_um, along_z_um: from its one end to its other [µm].
    """

    area_um2: float
    along_x_um: float
    along_z_um: float

    @property
    def radius_um(self) -> float:
        """Of a disc of this area [µm]."""
        return float(np.sqrt(self.area_um2 / np.pi))


class Surface:
    """The facets of one facet group that this rank owns.

    `nodes`, `displacement`, `reference` and `dofs` are of the facets that are modelled; every other number is of the
    whole body, which mirror images complete. The mirror planes pass through the origin and stay there: they add nothing
    to int x.n dA, nor to the volume's moments, since x.n = 0 on them.

    Args:
        domain: the mesh, of tetrahedra.
        space: displacement space, of order 1, 2 or 3 on the facets.
        name: facet group, on the boundary or between cells; an absent one gives an empty surface.
        mirrored: coordinates whose plane x[k] = 0 the body is mirrored at: (0, 2) of a quarter, (0,) of a half.
    """

    def __init__(self, domain: Domain, space: fem.FunctionSpace, name: str, mirrored: tuple[int, ...] = ()) -> None:
        self.comm: MPI.Comm = domain.mesh.comm
        self.mirrored, self.copies = mirrored, 2 ** len(mirrored)
        coordinates = space.tabulate_dof_coordinates()
        self.dofs = self._outward(_along_sides(owned_dofs(domain, space, name), coordinates), coordinates)
        self.reference = coordinates[self.dofs]

    def _outward(self, dofs: np.ndarray, coordinates: np.ndarray) -> np.ndarray:
        """The facets' dofs in Basix's order of a triangle whose normal points away from the ends' mean point."""
        ends = coordinates[dofs[:, :3]]
        total = self.comm.allreduce(np.append(ends.sum(axis=(0, 1)), ends.shape[0] * 3))
        a, b, c = np.moveaxis(ends - total[:3] / max(total[3], 1.0), 1, 0)
        inward = np.einsum("nc,nc->n", np.cross(b - a, c - a), a + b + c) < 0
        points = facets.node_points(dofs.shape[1])
        gaps = np.linalg.norm(points[:, None, ::-1] - points, axis=-1)
        return np.where(inward[:, None], dofs[:, np.argmin(gaps, axis=1)], dofs)

    def displacement(self, u: fem.Function) -> np.ndarray:
        """Displacement of the facets' nodes [µm], shape (n_facets, n_nodes, 3), in Basix's order of a triangle."""
        return u.x.array.reshape(-1, 3)[self.dofs]

    def nodes(self, u: fem.Function) -> np.ndarray:
        """Positions of the facets' nodes [µm], shape (n_facets, n_nodes, 3)."""
        return self.reference + self.displacement(u)

    def extent(self, u: fem.Function) -> tuple[float, float]:
        """Area of the deformed surface [µm^2] and the volume int x.n dA/3 it encloses [µm^3]. Collective."""
        return self.content(u)[:2]

    def content(self, u: fem.Function) -> tuple[float, float, np.ndarray]:
        """`extent`, and the volume's centroid [µm], shape (3,), int x_k^2 n_k dA/2 over the volume. Collective."""
        points, weights = facets.gauss()
        x = self.nodes(u)
        at, normal = facets.positions(x, points), facets.normals(x, points)
        along = at * normal
        local = [np.linalg.norm(normal, axis=-1), along.sum(axis=-1) / 3, *np.moveaxis(at * along / 2, -1, 0)]
        area, volume, *first = self.comm.allreduce(np.array([np.sum(part @ weights) for part in local]))
        centroid = np.array(first) / (volume or 1.0)
        centroid[list(self.mirrored)] = 0.0
        return self.copies * float(area), self.copies * float(volume), centroid

    def volume_below(self, u: fem.Function, level: float) -> float:
        """The enclosed volume under y = level [µm^3]: int (x n_x + z n_z) dA/2, none of it on the level. Collective."""
        x = self.nodes(u)
        part = facets.part_above(x, lambda at: level - at[..., 1], rounds=2)
        mine = part.integral(x, lambda at, normal: np.sum((at * normal)[..., ::2], axis=-1) / 2)
        return self.copies * self.comm.allreduce(mine)

    def crossing(self, u: fem.Function, planes: tuple[int, ...]) -> tuple[float, float, float] | None:
        """A place where the deformed surface crosses itself [µm], None where it does not. Collective.

        Args:
            u: displacement [µm].
            planes: coordinates whose plane through 0 mirrors it: past it are its mirror images.
        """
        return crossing_of_triangles(np.concatenate(self.comm.allgather(facets.triangles(self.nodes(u)))), planes)

    def max_depth(self, u: fem.Function, obstacles: Iterable[Obstacle]) -> float:
        """Largest depth in the obstacles [µm], at nodes and between them; -inf if empty. Collective."""
        obstacles = list(obstacles)
        return self.highest(self.nodes(u), lambda at: deepest(obstacles, at)) if obstacles else -np.inf

    def highest(self, x: np.ndarray, value: Callable[[np.ndarray], np.ndarray]) -> float:
        """Largest value of a function of points on facets, at nodes and between them; -inf without any. Collective."""
        largest, _, _ = facets.highest(x, lambda at, _: value(at), 1, self.comm)
        return float(self.comm.allreduce(largest[0], op=MPI.MAX))

    def contact_area(self, u: fem.Function, obstacles: Iterable[Obstacle], threshold: float) -> ContactPatch:
        """The part of the deformed surface deeper than the threshold. Collective.

        Args:
            u: displacement.
            obstacles: what is touched.
            threshold: depth at which the pressure falls to zero [µm].
        """
        obstacles, x = list(obstacles), self.nodes(u)
        area, low, high = 0.0, np.full(3, np.inf), np.full(3, -np.inf)
        if obstacles:
            part = facets.part_above(x, lambda at: deepest(obstacles, at) - threshold)
            area = part.integral(x, lambda _, normal: np.linalg.norm(normal, axis=-1))
            rim = part.rim(x)
            low, high = rim.min(axis=0, initial=np.inf), rim.max(axis=0, initial=-np.inf)
        area, (low, high) = self.comm.allreduce(area), self._of_all(low, high)
        wide = np.maximum(high - low, 0.0)
        return ContactPatch(self.copies * area, float(wide[0]), float(wide[2]))

    def section(self, u: fem.Function, axis: int = 2, level: float = 0.0) -> np.ndarray:
        """Where the deformed surface meets the plane z = level, or x = level for axis 0: this rank's part of a curve.

        Returns:
            Cubic edges [µm], shape (n, 4, 2), as `curves` has them, in (x, y), or in (z, y) for axis 0; of a body
            mirrored in the first of these, half the curve.
        """
        return arcs(*facets.section(self.nodes(u), axis, level))

    def section_moments(self, u: fem.Function, axis: int = 2, level: float = 0.0) -> Moments:
        """Length, area and moments of the whole section. Collective."""
        cut = Moments(self.comm.allreduce(moments(self.section(u, axis, level)).values))
        return cut.mirrored if 2 - axis in self.mirrored else cut

    def shadow(self, u: fem.Function) -> np.ndarray:
        """Convex rim of the surface's projection onto the x-z plane, the same on every rank. Collective.

        It joins the surface's outermost points in directions all around, where it runs square to them.

        Returns:
            Cubic edges [µm] in (x, z), shape (n, 4, 2), as `curves` has them.
        """
        x, angle = self.nodes(u), 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        points = self._rim_points(x, angle)
        for split in range(SPLITS + 1):
            chord = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
            long = np.flatnonzero(chord > LONG * chord.sum() / DIRECTIONS)
            if not len(long) or split == SPLITS:
                break
            between = angle[long] + (np.roll(angle, -1) - angle)[long] % (2 * np.pi) / 2
            angle = np.insert(angle, long + 1, between)
            points = np.insert(points, long + 1, self._rim_points(x, between), axis=0)
        along = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
        ends, tangents = (np.stack([rows, np.roll(rows, -1, axis=0)], axis=1) for rows in (points, along))
        tangents[long] = 0.0  # a side of no curvature
        return arcs(ends, tangents)

    def _rim_points(self, x: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Points (x, z) of the whole body farthest in directions at these angles to x [µm], shape (m, 2)."""
        outward = np.round(np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1), 15)
        sides = np.ones_like(outward)
        sides[:, self.mirrored] = np.where(outward[:, self.mirrored] < 0, -1.0, 1.0)
        modelled, copy = np.unique(outward * sides, axis=0, return_inverse=True)
        return np.asarray((self.outermost(x, modelled)[copy.ravel()] * sides)[:, ::2])

    def outermost(self, x: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """The modelled points farthest in given directions [µm], shape (m, 3) both. Collective.

        Of points equally far, as in a flat side, it is the same one whatever the round-off.

        Args:
            x: `nodes`, or `reference`.
            directions: unit vectors [-].
        """
        values, facet, place = facets.highest(x, _along(directions + TILT), len(directions), self.comm)
        mine = facets.positions(x[facet], place[:, None])[:, 0] if len(x) else np.zeros((len(directions), 3))
        return self._from_highest(values, mine)

    def box(self, u: fem.Function) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest coordinates of the deformed surface [µm], shape (3,) each. Collective."""
        both = np.vstack([-np.eye(3), np.eye(3)])
        low, high = np.einsum("sic,ic->si", self.outermost(self.nodes(u), both).reshape(2, 3, 3), np.eye(3))
        return self._mirrored_box(low, high)

    def pole(self, u: fem.Function, sign: float) -> np.ndarray:
        """Where the undeformed surface's lowest (-1) or highest (1) point is now [µm], shape (3,). Collective."""
        values, facet, place = facets.highest(self.reference, _along(np.array([[0.0, sign, 0.0]])), 1, self.comm)
        nodes = self.nodes(u)
        mine = facets.positions(nodes[facet], place[:, None])[:, 0] if len(nodes) else np.zeros((1, 3))
        return self._from_highest(values, mine)[0]

    def _from_highest(self, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Of each rank's points those of the largest values, shape (m, 3). Collective."""
        rows = np.array(self.comm.allgather(np.column_stack([values, points])))
        return np.asarray(rows[rows[..., 0].argmax(axis=0), np.arange(len(values)), 1:])

    def _of_all(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        outer = np.max(self.comm.allgather(np.concatenate([-low, high])), axis=0)
        return self._mirrored_box(-outer[:3], outer[3:])

    def _mirrored_box(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        for k in self.mirrored:
            high[k] = max(high[k], -low[k])
            low[k] = -high[k]
        return low, high


def _along(directions: np.ndarray) -> Callable[[np.ndarray, Any], np.ndarray]:
    """How far points lie along a direction, as `facets.highest` asks."""
    return lambda at, j: (at @ directions[j][..., None])[..., 0]


def _along_sides(dofs: np.ndarray, coordinates: np.ndarray) -> np.ndarray:
    """Facets' dofs with those inside a side in Basix's order: from its end of the smaller number on."""
    if dofs.shape[1] == 10:
        for k, start in ((3, 1), (5, 0), (7, 0)):
            gaps = np.linalg.norm(coordinates[dofs[:, k : k + 2]] - coordinates[dofs[:, [start]]], axis=-1)
            dofs[:, k : k + 2] = np.take_along_axis(dofs[:, k : k + 2], np.argsort(gaps, axis=1), axis=1)
    return dofs
