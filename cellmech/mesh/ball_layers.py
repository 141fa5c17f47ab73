"""Tetrahedra of a ball from the mesh of its thick layers: stacks of prisms for the thin ones, mirror images, curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cellmech.mesh.ball import BallSpec
from cellmech.mesh.elements import determinant
from cellmech.mesh.store import KeptModel

TETRAHEDRON = ((0, 1), (1, 2), (2, 0), (3, 0), (3, 2), (3, 1))  # its edges in Gmsh's order
TRIANGLE = TETRAHEDRON[:3]
KIND = {(2, 1): 2, (2, 2): 9, (3, 1): 4, (3, 2): 11}  # Gmsh's number of an element by dimension and order


@dataclass
class Corners:
    """A mesh of straight tetrahedra about the origin.

    Args:
        x: positions [µm], shape (n, 3); some may belong to no element.
        layers: tetrahedra by layer, rows of four nodes.
        faces: triangles by group, rows of three nodes.
        along: pairs of nodes whose edge follows the spheres.
    """

    x: np.ndarray
    layers: dict[str, np.ndarray]
    faces: dict[str, np.ndarray]
    along: np.ndarray

    def mirror(self, axis: int) -> None:
        """Add the mirror image about the plane through the centre."""
        apart = self.x[:, axis] != 0.0
        image = np.arange(len(self.x))
        image[apart] = len(self.x) + np.arange(apart.sum())
        other = self.x[apart]
        other[:, axis] *= -1.0
        self.x = np.concatenate([self.x, other])
        for groups in (self.layers, self.faces):
            groups.update({name: np.concatenate([own, image[own]]) for name, own in groups.items()})
        self.along = np.concatenate([self.along, image[self.along]])

    def close(self, name: str, axis: int) -> None:
        """Name the faces on a plane through the centre."""
        cells = np.concatenate(list(self.layers.values()))
        on_plane = (self.x[:, axis] == 0.0)[cells]
        sides = [np.delete(cells[np.delete(on_plane, k, axis=1).all(axis=1)], k, axis=1) for k in range(4)]
        self.faces[name] = np.concatenate(sides)

    def model(self, centre: np.ndarray, order: int) -> KeptModel:
        """Answers of a Gmsh model with this mesh, its elements straight (order 1) or curved (order 2)."""
        used, x = np.zeros(len(self.x), dtype=bool), self.x
        for cells in self.layers.values():
            used[cells] = True
            points = x[cells]
            turned = determinant(points[:, 1:] - points[:, :1]) < 0.0
            cells[turned] = cells[turned][:, [1, 0, 2, 3]]
        number, x = np.cumsum(used) - 1, x[used]
        groups = [(3, name, number[cells]) for name, cells in self.layers.items()]
        groups += [(2, name, number[triangles]) for name, triangles in self.faces.items()]
        if order == 2:
            edges = np.unique(np.concatenate([_codes(nodes, TETRAHEDRON) for dim, _, nodes in groups if dim == 3]))
            bent = np.searchsorted(edges, np.unique(_codes(number[self.along], ((0, 1),))))
            groups = [
                (dim, name, _with_middles(nodes, TRIANGLE if dim == 2 else TETRAHEDRON, edges, len(x)))
                for dim, name, nodes in groups
            ]
            x = np.concatenate([x, _middles(x, edges, bent)])
        return KeptModel.of(x + centre, [(dim, name, KIND[dim, order], nodes) for dim, name, nodes in groups])


def layered(
    spec: BallSpec,
    shells: list[np.ndarray],
    radii: list[float],
    x: np.ndarray,
    triangles: list[np.ndarray],
    tetrahedra: list[np.ndarray],
) -> Corners:
    """A quarter with its thin layers in place: the thick ones shrink, stacks of prisms fill the gaps.

    Args:
        spec: what its layers are.
        shells: radii of nodes of what is extruded, from the inside out [µm].
        radii: of the sphere that each shell is in what follows [µm].
        x: positions about the centre [µm].
        triangles: of each of these spheres.
        tetrahedra: inside each of them, outside of the one before.
    """
    layers: dict[str, list[np.ndarray]] = {}
    faces: dict[str, np.ndarray] = {}
    along, places = [], [_shrunk(x, shells, radii, triangles, tetrahedra)]
    below, count = np.arange(len(x)), len(x)  # the number of each node as the next layer sees it
    for shell, own, cells in zip(shells, triangles, tetrahedra, strict=True):
        layers.setdefault(spec.layer_at(shell[0]), []).append(below[cells])
        foot, columns, below = np.unique(own), np.sort(own, axis=1), np.arange(len(x))
        for radius in shell:
            if radius > shell[0]:
                above = below.copy()
                above[foot] = np.arange(count, count + len(foot))
                count += len(foot)
                places.append(places[0][foot] * (radius / shell[0]))
                prisms = _prisms(below[columns], above[columns])
                layers.setdefault(spec.layer_at(radius), []).append(prisms)
                along.append(_ends(prisms, TETRAHEDRON))
                below = above
            if radius == spec.nucleus_radius_um:
                faces["nucleus_outline"] = below[columns]
        along.append(_ends(below[columns], TRIANGLE))
    whole = {name: np.concatenate(parts) for name, parts in layers.items()}
    return Corners(np.concatenate(places), whole, {"outer": below[columns], **faces}, np.concatenate(along))


def _shrunk(
    x: np.ndarray,
    shells: list[np.ndarray],
    radii: list[float],
    triangles: list[np.ndarray],
    tetrahedra: list[np.ndarray],
) -> np.ndarray:
    """Positions [µm] when each thick layer has its own size."""
    factor = np.ones((len(x), 1))
    for shell, radius, cells in zip(shells, radii, tetrahedra, strict=True):
        factor[cells] = shell[0] / radius
    x = x * factor
    for shell, own in zip(shells, triangles, strict=True):
        foot = np.unique(own)
        x[foot] *= shell[0] / np.linalg.norm(x[foot], axis=1, keepdims=True)
    return x


def _prisms(below: np.ndarray, above: np.ndarray) -> np.ndarray:
    """Prisms between triangles as three tetrahedra each.

    Columns come in the order of their numbers, so that prisms beside each other cut the wall between them alike.

    Source: Dompierre, Labbé, Vallet, Camarero, 8th International Meshing Roundtable (1999).
    """
    (a, b, c), (d, e, f) = below.T, above.T
    return np.concatenate([np.column_stack(four) for four in ((a, b, c, f), (a, b, e, f), (a, d, e, f))])


def _ends(elements: np.ndarray, edges: tuple[tuple[int, int], ...]) -> np.ndarray:
    """Nodes at the ends of the edges of elements, a row for each edge."""
    return elements[:, edges].reshape(-1, 2)


def _codes(elements: np.ndarray, edges: tuple[tuple[int, int], ...]) -> np.ndarray:
    """A number for each edge, which the elements around it share."""
    ends = np.sort(_ends(elements, edges), axis=1)
    return ends[:, 0] << 32 | ends[:, 1]


def _with_middles(
    elements: np.ndarray, edges: tuple[tuple[int, int], ...], known: np.ndarray, first: int
) -> np.ndarray:
    """Elements with the numbers of their mid-edge nodes, which follow `first` in the order of the known edges."""
    return np.hstack([elements, first + np.searchsorted(known, _codes(elements, edges)).reshape(len(elements), -1)])


def _middles(x: np.ndarray, edges: np.ndarray, bent: np.ndarray) -> np.ndarray:
    """Positions of mid-edge nodes [µm]: halfway, or, of bent edges, at the mean radius in the mean direction."""
    a, b = x[edges >> 32], x[edges & 0xFFFFFFFF]
    middle = (a + b) / 2
    ra, rb = (np.linalg.norm(end[bent], axis=1, keepdims=True) for end in (a, b))
    direction = a[bent] / ra + b[bent] / rb
    middle[bent] = (ra + rb) / 2 * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    return middle
