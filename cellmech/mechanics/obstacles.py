"""Rigid, fixed obstacles as level sets (eqs 26, 28, 29).

Sign convention, stated once: a level set l is positive inside the obstacle, the depth d = l/|grad l| [µm] is
positive where the cell has penetrated, and n = -grad l/|grad l| points out of the obstacle.
To add an obstacle: a frozen dataclass with `level_set`, `gradient` and `length_um`; plain arithmetic, so that the
same lines serve UFL and numpy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import ufl


class Obstacle(Protocol):
    """What the contact needs to know of a rigid, fixed obstacle."""

    @property
    def length_um(self) -> float:
        """A length of its size [µm]; depths are never reported beyond it."""

    def level_set(self, x: Any, y: Any) -> Any:
        """The level set l(x, y) [any unit], positive inside."""

    def gradient(self, x: Any, y: Any) -> tuple[Any, Any]:
        """(dl/dx, dl/dy) [unit of l per µm]."""


@dataclass(frozen=True)
class Pillar:
    """A micropillar, l = 1 - |(x - x_mp)/w|^e - |(y - y_mp)/h|^e [-] (eq. 26; w is the half-width)."""

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

    def level_set(self, x: Any, y: Any) -> Any:
        """See class; [-]."""
        xi, eta = (x - self.x_um) / self.half_width_um, (y - self.y_um) / self.height_um
        return 1 - self._power(xi, self.exponent) - self._power(eta, self.exponent)

    def gradient(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Of the level set [1/µm]."""
        xi, eta = (x - self.x_um) / self.half_width_um, (y - self.y_um) / self.height_um
        e = self.exponent
        return (
            -e / self.half_width_um * xi * self._power(xi, e - 2),
            -e / self.height_um * eta * self._power(eta, e - 2),
        )


@dataclass(frozen=True)
class Flat:
    """The flat region, l = y_flat - y [µm] (eq. 26)."""

    y_um: float

    @property
    def length_um(self) -> float:
        """The flat is unbounded [µm]."""
        return 1e9

    def level_set(self, x: Any, y: Any) -> Any:
        """See class; [µm]."""
        return self.y_um - y

    def gradient(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Of the level set [-]."""
        return 0 * x, -1 + 0 * y


def depth_and_normal(obstacle: Obstacle, x):
    """Depth d = l/|grad l| [µm] and outward normal n = -grad l/|grad l| [-] at the spatial point x (eqs 26, 28, 29).

    |grad l| is kept above 1/length, which only a pillar's inside near its centre reaches.

    Args:
        obstacle: the obstacle.
        x: spatial position [µm], shape (2,).
    """
    gx, gy = obstacle.gradient(x[0], x[1])
    square = gx * gx + gy * gy
    floor = obstacle.length_um ** (-2)
    norm = ufl.sqrt(ufl.conditional(ufl.lt(square, floor), floor, square))
    return obstacle.level_set(x[0], x[1]) / norm, ufl.as_vector([-gx / norm, -gy / norm])
