"""The start of the cell: lowered vertically until it first touches, then lifted by the gap.

A cell that nothing but contact holds, and that touches on a slope, slides down to where it touches on all sides, if
that is in reach: there it starts, since its equilibrium is near there and not where it was put.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from itertools import combinations, pairwise
from typing import NamedTuple

from cellmech.mechanics.obstacles import Pillar
from cellmech.mechanics.pillars import RoundPillar
from cellmech.scene.inputs import Inputs
from cellmech.scene.substrate import Standing, Upright, standing
from cellmech.scene.substrate_parts import Flat
from cellmech.scene.touch import gradient_of, meet

Obstacle = int | str  # a pillar by its index, one of the array by its name, "flat"
Place = tuple[float, ...]  # across the vertical [µm]: x, in 3-D x and z

# Two obstacles count as touched together when their first touches differ by less than this share of the radius.
TIE = 1e-9
FARTHEST_SLIDE = 0.5  # share of the radius that a cell may slide to where it rests; farther away is another scene
FIRST_STEP, LAST_STEP = 0.05, 1e-11  # of a way down in space, shares of the radius
ACTIVE = 0.5  # share of a step that the level of an obstacle may lie lower for it to be in the way
STEEP = 1e-5  # sine of a slope on which a cell slides; on less it is held, with that share of its weight
LOOKS = 200  # at the substrate along a radius: each obstacle's level is as smooth there as the cell


class Touch(NamedTuple):
    """A point of first touch on the substrate [µm], and the outward unit normal of the substrate there; x, y and z."""

    at: tuple[float, ...]
    obstacle: Obstacle
    normal: tuple[float, ...]


class Placement(NamedTuple):
    """The cell's centre at the start [µm], `gap_um` above first touch; `touch` is empty when nothing is below.

    `slide_um` is how far it has been moved to where it rests, along x, and in 3-D along z.
    """

    centre: tuple[float, ...]
    touch: tuple[Touch, ...]
    slide_um: Place = (0.0,)


class Overlap(NamedTuple):
    """An obstacle the cell would overlap, and how far the cell must rise to be free of it [µm]."""

    obstacle: Obstacle
    depth_um: float


def placement(scene: Inputs) -> Placement:
    """The start of the scene's cell, `gap_um` of vertical travel above its first touch.

    The touch points lie on the substrate. Of symmetric ones only those in the modelled part of the cell are given. With
    nothing below the cell's width, its lowest point starts at y = gap_um and `touch` is empty.
    """
    place, gap, high = scene.centre_um, scene.cell.gap_um, scene.semi_axes_um[1]
    first = _first(scene, place)
    if not first:
        return Placement(_above(place, gap + high), ())
    slide = _slide(scene, FARTHEST_SLIDE * scene.radius_um) or (0.0,) * len(place)
    if any(slide):
        place = tuple(at + way for at, way in zip(place, slide, strict=True))
        first = _first(scene, place)
    level = max(level for level, _ in first)
    return Placement(_above(place, level + gap), tuple(touch for _, touch in first), slide)


def _above(place: Place, y: float) -> tuple[float, ...]:
    return place[0], y, *place[1:]


def rest_beside(scene: Inputs) -> Place | None:
    """How far from where it was put a cell that touches on a slope would rest [µm]; None if not near by."""
    return _slide(scene, 2 * scene.radius_um)


def slope_at(scene: Inputs, touch: tuple[Touch, ...]) -> float:
    """Sine of the slope that a cell touching so slides down, > 0 to the right in a plane; 0 where it rests.

    It rests where weights of its touches, mirror images included, balance their horizontal normals.
    """
    tilts = [(point.normal[0], *point.normal[2:]) for point in touch]
    if scene.cell.geometry == "3d":
        return math.hypot(*_nearest(_with_images(scene, tilts)))
    sines = [tilt for (tilt,) in _with_images(scene, tilts)]
    return min(sines, key=abs) if sines and (min(sines) > 0) == (max(sines) > 0) else 0.0


def _with_images(scene: Inputs, tilts: list[Place]) -> list[Place]:
    """Horizontal vectors, and their mirror images where planes of symmetry bound what is modelled."""
    for axis, name in enumerate("xz"):
        if name in scene.mirrors:
            tilts = tilts + [tuple(-t if k == axis else t for k, t in enumerate(tilt)) for tilt in tilts]
    return tilts


def _nearest(points: Iterable[Place]) -> Place:
    """The point of the convex hull of points of a plane that is nearest to the origin; the origin for no points."""
    found = [point for point in points]
    angles = sorted(math.atan2(z, x) for x, z in found)
    if not found or (0.0, 0.0) in found:
        return 0.0, 0.0
    around = [later - earlier for earlier, later in pairwise((*angles, angles[0] + 2 * math.pi))]
    if max(around) <= math.pi:
        return 0.0, 0.0
    candidates = list(found)
    for (x0, z0), (x1, z1) in combinations(found, 2):
        dx, dz = x1 - x0, z1 - z0
        if (x0 * dx + z0 * dz) * (x1 * dx + z1 * dz) < 0.0:  # its foot lies between the two
            s = -(x0 * dx + z0 * dz) / (dx * dx + dz * dz)
            candidates.append((x0 + s * dx, z0 + s * dz))
    return min(candidates, key=lambda point: math.hypot(*point))


def _slide(scene: Inputs, farthest: float) -> Place | None:
    """The way [µm] down to the first place where the cell touches on all sides; None if it needs none or finds none."""
    held = len(scene.mirrors) == len(scene.centre_um)
    if held or scene.cell.inertia or not scene.has_weight:
        return None
    slope = slope_at(scene, tuple(touch for _, touch in _first(scene, scene.centre_um)))
    if slope == 0.0:
        return None
    return _down(scene, farthest) if scene.cell.geometry == "3d" else _along(scene, slope, farthest)


def _along(scene: Inputs, slope: float, farthest: float) -> Place | None:
    """`_slide` in a plane, where the way down is a line."""
    (x,) = scene.centre_um
    sign = 1.0 if slope > 0 else -1.0

    def still_slides(way: float) -> bool:
        highest = max(_touches(scene, (x + sign * way,)), key=lambda found: found[0], default=None)
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
    return (sign * there,) if len(_first(scene, (x + sign * there,))) > 1 else None


def _down(scene: Inputs, farthest: float) -> Place | None:
    """`_slide` in space: steepest descent of the level of first touch, the highest of the obstacles' levels.

    Where several of them are about as high the way leads between them: it is opposite to the shortest vector in the
    convex hull of their slopes. Steps are halved where they lead up.
    """
    radius, start = scene.radius_um, scene.centre_um
    place, step, touches = start, FIRST_STEP * radius, _touches(scene, start)
    while step > LAST_STEP * radius:
        level = max(found for found, _ in touches)
        near = [touch.normal for found, touch in touches if found >= level - ACTIVE * step]
        slopes = _with_images(scene, [(-n[0] / n[1], -n[2] / n[1]) for n in near])
        slope = _nearest(slopes)
        steepness = math.hypot(*slope)
        if steepness > 0.0:
            there = tuple(at - step * part / steepness for at, part in zip(place, slope, strict=True))
            below = _touches(scene, there)
            if not below or math.dist(there, start) > farthest:
                return None
            if max(found for found, _ in below) < level:
                place, touches = there, below
                continue
        step /= 2
    if slope_at(scene, tuple(touch for _, touch in _first(scene, place))) > STEEP:
        return None
    return tuple(at - before for at, before in zip(place, start, strict=True))


def _first(scene: Inputs, place: Place) -> tuple[tuple[float, Touch], ...]:
    """(level of the centre [µm], touch) of the obstacles that a cell centred there touches first, all but tied."""
    touches = _touches(scene, place)
    first = max((level for level, _ in touches), default=0.0)
    return tuple((level, touch) for level, touch in touches if level >= first - TIE * scene.radius_um)


def overlaps(scene: Inputs, start: Placement) -> tuple[Overlap, ...]:
    """Obstacles that the cell at its start overlaps, deepest first.

    The depth is the vertical travel to touch. More than `TIE` radii count, so that touching is no overlap.
    """
    depths: dict[Obstacle, float] = {}
    x, y, *z = start.centre
    for level, touch in _touches(scene, (x, *z)):
        if level - y > TIE * scene.radius_um:
            depths[touch.obstacle] = max(level - y, depths.get(touch.obstacle, 0.0))
    return tuple(sorted((Overlap(*item) for item in depths.items()), key=lambda overlap: -overlap.depth_um))


def _touches(scene: Inputs, place: Place) -> tuple[tuple[float, Touch], ...]:
    return _touches_of(scene.semi_axes_um, place, scene.mirrors, standing(scene), scene.flat)


@lru_cache(maxsize=256)  # the cases of a sweep mostly share one geometry
def _touches_of(
    semi_axes: tuple[float, float], place: Place, mirrors: str, stands: tuple[Standing, ...], flat: Flat | None
) -> tuple[tuple[float, Touch], ...]:
    """(level of the centre at touch [µm], touch) for every obstacle below the cell's width."""
    found, (wide, high) = [], semi_axes
    cell: Upright = Pillar(place[0], 0.0, wide, high, 2.0)
    if len(place) == 2:
        cell = RoundPillar(place[0], 0.0, place[1], wide, high, 2.0)
    for stand in stands:
        arch = stand.arch
        met = meet(cell, arch)
        if met is None or any(at < 0.0 for at, _ in zip(met, mirrors, strict=False)):
            continue
        *at, distance = met
        z = at[-1]
        # both surfaces share the normal; the cell's is the well-conditioned one at a sharp corner
        across = [(middle - x) / wide for middle, x in zip(place, at, strict=True)]
        length = gradient_of(high / wide, across)
        ways = [high / wide * part / length for part in across]
        normal = (ways[0], cell.across(z).rise(at[0]) / high / length, *ways[1:])
        point = (at[0], arch.y_um + arch.across(z).rise(at[0]), *at[1:])
        found.append((arch.y_um + distance, Touch(point, stand.pillar, normal)))
    if flat is not None:
        upward = (0.0, 1.0, 0.0)[: len(place) + 1]
        found.append((flat.y_um + high, Touch(_above(place, flat.y_um), "flat", upward)))
    return tuple(found)
