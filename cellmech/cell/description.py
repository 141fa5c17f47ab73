"""A case in words: what it models and what it leaves out, with the reasons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cellmech.cell.actin_places import PLACES
from cellmech.cell.advice import hints_of, warnings_of
from cellmech.cell.setup import Setup, material, mixed_layers
from cellmech.cell.shape_words import cell_words, nucleus_words
from cellmech.cell.slips import USUAL_MEDIUM, slips
from cellmech.scene.driver_parts import Adhesion
from cellmech.scene.inputs import MIXED_ABOVE
from cellmech.scene.parts import LAYER_NAMES
from cellmech.scene.scene import Scene
from cellmech.scene.substrate import MIRRORED
from cellmech.solver.simulation import Simulation

WORDS = {
    "plane": "a cylinder on endless ridges (plane strain)",
    "axisymmetric": "a ball on what is round about its axis",
    "3d": "a ball in space",
}


@dataclass(frozen=True)
class Model:
    """Parts of the equations and parts left out, each with the reason; hints say what could be left out too.

    The summary is one line of it, and slips are what the scene's author may not have meant: neither goes to results.
    """

    modelled: Mapping[str, str]
    left_out: Mapping[str, str]
    warnings: Mapping[str, str]
    hints: Mapping[str, str]
    summary: str = ""
    slips: Mapping[str, str] = field(default_factory=dict)

    def lines(self) -> list[str]:
        """For people."""
        warnings = {**self.warnings, **self.slips}
        kinds = ("modelled", self.modelled), ("left out", self.left_out), ("warning", warnings), ("hint", self.hints)
        return [f"in short: {self.summary}"] * bool(self.summary) + [
            f"{kind}: {k}: {v}" for kind, part in kinds for k, v in part.items()
        ]

    def as_dict(self) -> dict[str, dict[str, str]]:
        """For result.json."""
        parts = {"modelled": self.modelled, "left_out": self.left_out, "warnings": self.warnings, "hints": self.hints}
        return {name: dict(part) for name, part in parts.items()}


def describe_model(setup: Setup, run: Simulation | None = None, found: Mapping[str, str] | None = None) -> Model:
    """Say what a case models and what it leaves out, as of now (obstacles may come into reach during a run).

    Args:
        setup: the case.
        run: its run, once there is one.
        found: warnings that its states have led to.
    """
    scene, cell = setup.scene, setup.scene.cell
    modelled: dict[str, str] = {"kinematics": setup.kinematics.words}
    left: dict[str, str] = {}
    own = setup.additions.materials
    for law in scene.laws():
        names = [n for n in LAYER_NAMES if scene.layer_law(n) == law and n not in own]
        if names:
            modelled[law] = f"solid phase of {', '.join(names)}"
    for law_of_own in dict.fromkeys(one.law for one in own.values()):
        names = [n for n in LAYER_NAMES if n in own and own[n].law is law_of_own]
        modelled[f"{law_of_own.__name__} (not the scene's)"] = f"material of {', '.join(names)}"
    modelled["displacement"] = _elements(scene)
    _describe_pressure(setup, modelled, left)
    wet = [n for n in LAYER_NAMES if (own.get(n) or material(scene, n)).rate_dependent]
    if wet:
        modelled["fluid phase"] = f"viscous stress of {', '.join(wet)}; BDF2 in time"
    elif scene.time.history:
        left["fluid phase"] = "every fluid fraction or viscosity is 0"
    else:
        left["fluid phase"] = (
            "time.history is false: elastic equilibria, no energies of the way there; the fluid comes to rest in about "
            f"{scene.relaxation_s:.3g} s, and the load does not change in the last "
            f"{max(scene.time.end_s - scene.ramp_end_s, 0):g} s"
        )
    if cell.layers == "smeared":
        modelled["layers"] = f"smeared over ± {cell.smear_um:g} um; meshed: {', '.join(n for n, _ in setup.interfaces)}"
    else:
        modelled["layers"] = f"meshed apart: {', '.join(n for n, _ in setup.interfaces)}"
    shapes = {"cell": cell_words(scene), "nucleus": nucleus_words(scene)}
    modelled |= {body: words for body, words in shapes.items() if words is not None}
    waiting = setup.out_of_reach if run is None else run.out_of_reach
    for label, obstacle in setup.obstacles.items():
        if obstacle in waiting and setup.obstacles[label.partition(MIRRORED)[0]] not in (obstacle, *waiting):
            modelled[label] = "meets the mirrored half, as its own pillar this one; checked at every step"
        elif obstacle in waiting:
            left[label] = "out of the cell's reach; checked at every step"
        else:
            modelled[label] = f"frictionless penalty contact, {scene.contact.form} form"
    if cell.inertia:
        modelled["inertia"] = "BDF2 on displacement and velocity"
    else:
        left["inertia"] = "not asked for; rho a is about 1e-16 of the elastic forces at these rates"
    _describe_rest(setup, modelled, left)
    warnings = {**warnings_of(setup), **(found or {})}
    return Model(modelled, left, warnings, hints_of(setup), summarised(scene), slips(setup) if run is None else {})


def summarised(scene: Scene) -> str:
    """Geometry, what drives the cell, and what is left out, in one line."""
    medium = scene.cell.medium_density_kg_m3
    buoyancy = f"in medium of {medium:g} kg/m3" if medium else "without buoyancy"
    weight = f"{'its weight' if scene.load.factor >= 0 else 'a lift'} {buoyancy}"
    names = dict.fromkeys("adhesion" if isinstance(one, Adhesion) else "actin" for _, one in scene.drivers)
    drivers = [weight] * scene.has_weight + list(names)
    left = [name for name in ("adhesion", "actin") if name not in names]
    left += ["friction", *["inertia"] * (not scene.cell.inertia), *["the way to the end"] * (not scene.time.history)]
    return f"{WORDS[scene.cell.geometry]}, driven by {' and '.join(drivers) or 'nothing'}; without {', '.join(left)}"


def _elements(scene: Scene) -> str:
    """The displacement's order on the elements, and why it is not the third."""
    order = scene.mesh.order
    shapes = "tetrahedra with curved faces" if scene.cell.geometry == "3d" else "triangles with curved sides"
    if order == 3:
        return f"third order on {shapes}"
    if order == 1:
        return f"first order on {shapes.split()[0]}"
    mixed, fluid = mixed_layers(scene), scene.without_solid()
    why = "a pressure of its own takes it" if mixed else f"{', '.join(fluid)} without solid" if fluid else "asked for"
    return f"second order on {shapes} ({why})"


