"""Width of the cell's contact with each obstacle, before anything is solved, and the mesh that it asks for.

A frictionless contact of the half-plane with a profile whose gap grows like g(t) beside the first touch bears
P(a) = E* ∫_0^a t g'(t) / sqrt(a^2 - t^2) dt at the half-width a (Hertz: g = t^2/2R gives P = pi E* a^2/4R). One of the
half-space that is round about its first touch bears F(a) = 2 E* ∫_0^a t^2 g'(t) / sqrt(a^2 - t^2) dt (Hertz:
4 E* a^3/3R). With the cytosol's modulus this is within a tenth of the solved half-width for pillars 0.5 to 20 µm wide
under Table 1. A penalty bears its load over a width of its own, larger under light loads and on narrow pillars.
Sources: Barber, Contact Mechanics (2018), 6.2, for symmetric profiles; Sneddon, Int. J. Engng Sci. 3 (1965) 47-57, for
round ones; the penalty's integral is ours.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

from cellmech.mechanics.obstacles import Pillar
from cellmech.mesh.disc import DiscSpec, Footprint
from cellmech.mesh.disc_script import resolves
from cellmech.scene.rules import FINEST_CONTACT
from cellmech.scene.scene import Scene
from cellmech.scene.substrate import standing
from cellmech.scene.touch import gradient_of, touch_of

LEAST, BISECTIONS, POINTS = 1e-7, 15, 24  # of the radius; of the half-width's logarithm; of the integrals over it
BEARS = (0.5, 1.2)  # of the share of the load that an obstacle is expected to bear
BEARS_LATER = 0.1  # the least of it where obstacles are touched one after the other, or several bear
BEND = 1e-3  # of the half-width: over which the growth of the gap's slope is measured
SIZE_OVER_RADIUS = {1: 0.06, 2: 0.06, 3: 0.24}  # mesh.size_um that accuracy was measured at, over the radius
FOOT_OF_ORDER = {1: 2.0, 2: 2.0, 3: 1.0}  # how much smaller the elements of an order are at a footprint
MOST_EDGES = 400  # on one side of a footprint: the edge of a box may lie anywhere between its ends
FINENESS = (0.5, 10.0)  # least and most of a footprint


class Profile(NamedTuple):
    """The gap between cell and obstacle on one side of their first touch.

    Args:
        cell, obstacle: the two shapes; no obstacle is the flat.
        x: of the first touch [µm].
        side: 1 to the right, -1 to the left.
        stretch: length along the surfaces over that along x, 1 at the cell's bottom [-].
        around: whether the surfaces are turned about their first touch: a ball's contact on its axis.
    """

    cell: Pillar
    obstacle: Pillar | None
    x: float
    side: int
    stretch: float
    around: bool = False

    def slope(self, t: float) -> float:
        """dg/dt at the distance t along the surfaces [-], infinite where one of them ends."""
        at = self.x + self.side * t / self.stretch
        rise = self.cell.slope(at) + (self.obstacle.slope(at) if self.obstacle else 0.0)
        return max(-self.side * rise, 0.0) / self.stretch**2

    def gap(self, t: float) -> float:
        """g(t) [µm]."""
        at = self.x + self.side * t / self.stretch
        fall = sum(arch.rise(self.x) - arch.rise(at) for arch in (self.cell, self.obstacle) if arch)
        return max(fall, 0.0) / self.stretch


@dataclass(frozen=True)
class Foot:
    """The end of a contact, seen from its first touch.

    Args:
        at: the first touch on the cell's outline, from the cell's centre [µm].
        edges: least and largest half-width of the contact [µm].
        scale_um: over which the slope of the gap doubles at the contact's edge: the half-width on round surfaces,
            less at the edge of a box. What the pressure does there takes such a length.
    """

    at: tuple[float, float]
    edges: tuple[float, float]
    scale_um: float


def follow(spec: DiscSpec, scene: Scene, load: float, pressure: Callable[[float], float]) -> DiscSpec:
    """A disc whose mesh also follows the contacts that are narrower than its zones take for granted.

    Elements there are as much smaller than the grading's as the scene's are beside the size it was chosen at.

    Args:
        spec: the disc.
        scene: what it is to be.
        load: the whole weight [Pa µm or pN].
        pressure: of the contact, as a function of the depth [Pa].
    """
    order, radius = scene.mesh.order, scene.radius_um
    fineness = min(max(SIZE_OVER_RADIUS[order] * radius / scene.mesh.size_um, FINENESS[0]), FINENESS[1])
    fineness *= FOOT_OF_ORDER[order]
    expected = feet(scene, load, pressure)
    least = (max(FINEST_CONTACT * radius, (f.edges[1] - f.edges[0]) / MOST_EDGES) for f in expected)
    found = (_in_the_mesh(spec, f, fineness, um) for f, um in zip(expected, least, strict=True))
    return replace(spec, footprints=tuple(foot for foot in found if not resolves(spec, foot)))


def _in_the_mesh(spec: DiscSpec, foot: Foot, fineness: float, least_um: float) -> Footprint:
    """A contact's footprint in the mesh of circles."""
    if spec.moves is None:
        return Footprint(foot.at, foot.edges, foot.scale_um, fineness, least_um)
    (x, y), longer = spec.moves.on_circle(foot.at)
    edges = foot.edges[0] / longer, foot.edges[1] / longer
    return Footprint((x, y), edges, foot.scale_um / longer, fineness, least_um / longer)


