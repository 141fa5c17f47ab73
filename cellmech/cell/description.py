"""A case in words: what it models and what it leaves out, with the reasons."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from cellmech.cell.actin_places import PLACES
from cellmech.cell.footing import SIZE_OVER_RADIUS
from cellmech.cell.placed import M_S2
from cellmech.cell.setup import Setup, material, mixed_layers
from cellmech.cell.shape_words import cell_words, nucleus_words
from cellmech.cell.slips import USUAL_MEDIUM, slips
from cellmech.mesh.disc import DiscSpec
from cellmech.scene.inputs import MIXED_ABOVE
from cellmech.scene.parts import LAYER_NAMES, Adhesion, Mesh
from cellmech.scene.scene import AT_REST, Scene
from cellmech.scene.substrate import MIRRORED
from cellmech.solver.ellipticity import yeoh_bounds
from cellmech.solver.simulation import Simulation

COARSE = 1.5  # mesh.size_um over the usual one from which a mesh is called coarse
NO_INERTIA = 1e-9  # of the weight: rho a below it is below the Newton tolerance
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
    warnings = {**_warnings(scene), **_mesh_warnings(setup), **(found or {})}
    return Model(modelled, left, warnings, _hints(setup), summarised(scene), slips(setup) if run is None else {})


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


def _warnings(scene: Scene) -> dict[str, str]:
    return {**_yeoh_warning(scene), **_locking_warning(scene), **_driver_warnings(scene)}


def _driver_warnings(scene: Scene) -> dict[str, str]:
    if scene.adhesion is None or scene.time.history:
        return {}
    told = "time.history is false: where a surface jumps into contact, the end depends on the way there"
    return {"adhesion": f"{told}, and only an equilibrium that the load leads to without a jump is found"}


def _yeoh_warning(scene: Scene) -> dict[str, str]:
    below, beyond = yeoh_bounds(scene.cell.beta_over_mu)
    if "yeoh" not in scene.laws() or beyond is None:
        return {}
    text = f"beta/mu = {scene.cell.beta_over_mu:g}: "
    if scene.cell.beta_over_mu > 0.5:
        text += "alpha < 0 and the energy is unbounded below; "
    text += f"ellipticity is lost in stretch, at constant area beyond J1 = {beyond:.3g}"
    if below is not None:
        text += f", and in compression of any kind below J1 = {below:.4g}"
    return {"yeoh": f"{text}; how near this state comes is computed (stability)"}


def _mesh_warnings(setup: Setup) -> dict[str, str]:
    """A mesh coarser than its order needs for 1 %, and contacts too narrow for any mesh that would be made."""
    scene, found = setup.scene, {}
    usual = SIZE_OVER_RADIUS[scene.mesh.order] * scene.radius_um
    if scene.cell.geometry != "3d" and scene.mesh.size_um > COARSE * usual:
        found["mesh"] = (
            f"mesh.size_um = {scene.mesh.size_um:g} um is {scene.mesh.size_um / usual:.3g} times the {usual:.3g} um at "
            f"which numbers of a cell of radius {scene.radius_um:g} um are within 1 %"
        )
    spec = setup.spec
    if isinstance(spec, DiscSpec) and any(spec.least_size_um(foot) <= foot.least_um for foot in spec.footprints):
        narrow = min(foot.edges[0] for foot in spec.footprints)
        found["contact mesh"] = (
            f"a contact {narrow:.2g} um in half-width is expected, and elements are not made smaller than "
            f"{spec.footprints[0].least_um:.2g} um: depth and strain beside it may be off by more than 1 %"
        )
    return found


def _locking_warning(scene: Scene) -> dict[str, str]:
    stiff = [name for name in scene.nearly_incompressible() if name not in mixed_layers(scene)]
    if not stiff:
        return {}
    why = 'mesh.pressure is "none"' if scene.mesh.order == 2 else f"mesh.order is {scene.mesh.order}"
    return {
        "locking": f"Poisson's ratio is above {MIXED_ABOVE:g} in {', '.join(stiff)}, but {why}: the largest pressures "
        "may be far off, and near 0.5 no equilibrium may be found"
    }


def _hints(setup: Setup) -> dict[str, str]:
    """Settings that do nothing to the numbers, or to those of the end state; which numbers are the least exact."""
    scene, cell, hints = setup.scene, setup.scene.cell, {}
    if cell.geometry == "3d":
        hints["maxima"] = (
            "in 3-D the largest J3 and lowest pressure of cytosol and membrane, at single points, are the least exact: "
            "off by half of themselves where the nucleus's are by 3 %, stresses and J2 by 2 %, means by 0.1 %"
        )
    symmetric = not setup.turns or setup.mirror_symmetric
    if setup.turns and symmetric and scene.cell.geometry == "plane":
        hints["shape"] = (
            'the scene is its own mirror image: cell.shape = "half"'
            + (" about x = 0" if cell.centre_x_um else "")
            + ", which mirrors its pillars, gives the same numbers with half the unknowns"
        )
    alone = scene.adhesion is None and not scene.medium.viscosity_Pa_s  # else the way there may decide
    if scene.time.history and alone and not cell.inertia and scene.rest_s > AT_REST * scene.relaxation_s:
        hints["history"] = "time.history = false finds the same end state directly, without what happens on the way"
    third, second = Mesh().size_um, Mesh(order=2).size_um
    if scene.cell.geometry != "3d" and scene.mesh.order == 2 and scene.mesh.size_um > 2 * second:
        hints["mesh"] = f"second order is as accurate at mesh.size_um = {second:g} as third order at {third:g}"
    if cell.inertia and symmetric and setup.place.touch and cell.gap_um == 0 and scene.load.half_ramp_s > 0:
        gravity_um_s2 = abs(scene.load.gravity_m_s2 * M_S2 * scene.load.factor)
        share = scene.radius_um / scene.load.half_ramp_s**2 / gravity_um_s2 if gravity_um_s2 else math.inf
        if share < NO_INERTIA:
            hints["inertia"] = f"rho a is below {share:.0e} of the weight: inertia = false gives the same numbers"
    return hints


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
