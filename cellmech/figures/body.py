"""Deformed cells from field files of triangles or tetrahedra: sections and, in space, surfaces, as flat triangles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, pairwise, permutations, product
from pathlib import Path
from typing import Any

import numpy as np

from cellmech.cell.outlines import cell_outline, nucleus_outline
from cellmech.errors import InputError
from cellmech.figures.style import LAYER_COLOURS
from cellmech.mesh.cell_shape import BodyOutline
from cellmech.results.result import modelled, read_grid
from cellmech.scene.placement import placement
from cellmech.scene.scene import Scene

SUBDIVISIONS = 4
START, NOW, VALUE = slice(0, 3), slice(3, 6), 6  # what is known of a point: position at the start and now, a field
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # whose middles follow the corners, in VTK's order
FACES = ((0, 1, 2, 4, 5, 6), (0, 3, 1, 7, 8, 4), (1, 3, 2, 8, 9, 5), (0, 2, 3, 6, 9, 7))
INSIDE = 1e-5  # of the radius: so far beside a mirror plane it is cut, where elements only touch it
ON_OUTLINE = 1e-6  # of half of its width
SAME = 1e-6  # of a nucleus's size: points nearer than that are one


@dataclass(frozen=True)
class Patch:
    """Flat triangles.

    Args:
        corners: position at the start, position now [µm], value of a field; shape (n, 3, 7).
        layer: code of each triangle's layer, shape (n,).
    """

    corners: np.ndarray
    layer: np.ndarray

    @property
    def start(self) -> np.ndarray:
        """Corners before the load [µm], shape (n, 3, 3)."""
        return self.corners[..., START]

    @property
    def now(self) -> np.ndarray:
        """Corners as displaced [µm], shape (n, 3, 3)."""
        return self.corners[..., NOW]

    @property
    def values(self) -> np.ndarray:
        """Of the field at the corners, shape (n, 3)."""
        return self.corners[..., VALUE]

    def rim(self) -> np.ndarray:
        """The outline of the nucleus in a section, as it is now: edges from end to end [µm], shape (n, 2, 3)."""
        return rim_of(self.now, self.layer)

    def copies(self, axes: str) -> dict[str, Patch]:
        """Itself, "", and its images at x = 0 and z = 0, by the letters of the axes along which each is mirrored."""
        found = {"": self}
        for axis in axes:
            signs = np.ones(7)
            signs[["xyz".index(axis), 3 + "xyz".index(axis)]] = -1.0
            # corners reversed: the triangles keep their sense
            found |= {name + axis: Patch(one.corners[:, ::-1] * signs, one.layer) for name, one in found.items()}
        return found

    def whole(self, axes: str) -> Patch:
        """All these in one."""
        found = self.copies(axes).values()
        return Patch(np.concatenate([one.corners for one in found]), np.concatenate([one.layer for one in found]))


@dataclass(frozen=True)
class Body:
    """What is modelled of a cell, element by element.

    Args:
        nodes: of each element, as a patch has its corners; shape (elements, nodes, 7).
        layer: code of each element's layer, shape (elements,).
        centre: at the start [µm], shape (3,).
        mirrors: axes along which it is mirrored.
        pieces: into which a curved element's edge is cut, so that it looks curved.
        outlines: before the load, of the cell and its nucleus, by the outermost layer of each.
    """

    nodes: np.ndarray
    layer: np.ndarray
    centre: np.ndarray
    mirrors: str
    pieces: int = SUBDIVISIONS
    outlines: Mapping[str, BodyOutline] = field(default_factory=dict)

    @property
    def in_space(self) -> bool:
        """Whether its elements are tetrahedra."""
        return self.nodes.shape[1] in (4, 10)

    @property
    def values(self) -> np.ndarray:
        """Of the field at the nodes, shape (elements, nodes)."""
        return self.nodes[..., VALUE]

    @cached_property
    def middle(self) -> np.ndarray:
        """Of the nucleus as it is now [µm], shape (3,): the mean of its nodes, 0 across a mirror plane."""
        nucleus = self.nodes[self.layer <= list(LAYER_COLOURS).index("lamina")][..., NOW]
        mean = nucleus.reshape(-1, 3).mean(axis=0)
        return np.where([axis in self.mirrors for axis in "xyz"], 0.0, mean)

    def level(self, axis: str, part: slice = NOW) -> float:
        """Where along an axis its section lies [µm]."""
        return float((self.middle if part == NOW else self.centre)["xyz".index(axis)])

    def section(self, axis: str = "z", part: slice = NOW) -> Patch:
        """The whole cell's section through the middle of its nucleus, or its centre, square to an axis.

        Args:
            axis: "x", "y" or "z"; of triangles all are the section.
            part: `NOW` for the plane that is flat now, `START` for the one that was flat before the load.
        """
        if not self.in_space:
            return Patch(*_triangles(self.nodes, self.layer, self.pieces)).whole(self.mirrors)
        index, level = "xyz".index(axis), self.level(axis, part)
        if axis in self.mirrors:
            level += INSIDE * float(np.ptp(self.nodes[..., 1]))
        places = self.nodes[..., part][..., index]
        met = (places.min(axis=1) <= level) & (places.max(axis=1) >= level)
        points, layer = _tetrahedra(self.nodes[met], self.layer[met], self.pieces)
        return _slice(points, layer, part, index, level).whole(self.mirrors.replace(axis, ""))

    def surface(self, layer: str) -> Patch:
        """What is modelled of the surface, at the start, of the cell or its nucleus, seen from outside.

        Args:
            layer: its outermost layer.
        """
        outline = self.outlines[layer]
        mine = self.layer == list(LAYER_COLOURS).index(layer)
        faces = self.nodes[mine][:, [face[: 6 if self.nodes.shape[1] == 10 else 3] for face in FACES]]
        places = faces[..., :3, START] - self.centre
        gaps = np.abs(outline.beyond(places.reshape(-1, 3))).reshape(places.shape[:-1])
        there = faces[
            gaps.max(axis=-1) < ON_OUTLINE * outline.semi_axes_um[0]
        ]  # corners only: third order's middles are near it
        corners, layers = _triangles(there, np.full(len(there), list(LAYER_COLOURS).index(layer)), self.pieces)
        return Patch(_facing(corners, START, corners[:, 0, START] - self.centre), layers)


def rim_of(corners: np.ndarray, layer: np.ndarray, outermost: str = "lamina") -> np.ndarray:
    """The outline of the nucleus, or of all to another layer: edges that an odd number of these triangles have.

    Slivers whose sides are one do not count, as they have both.

    Args:
        corners: of triangles [µm], shape (n, 3, d).
        layer: code of each triangle's layer, shape (n,).
        outermost: layer.

    Returns:
        The ends of each edge, shape (m, 2, d).
    """
    mine = corners[layer <= list(LAYER_COLOURS).index(outermost)]
    ends = np.stack([mine, np.roll(mine, -1, axis=1)], axis=2).reshape(-1, 2, corners.shape[-1])
    places = np.round(ends.reshape(-1, corners.shape[-1]) / (SAME * np.ptp(mine)))
    number = np.unique(places, axis=0, return_inverse=True)[1].reshape(-1, 2)
    _, first, count = np.unique(np.sort(number, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(ends[first[count % 2 == 1]])


def read_body(path: Path, scene: Scene, quantity: str | None = None, pieces: int = SUBDIVISIONS) -> Body:
    """Read a field file, and a scalar of it; `pieces` as a `Body` has it.

    Raises:
        InputError: for a file that is broken or has other content, or for a field that is not there.
    """
    try:
        grid = modelled(read_grid(path))
        cells = np.concatenate([nodes for _, nodes in sorted(grid.cells_dict.items())])
        points, moved = np.asarray(grid.points), np.asarray(grid.point_data["displacement_um"])
        layer = np.asarray(grid.cell_data["layer"])
        if not np.all(np.isfinite(moved)) or cells.shape[1] not in (3, 6, 4, 10) or len(cells) != len(layer):
            raise ValueError("its cells or displacements are not those of a cell")
    except (AttributeError, KeyError, ValueError, OSError, UserWarning) as error:
        text = " ".join(str(error).split())[:120]
        raise InputError(str(path), "", f"is no field file of this program ({text})") from None
    values = np.zeros(len(points)) if quantity is None else _scalar(grid, path, quantity)
    nodes = np.column_stack([points, points + moved, values])[cells]
    x, _, *z = placement(scene).centre
    # the level of the centre is the file's own: a cell that falls starts above its first touch
    centre = np.array([x, float(points[:, 1].min()) + scene.semi_axes_um[1], *(z or [0.0])])
    outlines = {"membrane": cell_outline(scene), "lamina": nucleus_outline(scene)}
    return Body(nodes, layer, centre, scene.mirrors, pieces, outlines)


def _scalar(grid: Any, path: Path, quantity: str) -> np.ndarray:
    scalars = [name for name, values in grid.point_data.items() if values.ndim == 1]
    if quantity not in scalars:
        raise InputError(str(path), quantity, f"must be one of {', '.join(scalars)}")
    return np.asarray(grid.point_data[quantity])


def _shapes(weights: np.ndarray, nodes: int) -> np.ndarray:
    """Shape functions of first or second order at points of barycentric coordinates (p, corners); shape (p, nodes)."""
    corners = weights.shape[1]
    if nodes == corners:
        return weights
    middles = [4 * weights[:, i] * weights[:, j] for i, j in EDGES[: nodes - corners]]
    return np.column_stack([weights * (2 * weights - 1), *middles])


def _lattice(corners: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of an element cut into n pieces along each edge, barycentric, and the corners of these pieces.

    The element is 1 >= a >= b (>= c) >= 0, whose coordinates are the differences; a cube of the lattice falls into one
    piece for each order of its axes, of which those within the element are taken.
    """
    size = corners - 1
    points = [p for p in product(range(n + 1), repeat=size) if all(a >= b for a, b in pairwise(p))]
    number, pieces = {point: index for index, point in enumerate(points)}, []
    for point, order in product(points, permutations(range(size))):
        path = [point]
        for axis in order:
            path.append(tuple(v + (k == axis) for k, v in enumerate(path[-1])))
        if all(step in number for step in path):
            if sum(a > b for a, b in combinations(order, 2)) % 2:
                path[-2:] = reversed(path[-2:])  # all pieces have one sense
            pieces.append([number[step] for step in path])
    steps = np.column_stack([np.full(len(points), n), np.array(points), np.zeros(len(points), dtype=int)])
    return -np.diff(steps, axis=1) / n, np.array(pieces)


