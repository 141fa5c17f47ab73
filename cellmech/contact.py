"""Obstacles as level sets, and the penalty contact between them and the cell (eqs 26-29).

Sign convention, stated once: a level set l is positive inside the obstacle, the depth d = l/|grad l| [µm] is
positive where the cell has penetrated, and n = -grad l/|grad l| points out of the obstacle.
To add an obstacle: a frozen dataclass with `level_set`, `gradient` and `length_um`; plain arithmetic, so that the
same lines serve UFL and numpy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import ufl

from cellmech.kinematics import deformation_gradient


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


def pressure(d, kappa, s):
    """Penalty pressure p(d) [Pa]: 0 before touch, kappa d^2/(2 s) for 0 < d <= s, kappa (d - s/2) beyond.

    Args:
        d: depth [µm].
        kappa: penalty [Pa/µm].
        s: smoothing [µm].
    """
    touching = ufl.conditional(ufl.lt(d, s), kappa * d * d / (2 * s), kappa * (d - s / 2))
    return ufl.conditional(ufl.gt(d, 0), touching, 0.0)


def smooth_step(d, w):
    """C2 step H_w(d) [-], 0 below -w and 1 above w, w [µm]."""
    s = ufl.conditional(ufl.lt(d, -w), 0.0, ufl.conditional(ufl.gt(d, w), 1.0, (d / w + 1) / 2))
    return s**3 * (10 - 15 * s + 6 * s**2)


@dataclass(frozen=True)
class Contact:
    """How the cell and the obstacles push on each other.

    Args:
        form: "surface", a pressure on the outer boundary (default); "volume", the same force spread over the overlap;
            "volume-printed", eq. 27 with h_p = 1, whose cofactor acts on a spatial normal: kept to be measured against.
        kappa: penalty [Pa/µm].
        width: smoothing s of the surface form, or w of the volume forms [µm].
    """

    form: str = "surface"
    kappa: Any = 50.0
    width: Any = 1e-4

    @property
    def threshold_um(self) -> float:
        """Depth at which the force sets in [µm]: touch for a pressure, -w for the volume forms."""
        return 0.0 if self.form == "surface" else -self.width

    def pressure_at(self, d: float) -> float:
        """Pressure at depth d [Pa], as a number; for the volume forms, the body force summed up over the depth."""
        if self.form == "surface":
            return 0.0 if d <= 0 else self.kappa * (d * d / (2 * self.width) if d < self.width else d - self.width / 2)
        s = min(max((d / self.width + 1) / 2, 0.0), 1.0)
        return self.kappa * (2 * self.width * s**4 * (2.5 - 3 * s + s * s) + max(d - self.width, 0.0))

    def surface_traction(self, u, N, X, obstacle: Obstacle):
        """p(d) |cof(F) N| n [Pa], traction per reference area (Nanson); shape (2,)."""
        F = deformation_gradient(u)
        d, n = depth_and_normal(obstacle, X + u)
        cof_N = ufl.cofac(F) * N
        return pressure(d, self.kappa, self.width) * ufl.sqrt(ufl.dot(cof_N, cof_N)) * n

    def body_force(self, u, X, obstacle: Obstacle):
        """Force per reference volume of the volume forms [Pa/µm], shape (2,).

        kappa H_w(d) J n for "volume", kappa H_w(d) cof(F) n for "volume-printed" (eq. 27).
        """
        F = deformation_gradient(u)
        d, n = depth_and_normal(obstacle, X + u)
        direction = ufl.det(F) * n if self.form == "volume" else ufl.cofac(F) * n
        return self.kappa * smooth_step(d, self.width) * direction

    def virtual_work(self, u, w, obstacle: Obstacle, dx, ds):
        """Virtual work of the contact force on w [Pa µm], over the measure this form acts on."""
        domain = w.ufl_function_space().ufl_domain()
        X = ufl.SpatialCoordinate(domain)
        if self.form == "surface":
            return ufl.dot(self.surface_traction(u, ufl.FacetNormal(domain), X, obstacle), w) * ds
        return ufl.dot(self.body_force(u, X, obstacle), w) * dx
