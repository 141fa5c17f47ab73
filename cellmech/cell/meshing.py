"""From a scene to what Gmsh is asked for: a disc, or a ball."""

from __future__ import annotations

import math

from cellmech.cell.footing import follow, modulus_of
from cellmech.cell.layering import MeshPlan, graded
from cellmech.cell.outlines import cell_shape
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.kinematics import GEOMETRIES
from cellmech.mechanics.obstacles import Flat, Obstacle
from cellmech.mesh.ball import BALL, SYMMETRIC, BallSpec
from cellmech.mesh.cell_shape import CellShape
from cellmech.mesh.disc import DiscSpec
from cellmech.mesh.sizes import Zone
from cellmech.scene.placement import Touch
from cellmech.scene.scene import Scene
from cellmech.scene.substrate import facing
from cellmech.scene.touch import gradient_of

ZONE_OVER_HERTZ = 1.32  # on Table 1 the contact edge lies at 0.9 of Hertz's half-width, the membrane's peaks beyond it
AXES = "xyz"
ON_PLANE = 1e-9  # of the radius: a touch so near to a plane of symmetry is its own image
STEEP = 0.2  # vertical part of a normal below which a touch bears no more
STEP = 1e-5  # of the radius, over which an obstacle's curvature is measured


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
    moves = cell_shape(scene)
    if scene.cell.geometry == "3d":
        return BallSpec(
            shape=scene.cell.shape,
            centre=(centre[0], centre[1], centre[2]),
            interfaces=plan.interfaces(scene),
            nucleus_radius_um=scene.nucleus_radius_um,
            size_um=scene.mesh.size_um,
            order=min(scene.mesh.order, 2),
            thin_layers=scene.mesh.thin_layers,
            zones=_zones(scene, centre, touch, weight, moves),
            grading=graded(scene, BALL),
            moves=moves,
        )
    places = [_in_the_mesh(moves, centre, t.at) for t in touch]
    zones = (contact_zone_um(scene, weight, bends_of(scene, centre, t.at)[0]) for t in touch)
    disc = DiscSpec(
        shape=scene.cell.shape,
        centre=(centre[0], centre[1]),
        interfaces=plan.interfaces(scene),
        nucleus_radius_um=scene.nucleus_radius_um,
        size_um=scene.mesh.size_um,
        contact_size_um=scene.mesh.contact_size_um
        or _within_the_range(scene, plan.grading.contact * scene.mesh.size_um),
        order=min(scene.mesh.order, 2),
        thin_layers=scene.mesh.thin_layers,
        touch=tuple((at[0], at[1]) for at, _ in places),
        contact_zone_um=max((zone / longer for zone, (_, longer) in zip(zones, places, strict=True)), default=None),
        grading=plan.grading,
        moves=moves,
    )
    return follow(disc, scene, weight, contact.pressure_at) if scene.mesh.grading == "fitted" else disc


def contact_zone_um(scene: Scene, force: float, radius_um: float) -> float:
    """Radius of the finely meshed zone [µm]: somewhat more than Hertz's half-width on the cytosol's solid.

    Args:
        scene: whose cytosol is pressed.
        force: on the contact [Pa µm or pN].
        radius_um: of a cell that touches a plane as this one touches the obstacle.
    """
    radius = scene.radius_um
    half_width = GEOMETRIES[scene.cell.geometry].hertz_um(abs(force), radius_um, modulus_of(scene))
    return radius * min(max(ZONE_OVER_HERTZ * half_width / radius, 0.1), 1.0)


def bends_of(scene: Scene, centre: tuple[float, ...], at: tuple[float, ...]) -> tuple[float, float]:
    """Radii of curvature of the cell at a place of its outline [µm]: in the vertical plane through it, and across that.

    Args:
        scene: whose cell it is.
        centre: of the cell [µm].
        at: the place [µm].
    """
    wide, high = scene.semi_axes_um
    across = [(x - middle) / wide for k, (x, middle) in enumerate(zip(at, centre, strict=True)) if k != 1]
    length, at_the_pole = gradient_of(high / wide, across), wide / (high / wide)
    return at_the_pole * length**3, at_the_pole * length


def _in_the_mesh(
    moves: CellShape | None, centre: tuple[float, ...], at: tuple[float, ...]
) -> tuple[tuple[float, ...], float]:
    """A place of the cell's outline in the mesh of circles [µm], and lengths along it here over those there [-]."""
    if moves is None:
        return at, 1.0
    offset, longer = moves.on_circle([x - middle for x, middle in zip(at, centre, strict=True)])
    return tuple(x + middle for x, middle in zip(offset, centre, strict=True)), longer


def _zones(
    scene: Scene, centre: tuple[float, ...], touch: tuple[Touch, ...], weight: float, moves: CellShape | None
) -> tuple[Zone, ...]:
    """A zone for each contact of a ball, which share its weight; narrow ones get smaller elements."""
    radius, planes, zones = scene.radius_um, SYMMETRIC[scene.cell.shape], []
    images = [2 ** sum(abs(t.at[AXES.index(axis)]) > ON_PLANE * radius for axis in planes) for t in touch]
    for t in touch:
        arches = [stand.arch for stand in facing(scene)] if t.obstacle != "flat" else []
        arch = min(arches, key=lambda arch: abs(float(arch.level_set(t.at))), default=Flat(t.at[1]))
        bend = sum(1 / one for one in bends_of(scene, centre, t.at)) / 2
        effective = 1 / (bend + max(mean_curvature(arch, t.at, STEP * radius), 0.0))
        zone = contact_zone_um(scene, weight / (sum(images) * max(t.normal[1], STEEP)), effective)
        size = BALL.contact * scene.mesh.size_um * min(1.0, zone / (BALL.zone * radius))
        wanted = scene.mesh.contact_size_um or _within_the_range(scene, size) or size
        at, longer = _in_the_mesh(moves, centre, t.at)
        zones.append(Zone(at, wanted / longer, zone / longer))
    return tuple(zones)


def _within_the_range(scene: Scene, usual_um: float) -> float | None:
    """Size of elements that do not miss a pull [µm], where that is less than the usual one."""
    reach = scene.adhesion.range_um if scene.adhesion is not None else math.inf
    return reach if reach < usual_um else None


def mean_curvature(obstacle: Obstacle, at: tuple[float, ...], step: float) -> float:
    """Half the divergence of an obstacle's normal at a place on it [1/µm]: its mean curvature, positive if it bulges.

    Args:
        obstacle: in space.
        at: the place [µm].
        step: over which differences are taken [µm].
    """
    divergence = 0.0
    for k in range(len(at)):
        ends = []
        for side in (step, -step):
            gradient = [float(part) for part in obstacle.gradient(tuple(x + side * (j == k) for j, x in enumerate(at)))]
            ends.append(-gradient[k] / math.hypot(*gradient))
        divergence += (ends[0] - ends[1]) / (2 * step)
    return divergence / 2
