"""The start of the cell: lowered vertically until it first touches, then lifted by the gap.

A cell that nothing but contact holds, and that touches on a slope beside a second obstacle, slides a little down to
where it touches both: there it starts, since its equilibrium is near there and not where it was put.

Disc and pillars are superellipses |x/w|^p + |y/h|^p <= 1. At each x the distance of two centres at which the shapes
just touch is the sum of their half heights there. Both are concave, so the sum has one maximum, which bisection on
its slope finds to the last digit: the sum at that x is the vertical distance of first touch.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Literal, NamedTuple

from cellmech.mechanics import obstacles
from cellmech.scene.inputs import Inputs
from cellmech.scene.limits import below
from cellmech.scene.parts import Flat, Pillar

Obstacle = int | Literal["flat"]

# Two obstacles count as touched together when their first touches differ by less than this share of the radius.
TIE = 1e-9
# Share of the radius that a cell may slide to where it rests on both sides; farther away is another scene.
FARTHEST_SLIDE = 0.1
STEEP = 1e-5  # sine of a slope on which a cell slides; on less it is held, with that share of its weight
LOOKS = 200  # at the substrate along a radius: each obstacle's level is as smooth there as the cell is round


class Touch(NamedTuple):
    """A point of first touch [µm] on the substrate, and the outward unit normal of the substrate there."""

    x_um: float
    y_um: float
    obstacle: Obstacle
    normal: tuple[float, float]


class Placement(NamedTuple):
    """The cell's centre at the start [µm], `gap_um` above first touch; `touch` is empty when nothing is below.

    `slide_um` is how far it has been moved along x to where it rests.
    """

    centre_x_um: float
    centre_y_um: float
    touch: tuple[Touch, ...]
    slide_um: float = 0.0


class Overlap(NamedTuple):
    """An obstacle the cell would overlap, and how far the cell must rise to be free of it [µm]."""

    obstacle: Obstacle
    depth_um: float


class Standing(NamedTuple):
    """A pillar of the scene, by its index, or that pillar's mirror image."""

    pillar: int
    mirrored: bool
    arch: obstacles.Pillar


def touch_of(a: obstacles.Pillar, b: obstacles.Pillar) -> tuple[float, float] | None:
    """The x [µm] where two shapes meet vertically and the distance of their centres then [µm]; None if they cannot."""
    low = max(a.x_um - a.half_width_um, b.x_um - b.half_width_um)
    high = min(a.x_um + a.half_width_um, b.x_um + b.half_width_um)
    if not below(low, high, a.x_um, b.x_um):  # side by side, as exactly as numbers can say
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
        arch = obstacles.Pillar(pillar.x_um, pillar.y_um, pillar.half_width_um, pillar.height_um, pillar.exponent)
        found.append(Standing(index, False, arch))
        if half and arch.x_um != 0.0:
            found.append(Standing(index, True, replace(arch, x_um=-arch.x_um)))
    return tuple(found)


def placement(scene: Inputs) -> Placement:
    """The start of the scene's cell, `gap_um` of vertical travel above its first touch.

    The touch points lie on the substrate. Of a half cell's symmetric pairs only the one at x >= 0 is given. With
    nothing below the cell's width, its lowest point starts at y = gap_um and `touch` is empty.
    """
    x, gap, radius = scene.cell.centre_x_um, scene.cell.gap_um, scene.radius_um
    first = _first(scene, x)
    if not first:
        return Placement(x, gap + radius, ())
    slide = _slide(scene, FARTHEST_SLIDE * radius) or 0.0
    if slide:
        first = _first(scene, x + slide)
    level = max(level for level, _ in first)
    return Placement(x + slide, level + gap, tuple(touch for _, touch in first), slide)


def rest_beside(scene: Inputs) -> float | None:
    """Way along x to where a cell that touches on a slope would rest [µm]; None if that is not near by."""
    return _slide(scene, 2 * scene.radius_um)


def slope_at(touch: tuple[Touch, ...]) -> float:
    """Sine of the slope that a cell touching so slides down, > 0 to the right; 0 where it rests."""
    tilts = [point.normal[0] for point in touch]
    return min(tilts, key=abs) if tilts and (min(tilts) > 0) == (max(tilts) > 0) else 0.0


def _slide(scene: Inputs, farthest: float) -> float | None:
    """The way along x [µm] down to the first place where the cell touches on both sides; None if it is not needed."""
    x = scene.cell.centre_x_um
    slope = slope_at(tuple(touch for _, touch in _first(scene, x)))
    if scene.cell.shape == "half" or scene.cell.inertia or not scene.has_weight or slope == 0.0:
        return None
    sign = 1.0 if slope > 0 else -1.0

    def still_slides(way: float) -> bool:
        highest = max(_touches(scene, x + sign * way), key=lambda found: found[0], default=None)
        return highest is not None and sign * highest[1].normal[0] > 0.0

    step = scene.radius_um / LOOKS
    here = 0.0
    while still_slides(here + step):
        here += step
        if here > farthest:
            return None
    there = here + step
    while here < (middle := 0.5 * (here + there)) < there:
        here, there = (middle, there) if still_slides(middle) else (here, middle)
    return sign * there if len(_first(scene, x + sign * there)) > 1 else None


def _first(scene: Inputs, x: float) -> tuple[tuple[float, Touch], ...]:
    """(level of the centre [µm], touch) of the obstacles that a cell centred at x [µm] touches first, all but tied."""
    touches = _touches(scene, x)
    first = max((level for level, _ in touches), default=0.0)
    return tuple((level, touch) for level, touch in touches if level >= first - TIE * scene.radius_um)


def overlaps(scene: Inputs, start: Placement) -> tuple[Overlap, ...]:
    """Obstacles that the cell at its start overlaps, deepest first.

    The depth is the vertical travel to touch. More than `TIE` radii count, so that touching is no overlap.
    """
    depths: dict[Obstacle, float] = {}
    for level, touch in _touches(scene, start.centre_x_um):
        if level - start.centre_y_um > TIE * scene.radius_um:
            depths[touch.obstacle] = max(level - start.centre_y_um, depths.get(touch.obstacle, 0.0))
    return tuple(sorted((Overlap(*item) for item in depths.items()), key=lambda overlap: -overlap.depth_um))


def _touches(scene: Inputs, x: float) -> tuple[tuple[float, Touch], ...]:
    return _touches_of(scene.radius_um, x, scene.cell.shape == "half", scene.pillar, scene.flat)


@lru_cache(maxsize=256)  # the cases of a sweep mostly share one geometry
def _touches_of(
    radius: float, centre_x: float, half: bool, pillars: tuple[Pillar, ...], flat: Flat | None
) -> tuple[tuple[float, Touch], ...]:
    """(level of the centre at touch [µm], touch) for every obstacle below the cell's width."""
    disc = obstacles.Pillar(centre_x, 0.0, radius, radius, 2.0)
    found = []
    for index, _, arch in standing(half, pillars):
        met = touch_of(disc, arch)
        if met is None or (half and met[0] < 0.0):
            continue
        x, distance = met
        # both surfaces share the normal; the disc's is the well-conditioned one at a sharp corner
        normal = ((centre_x - x) / radius, disc.rise(x) / radius)
        found.append((arch.y_um + distance, Touch(x, arch.y_um + arch.rise(x), index, normal)))
    if flat is not None:
        found.append((flat.y_um + radius, Touch(centre_x, flat.y_um, "flat", (0.0, 1.0))))
    return tuple(found)
