"""The settled neo-Hookean ball in NGSolve, turned about its axis or in space: nothing of cellmech in it.

Both have the 3 x 3 deformation gradient and share stress, energy and report; what differs is mesh, measure and contact.
The turned ball is `ngsolve_cell`'s half disc. The ball in space is a quarter made by hand, for Netgen's tetrahedra do
not fit into a lamina that is fifty times as wide as thick: triangles on a sphere, prisms from each outwards through all
layers, tetrahedra from each down to the centre. It is graded by latitude, and knows nothing of symmetry about the axis.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
from ngsolve import (
    ET,
    L2,
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
    Norm,
    OuterProduct,
    Trace,
    VectorH1,
    ds,
    dx,
    log,
    specialcf,
    sqrt,
    x,
    y,
    z,
)
from ngsolve_cell import INSIDE_OUT, Elastic, energy_slopes
from ngsolve_quarter import ON_AXIS, displacements, interpolated, quarter_ball

REGIONS = {**{name: (name,) for name in INSIDE_OUT}, "nucleus": INSIDE_OUT[:2], "cell": INSIDE_OUT}
REST = {"J1": 3.0, "J2": 3.0, "J3": 1.0}


class Ball(Elastic):
    """What both balls have in common."""

    def __init__(self, scene: dict[str, Any], level: Any) -> None:
        if scene["cell"]["law"] != "neo-hookean":
            raise ValueError("only the neo-Hookean ball's energy is coded here")
        super().__init__(scene, level)

    # What the geometries state

    def gradient(self, u: Any) -> Any:
        """Displacement gradient in space, 3 x 3."""
        raise NotImplementedError

    @property
    def measure(self) -> Any:
        """Volume of the whole ball per volume or area of the mesh."""
        raise NotImplementedError

    def stretch_of_surface(self, u: Any) -> Any:
        """Deformed over undeformed area of the surface, by its tangents."""
        raise NotImplementedError

    # Equations

    def second_piola(self, F: Any) -> Any:
        """c_s times the solid's S [Pa], 3 x 3, by hand."""
        C = F.trans * F
        W1, W2, W3 = energy_slopes("neo-hookean", self.lmbda, self.mu, 0.0, Trace(C), Det(F))
        return 2 * self.solid * ((W1 + Trace(C) * W2) * Id(3) - W2 * C + W3 * Inv(C))

    def residual(self) -> BilinearForm:
        """Equilibrium of the whole ball as a nonlinear form."""
        u, v = self.space.TnT()
        F, weight = Id(3) + self.gradient(u), self.measure
        form = BilinearForm(self.space)
        bulk = InnerProduct(F * self.second_piola(F), self.gradient(v)) + self.load * self.weight_density * v[1]
        form += (weight * bulk).Compile() * dx(bonus_intorder=2)
        d, n = self.depth_and_normal(*self.moved(u.Trace()))
        push = self.pressure(d) * self.stretch_of_surface(u) * InnerProduct(n, v.Trace())
        form += (-weight * push).Compile() * ds("outer", bonus_intorder=10)
        return form

    def weight(self) -> float:
        """Of the whole ball [pN]."""
        return self.weight_density * float(Integrate(self.measure * dx, self.mesh))

    def pressure(self, d: Any) -> Any:
        """Of the contact [Pa], at a depth [µm]."""
        kappa, s = self.scene["contact"]["penalty_Pa_per_um"], self.scene["contact"]["smoothing_um"]
        return IfPos(d, IfPos(d - s, kappa * (d - s / 2), kappa * d * d / (2 * s)), 0.0)

    def moved(self, u: Any) -> tuple[Any, ...]:
        """Deformed place."""
        return tuple(place + u[k] for k, place in enumerate((x, y, z)[: self.mesh.dim]))

    # Report

    def quantities(self) -> dict[str, Any]:
        """σ_Mises and pressure [Pa], J1, J2, J3 and det F as functions of place."""
        F = Id(3) + self.gradient(self.u)
        C, J = F.trans * F, Det(F)
        sigma = F * self.second_piola(F) * F.trans / J
        dev = sigma - Trace(sigma) / 3 * Id(3)
        mises = sqrt(1.5 * InnerProduct(dev, dev))
        strains = {"J1": Trace(C), "J2": InnerProduct(C, C), "J3": Det(C)}
        return {"sigma_mises": mises, **strains, "pressure": -Trace(sigma) / 3, "det_F": J}

    def stored(self) -> float:
        """Energy of the solid in the whole ball [aJ]."""
        F = Id(3) + self.gradient(self.u)
        ln_J = log(Det(F))
        W = self.mu / 2 * (Trace(F.trans * F) - 3 - 2 * ln_J) + self.lmbda / 2 * ln_J**2
        return float(Integrate(self.measure * self.solid * W * dx(bonus_intorder=4), self.mesh))

    def rules(self) -> tuple[dict[Any, IntegrationRule], dict[Any, IntegrationRule]]:
        """Points of each kind of element: evenly spaced ones, from corner to corner, and Gauss's."""
        n = self.level.order
        line = [k / n for k in range(n + 1)]
        triangle = [(a, b) for a in line for b in line if a + b < 1 + 1e-9]
        even = {
            ET.TRIG: triangle,
            ET.TET: [(a, b, c) for a, b in triangle for c in line if a + b + c < 1 + 1e-9],
            ET.PRISM: [(a, b, c) for a, b in triangle for c in line],
        }
        kinds = {el.type for el in self.mesh.Elements()}
        flat = {kind: IntegrationRule(even[kind], [0.0] * len(even[kind])) for kind in kinds}
        return flat, {kind: IntegrationRule(kind, 2 * n + 2) for kind in kinds}

    def report(self) -> dict[str, Any]:
        """Numbers named as in cellmech's result.json."""
        found: dict[str, Any] = {}
        quantities = self.quantities()
        together = CoefficientFunction(tuple(quantities.values()))
        size = self.measure * Norm(Det(specialcf.JacobianMatrix(self.mesh.dim)))
        steepness = self.steepness()
        even, gauss = self.rules()
        for region, layers in REGIONS.items():
            where = self.mesh.Materials("|".join(layers))
            points = self.mesh.MapToAllElements(even, where)
            peaks, place = together(points), CoefficientFunction((x, y, z)[: self.mesh.dim])(points)
            points = self.mesh.MapToAllElements(gauss, where)
            inside, sizes = together(points), self.weights(gauss, where) * size(points).ravel()
            volume = sizes.sum()
            found[f"{region}.volume_um3"] = float(volume)
            for k, name in enumerate(quantities):
                if name == "det_F":
                    found[f"{region}.det_F_min"] = float(min(peaks[:, k].min(), inside[:, k].min()))
                    continue
                unit = "_Pa" if name in ("sigma_mises", "pressure") else ""
                found[f"{region}.{name}_max{unit}"] = float(peaks[:, k].max())
                found[f"{region}.{name}_max_at_um"] = place[int(peaks[:, k].argmax())].tolist()
                found[f"{region}.{name}_mean{unit}"] = float(sizes @ inside[:, k] / volume)
                if name == "pressure":
                    found[f"{region}.pressure_min_Pa"] = float(peaks[:, k].min())
            downwards = np.argsort(-inside[:, 0])
            above = np.searchsorted(np.cumsum(sizes[downwards]), 0.01 * volume, side="right")
            found[f"{region}.sigma_mises_p99_Pa"] = float(inside[downwards[above], 0])
            found[f"{region}.pressure_gradient_max_Pa_per_um"] = max(steepness[layer] for layer in layers)
        found["energy.stored"] = self.stored()
        return found | self.shares(found) | self.contact() | self.nucleus()

    def shares(self, found: dict[str, Any]) -> dict[str, float]:
        """The nucleus's part in the ball's J1, J2, J3: of the volume in percent, of the largest, of the integral."""
        shares = {}
        part = found["nucleus.volume_um3"] / found["cell.volume_um3"]
        for name, rest in REST.items():
            nucleus, cell = (found[f"{region}.{name}_mean"] for region in ("nucleus", "cell"))
            peaks = [found[f"{region}.{name}_max"] - rest for region in ("nucleus", "cell")]
            shares[f"share_of_volume_percent.{name}"] = 100 * part * nucleus
            shares[f"share_of_max.{name}"] = peaks[0] / peaks[1]
            shares[f"share_of_integral.{name}"] = part * (nucleus - rest) / (cell - rest)
        return shares

    def weights(self, rules: dict[Any, IntegrationRule], where: Any) -> np.ndarray:
        """Gauss weights of all points of a region, in the order of MapToAllElements."""
        mask = where.Mask()
        kinds = [el.type for el in self.mesh.Elements() if mask[el.index]]
        each = {kind: np.array(rule.weights) for kind, rule in rules.items()}
        return np.concatenate([each[kind] for kind in kinds])

    def steepness(self) -> dict[str, float]:
        """Largest gradient of the pressure in each layer [Pa/µm], in the deformed ball, from a fit in each element."""
        fit = GridFunction(L2(self.mesh, order=self.level.order - 1))
        fit.Set(self.quantities()["pressure"])
        F = Id(3) + self.gradient(self.u)
        slope = Grad(fit) if self.mesh.dim == 3 else CoefficientFunction((Grad(fit)[0], Grad(fit)[1], 0.0))
        size = Norm(Inv(F).trans * slope)
        even, _ = self.rules()
        return {
            name: float(size(self.mesh.MapToAllElements(even, self.mesh.Materials(name))).max())
            for name in REGIONS
            if name in INSIDE_OUT
        }

    def contact(self) -> dict[str, float]:
        """Force, weight [pN], depth, largest pressure and half-width."""
        place = self.moved(self.u)
        d, n = self.depth_and_normal(*place)
        rim = ds("outer", bonus_intorder=20)
        p, stretch = self.pressure(d), self.measure * self.stretch_of_surface(self.u)
        deepest = float(self.on_rim(d).max())
        return {
            "contact.force_pN": float(Integrate(p * n[1] * stretch * rim, self.mesh)),
            "contact.weight_pN": self.weight(),
            "contact.max_depth_um": deepest,
            "contact.max_pressure_Pa": float(self.scene["contact"]["penalty_Pa_per_um"])
            * (deepest - self.scene["contact"]["smoothing_um"] / 2),
            "contact.half_width_um": self.half_width(),
        }

    def half_width(self) -> float:
        """Radius of the contact, where the depth falls to 0 [µm]."""
        raise NotImplementedError

    def on_rim(self, quantity: Any, name: str = "outer") -> np.ndarray:
        """Values at many points of a surface."""
        raise NotImplementedError

    def nucleus(self) -> dict[str, float]:
        """Its shape, by its outline: lengths, the section z = 0, the solid, the view from above."""
        place = self.moved(self.u)
        X, Y, *Z = (self.on_rim(CoefficientFunction(one), "lamina outline") for one in place)
        low, high, across = Y.min(), Y.max(), X.max()
        in_section = self.on_rim(z, "lamina outline") < ON_AXIS if Z else np.full(len(X), True)
        length, area = half_section(X[in_section], Y[in_section])
        where, J = dx(definedon=self.mesh.Materials("nucleoplasm|lamina"), bonus_intorder=6), self.quantities()["det_F"]
        volume = float(Integrate(self.measure * J * where, self.mesh))
        outline = ds("lamina outline", bonus_intorder=8)
        surface = float(Integrate(self.measure * self.stretch_of_surface(self.u) * outline, self.mesh))
        below = Y < (low + high) / 2
        bottom = float(Y[below][np.argmin(np.linalg.norm([X, *Z], axis=0)[below])])
        shape = {
            "lowest_um": low,
            "highest_um": high,
            "height_um": high - low,
            "width_um": 2 * across,
            "aspect": (high - low) / (2 * across),
            "indentation_um": self.top - low,
            "perimeter_um": 2 * length,
            "area_um2": 2 * area,
            "volume_um3": volume,
            "surface_um2": surface,
            "sphericity": np.cbrt(pi) * np.cbrt(6 * volume) ** 2 / surface,
            "projection_area_um2": pi * across**2,
            "centroid_um": float(Integrate(self.measure * J * place[1] * where, self.mesh)) / volume,
        }
        found = {f"nucleus_shape.{name}": float(value) for name, value in shape.items()}
        found["shape_index.full"] = 2 * pi * area / length**2
        found["shape_index.half_outline"] = 4 * pi * area / (length + high - low) ** 2
        found["shape_index.half_area_full_perimeter"] = pi * area / length**2
        return found | {"lamina_pillar_distance_um": bottom - self.top}


