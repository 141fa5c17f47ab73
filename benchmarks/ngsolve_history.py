"""The whole history of Table 1 in NGSolve, as its user would write it: what speed is measured by beside `plain.py`.

BDF2 with fixed 200 s steps, P2, compiled forms, full Newton with UMFPACK at every iteration; graded by hand like the
cell of `ngsolve_cell.py`.

    python benchmarks/ngsolve_history.py SIZE_UM

SIZE_UM: of the elements near the contact and in and along the lamina; four times that elsewhere.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

from ngsolve import BilinearForm, Det, Grad, GridFunction, Id, InnerProduct, Inv, Trace, dx
from ngsolve_cell import INSIDE_OUT, REST, Elastic, Level

from cellmech.scene.scene import Scene

DT_S, FIRST_DEPTH_UM, TOLERANCE = 200.0, 1e-3, 1e-8


def right_cauchy_green(u: Any) -> Any:
    """C of a displacement field, in plane."""
    F = Id(2) + Grad(u)
    return F.trans * F


class Settling(Elastic):
    """The visco-elastic half cell; `before` and `earlier` are the displacements of the last two steps."""

    def __init__(self, scene: dict[str, Any], level: Level) -> None:
        super().__init__(scene, level)
        self.before, self.earlier = GridFunction(self.space), GridFunction(self.space)
        layers = scene["layer"]
        self.fluid = self.mesh.MaterialCF({name: layers[name]["fluid_fraction"] for name in INSIDE_OUT})

    def residual(self) -> BilinearForm:
        """Equilibrium with the fluid's stress at the end of a step."""
        form, cell = super().residual(), self.scene["cell"]
        u, v = self.space.TnT()
        F = Id(2) + Grad(u)
        C = F.trans * F
        C_dot = (1.5 * C - 2 * right_cauchy_green(self.before) + 0.5 * right_cauchy_green(self.earlier)) / DT_S
        C_inv, J = Inv(C), Det(F)
        S = cell["fluid_lambda_Pa_s"] / 2 * Trace(C_inv * C_dot) * C_inv + cell["fluid_mu_Pa_s"] * C_inv * C_dot * C_inv
        form += (self.fluid * J * InnerProduct(F * S, Grad(v))).Compile() * dx(bonus_intorder=2)
        return form

    def march(self) -> int:
        """All steps; returns the Newton iterations."""
        form, iterations = self.residual(), 0
        self.u.vec.FV().NumPy()[:] = 0.0
        self.u.Set((0.0, -FIRST_DEPTH_UM))  # the contact does not resist before it touches
        for k in range(1, round(self.scene["time"]["end_s"] / DT_S) + 1):
            s = min(k * DT_S / (2 * self.scene["load"]["half_ramp_s"]), 1.0)
            self.load.Set(s**3 * (10 - 15 * s + 6 * s**2))
            iterations += len(self.newton(form, TOLERANCE)) - 1
            self.earlier.vec.data = self.before.vec
            self.before.vec.data = self.u.vec
        return iterations


def nucleus(scene: dict[str, Any], found: dict[str, Any]) -> dict[str, float]:
    """Largest and mean values of nucleoplasm and lamina together."""
    radius = {name: scene["layer"][name]["outer_radius_um"] for name in INSIDE_OUT[:2]}
    share = (radius["nucleoplasm"] / radius["lamina"]) ** 2
    both = {}
    for name in REST:
        unit = "_Pa" if name == "sigma_mises" else ""
        both[f"{name}_max{unit}"] = max(found[f"{layer}.{name}_max{unit}"] for layer in radius)
        inner, outer = (found[f"{layer}.{name}_mean{unit}"] for layer in ("nucleoplasm", "lamina"))
        both[f"{name}_mean{unit}"] = share * inner + (1 - share) * outer
    return both


def main(size_um: float) -> dict[str, Any]:
    """Solve and report in the shape of a result.json."""
    scene = Scene().model_dump(mode="json", by_alias=True)
    started = time.perf_counter()
    cell = Settling(scene, Level(far=4 * size_um, near=size_um, lamina=size_um, order=2))
    iterations = cell.march()
    result = {"status": "solved", "wall_s": time.perf_counter() - started, "dofs": cell.space.ndof}
    steps = round(scene["time"]["end_s"] / DT_S)
    return result | {
        "steps": steps,
        "newton_iterations": iterations,
        "factorisations": iterations,
        "nucleus": nucleus(scene, cell.report()),
    }


if __name__ == "__main__":
    print(json.dumps(main(float(sys.argv[1]))))