def _describe_pressure(setup: Setup, modelled: dict[str, str], left: dict[str, str]) -> None:
    scene, own = setup.scene, setup.additions.materials
    mixed = [n for n in LAYER_NAMES if (own[n].mixed if n in own else n in mixed_layers(scene))]
    if mixed:
        why = "asked for" if scene.mesh.pressure == "mixed" else f"Poisson's ratio above {MIXED_ABOVE:g}"
        names = ", ".join(mixed)
        modelled["pressure"] = f"an unknown of its own in {names}, linear in each element ({why}); P2 with a bubble"
    elif set(scene.nearly_incompressible()) <= own.keys():
        why = f"no layer's Poisson's ratio is above {MIXED_ABOVE:g}: a displacement alone does not lock"
        unknown = "; of materials that are not the scene's nothing is known" if own else ""
        left["pressure as an unknown"] = why + unknown
    else:
        left["pressure as an unknown"] = "not asked for; see the warning"


def _describe_drivers(setup: Setup, modelled: dict[str, str], left: dict[str, str]) -> None:
    """Adhesion, actin and drag; nothing of what a scene does not have."""
    scene = setup.scene
    for name, one in scene.drivers:
        if isinstance(one, Adhesion):
            above = "" if one.above_um is None else f", above y = {one.above_um:g} um"
            told = f"{one.work_uJ_m2:g} uJ/m2 per reference area within {one.range_um:g} um of "
            told += f"{' and '.join(one.on)}{above}"
        else:
            told = f"{one.told}, {one.direction or PLACES[one.where][1]}, {one.where}"
        modelled[name.replace("_", " ")] = f"{told}, whole at {one.start_s + 2 * one.half_ramp_s:g} s"
    if scene.drivers:
        boundary = "surface" if scene.cell.geometry == "3d" else "outline"
        left["contact of the cell with itself"] = f"a run stops where the {boundary} crosses itself"
    if setup.body.drag is not None:
        modelled["drag"] = f"of the medium on the outline, {scene.medium.viscosity_Pa_s:g} Pa s"
    elif scene.medium.viscosity_Pa_s:
        left["drag"] = "time.history is false"


def _describe_rest(setup: Setup, modelled: dict[str, str], left: dict[str, str]) -> None:
    scene = setup.scene
    if setup.weight:
        whole, left_over = scene.cell.density_kg_m3, scene.cell.density_kg_m3 - USUAL_MEDIUM
        buoyancy = ""
        if not scene.cell.medium_density_kg_m3 and left_over > 0:
            part = f"{100 * left_over / whole:.2g} % of it would be left in {USUAL_MEDIUM:g} kg/m3"
            buoyancy = f", without buoyancy (cell.medium_density_kg_m3 is 0; {part})"
        lifts = ", upwards: it lifts the cell" if setup.weight < 0 else ""
        size = abs(setup.force_density)
        modelled["gravity"] = f"{size:.6g} Pa/um per reference volume at full load{lifts}{buoyancy}"
    else:
        left["gravity"] = "the load is zero"
    _describe_drivers(setup, modelled, left)
    if setup.lift_um:
        modelled["first touch"] = f"moved down by {setup.lift_um:g} um: without inertia the fall needs no solving"
    if any(setup.place.slide_um):
        ways = [f"{way:.6g} um along {axis}" for way, axis in zip(setup.place.slide_um, "xz", strict=False)]
        told = "there the cell, which touched on a slope, rests on all sides"
        modelled["place"] = f"moved by {' and '.join(ways)}: {told}"
    space = scene.cell.geometry == "3d"
    if scene.mirrors:
        planes = " and ".join(f"u_{axis} = 0 on {axis} = 0" for axis in scene.mirrors)
        modelled["symmetry"] = f"{scene.cell.shape} cell, {planes if space else 'u_x = 0 on the axis'}"
    if setup.turns and not scene.cell.inertia:
        turning, sideways = ("rotations", "horizontal displacements") if space else ("rotation", "u_x")
        held = f"mean {turning}" + (f" and mean {sideways}" if setup.free_sideways else "")
        why = "nothing resists them"
        if scene.lopsided:
            why += (
                "; with its nucleus aside the cell would roll, which its grip on the obstacles, not modelled, prevents"
            )
        modelled["rigid modes"] = f"{held} set to 0: {why}"
    if setup.body.rate_dependent:
        modelled["time"] = f"variable-step BDF2, rtol {scene.time.rtol:g}"
    else:
        left["time stepping"] = "nothing depends on rate: load steps, no stored history"
