"""Evenly spaced points of a reference triangle or tetrahedron, their weights, and the pieces between them."""

from __future__ import annotations

from itertools import pairwise, permutations, product

import numpy as np

Place = tuple[int, ...]


def lattice(n: int, dim: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Points of the reference cell's n-fold subdivision and weights that integrate linear functions exactly."""
    index, pieces = numbers(n, dim), simplices(n, dim)
    weights = np.zeros(len(index))
    size = (1 / 2, 1 / 6)[dim - 2] / len(pieces)
    for corners in pieces:
        weights[[index[c] for c in corners]] += size / (dim + 1)
    return np.array(list(index), dtype=float) / n, weights


def lattice_pieces(n: int, dim: int = 2) -> np.ndarray:
    """Numbers of the lattice's points in pieces that cover it: ends, then, for even n, the middles between them.

    Triangles, shape (n^2, 3) or (n^2/4, 6), or tetrahedra, shape (n^3, 4) or (n^3/8, 10); edges are in VTK's order: 01,
    12, 20, and then 03, 13, 23.
    """
    index, step = numbers(n, dim), 1 if n % 2 else 2
    edges = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)][: 3 * (dim - 1)] if step == 2 else []
    found = []
    for corners in simplices(n // step, dim):
        ends = [tuple(step * c for c in corner) for corner in corners]
        middles = [tuple((p + q) // 2 for p, q in zip(ends[a], ends[b], strict=True)) for a, b in edges]
        found.append([index[point] for point in (*ends, *middles)])
    return np.array(found)


def numbers(n: int, dim: int) -> dict[Place, int]:
    """Numbers of the points whose coordinates add up to n or less."""
    return {place: k for k, place in enumerate(p for p in product(range(n + 1), repeat=dim) if sum(p) <= n)}


def simplices(n: int, dim: int) -> list[tuple[Place, ...]]:
    """The n^dim pieces that the lattice's lines cut the cell into, right-handed."""
    return _triangles(n) if dim == 2 else _tetrahedra(n)


def _triangles(n: int) -> list[tuple[Place, ...]]:
    index = numbers(n, 2)
    found: list[tuple[Place, ...]] = []
    for i, j in index:
        for corners in (((i, j), (i + 1, j), (i, j + 1)), ((i + 1, j), (i + 1, j + 1), (i, j + 1))):
            if all(c in index for c in corners):
                found.append(corners)
    return found


def _tetrahedra(n: int) -> list[tuple[Place, ...]]:
    """Those of Freudenthal's division of cubes, which fills the cell in the coordinates i + j + k, j + k, k."""
    index = numbers(n, 3)
    found: list[tuple[Place, ...]] = []
    for base in product(range(n), repeat=3):
        for order in permutations(range(3)):
            chain = [base]
            for axis in order:
                chain.append(tuple(c + (k == axis) for k, c in enumerate(chain[-1])))
            corners = tuple((a - b, b - c, c) for a, b, c in chain)
            if all(corner in index and min(corner) >= 0 for corner in corners):
                sides = np.array([np.subtract(q, p) for p, q in pairwise(corners)])
                found.append(corners if np.linalg.det(sides) > 0 else (*corners[:2], corners[3], corners[2]))
    return found
