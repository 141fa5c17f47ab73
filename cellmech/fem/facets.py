"""Curved triangles in space as numpy arrays: points and normals, sections by planes, highest values, parts above zero.

Facets are given by their Lagrange nodes x, shape (n_facets, n_nodes, 3) [µm], in Basix's order. Their parameters (s, t)
run over the triangle s, t >= 0, s + t <= 1, and dx/ds x dx/dt points outward. A `value` is a function of points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import basix
import numpy as np
from mpi4py import MPI

from cellmech.fem import subdivision

ORDERS = {3: 1, 6: 2, 10: 3}  # of facets, by their number of nodes
GAUSS_DEGREE = 12  # the volume and its first moments of third-order facets take 10
DIVISIONS = 4  # of a facet's sides by its lattice of samples
GAIN = 2 / DIVISIONS**2  # the most that a value rises above its largest sample, in parts of its range on the facet
ZOOMS = 4  # closer looks: to 1/1024 of a facet
NEWTON = 4  # iterations for a point of a section
ON_LEVEL = 1e-9  # points so near to a section's plane, in parts of the body's size, are on it


@lru_cache
def node_points(n_nodes: int) -> np.ndarray:
    """Parameters of a facet's nodes, shape (n_nodes, 2)."""
    variant = basix.LagrangeVariant.gll_warped
    element = basix.create_element(basix.ElementFamily.P, basix.CellType.triangle, ORDERS[n_nodes], variant)
    return np.asarray(element.points)


@lru_cache
def _powers(n_nodes: int) -> list[tuple[int, int]]:
    return [(i, k - i) for k in range(ORDERS[n_nodes] + 1) for i in range(k + 1)]


@lru_cache
def _coefficients(n_nodes: int) -> np.ndarray:
    """Of the Lagrange functions in the monomials of s and t, shape (n_nodes, n_nodes)."""
    s, t = node_points(n_nodes).T
    return np.linalg.inv(np.stack([s**i * t**j for i, j in _powers(n_nodes)], axis=-1))


def _shapes(points: np.ndarray, n_nodes: int, d_s: int = 0, d_t: int = 0) -> np.ndarray:
    """Lagrange functions, or first derivatives, at parameters of shape (..., 2); shape (..., n_nodes)."""
    raised = [[np.ones(points.shape[:-1])], [np.ones(points.shape[:-1])]]
    for axis in (0, 1):
        for _ in range(ORDERS[n_nodes]):
            raised[axis].append(raised[axis][-1] * points[..., axis])
    terms = []
    for i, j in _powers(n_nodes):
        factor = (i if d_s else 1) * (j if d_t else 1)
        terms.append(factor * raised[0][max(i - d_s, 0)] * raised[1][max(j - d_t, 0)])
    return np.stack(terms, axis=-1) @ _coefficients(n_nodes)


