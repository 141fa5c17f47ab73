"""Pillars that end on all sides (eq. 26 in space): round ones and square ones, x and z horizontal.

Both are convex, and symmetric about the vertical planes through their axis. A vertical plane cuts an arch out of their
upper half (`across`, `along`), and the level of their foot a disc or a rounded square (`foot`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

from cellmech.mechanics.obstacles import Pillar

TINY = 1e-30  # [-] beside a square, whose real powers then have all derivatives at 0 and no other value; of a section


class Arch(Protocol):
    """A concave top above an interval."""

    @property
    def x_um(self) -> float:
        """Its middle [µm]."""

    @property
    def half_width_um(self) -> float:
        """Half of its width [µm]."""

    def rise(self, x: float) -> float:
        """Its height at x [µm], 0 at and beyond the ends."""

    def slope(self, x: float) -> float:
        """Derivative of `rise`, infinite at and beyond the ends [-]."""


@dataclass(frozen=True)
class Cut:
    """The arch that a plane beside the axis of a round pillar cuts out of it.

    Args:
        x_um: its middle, along the plane.
        half_width_um: half of its width.
        aside_um: distance of the plane from the axis.
        profile: the pillar's own arch about 0, by the distance from its axis.
    """

    x_um: float
    half_width_um: float
    aside_um: float
    profile: Pillar

    def rise(self, x: float) -> float:
        """See `Arch`."""
        return self.profile.rise(math.hypot(x - self.x_um, self.aside_um))

    def slope(self, x: float) -> float:
        """See `Arch`."""
        along = x - self.x_um
        distance = math.hypot(along, self.aside_um)
        return self.profile.slope(distance) * along / distance if along else 0.0


@dataclass(frozen=True)
class _Upright:
    """What a round and a square pillar have in common; `half_width_um` is along x and along z."""

    x_um: float
    y_um: float
    z_um: float
    half_width_um: float
    height_um: float
    exponent: float = 4.0

    @property
    def length_um(self) -> float:
        """The larger half-axis [µm]."""
        return max(self.half_width_um, self.height_um)

    def _squares(self, x: Any) -> tuple[Any, Any, Any]:
        """Coordinates over half-axes, squared [-]."""
        w = self.half_width_um
        return ((x[0] - self.x_um) / w) ** 2, ((x[1] - self.y_um) / self.height_um) ** 2, ((x[2] - self.z_um) / w) ** 2

    def _power(self, square: Any, exponent: float) -> Any:
        """|a|^exponent from a^2."""
        return square ** int(exponent / 2) if exponent % 2 == 0 else (square + TINY) ** (exponent / 2)

    def _derivatives(self, x: Any, factors: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
        """-e a/A^2 times a factor for each coordinate a and its half-axis A [1/µm]."""
        e, w, h = self.exponent, self.half_width_um, self.height_um
        return (
            -e / w**2 * (x[0] - self.x_um) * factors[0],
            -e / h**2 * (x[1] - self.y_um) * factors[1],
            -e / w**2 * (x[2] - self.z_um) * factors[2],
        )


@dataclass(frozen=True)
class RoundPillar(_Upright):
    """A round micropillar, l = 1 - (rho/w)^e - |(y - y_mp)/h|^e [-], rho the distance from its axis; or a ball."""

    def level_set(self, x: Any) -> Any:
        """See class; [-]."""
        xi, eta, zeta = self._squares(x)
        return 1 - self._power(xi + zeta, self.exponent) - self._power(eta, self.exponent)

    def gradient(self, x: Any) -> tuple[Any, Any, Any]:
        """Of the level set [1/µm]."""
        xi, eta, zeta = self._squares(x)
        around, up = (self._power(square, self.exponent - 2) for square in (xi + zeta, eta))
        return self._derivatives(x, (around, up, around))

    def octant(self, x: Any) -> tuple[tuple[Any, ...], tuple[float, ...]]:
        """Distance from its axis and height over its foot, without its sign, and its half-axes along them [µm]."""
        aside = ((x[0] - self.x_um) ** 2 + (x[2] - self.z_um) ** 2) ** 0.5
        return (aside, abs(x[1] - self.y_um)), (self.half_width_um, self.height_um)

    @property
    def foot(self) -> Pillar:
        """Half-width of its foot by the distance from its middle, as an arch about 0."""
        return Pillar(0.0, 0.0, self.half_width_um, self.half_width_um, 2.0)

    @property
    def profile(self) -> Pillar:
        """Its arch about 0, by the distance from its axis."""
        return Pillar(0.0, self.y_um, self.half_width_um, self.height_um, self.exponent)

    def across(self, z: float) -> Arch:
        """Its section by a plane z = const, an arch along x."""
        return Cut(self.x_um, self.foot.rise(z - self.z_um), z - self.z_um, self.profile)

    def along(self, x: float) -> Arch:
        """Its section by a plane x = const, an arch along z."""
        return Cut(self.z_um, self.foot.rise(x - self.x_um), x - self.x_um, self.profile)

    def top(self, x: float, z: float = 0.0) -> float | None:
        """Level of its surface at x, z [µm]; None where there is none."""
        return self.profile.top(math.hypot(x - self.x_um, z - self.z_um))

    def outline(self, points: int, z: float = 0.0) -> list[tuple[float, float]] | None:
        """Points of the closed outline (x, y) of its section at z [µm]; None where that misses it."""
        aside, e = abs(z - self.z_um) / self.half_width_um, self.exponent
        if aside >= 1.0:
            return None
        share, found = 1.0 - aside**e, []
        for k in range(points):
            angle = 2.0 * math.pi * k / (points - 1)
            along, up = round(math.cos(angle), 15), round(math.sin(angle), 15)
            rho = (1.0 - share * up**2) ** (1.0 / e)
            xi = math.copysign(math.sqrt(max(rho**2 - aside**2, 0.0)) if along else 0.0, along)
            eta = math.copysign((share * up**2) ** (1.0 / e), up)
            found.append((self.x_um + self.half_width_um * xi, self.y_um + self.height_um * eta))
        return found


@dataclass(frozen=True)
class SquarePillar(_Upright):
    """A square micropillar, l = 1 - |(x - x_mp)/w|^e - |(z - z_mp)/w|^e - |(y - y_mp)/h|^e [-]."""

    def level_set(self, x: Any) -> Any:
        """See class; [-]."""
        xi, eta, zeta = (self._power(square, self.exponent) for square in self._squares(x))
        return 1 - xi - eta - zeta

    def gradient(self, x: Any) -> tuple[Any, Any, Any]:
        """Of the level set [1/µm]."""
        xi, eta, zeta = (self._power(square, self.exponent - 2) for square in self._squares(x))
        return self._derivatives(x, (xi, eta, zeta))

    def octant(self, x: Any) -> tuple[tuple[Any, ...], tuple[float, ...]]:
        """Coordinates from its centre without their signs, y the last, and its half-axes along them [µm]."""
        w = self.half_width_um
        offsets = abs(x[0] - self.x_um), abs(x[2] - self.z_um), abs(x[1] - self.y_um)
        return offsets, (w, w, self.height_um)

    @property
    def foot(self) -> Pillar:
        """Half-width of its foot by the distance from its middle, as an arch about 0."""
        return Pillar(0.0, 0.0, self.half_width_um, self.half_width_um, self.exponent)

    def _section(self, middle: float, aside: float) -> Pillar:
        share = max(self.foot.rise(aside) / self.half_width_um, TINY)
        return Pillar(middle, self.y_um, self.half_width_um * share, self.height_um * share, self.exponent)

    def across(self, z: float) -> Pillar:
        """Its section by a plane z = const, an arch along x, which must not miss it."""
        return self._section(self.x_um, z - self.z_um)

    def along(self, x: float) -> Pillar:
        """Its section by a plane x = const, an arch along z, which must not miss it."""
        return self._section(self.z_um, x - self.x_um)

    def top(self, x: float, z: float = 0.0) -> float | None:
        """Level of its surface at x, z [µm]; None where there is none."""
        return self.across(z).top(x) if abs(z - self.z_um) < self.half_width_um else None

    def outline(self, points: int, z: float = 0.0) -> list[tuple[float, float]] | None:
        """Points of the closed outline (x, y) of its section at z [µm]; None where that misses it."""
        return self.across(z).outline(points) if abs(z - self.z_um) < self.half_width_um else None
