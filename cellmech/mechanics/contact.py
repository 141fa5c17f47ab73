"""The penalty contact between cell and obstacles (eqs 26-29)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ufl

from cellmech.mechanics.kinematics import deformation_gradient
from cellmech.mechanics.obstacles import Obstacle, depth_and_normal


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
