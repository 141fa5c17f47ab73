"""Whether triangles and tetrahedra are valid, and how good their shapes are; nodes are in DOLFINx's order."""

from __future__ import annotations

from itertools import combinations_with_replacement, product

import numpy as np

EDGES = ((0, 1), (0, 2), (0, 3), (2, 3), (1, 3), (1, 2))  # of a tetrahedron, each beside the one it does not meet
BETWEEN = np.array([[0, 9, 8, 7], [9, 1, 6, 5], [8, 6, 2, 4], [7, 5, 4, 3]])  # node of a tetrahedron midway of corners
BLOCK = 1 << 15  # cells at a time, for memory


def jacobian_coefficients(points: np.ndarray) -> np.ndarray:
    """Bernstein coefficients of the Jacobian determinant, shape (cells, 1 or 6) [µm²] or (cells, 1 or 20) [µm³].

    The determinant of a second-order triangle is quadratic, of a second-order tetrahedron cubic: it lies between its
    least and its largest coefficient.

    Args:
        points: geometry nodes, shape (cells, 3 or 6, 2) or (cells, 4 or 10, 3) [µm].

    Source: Johnen, Remacle, Geuzaine, J. Comput. Phys. 233 (2013) 359-372.
    """
    corners = points.shape[2] + 1
    if points.shape[1] == corners:
        return determinant(points[:, 1:] - points[:, :1])[:, None]
    if corners == 4:
        blocks = range(0, max(len(points), 1), BLOCK)
        return np.concatenate([_coefficients_of_tetrahedra(points[k : k + BLOCK]) for k in blocks])
    return _coefficients_of_triangles(points)


def determinant(matrices: np.ndarray) -> np.ndarray:
    """Of matrices of two or three rows, shape (n,)."""
    if matrices.shape[-1] == 2:
        return matrices[:, 0, 0] * matrices[:, 1, 1] - matrices[:, 0, 1] * matrices[:, 1, 0]
    found: np.ndarray = np.einsum("ni,ni->n", np.cross(matrices[:, 0], matrices[:, 1]), matrices[:, 2])
    return found


def shape_measures(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shape quality and aspect ratio of straight elements, shape (cells,), and their edges' lengths [µm].

    Shape quality is the inscribed over the circumscribed radius, times the dimension: 1 at best. Aspect ratio is the
    longest edge over the least height: 1.15 at best for triangles, 1.22 for tetrahedra.

    Args:
        corners: shape (cells, 3, 2) or (cells, 4, 3) [µm].
    """
    content = np.abs(determinant(corners[:, 1:] - corners[:, :1]))
    if corners.shape[1] == 3:
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        area = content / 2
        shape = 16 * area**2 / (edges.sum(axis=1) * edges.prod(axis=1))
        return shape, edges.max(axis=1) ** 2 / (2 * area), edges
    edges = np.linalg.norm(np.stack([corners[:, b] - corners[:, a] for a, b in EDGES], axis=1), axis=2)
    faces = np.stack([_area(corners[:, [k for k in range(4) if k != left_out]]) for left_out in range(4)], axis=1)
    opposite = edges[:, :3] * edges[:, 3:]
    half = opposite.sum(axis=1, keepdims=True) / 2
    circumscribed = np.sqrt(half[:, 0] * np.prod(half - opposite, axis=1)) / content  # Crelle's formula
    shape = 3 * content / (2 * faces.sum(axis=1) * circumscribed)
    return shape, edges.max(axis=1) * 2 * faces.max(axis=1) / content, edges


def _coefficients_of_triangles(points: np.ndarray) -> np.ndarray:
    corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    values = [determinant(_gradients(x, y) @ points) for x, y in (*corners, (0.5, 0.5), (0.0, 0.5), (0.5, 0.0))]
    edges = [2 * values[3 + k] - (values[i] + values[j]) / 2 for k, (i, j) in enumerate(((1, 2), (0, 2), (0, 1)))]
    return np.stack([*values[:3], *edges], axis=1)


def _coefficients_of_tetrahedra(points: np.ndarray) -> np.ndarray:
    """The gradient G is linear: det = sum of λ_a λ_b λ_c det(G_a1, G_b2, G_c3) over its values at the corners."""
    by_corner = 4 * points[:, BETWEEN] - points[:, None, :4]  # derivatives at each corner by each λ
    gradient = by_corner[:, :, 1:] - by_corner[:, :, :1]
    normal = np.cross(gradient[:, :, None, 0], gradient[:, None, :, 1])
    volumes = np.einsum("nabi,nci->nabc", normal, gradient[:, :, 2]).reshape(-1, 64)
    kinds = list(combinations_with_replacement(range(4), 3))
    mean = np.array([[sorted(corners) == list(kind) for kind in kinds] for corners in product(range(4), repeat=3)])
    found: np.ndarray = volumes @ (mean / mean.sum(axis=0))
    return found


def _gradients(x: float, y: float) -> np.ndarray:
    """Derivatives of the second-order shape functions by the reference coordinates, shape (2, 6)."""
    z = 1 - x - y
    return np.array(
        [
            [1 - 4 * z, 4 * x - 1, 0.0, 4 * y, -4 * y, 4 * (z - x)],
            [1 - 4 * z, 0.0, 4 * y - 1, 4 * x, 4 * (z - y), -4 * x],
        ]
    )


def _area(corners: np.ndarray) -> np.ndarray:
    """Of triangles in space, shape (n,)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    found: np.ndarray = np.linalg.norm(normal, axis=1) / 2
    return found
