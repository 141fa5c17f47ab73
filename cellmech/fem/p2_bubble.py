"""P2 on triangles with a cubic bubble, as tables for a custom Basix element with values at seven nodes."""

from __future__ import annotations

import basix
import numpy as np

COMPLETE, HIGHEST = 2, 3  # degrees: all polynomials up to the first, none above the second
DIMENSION = 7
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


def coefficients() -> np.ndarray:
    """P2 and the bubble x y (1 - x - y) in the orthonormal cubic polynomials of the triangle, shape (7, 10)."""
    points, weights = basix.make_quadrature(basix.CellType.triangle, 2 * HIGHEST)
    legendre = basix.tabulate_polynomials(basix.PolynomialType.legendre, basix.CellType.triangle, HIGHEST, points)
    x, y = np.asarray(points).T
    table = np.zeros((DIMENSION, len(legendre)))
    table[:6, :6] = np.eye(6)  # the polynomials are ordered by degree
    table[6] = legendre @ (weights * x * y * (1 - x - y))
    return table


def nodes() -> list[list[np.ndarray]]:
    """Reference points of the values, by dimension and number of the vertex, edge or cell that they belong to."""
    middles = [(CORNERS[i] + CORNERS[j]) / 2 for i, j in ((1, 2), (0, 2), (0, 1))]
    return [[c[None] for c in CORNERS], [m[None] for m in middles], [CORNERS.mean(axis=0)[None]], []]


def evaluations() -> list[list[np.ndarray]]:
    """The functionals at `nodes`: each takes the value there."""
    one = np.ones((1, 1, 1, 1))
    return [[one] * len(of_dimension) for of_dimension in nodes()]