def half_section(X: np.ndarray, Y: np.ndarray) -> tuple[float, float]:
    """Length and area of the right half of an outline [µm, µm²], of many points on it in any order."""
    order = np.argsort(np.arctan2(X, Y - (Y.min() + Y.max()) / 2))
    X, Y = X[order], Y[order]
    return float(np.hypot(np.diff(X), np.diff(Y)).sum()), float(-((X[1:] + X[:-1]) / 2 * np.diff(Y)).sum())


class Turned(Ball):
    """The half disc turned about x = 0: F33 = 1 + u_r/r, all integrals with 2 pi r."""

    def gradient(self, u: Any) -> Any:
        """See `Ball`; u_r/r at the axis is du_r/dr."""
        g = Grad(u)
        around = inverse_radius() * u[0] + IfPos(x - ON_AXIS, 0.0, 1.0) * g[0, 0]
        return CoefficientFunction((g[0, 0], g[0, 1], 0.0, g[1, 0], g[1, 1], 0.0, 0.0, 0.0, around), dims=(3, 3))

    @property
    def measure(self) -> Any:
        """See `Ball`."""
        return 2 * pi * x

    def stretch_of_surface(self, u: Any) -> Any:
        """See `Ball`: along the outline, times around the axis."""
        along = specialcf.tangential(2)
        return Norm(along + Grad(u).Trace() * along) * (1 + inverse_radius() * u.Trace()[0])

    def half_width(self) -> float:
        """See `Ball`: on the line between the outermost point inside and the next."""
        place = self.moved(self.u)
        depth, across = self.on_rim(self.depth_and_normal(*place)[0]), self.on_rim(CoefficientFunction(place[0]))
        order = np.argsort(across)
        depth, across = depth[order], across[order]
        last = np.flatnonzero((depth > 0) & (across < self.radii["membrane"] / 2))[-1]
        (a, b), (p, q) = across[last : last + 2], depth[last : last + 2]
        return float(a + (b - a) * p / (p - q))

    def on_rim(self, quantity: Any, name: str = "outer") -> np.ndarray:
        """See `Ball`."""
        line = IntegrationRule([(k / 40,) for k in range(41)], [0.0] * 41)
        rim = self.mesh.MapToAllElements({ET.SEGM: line}, self.mesh.Boundaries(name))
        return quantity(rim).ravel()


