"""What a case models and what it leaves out, in words, with the reasons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cellmech.run import Run
from cellmech.scene import LAYER_NAMES, Scene
from cellmech.setup import MERGED, MIXED_ABOVE, Setup, material, mixed_layers, relaxation_s

YEOH_STABLE = 0.5  # beta/mu up to which alpha >= 0


@dataclass(frozen=True)
class Model:
    """What is in the equations and what is not, each with the reason."""

    modelled: Mapping[str, str]
    left_out: Mapping[str, str]
    warnings: Mapping[str, str]

    def lines(self) -> list[str]:
        """For people."""
        return [f"modelled: {k}: {v}" for k, v in self.modelled.items()] + [
            f"{kind}: {k}: {v}"
            for kind, part in (("left out", self.left_out), ("warning", self.warnings))
            for k, v in part.items()
        ]

    def as_dict(self) -> dict[str, dict[str, str]]:
        """For result.json."""
        return {"modelled": dict(self.modelled), "left_out": dict(self.left_out), "warnings": dict(self.warnings)}


def describe_model(setup: Setup, run: Run | None = None) -> Model:
    """Say what a case models and what it leaves out, as of now (obstacles may come into reach during a run)."""
    scene, cell = setup.scene, setup.scene.cell
    modelled: dict[str, str] = {"kinematics": "plane strain, finite strain"}
    left: dict[str, str] = {}
    for law in scene.laws():
        names = [n for n in LAYER_NAMES if scene.layer_law(n) == law]
        modelled[law] = f"solid phase of {', '.join(names)}"
    _describe_pressure(scene, modelled, left)
    wet = [n for n in LAYER_NAMES if material(scene, n).rate_dependent]
    if wet:
        modelled["fluid phase"] = f"viscous stress of {', '.join(wet)}; BDF2 in time"
    elif scene.time.history:
        left["fluid phase"] = "every fluid fraction or viscosity is 0"
    else:
        left["fluid phase"] = (
            "time.history is false: elastic equilibria, no energies of the way there; the fluid comes to rest in about "
            f"{relaxation_s(scene):.3g} s, and the load does not change in the last "
            f"{max(scene.time.end_s - scene.ramp_end_s, 0):g} s"
        )
    if cell.layers == "smeared":
        modelled["layers"] = f"smeared over ± {cell.smear_um:g} um; meshed: {', '.join(n for n, _ in setup.interfaces)}"
    else:
        modelled["layers"] = f"meshed apart: {', '.join(n for n, _ in setup.interfaces)}"
    for pair, name in MERGED.items():
        if any(n == name for n, _ in setup.interfaces) and cell.layers != "smeared":
            left[f"interface of {pair[0]} and {pair[1]}"] = "no case of the study gives them different properties"
    waiting = setup.out_of_reach if run is None else run.out_of_reach
    for label, obstacle in setup.obstacles.items():
        if obstacle in waiting:
            left[label] = "out of the cell's reach; checked at every step"
        else:
            modelled[label] = f"frictionless penalty contact, {scene.contact.form} form"
    if cell.inertia:
        modelled["inertia"] = "BDF2 on displacement and velocity"
    else:
        left["inertia"] = "not asked for; rho a is about 1e-16 of the elastic forces at these rates"
    _describe_rest(setup, modelled, left)
    return Model(modelled, left, _warnings(scene))


def _warnings(scene: Scene) -> dict[str, str]:
    found = {}
    if "yeoh" in scene.laws() and scene.cell.beta_over_mu > YEOH_STABLE:
        found["yeoh"] = (
            f"alpha < 0 at beta/mu = {scene.cell.beta_over_mu:g}: the energy is unbounded below; at beta/mu = 2.5 "
            "and nu = 0.45 ellipticity is lost at J1 above about 5.1 and, in compression, below about 1.54"
        )
    stiff = [n for n in LAYER_NAMES if scene.layer_poisson(n) > MIXED_ABOVE and n not in mixed_layers(scene)]
    if stiff:
        why = 'mesh.pressure is "none"' if scene.mesh.order == 2 else "mesh.order is 1"
        found["locking"] = (
            f"Poisson's ratio is above {MIXED_ABOVE:g} in {', '.join(stiff)}, but {why}: the largest pressures are off "
            "by more than 1 %, and near 0.5 no equilibrium is found"
        )
    return found


def _describe_pressure(scene: Scene, modelled: dict[str, str], left: dict[str, str]) -> None:
    mixed = mixed_layers(scene)
    if mixed:
        why = "asked for" if scene.mesh.pressure == "mixed" else f"Poisson's ratio above {MIXED_ABOVE:g}"
        names = ", ".join(n for n in LAYER_NAMES if n in mixed)
        modelled["pressure"] = f"an unknown of its own in {names}, linear in each element ({why}); P2 with a bubble"
    elif all(scene.layer_poisson(n) <= MIXED_ABOVE for n in LAYER_NAMES):
        left["pressure as an unknown"] = f"no layer's Poisson's ratio is above {MIXED_ABOVE:g}: P2 alone does not lock"
    else:
        left["pressure as an unknown"] = "not asked for; see the warning"


def _describe_rest(setup: Setup, modelled: dict[str, str], left: dict[str, str]) -> None:
    scene = setup.scene
    if setup.weight:
        modelled["gravity"] = f"{setup.force_density:.6g} Pa/um per reference volume at full load"
    else:
        left["gravity"] = "the load is zero"
    if setup.lift_um:
        modelled["first touch"] = f"moved down by {setup.lift_um:g} um: without inertia the fall needs no solving"
    if setup.half:
        modelled["symmetry"] = "half cell, u_x = 0 on the axis"
    elif not scene.cell.inertia:
        sideways = " and mean u_x" if setup.free_sideways else ""
        modelled["rigid modes"] = f"mean rotation{sideways} set to 0: nothing resists them"
    if setup.body.rate_dependent:
        modelled["time"] = f"variable-step BDF2, rtol {scene.time.rtol:g}"
    else:
        left["time stepping"] = "nothing depends on rate: load steps, no stored history"
