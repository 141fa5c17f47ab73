"""From a scene to what Gmsh is asked for: a disc, or a ball."""

from __future__ import annotations

from cellmech.cell.footing import follow, modulus_of
from cellmech.cell.layering import MeshPlan
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.kinematics import GEOMETRIES
from cellmech.mesh.ball import BallSpec
from cellmech.mesh.disc import DiscSpec
from cellmech.mesh.sizes import Zone
from cellmech.scene.placement import Touch
from cellmech.scene.scene import Scene

ZONE_OVER_HERTZ = 1.32  # on Table 1 the contact edge lies at 0.9 of Hertz's half-width, the membrane's peaks beyond it


def mesh_spec(
    scene: Scene, plan: MeshPlan, centre: tuple[float, ...], touch: tuple[Touch, ...], weight: float, contact: Contact
) -> DiscSpec | BallSpec:
    """The body to mesh, its elements small where contacts are expected.

    Args:
        scene: what is to be meshed.
        plan: which layers are meshed apart.
        centre: of the cell at the start [µm].
        touch: where it first touches.
        weight: of the whole cell [Pa µm or pN].
        contact: how obstacles push.
    """
    zone = contact_zone_um(scene, weight)
    if scene.cell.geometry == "3d":
        return BallSpec(
            shape=scene.cell.shape,
            centre=(centre[0], centre[1], centre[2]),
            interfaces=plan.interfaces(scene),
            nucleus_radius_um=scene.nucleus_radius_um,
            size_um=scene.mesh.size_um,
            order=min(scene.mesh.order, 2),
            thin_layers=scene.mesh.thin_layers,
            zones=tuple(Zone(t.at, scene.mesh.contact_size_um, zone) for t in touch),
        )
    disc = DiscSpec(
        shape=scene.cell.shape,
        centre=(centre[0], centre[1]),
        interfaces=plan.interfaces(scene),
        nucleus_radius_um=scene.nucleus_radius_um,
        size_um=scene.mesh.size_um,
        contact_size_um=scene.mesh.contact_size_um,
        order=min(scene.mesh.order, 2),
        thin_layers=scene.mesh.thin_layers,
        touch=tuple((t.at[0], t.at[1]) for t in touch),
        contact_zone_um=zone,
        grading=plan.grading,
    )
    return follow(disc, scene, weight, contact.pressure_at) if scene.mesh.grading == "fitted" else disc


def contact_zone_um(scene: Scene, weight: float) -> float:
    """Radius of the finely meshed zone [µm]: somewhat more than Hertz's half-width on the cytosol's solid."""
    radius = scene.radius_um
    half_width = GEOMETRIES[scene.cell.geometry].hertz_um(abs(weight), radius, modulus_of(scene))
    return radius * min(max(ZONE_OVER_HERTZ * half_width / radius, 0.1), 1.0)