def inverse_radius() -> Any:
    """1/r [1/µm], and 0 on the axis."""
    off = x - ON_AXIS
    return IfPos(off, 1 / IfPos(off, x, 1.0), 0.0)


class InSpace(Ball):
    """A quarter of the ball in space: no motion across x = 0 and z = 0."""

    def discretised(self, centre_y: float) -> tuple[Mesh, VectorH1]:
        """See `Elastic`."""
        mesh, self.curving = quarter_ball(self.radii, centre_y, self.level)
        return mesh, displacements(mesh, self.level.order)

    def solve(self, start_depth: float = 1.0, tolerance: float = 1e-11) -> list[float]:
        """As `Elastic`, but first with second-order displacements on the same mesh, from where few steps are left."""
        space = self.space
        self.space = displacements(self.mesh, 2)
        self.u = GridFunction(self.space)
        norms = super().solve(start_depth, 1e-3)
        self.space, self.u = space, interpolated(space, self.u)
        return norms + self.newton(self.residual(), tolerance)

    def gradient(self, u: Any) -> Any:
        """See `Ball`."""
        return Grad(u)

    @property
    def measure(self) -> Any:
        """See `Ball`."""
        return CoefficientFunction(4.0)

    def depth_and_normal(self, X: Any, Y: Any, Z: Any) -> tuple[Any, Any]:
        """l/|grad l| [µm] and the outward normal of a round pillar."""
        p = self.pillar
        w, h, e = p["half_width_um"], p["height_um"], p["exponent"]
        a, b, around = X - p["x_um"], (Y - p["y_um"]) / h, Z - p["z_um"]
        outwards = (a * a + around * around) / w**2
        fall = -e * outwards ** (e / 2 - 1) / w**2
        gradient = CoefficientFunction((fall * a, -e * b ** (e - 1) / h, fall * around))
        size = sqrt(InnerProduct(gradient, gradient))
        return (1 - outwards ** (e / 2) - b**e) / size, -gradient / size

    def stretch_of_surface(self, u: Any) -> Any:
        """See `Ball`: the product of two tangents, moved."""
        normal = specialcf.normal(3)
        across = OuterProduct(normal, normal)
        tangents = Id(3) + Grad(u).Trace() - across
        return sqrt(Det(tangents.trans * tangents + across))

    def half_width(self) -> float:
        """See `Ball`: of the disc that has the contact's area."""
        n = 40
        middles = [((i + a) / n, (j + a) / n) for i in range(n) for j in range(n - i) for a in (1 / 3,)]
        middles += [((i + 2 / 3) / n, (j + 2 / 3) / n) for i in range(n - 1) for j in range(n - 1 - i)]
        points = self.mesh.MapToAllElements(
            {ET.TRIG: IntegrationRule(middles, [0.0] * len(middles))}, self.mesh.Boundaries("outer")
        )
        jacobian = specialcf.JacobianMatrix(3, 2)
        area = self.measure * self.stretch_of_surface(self.u) * sqrt(Det(jacobian.trans * jacobian)) / (2 * n * n)
        d, _ = self.depth_and_normal(*self.moved(self.u))
        return float(np.sqrt(area(points).ravel()[d(points).ravel() > 0].sum() / pi))

    def on_rim(self, quantity: Any, name: str = "outer") -> np.ndarray:
        """See `Ball`."""
        n = 16
        lattice = [(i / n, j / n) for i in range(n + 1) for j in range(n + 1 - i)]
        rim = self.mesh.MapToAllElements(
            {ET.TRIG: IntegrationRule(lattice, [0.0] * len(lattice))}, self.mesh.Boundaries(name)
        )
        return quantity(rim).ravel()