def _pieces(nodes: np.ndarray, corners: int, cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """What is known at the lattice's points of each element, (elements, points, 7), and the corners of its pieces."""
    weights, pieces = _lattice(corners, 1 if nodes.shape[1] == corners else cuts)
    return np.einsum("pk,ekc->epc", _shapes(weights, nodes.shape[1]), nodes), pieces


def _triangles(nodes: np.ndarray, layer: np.ndarray, cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners of flat triangles of one sense, shape (n, 3, 7), and their layers."""
    points, pieces = _pieces(nodes, 3, cuts)
    return points[:, pieces].reshape(-1, 3, points.shape[-1]), np.repeat(layer, len(pieces))


def _tetrahedra(nodes: np.ndarray, layer: np.ndarray, cuts: int) -> tuple[np.ndarray, np.ndarray]:
    points, pieces = _pieces(nodes, 4, cuts)
    return points[:, pieces].reshape(-1, 4, points.shape[-1]), np.repeat(layer, len(pieces))


def _slice(corners: np.ndarray, layer: np.ndarray, part: slice, index: int, level: float) -> Patch:
    """The section of flat tetrahedra, whose corners have shape (n, 4, 7), by a plane."""
    import pyvista

    known = corners.reshape(-1, corners.shape[-1])
    grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: np.arange(len(known)).reshape(-1, 4)}, known[:, part])
    grid.point_data["known"], grid.cell_data["layer"] = known, layer
    normal, origin = np.eye(3)[index], level * np.eye(3)[index]
    cut = grid.slice(normal=normal, origin=origin, generate_triangles=True)
    found = np.asarray(cut.point_data["known"])[cut.faces.reshape(-1, 4)[:, 1:]]
    return Patch(_facing(found, part, normal), np.asarray(cut.cell_data["layer"]))


def _facing(corners: np.ndarray, part: slice, outward: np.ndarray) -> np.ndarray:
    """Triangles, shape (n, 3, 7), counter-clockwise for who looks against a direction."""
    edges = np.diff(corners[..., part], axis=1)
    away = np.sum(np.cross(edges[:, 0], edges[:, 1]) * outward, axis=1) < 0
    return np.where(away[:, None, None], corners[:, ::-1], corners)
