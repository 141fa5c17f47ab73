"""Where the cell starts: lowered vertically until it first touches, then lifted by the gap.

Disc and pillars are superellipses |x/w|^p + |y/h|^p <= 1. At each x the distance of two centres at which the shapes
just touch is the sum of their half heights there. Both are concave, so the sum has one maximum, which bisection on
its slope finds to the last digit: the sum at that x is the vertical distance of first touch.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, NamedTuple

from cellmech.limits import below
from cellmech.scene_parts import Flat, Pillar

if TYPE_CHECKING:
    from cellmech.scene import Scene

Obstacle = int | Literal["flat"]

# Two obstacles count as touched together when their first touches differ by less than this share of the radius.
TIE = 1e-9


class Touch(NamedTuple):
    """A point of first touch [µm] on the substrate, and the outward unit normal of the substrate there."""

    x_um: float
    y_um: float
    obstacle: Obstacle
    normal: tuple[float, float]


class Placement(NamedTuple):
    """The cell's centre at the start [µm], `gap_um` above first touch; `touch` is empty when nothing is below."""

    centre_x_um: float
    centre_y_um: float
    touch: tuple[Touch, ...]


class Overlap(NamedTuple):
    """An obstacle the cell would overlap, and how far the cell must rise to be free of it [µm]."""

    obstacle: Obstacle
    depth_um: float


class Arch(NamedTuple):
    """Upper half of a superellipse about (x, y) [µm]."""

    x: float
    y: float
    half_width: float
    height: float
    exponent: float

    def rise(self, x: float) -> float:
        """Height above y at x [µm], 0 at and beyond the ends."""
        xi = abs(x - self.x) / self.half_width
        if xi >= 1.0:
            return 0.0
        return self.height * math.pow(self._rest(xi), 1.0 / self.exponent)

    def slope(self, x: float) -> float:
        """Derivative of `rise`, infinite at and beyond the ends [-]."""
        xi = abs(x - self.x) / self.half_width
        if xi >= 1.0:
            return -math.copysign(math.inf, x - self.x)
        rest = self._rest(xi) ** (1.0 / self.exponent - 1.0)
        return -math.copysign(self.height / self.half_width * xi ** (self.exponent - 1.0) * rest, x - self.x)

    def _rest(self, xi: float) -> float:
        # 1 - xi^p without the cancellation near the end, where a sharp pillar is steepest
        return -math.expm1(self.exponent * math.log(xi)) if xi > 0.0 else 1.0


class Standing(NamedTuple):
    """A pillar of the scene, by its index, or that pillar's mirror image."""

    pillar: int
    mirrored: bool
    arch: Arch


def touch_of(a: Arch, b: Arch) -> tuple[float, float] | None:
    """The x [µm] where two shapes meet vertically and the distance of their centres then [µm]; None if they cannot."""
    low, high = max(a.x - a.half_width, b.x - b.half_width), min(a.x + a.half_width, b.x + b.half_width)
    if not below(low, high, a.x, b.x):  # side by side, as exactly as numbers can say
        return None
    while low < (middle := 0.5 * (low + high)) < high:
        slope = a.slope(middle) + b.slope(middle)
        if slope > 0.0:
            low = middle
        elif slope < 0.0:
            high = middle
        else:
            low = high = middle
    x = max(low, high, key=lambda x: a.rise(x) + b.rise(x))
    return x, a.rise(x) + b.rise(x)


def standing(half: bool, pillars: tuple[Pillar, ...]) -> tuple[Standing, ...]:
    """Every pillar, and for a half cell the mirror image at x = 0 of each one off the axis."""
    found = []
    for index, pillar in enumerate(pillars):
        arch = Arch(pillar.x_um, pillar.y_um, pillar.half_width_um, pillar.height_um, pillar.exponent)
        found.append(Standing(index, False, arch))
        if half and arch.x != 0.0:
            found.append(Standing(index, True, arch._replace(x=-arch.x)))
    return tuple(found)


def placement(scene: Scene) -> Placement:
    """Where the scene's cell starts, `gap_um` of vertical travel above its first touch.

    The touch points lie on the substrate. Of a half cell's symmetric pairs only the one at x >= 0 is given. With
    nothing below the cell's width, its lowest point starts at y = gap_um and `touch` is empty.
    """
    touches = _touches(scene)
    x, gap, radius = scene.cell.centre_x_um, scene.cell.gap_um, scene.radius_um
    if not touches:
        return Placement(x, gap + radius, ())
    first = max(level for level, _ in touches)
    return Placement(x, first + gap, tuple(touch for level, touch in touches if level >= first - TIE * radius))


def overlaps(scene: Scene, centre_y_um: float) -> tuple[Overlap, ...]:
    """Obstacles that the disc with its centre at `centre_y_um` [µm] overlaps, deepest first.

    The depth is the vertical travel to touch. More than `TIE` radii count, so that touching is no overlap.
    """
    depths: dict[Obstacle, float] = {}
    for level, touch in _touches(scene):
        if level - centre_y_um > TIE * scene.radius_um:
            depths[touch.obstacle] = max(level - centre_y_um, depths.get(touch.obstacle, 0.0))
    return tuple(sorted((Overlap(*item) for item in depths.items()), key=lambda overlap: -overlap.depth_um))


def _touches(scene: Scene) -> tuple[tuple[float, Touch], ...]:
    half = scene.cell.shape == "half"
    return _touches_of(scene.radius_um, scene.cell.centre_x_um, half, scene.pillar, scene.flat)


@lru_cache(maxsize=256)  # the cases of a sweep mostly share one geometry
def _touches_of(
    radius: float, centre_x: float, half: bool, pillars: tuple[Pillar, ...], flat: Flat | None
) -> tuple[tuple[float, Touch], ...]:
    """(level of the centre at touch [µm], touch) for every obstacle below the cell's width."""
    disc = Arch(centre_x, 0.0, radius, radius, 2.0)
    found = []
    for index, _, arch in standing(half, pillars):
        met = touch_of(disc, arch)
        if met is None or (half and met[0] < 0.0):
            continue
        x, distance = met
        # both surfaces share the normal; the disc's is the well-conditioned one at a sharp corner
        normal = ((centre_x - x) / radius, disc.rise(x) / radius)
        found.append((arch.y + distance, Touch(x, arch.y + arch.rise(x), index, normal)))
    if flat is not None:
        found.append((flat.y_um + radius, Touch(centre_x, flat.y_um, "flat", (0.0, 1.0))))
    return tuple(found)
