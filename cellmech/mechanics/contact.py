"""The penalty contact between cell and obstacles (eqs 26-29)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ufl

from cellmech.mechanics.kinematics import Kinematics, deformation_gradient
from cellmech.mechanics.normal_law import push_at
from cellmech.mechanics.obstacles import Obstacle, depth_and_normal


def symbolic_depth_and_normal(obstacle: Obstacle, x):
    """Depth [µm] and outward normal [-], shape of x, at a symbolic point (`obstacles.depth_and_normal`)."""
    d, n = depth_and_normal(obstacle, x, ufl.sqrt, lambda a, least: ufl.conditional(ufl.lt(a, least), least, a))
    return d, ufl.as_vector(n)


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
    """The contact of the cell and the obstacles.

    Args:
        form: "surface", a pressure on the outer boundary along the obstacle's normal (default); "conservative", along
            the boundary's own, which has a potential; "volume", the force spread over the overlap;
            "volume-printed", eq. 27 with h_p = 1, whose cofactor acts on a spatial normal: kept to be measured against.
        kappa: penalty [Pa/µm].
        width: smoothing s of the surface forms, or w of the volume forms [µm].
    """

    form: str = "surface"
    kappa: Any = 50.0
    width: Any = 1e-4

    @property
    def on_surface(self) -> bool:
        """True if the force is a pressure on the outer boundary, False if one in the volume of the overlap."""
        return not self.form.startswith("volume")

    @property
    def symmetric(self) -> bool:
        """True if the force has a potential, which makes its tangent symmetric."""
        return self.form == "conservative"

    @property
    def threshold_um(self) -> float:
        """Depth at which the force sets in [µm]: touch for a pressure, -w for the volume forms."""
        return 0.0 if self.on_surface else -self.width

    def pressure_at(self, d: float) -> float:
        """Pressure at depth d [Pa], as a number; for the volume forms, the body force summed up over the depth."""
        return push_at(d, self.kappa, self.width, self.on_surface)

    def surface_traction(self, u, N, X, obstacle: Obstacle, kinematics: Kinematics):
        """Traction per reference area (Nanson) [Pa], shape of u: p(d) |cof(F) N| n, or -p(d) cof(F) N if conservative.

        The second is minus the gradient of the integral of p(d(x)) over the deformed body: its energy depends on where
        the body is, not on how it came there.
        """
        F = deformation_gradient(u, kinematics)
        d, n = symbolic_depth_and_normal(obstacle, X + u)
        cof_N = ufl.cofac(F) * kinematics.vector(N)
        if self.symmetric:
            return -pressure(d, self.kappa, self.width) * ufl.as_vector([cof_N[k] for k in range(len(n))])
        return pressure(d, self.kappa, self.width) * ufl.sqrt(ufl.dot(cof_N, cof_N)) * n

    def body_force(self, u, X, obstacle: Obstacle, kinematics: Kinematics):
        """Force per reference volume of the volume forms [Pa/µm], shape of u.

        kappa H_w(d) J n for "volume", kappa H_w(d) cof(F) n for "volume-printed" (eq. 27).
        """
        F = deformation_gradient(u, kinematics)
        d, n = symbolic_depth_and_normal(obstacle, X + u)
        leaning = ufl.cofac(F) * kinematics.vector(n)
        direction = ufl.det(F) * n if self.form == "volume" else ufl.as_vector([leaning[k] for k in range(len(n))])
        return self.kappa * smooth_step(d, self.width) * direction

    def force(self, u, obstacle: Obstacle, mesh, kinematics: Kinematics):
        """Per reference area of the outline [Pa], or per reference volume [Pa/µm] in the volume forms; shape of u."""
        X = ufl.SpatialCoordinate(mesh)
        if self.on_surface:
            return self.surface_traction(u, ufl.FacetNormal(mesh), X, obstacle, kinematics)
        return self.body_force(u, X, obstacle, kinematics)
