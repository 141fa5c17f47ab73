"""What a curve in the plane measures, its edges being given by their Lagrange nodes as those of `outline.Outline`.

Edges have shape (n_edges, n_nodes, 2) [µm], ends first, and run counter-clockwise about what they enclose. Of a curve
that x = 0 halves, a half is enough: the line x = 0 that closes it adds nothing to any integral of `Moments`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cellmech.fem.outline import GAUSS_POINTS, INNER_NODES, _coefficients, along

ROUND = 1e-4  # principal axes that differ by less, relatively, are those of a circle
LEAST_COSINE = 0.5  # between a chord and the tangents at its ends; of less there is no smooth arc between them


@dataclass(frozen=True)
class Moments:
    """Integrals along a curve and over what it encloses; those of pieces add.

    Args:
        values: length [µm], int x ds [µm^2], area [µm^2], int x dA, int y dA [µm^3], int x^2 dA, int xy dA and
            int y^2 dA [µm^4].
    """

    values: np.ndarray

    @property
    def length(self) -> float:
        """Of the curve [µm]."""
        return float(self.values[0])

    @property
    def area(self) -> float:
        """Enclosed, int x dy [µm^2]."""
        return float(self.values[2])

    @property
    def centroid(self) -> np.ndarray:
        """Of the enclosed area [µm], shape (2,)."""
        return self.values[3:5] / self.area

    @property
    def mirrored(self) -> Moments:
        """Of the whole curve that x = 0 halves: what is odd in x vanishes, all else doubles."""
        return Moments(2 * self.values * np.array([1, 0, 1, 0, 1, 1, 0, 1]))

    @property
    def shape_index(self) -> float:
        """4 pi S/l^2 of a whole curve, 1 of a circle [-] (eq. 33)."""
        return 4 * np.pi * self.area / self.length**2

    @property
    def turned(self) -> tuple[float, float, float]:
        """Of the body that x > 0 turned about x = 0 makes: surface [µm^2], volume [µm^3], its centroid's y [µm].

        By Pappus they are 2 pi int x ds, 2 pi int x dA and int xy dA/int x dA.
        """
        return (
            2 * np.pi * float(self.values[1]),
            2 * np.pi * float(self.values[3]),
            float(self.values[6] / self.values[3]) if self.values[3] else 0.0,
        )

    @property
    def tilt_deg(self) -> float | None:
        """Angle from x to the longer principal axis of the area, in (-90, 90] degrees; None where there is none."""
        x, y = self.centroid
        xx, xy, yy = self.values[5:] / self.area - (x * x, x * y, y * y)
        if np.hypot(xx - yy, 2 * xy) < ROUND * (xx + yy):
            return None
        return float(np.degrees(np.arctan2(2 * xy, xx - yy) / 2))


@lru_cache
def _gauss(n_nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Functions of an edge at Gauss points, then derivatives, shape (2 GAUSS_POINTS, n_nodes); the points' weights."""
    s, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    powers, s = np.arange(n_nodes), (s[:, None] + 1) / 2
    derivative = powers * s ** np.maximum(powers - 1, 0)
    return np.vstack([s**powers, derivative]) @ _coefficients(n_nodes), weight[:, None] / 2


def moments(x: np.ndarray) -> Moments:
    """Of edges, by Green's theorem; exact but for the lengths, for edges of up to third order."""
    functions, weight = _gauss(x.shape[1])
    (px, tx), (py, ty) = np.moveaxis(np.tensordot(functions, x, (1, 1)).reshape(2, GAUSS_POINTS, -1, 2), -1, 0)
    ds, x_dy = np.hypot(tx, ty) * weight, px * ty * weight
    xx_dy, xy_dy = px * x_dy, py * x_dy
    over_area = [x_dy.sum(), xx_dy.sum() / 2, xy_dy.sum(), np.vdot(px, xx_dy) / 3, np.vdot(py, xx_dy) / 2]
    return Moments(np.array([ds.sum(), np.vdot(px, ds), *over_area, np.vdot(py, xy_dy)]))


def ranges(x: np.ndarray) -> np.ndarray:
    """Least and largest coordinates on each edge, between its nodes too [µm], shape (2, n_edges, 2)."""
    c = np.zeros((4, len(x), 2))
    c[: x.shape[1]] = np.tensordot(_coefficients(x.shape[1]), x, (1, 1))
    half = -(c[2] + np.copysign(np.sqrt(np.maximum(c[2] ** 2 - 3 * c[1] * c[3], 0.0)), c[2]))
    with np.errstate(divide="ignore", invalid="ignore"):  # a coordinate that has fewer extremes, or none
        s = np.clip(np.nan_to_num(np.array([half / (3 * c[3]), c[1] / half])), 0.0, 1.0)
    inner = c[0] + s * (c[1] + s * (c[2] + s * c[3]))
    on_edge = np.concatenate([np.moveaxis(x[:, :2], 1, 0), inner])
    return np.array([on_edge.min(axis=0), on_edge.max(axis=0)])


def below(x: np.ndarray, level: float, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The part of the curve under y = level, as edges like those given.

    What it encloses with the level has `moments(...).area`, and turned its volume: along the level dy = 0.

    Args:
        x: edges.
        level: [µm].
        low, high: least and largest y on each edge (`ranges`), shape (n_edges,).
    """
    nodes = np.array([0.0, 1.0, *INNER_NODES[x.shape[1]]])
    parts = [x[high <= level]]
    for edge in x[(low < level) & (high > level)]:
        powers = _coefficients(x.shape[1]) @ edge[:, 1]
        powers[0] -= level
        roots = np.polynomial.polynomial.polyroots(powers)
        real = np.sort(roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0) & (roots.real < 1.0)])
        ends = np.concatenate([[0.0], real, [1.0]])
        middle = np.polynomial.polynomial.polyval((ends[1:] + ends[:-1]) / 2, powers)
        for k in np.flatnonzero(middle < 0.0):
            parts.append(along(edge[None], ends[k] + (ends[k + 1] - ends[k]) * nodes))
    return np.concatenate(parts)


def arcs(ends: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    """Cubic edges through points with given directions there; of a smooth curve, off by the fourth power of a length.

    Args:
        ends: start and end of each [µm], shape (n, 2, 2).
        tangents: unit vectors there, shape (n, 2, 2).
    """
    chord = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(chord, axis=1)[:, None]
    cosines = np.einsum("nec,nc->ne", tangents, chord)
    straight = cosines.min(axis=1, initial=1.0) < LEAST_COSINE * length[:, 0]
    start, end = np.where(straight[:, None, None], chord[:, None], tangents * length[:, None]).swapaxes(0, 1)
    inner = [
        ends[:, 0] + s * s * (3 - 2 * s) * chord + s * (1 - s) * ((1 - s) * start - s * end) for s in INNER_NODES[4]
    ]
    return np.stack([ends[:, 0], ends[:, 1], *inner], axis=1)
