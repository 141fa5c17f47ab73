"""What is doubtful about a case, and what it could do without: warnings and hints, each with the reason."""

from __future__ import annotations

import math

from cellmech.cell.footing import SIZE_OVER_RADIUS
from cellmech.cell.placed import M_S2
from cellmech.cell.setup import Setup, mixed_layers
from cellmech.mesh.disc import DiscSpec
from cellmech.scene.inputs import MIXED_ABOVE
from cellmech.scene.parts import Mesh
from cellmech.scene.scene import AT_REST, Scene
from cellmech.solver.ellipticity import yeoh_bounds

COARSE = 1.5  # mesh.size_um over the usual one from which a mesh is called coarse
NO_INERTIA = 1e-9  # of the weight: rho a below it is below the Newton tolerance


def warnings_of(setup: Setup) -> dict[str, str]:
    """What makes numbers of a case doubtful that can be told before it is solved."""
    scene = setup.scene
    return {**_yeoh_warning(scene), **_locking_warning(scene), **_driver_warnings(scene), **_mesh_warnings(setup)}


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


def hints_of(setup: Setup) -> dict[str, str]:
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