def positions(x: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points of each facet [µm], shape (n_facets, k, 3), at parameters of shape (k, 2) or (n_facets, k, 2)."""
    return _shapes(points, x.shape[1]) @ x


def normals(x: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Outward dx/ds x dx/dt [µm^2] there: normals as long as an area is large."""
    return np.cross(_shapes(points, x.shape[1], d_s=1) @ x, _shapes(points, x.shape[1], d_t=1) @ x)


@lru_cache
def lattice(divisions: int = DIVISIONS) -> tuple[np.ndarray, np.ndarray]:
    """Samples of a facet, shape (k, 2), and the numbers of those at the ends of each triangle of them, shape (m, 3)."""
    points, number = subdivision.lattice(divisions)[0], subdivision.numbers(divisions, 2)
    return points, np.array([[number[corner] for corner in ends] for ends in subdivision.simplices(divisions, 2)])


def triangles(x: np.ndarray) -> np.ndarray:
    """Flat triangles that follow the facets, as many to a side as their order, shape (n, 3, 3) [µm]."""
    points, ends = lattice(ORDERS[x.shape[1]])
    return positions(x, points)[:, ends].reshape(-1, 3, 3)


@lru_cache
def star() -> np.ndarray:
    """A hexagon of samples about (0, 0) as far apart, up to 1 from it, shape (m, 2): alike along all three sides."""
    steps = range(-DIVISIONS, DIVISIONS + 1)
    return np.array([(i, j) for i in steps for j in steps if abs(i + j) <= DIVISIONS]) / DIVISIONS


@lru_cache
def gauss() -> tuple[np.ndarray, np.ndarray]:
    """Points and weights on a facet; the weights add to 1/2."""
    points, weights = basix.make_quadrature(basix.CellType.triangle, GAUSS_DEGREE)
    return np.asarray(points), np.asarray(weights)


def highest(
    x: np.ndarray, value: Callable[[np.ndarray, Any], np.ndarray], count: int, comm: MPI.Comm
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where functions are largest on this rank's facets. Collective: only near the largest of all is it looked closer.

    Args:
        x: facets.
        value: function number j of points of shape (n, k, 3), shape (n, k); j is a number, or n of them.
        count: how many functions there are.
        comm: of the ranks.

    Returns:
        Values, shape (count,), -inf where this rank is far from the largest; facets and parameters there.
    """
    points, _ = lattice()
    sampled = positions(x, points)
    top, promise = np.full((2, count, len(x)), -np.inf)
    at = np.zeros((count, len(x)), dtype=int)
    for j in range(count if len(x) else 0):
        values = value(sampled, j)
        at[j], top[j] = values.argmax(axis=1), values.max(axis=1)
        promise[j] = top[j] + GAIN * (top[j] - values.min(axis=1))
    lead = np.max(comm.allgather(top.max(axis=1, initial=-np.inf)), axis=0)
    which, facet = np.nonzero(promise >= lead[:, None])
    places, step, n = points[at[which, facet]], 1 / DIVISIONS, np.arange(len(which))
    found = top[which, facet]
    for _ in range(ZOOMS if len(which) else 0):
        looked = _on_facet(places[:, None] + step * star())
        values = value(positions(x[facet], looked), which)
        best = values.argmax(axis=1)
        places, found, step = looked[n, best], values[n, best], step / DIVISIONS
    largest, on, where = np.full(count, -np.inf), np.zeros(count, dtype=int), np.zeros((count, 2))
    for k in np.argsort(found, kind="stable"):
        largest[which[k]], on[which[k]], where[which[k]] = found[k], facet[k], places[k]
    return largest, on, where


@dataclass(frozen=True)
class Part:
    """The part of facets where a value is positive, as triangles of their parameters.

    Args:
        whole, corners: facets of triangles all of which belongs to it, shape (n,), and the triangles, shape (n, 3, 2).
        cut, cut_corners, values: of small triangles that its rim crosses, or may cross; values at their corners,
            shape (m, 3), linear between them.
    """

    whole: np.ndarray
    corners: np.ndarray
    cut: np.ndarray
    cut_corners: np.ndarray
    values: np.ndarray

    def integral(self, x: np.ndarray, integrand: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> float:
        """Over the part of x, of a function of points and normals [per ds dt], shapes (n, k, 3); shape (n, k)."""
        points, weights = gauss()
        looked = _within(self.corners, points)
        sums = integrand(positions(x[self.whole], looked), normals(x[self.whole], looked)) @ weights
        centre = self.cut_corners.mean(axis=1, keepdims=True)
        at_centre = integrand(positions(x[self.cut], centre), normals(x[self.cut], centre))[:, 0] / 2
        shares = _positive_share(self.values) * _twice_area(self.cut_corners)
        return float(sums @ _twice_area(self.corners) + at_centre @ shares)

    def rim(self, x: np.ndarray) -> np.ndarray:
        """Points of x among which are the farthest ones of the part [µm], shape (n, 3)."""
        v, w = self.values, np.roll(self.values, -1, axis=1)
        crossed = (v > 0) != (w > 0)
        s = np.where(crossed, v / np.where(crossed, v - w, 1.0), 0.0)
        between = self.cut_corners + s[..., None] * (np.roll(self.cut_corners, -1, axis=1) - self.cut_corners)
        kept = positions(x[self.cut], between)[crossed | (v > 0)]
        return np.concatenate([positions(x[self.whole], self.corners).reshape(-1, 3), kept])


def part_above(x: np.ndarray, value: Callable[[np.ndarray], np.ndarray], rounds: int = 3) -> Part:
    """Where a value is positive: facets that its rim crosses are divided, and in the end cut straight.

    Also what may be above zero between its samples is divided: a contact may be smaller than they are apart.

    Args:
        x: facets.
        value: of points of shape (n, k, 3), shape (n, k).
        rounds: of division, each to a quarter of the length.
    """
    points, triangles = lattice()
    facet, whole = np.arange(len(x)), []
    corners = np.tile(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), (len(x), 1, 1))
    for _ in range(rounds):
        looked = _within(corners, points)
        values = value(positions(x[facet], looked))
        low, high = values.min(axis=1), values.max(axis=1)
        slack = GAIN * (high - low)
        inside, outside = low > slack, high + slack <= 0.0
        whole.append((facet[inside], corners[inside]))
        crossed = ~inside & ~outside
        facet = np.repeat(facet[crossed], len(triangles))
        corners, values = looked[crossed][:, triangles].reshape(-1, 3, 2), values[crossed][:, triangles].reshape(-1, 3)
    kept = values.max(axis=1) > 0
    ends = [np.concatenate(parts) for parts in zip(*whole, strict=True)]
    return Part(ends[0], ends[1], facet[kept], corners[kept], values[kept])


def section(x: np.ndarray, axis: int, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Where facets meet the plane x[axis] = level: ends of pieces of the curve, exactly on it, and its direction there.

    The outside lies to the right. Of two facets that meet in the plane the one on the positive side has the piece.

    Returns:
        Points [µm] and unit vectors, shape (n, 2, 2) each, in the plane's coordinates: (x, y), or (z, y) for axis 0.
    """
    points, triangles = lattice()
    height = positions(x, points)[..., axis] - level
    height[np.abs(height) < ON_LEVEL * np.abs(x).max(initial=0.0)] = 0.0
    above = height[:, triangles] > 0
    facet, triangle = np.nonzero(above.any(axis=2) & ~above.all(axis=2))
    side, n = above[facet, triangle], np.arange(len(facet))
    apart = np.argmax(side == (side.sum(axis=1) == 1)[:, None], axis=1)  # the corner alone on its side
    numbers = triangles[triangle]
    start = numbers[n, apart][:, None]
    end = np.stack([numbers[n, (apart + 1) % 3], numbers[n, (apart + 2) % 3]], axis=1)
    run = points[end] - points[start]
    first, last = height[facet[:, None], start], height[facet[:, None], end]
    s, nodes = first / (first - last), x[facet]
    for _ in range(NEWTON):
        place = points[start] + s[..., None] * run
        off = positions(nodes, place)[..., axis] - level
        rate = sum((_shapes(place, x.shape[1], 1 - k, k) @ nodes)[..., axis] * run[..., k] for k in (0, 1))
        step = np.divide(off, rate, out=np.zeros_like(off), where=np.abs(rate) > np.abs(off))
        s = np.clip(s - step, 0.0, 1.0)
    place, plane = points[start] + s[..., None] * run, [0 if axis == 2 else 2, 1]
    normal = normals(nodes, place)[..., plane]
    tangents = np.stack([-normal[..., 1], normal[..., 0]], axis=-1)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=-1, keepdims=True), np.finfo(float).tiny)
    ends = positions(nodes, place)[..., plane]
    backward = np.einsum("nc,nc->n", ends[:, 1] - ends[:, 0], tangents.sum(axis=1)) < 0
    ends[backward], tangents[backward] = ends[backward, ::-1], tangents[backward, ::-1]
    return ends, tangents


def _on_facet(points: np.ndarray) -> np.ndarray:
    """Parameters off the triangle moved onto its rim, to whichever of its ends they count from alike."""
    weights = np.maximum(np.stack([1 - points.sum(axis=-1), points[..., 0], points[..., 1]], axis=-1), 0.0)
    return np.asarray(weights[..., 1:] / weights.sum(axis=-1, keepdims=True))


def _within(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Parameters at given places of triangles of parameters, shape (n, k, 2) for corners of shape (n, 3, 2)."""
    return np.column_stack([1 - points.sum(axis=1), points]) @ corners


def _twice_area(corners: np.ndarray) -> np.ndarray:
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]))


def _positive_share(values: np.ndarray) -> np.ndarray:
    """Share of a triangle on which the linear function with these values at its ends is positive, shape (n,)."""
    c, b, a = np.sort(values, axis=1).T
    one = np.divide(a * a, (a - b) * (a - c), out=np.zeros_like(a), where=(a > 0) & (b <= 0))
    two = np.divide(c * c, (a - c) * (b - c), out=np.zeros_like(a), where=(b > 0) & (c <= 0))
    return np.where(b > 0, 1 - two, one)