def modulus_of(scene: Scene) -> float:
    """E/(1 - nu^2) of the cytosol's solid [Pa], which decides how far the cell spreads on an obstacle."""
    solid = max(scene.layer_solid("cytosol"), 1e-3) * scene.layer_young_Pa("cytosol")
    return solid / (1.0 - scene.layer_poisson("cytosol") ** 2)


def feet(scene: Scene, load: float, pressure: Callable[[float], float]) -> tuple[Foot, ...]:
    """The contacts of a scene whose cell settles, in the order of its obstacles.

    Args:
        scene: with any number of obstacles; those that the cell cannot sink to are left out.
        load: the whole weight [Pa µm or pN].
        pressure: of the contact, as a function of the depth [Pa].
    """
    (wide, high), radius = scene.semi_axes_um, scene.radius_um
    x0, turned = scene.cell.centre_x_um, scene.cell.geometry == "axisymmetric"
    half = scene.cell.shape == "half"
    cell = Pillar(x0, 0.0, wide, high, 2.0)
    arches: list[Pillar | None] = [stand.arch for stand in standing(scene) if isinstance(stand.arch, Pillar)]
    if scene.flat is not None:
        arches.append(None)
    touches = []
    for arch in arches:
        met = (x0, high) if arch is None else touch_of(cell, arch)
        if met is not None and not (half and met[0] < 0.0):
            level = met[1] + (arch.y_um if arch else scene.flat.y_um if scene.flat else 0.0)
            touches.append((level, met[0], arch))
    if load <= 0.0 or not touches:
        return ()
    top, modulus = max(level for level, _, _ in touches), modulus_of(scene)
    per_depth = load / (math.pi * wide) if turned else load  # of a ball about that of its middle slice
    bearing = [touch for touch in touches if top - touch[0] <= _settles(per_depth, modulus, high)]
    n = sum(scene.copies if x > 0.0 else 1 for _, x, _ in bearing)
    found = []
    for _, x, arch in bearing:
        stretch = high * gradient_of(high / wide, [(x - x0) / wide]) / max(cell.rise(x), 0.05 * high)
        around = turned and x == 0.0
        whole = load if around or not turned else load / (2 * math.pi * x)  # of a ring, per length of it
        share = whole * stretch / n
        least, most = (
            (BEARS[0] * share, BEARS[1] * share) if n == 1 else (BEARS_LATER * share, BEARS[1] * whole * stretch)
        )
        sides = [Profile(cell, arch, x, side, stretch, around) for side in ((1, -1) if x != x0 else (1,))]
        widths = [[half_width(p, side, modulus, pressure, radius) for p in (least, share, most)] for side in sides]
        scale = min(_scale(side, row[1]) for side, row in zip(sides, widths, strict=True))
        edges = min(row[0] for row in widths), max(row[2] for row in widths)
        found.append(Foot((x - x0, -cell.rise(x)), edges, scale))
    return tuple(found)


def half_width(
    load: float, profile: Profile, modulus: float, pressure: Callable[[float], float], radius: float
) -> float:
    """Half-width of a contact [µm]: the elastic one, or that of the penalty on rigid surfaces where it is larger.

    Args:
        load: on the contact, both sides, or all around [Pa µm or pN].
        profile: of the surfaces.
        modulus: E/(1 - nu^2) of the cell [Pa].
        pressure: of the contact, as a function of the depth [Pa].
        radius: of the cell, and the largest half-width [µm].
    """

    def elastic(a: float) -> float:
        sines = [math.sin((k + 0.5) * math.pi / (2 * POINTS)) for k in range(POINTS)]
        if profile.around:
            return 2 * modulus * a**2 * sum(s * s * profile.slope(a * s) for s in sines) * math.pi / (2 * POINTS)
        return modulus * a * sum(s * profile.slope(a * s) for s in sines) * math.pi / (2 * POINTS)

    def penalty(a: float) -> float:
        depth = profile.gap(a)
        points = (a * (k + 0.5) / POINTS for k in range(POINTS))
        lengths = ((t, 2 * math.pi * t if profile.around else 2.0) for t in points)
        return sum(length * pressure(depth - profile.gap(t)) for t, length in lengths) * a / POINTS

    a = _where(elastic, load, radius)
    return a if penalty(a) >= load else _where(penalty, load, radius)


def _where(bears: Callable[[float], float], load: float, radius: float) -> float:
    """The half-width [µm] at which a growing function reaches the load, between `LEAST` and 1 of the radius."""
    low, high = LEAST * radius, radius
    for _ in range(BISECTIONS):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if bears(middle) < load else (low, middle)
    return low


def _scale(profile: Profile, a: float) -> float:
    """g'/g'' at the half-width a, at most a [µm]."""
    here, before = profile.slope(a * (1 - BEND / 2)), profile.slope(a * (1 - 3 * BEND / 2))
    if not 0.0 < before < here < math.inf:
        return a if here < math.inf else BEND * a
    return min(a, BEND * a * here / (here - before))


def _settles(load: float, modulus: float, radius: float) -> float:
    """Depth to which a cell sinks at most, roughly [µm]: a disc on a half-plane's contact a thousandth of it wide.

    Source: Johnson, Contact Mechanics (1985), 5.6: 2 P/(pi E*) (ln(4 R/a) - 1/2).
    """
    return min(2.0 * load / (math.pi * modulus) * (math.log(4e3) - 0.5), radius)
