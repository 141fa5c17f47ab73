"""The settled elastic cell in a second finite-element code, NGSolve: nothing of cellmech in it.

Geometry and mesh are Netgen's, elements curved Lagrange triangles of any order; stresses are coded by hand from the
invariants' derivatives (cellmech differentiates energies), contact as a boundary term with |F T| for |cof(F) N|
(T the unit tangent), the tangent is NGSolve's own linearisation, the solve a damped Newton with UMFPACK.
Units: µm, s, Pa. The scene is the dictionary that `result.json` of cellmech holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import numpy as np
from netgen.geom2d import SplineGeometry
from ngsolve import (
    ET,
    BilinearForm,
    CoefficientFunction,
    Det,
    Grad,
    GridFunction,
    Id,
    IfPos,
    InnerProduct,
    Integrate,
    IntegrationRule,
    Inv,
    Mesh,
    Parameter,
    Trace,
    VectorH1,
    ds,
    dx,
    log,
    specialcf,
    sqrt,
    x,
    y,
)

INSIDE_OUT = ("nucleoplasm", "lamina", "cytosol", "membrane")
REST = {"sigma_mises": 0.0, "J1": 2.0, "J2": 2.0, "J3": 1.0}
MOST_STEPS, SHORTEST = 60, 1e-4
CONTACT_ARC = 0.36  # rad of the rim from its lowest point that get their own element size


@dataclass(frozen=True)
class Level:
    """How finely the cell is resolved; element sizes in µm.

    Args:
        far: largest size.
        near: in the contact zone and in the cytosol between nucleus and pillar.
        lamina: within and along the lamina.
        order: of displacement and geometry.
    """

    far: float
    near: float
    lamina: float
    order: int


def half_disc(radii: dict[str, float], centre_y: float, level: Level) -> Mesh:
    """The right half of the layered disc: sides "axis", "outer", "lamina outline" ..., materials like the layers."""
    geometry = SplineGeometry()
    previous: list[int] = []
    origin = geometry.AddPoint(0.0, centre_y)
    for k, name in enumerate(INSIDE_OUT, 1):
        r, outside = radii[name], 0 if k == len(INSIDE_OUT) else k + 1
        size = {"lamina": level.lamina, "nucleoplasm": level.lamina}.get(name, level.far)
        angles = [-pi / 2, -pi / 2 + CONTACT_ARC, 0.0, pi / 4, pi / 2]
        ends = [geometry.AddPoint(r * cos(a), centre_y + r * sin(a)) for a in angles]
        for i in range(len(angles) - 1):
            half, middle = (angles[i + 1] - angles[i]) / 2, (angles[i + 1] + angles[i]) / 2
            corner = geometry.AddPoint(r / cos(half) * cos(middle), centre_y + r / cos(half) * sin(middle))
            here = level.near if i == 0 and name in ("cytosol", "membrane") else size
            side = {"leftdomain": k, "rightdomain": outside, "bc": f"{name} outline" if outside else "outer"}
            geometry.Append(["spline3", ends[i], corner, ends[i + 1]], maxh=min(here, size), **side)
        inner = previous or [origin, origin]
        for a, b in ((inner[0], ends[0]), (ends[-1], inner[1])):
            geometry.Append(["line", a, b], leftdomain=k, rightdomain=0, bc="axis")
        previous = [ends[0], ends[-1]]
        geometry.SetMaterial(k, name)
    geometry.SetDomainMaxH(INSIDE_OUT.index("lamina") + 1, level.lamina)
    mesh = Mesh(geometry.GenerateMesh(maxh=level.far, grading=0.25))
    mesh.Curve(level.order)
    return mesh


def energy_slopes(law: str, lmbda: Any, mu: Any, beta_over_mu: float, I1: Any, J: Any) -> tuple[Any, Any, Any]:
    """dW/dI1, dW/dI2 and I3 dW/dI3 [Pa] of the four energies, by hand."""
    if law == "saint-venant":  # λ/8 (I1 - 3)² + µ/4 (I1² - 2 I2 - 2 I1 + 3)
        return lmbda / 4 * (I1 - 3) + mu / 2 * (I1 - 1), -mu / 2, CoefficientFunction(0.0)
    if law == "neo-hookean":
        return mu / 2, CoefficientFunction(0.0), (lmbda * log(J) - mu) / 2
    beta = beta_over_mu * mu
    alpha, bulk = mu / 2 - beta, lmbda + 2 * mu / 3
    first = alpha if law == "mooney-rivlin" else alpha * (1 - 0.5 * (I1 - 3) + 0.1 * (I1 - 3) ** 2)
    return first, beta, -alpha * J ** (2 / 3) - 2 * beta * J ** (4 / 3) + bulk * log(J) / 2


class Elastic:
    """The elastic half cell of a scene on one mesh."""

    def __init__(self, scene: dict[str, Any], level: Level) -> None:
        if scene["cell"]["gap_um"] or scene["cell"]["lame_lambda"] != "standard" or len(scene["pillar"]) != 1:
            raise ValueError("only a cell that touches one pillar, with the standard λ, is coded here")
        self.scene, self.level = scene, level
        layers, radius = scene["layer"], scene["layer"]["membrane"]["outer_radius_um"]
        self.pillar = scene["pillar"][0]
        self.top = self.pillar["y_um"] + self.pillar["height_um"]
        self.radii = {name: layers[name]["outer_radius_um"] for name in INSIDE_OUT}
        self.mesh, self.space = self.discretised(self.top + radius)
        self.u = GridFunction(self.space)
        poisson = scene["cell"]["poisson"]
        young = self.mesh.MaterialCF({name: layers[name]["young_Pa"] for name in INSIDE_OUT})
        self.lmbda, self.mu = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
        self.solid = self.mesh.MaterialCF({name: 1 - layers[name]["fluid_fraction"] for name in INSIDE_OUT})
        self.weight_density = scene["load"]["factor"] * scene["cell"]["density_kg_m3"] * scene["load"]["gravity_m_s2"]
        self.weight_density *= 1e-6  # N/m³ = Pa/m to Pa/µm
        self.load = Parameter(1.0)

    def discretised(self, centre_y: float) -> tuple[Mesh, VectorH1]:
        """The mesh, and the displacements on it, with no motion across the axis."""
        mesh = half_disc(self.radii, centre_y, self.level)
        return mesh, VectorH1(mesh, order=self.level.order, dirichletx="axis")

    def stress(self, grad: Any) -> tuple[Any, Any, Any]:
        """F, the in-plane S and S_zz of c_s times the solid [Pa] at a displacement gradient."""
        F = Id(2) + grad
        C, J = F.trans * F, Det(F)
        I1, cell = Trace(C) + 1, self.scene["cell"]
        W1, W2, W3 = energy_slopes(cell["law"], self.lmbda, self.mu, cell["beta_over_mu"], I1, J)
        S = 2 * self.solid * ((W1 + I1 * W2) * Id(2) - W2 * C + W3 * Inv(C))
        return F, S, 2 * self.solid * (W1 + I1 * W2 - W2 + W3)

    def depth_and_normal(self, X: Any, Y: Any) -> tuple[Any, Any]:
        """l/|grad l| [µm] and the pillar's outward normal at a spatial point."""
        p = self.pillar
        a, b = (X - p["x_um"]) / p["half_width_um"], (Y - p["y_um"]) / p["height_um"]
        e = p["exponent"]
        gradient = CoefficientFunction((-e * a ** (e - 1) / p["half_width_um"], -e * b ** (e - 1) / p["height_um"]))
        size = sqrt(InnerProduct(gradient, gradient))
        return (1 - a**e - b**e) / size, -gradient / size

    def residual(self) -> BilinearForm:
        """Equilibrium as a nonlinear form."""
        u, v = self.space.TnT()
        F, S, _ = self.stress(Grad(u))
        form = BilinearForm(self.space)
        form += (InnerProduct(F * S, Grad(v)) + self.load * self.weight_density * v[1]) * dx(bonus_intorder=2)
        kappa, s = self.scene["contact"]["penalty_Pa_per_um"], self.scene["contact"]["smoothing_um"]
        ut = u.Trace()
        d, n = self.depth_and_normal(x + ut[0], y + ut[1])
        p = IfPos(d, IfPos(d - s, kappa * (d - s / 2), kappa * d * d / (2 * s)), 0.0)
        tangent = specialcf.tangential(2)
        line = tangent + Grad(u).Trace() * tangent
        form += -p * sqrt(InnerProduct(line, line)) * InnerProduct(n, v.Trace()) * ds("outer", bonus_intorder=10)
        return form

    def solve(self, start_depth: float = 0.1, tolerance: float = 1e-11) -> list[float]:
        """Newton from a rigid translation [µm] into the pillar; returns the residual norms.

        From deep inside the contact opens by itself in a few steps; from first touch, where it has no stiffness, it
        takes several times as many.
        """
        self.u.Set(CoefficientFunction(tuple(-start_depth if k == 1 else 0.0 for k in range(self.mesh.dim))))
        return self.newton(self.residual(), tolerance)

    def weight(self) -> float:
        """Of the modelled part [Pa µm], or of the whole ball [pN]: what residuals are measured by."""
        return self.weight_density * float(Integrate(CoefficientFunction(1.0) * dx, self.mesh))

    def newton(self, form: BilinearForm, tolerance: float) -> list[float]:
        """Damped Newton from where u is until the residual is this share of the weight; the norms on the way."""
        free = self.space.FreeDofs()
        r, trial, du = (self.u.vec.CreateVector() for _ in range(3))

        def norm(vector: Any) -> float:
            form.Apply(vector, r)
            return float(np.linalg.norm(r.FV().NumPy()[np.array(free)]))

        norms = [norm(self.u.vec)]
        while norms[-1] > tolerance * self.weight():
            if len(norms) > MOST_STEPS:
                raise RuntimeError(f"no equilibrium in {MOST_STEPS} Newton steps, residuals {norms}")
            form.AssembleLinearization(self.u.vec)
            norm(self.u.vec)
            du.data = form.mat.Inverse(free, inverse="umfpack") * r
            step = 1.0
            while True:
                trial.data = self.u.vec - step * du
                size = norm(trial)
                if size < norms[-1]:  # false for nan: an element turned inside out
                    break
                if step < SHORTEST:
                    raise RuntimeError(f"no Newton step brings the residual down, residuals {norms}")
                step /= 2
            self.u.vec.data = trial
            norms.append(size)
        return norms

    def quantities(self) -> dict[str, Any]:
        """σ_Mises [Pa], in-plane J1, J2, J3 and det F as functions of place."""
        F, S, S_zz = self.stress(Grad(self.u))
        C, J = F.trans * F, Det(F)
        sigma, zz = F * S * F.trans / J, S_zz / J
        mean = (Trace(sigma) + zz) / 3
        dev = sigma - mean * Id(2)
        mises = sqrt(1.5 * (InnerProduct(dev, dev) + (zz - mean) ** 2))
        return {"sigma_mises": mises, "J1": Trace(C), "J2": InnerProduct(C, C), "J3": Det(C), "det_F": J}

    def report(self) -> dict[str, Any]:
        """Numbers named as in cellmech's result.json: maxima at the elements' nodes, means over the reference area."""
        n = self.level.order
        lattice = [(i / n, j / n) for j in range(n + 1) for i in range(n + 1 - j)]
        nodes = IntegrationRule(lattice, [0.0] * len(lattice))
        found: dict[str, Any] = {}
        for region in INSIDE_OUT:
            where = self.mesh.Materials(region)
            points = self.mesh.MapToAllElements({ET.TRIG: nodes}, where)
            place = CoefficientFunction((x, y))(points)
            area = Integrate(CoefficientFunction(1.0) * dx(definedon=where), self.mesh)
            for name, q in self.quantities().items():
                values = q(points).ravel()
                if name == "det_F":
                    found[f"{region}.det_F_min"] = float(values.min())
                    continue
                unit = "_Pa" if name == "sigma_mises" else ""
                found[f"{region}.{name}_max{unit}"] = float(values.max())
                found[f"{region}.{name}_max_at_um"] = place[int(values.argmax())].tolist()
                mean = Integrate(q * dx(definedon=where, bonus_intorder=4), self.mesh) / area
                found[f"{region}.{name}_mean{unit}"] = float(mean)
        line = IntegrationRule([(k / 8,) for k in range(9)], [0.0] * 9)
        rim = self.mesh.MapToAllElements({ET.SEGM: line}, self.mesh.Boundaries("outer"))
        d, _ = self.depth_and_normal(x + self.u[0], y + self.u[1])
        found["contact.max_depth_um"] = float(d(rim).max())
        return found
