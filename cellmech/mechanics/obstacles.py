"""Rigid, fixed obstacles (eqs 26, 28, 29): level set, depth and normal, top, outline.

Sign convention, stated once: a level set l is positive inside the obstacle, the depth d = l/|grad l| [µm] is
positive where the cell has penetrated, and n = -grad l/|grad l| points out of the obstacle.
A point is a vector of coordinates: symbols (UFL), numbers, or arrays of them, `x[k]` the k-th coordinate of all points.
It has two coordinates or three, of which y = x[1] is up: what is here is endless along z (`pillars` has what is not).
To add an obstacle: a frozen dataclass with `level_set`, `gradient` and `length_um`, in plain arithmetic that serves all
of these; with `distance(x)`, too, the nucleus's distance from it is reported. The built-in shapes have their tops and
outlines; pillars have an `octant`, by which their distance is known.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol


class Obstacle(Protocol):
    """A rigid, fixed obstacle, as the contact needs it."""

    @property
    def length_um(self) -> float:
        """A length of its size [µm]; depths are never reported beyond it."""

    def level_set(self, x: Any) -> Any:
        """The level set l at x [any unit], positive inside."""

    def gradient(self, x: Any) -> tuple[Any, ...]:
        """Its derivative by each coordinate [unit of l per µm]."""


@dataclass(frozen=True)
class Pillar:
    """A micropillar, l = 1 - |(x - x_mp)/w|^e - |(y - y_mp)/h|^e [-] (eq. 26; w is the half-width).

    Its upper half is an arch, whose height is `rise`. A disc is one too, of exponent 2. Turned about x = 0 it is round,
    or a ring where x_mp > 0; in 3-D it is a ridge.
    """

    x_um: float
    y_um: float
    half_width_um: float
    height_um: float
    exponent: float = 4.0

    @property
    def length_um(self) -> float:
        """The larger half-axis [µm]."""
        return max(self.half_width_um, self.height_um)

    def _power(self, a: Any, exponent: float) -> Any:
        return a ** int(exponent) if exponent % 2 == 0 else abs(a) ** exponent

    def _scaled(self, x: Any) -> tuple[Any, Any]:
        return (x[0] - self.x_um) / self.half_width_um, (x[1] - self.y_um) / self.height_um

    def level_set(self, x: Any) -> Any:
        """See class; [-]."""
        xi, eta = self._scaled(x)
        return 1 - self._power(xi, self.exponent) - self._power(eta, self.exponent)

    def gradient(self, x: Any) -> tuple[Any, ...]:
        """Gradient of the level set [1/µm]."""
        (xi, eta), e = self._scaled(x), self.exponent
        return (
            -e / self.half_width_um * xi * self._power(xi, e - 2),
            -e / self.height_um * eta * self._power(eta, e - 2),
            *_zeros(x),
        )

    def octant(self, x: Any) -> tuple[tuple[Any, ...], tuple[float, ...]]:
        """Coordinates from its centre without their signs, y the last, and its half-axes along them [µm]."""
        return (abs(x[0] - self.x_um), abs(x[1] - self.y_um)), (self.half_width_um, self.height_um)

    def rise(self, x: float) -> float:
        """Height of its surface above y_um at x [µm], 0 at and beyond the ends."""
        xi = abs(x - self.x_um) / self.half_width_um
        if xi >= 1.0:
            return 0.0
        return self.height_um * math.pow(self._rest(xi), 1.0 / self.exponent)

    def slope(self, x: float) -> float:
        """Derivative of `rise`, infinite at and beyond the ends [-]."""
        xi, side = abs(x - self.x_um) / self.half_width_um, x - self.x_um
        if xi >= 1.0:
            return -math.copysign(math.inf, side)
        rest = self._rest(xi) ** (1.0 / self.exponent - 1.0)
        return -math.copysign(self.height_um / self.half_width_um * xi ** (self.exponent - 1.0) * rest, side)

    def _rest(self, xi: float) -> float:
        # 1 - xi^p without the cancellation near the end, where a sharp pillar is steepest
        return -math.expm1(self.exponent * math.log(xi)) if xi > 0.0 else 1.0

    def across(self, z: float) -> Pillar:
        """Its section by a plane z = const."""
        return self

    def top(self, x: float, z: float = 0.0) -> float | None:
        """Level of its surface at x [µm]; None where there is none."""
        return self.y_um + self.rise(x) if abs(x - self.x_um) < self.half_width_um else None

    def outline(self, points: int, z: float = 0.0) -> list[tuple[float, float]]:
        """Points of its closed outline [µm], spaced evenly enough at round corners and sharp ones."""
        power, found = 2.0 / self.exponent, []
        for k in range(points):
            angle = 2.0 * math.pi * k / (points - 1)
            sides = []
            for along in (math.cos(angle), math.sin(angle)):
                along = round(along, 15)  # else what rounding leaves of 0 would be far from it under a small power
                sides.append(math.copysign(abs(along) ** power, along))
            found.append((self.x_um + self.half_width_um * sides[0], self.y_um + self.height_um * sides[1]))
        return found


@dataclass(frozen=True)
class Flat:
    """The flat region, l = y_flat - y [µm] (eq. 26)."""

    y_um: float

    @property
    def length_um(self) -> float:
        """The flat is unbounded [µm]."""
        return 1e9

    def level_set(self, x: Any) -> Any:
        """See class; [µm]."""
        return self.y_um - x[1]

    def gradient(self, x: Any) -> tuple[Any, ...]:
        """Of the level set [-]."""
        return 0 * x[0], -1 + 0 * x[1], *_zeros(x)

    def distance(self, x: Any) -> Any:
        """Of points from it, negative below [µm]."""
        return x[1] - self.y_um

    def top(self, x: float, z: float = 0.0) -> float | None:
        """Its level [µm]."""
        return self.y_um


def _zeros(x: Any) -> list[Any]:
    """Derivatives by the coordinates beyond the second, along which nothing changes."""
    return [0 * x[k] for k in range(2, len(x))]


def depth_and_normal(
    obstacle: Obstacle, x: Any, sqrt: Callable[[Any], Any], larger: Callable[[Any, float], Any]
) -> tuple[Any, list[Any]]:
    """Depth d = l/|grad l| [µm] and components of the outward normal n = -grad l/|grad l| [-] at x (eqs 26, 28, 29).

    |grad l| is kept above 1/length, which only a pillar's inside near its centre reaches.

    Args:
        obstacle: the obstacle.
        x: a point, or points [µm].
        sqrt, larger: the square root, and the larger of a value and a number, of what coordinates are.
    """
    gradient = obstacle.gradient(x)
    norm = sqrt(larger(sum(g * g for g in gradient), obstacle.length_um ** (-2)))
    return obstacle.level_set(x) / norm, [-g / norm for g in gradient]
