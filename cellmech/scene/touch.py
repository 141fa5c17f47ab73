"""Where two shapes first touch when one is lowered onto the other, in a vertical plane and in space.

Discs, balls and pillars have concave tops. At each place the vertical distance of two centres at which the shapes just
touch there is the sum of their heights there. The sum is concave, too, so it has one maximum, which bisection on its
slope finds to the last digit: the sum there is the vertical distance of first touch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache

from cellmech.mechanics.obstacles import Pillar
from cellmech.mechanics.pillars import Arch, RoundPillar, SquarePillar
from cellmech.scene.limits import below
from cellmech.scene.substrate import Upright


def _peak(slope: Callable[[float], float], low: float, high: float) -> tuple[float, float]:
    """Two neighbouring numbers with the maximum of a concave function between them, equal where its slope is 0."""
    while low < (middle := 0.5 * (low + high)) < high:
        here = slope(middle)
        if here > 0.0:
            low = middle
        elif here < 0.0:
            high = middle
        else:
            low = high = middle
    return low, high


def _shared(a: Arch, b: Arch) -> tuple[float, float] | None:
    """Where both have a width [µm]; None if they are side by side, as exactly as numbers can say."""
    low = max(a.x_um - a.half_width_um, b.x_um - b.half_width_um)
    high = min(a.x_um + a.half_width_um, b.x_um + b.half_width_um)
    return (low, high) if below(low, high, a.x_um, b.x_um) else None


def touch_of(a: Arch, b: Arch) -> tuple[float, float] | None:
    """The x [µm] where two shapes meet vertically and the distance of their centres then [µm]; None if they cannot."""
    shared = _shared(a, b)
    if shared is None:
        return None
    ends = _peak(lambda x: a.slope(x) + b.slope(x), *shared)
    x = max(ends, key=lambda x: a.rise(x) + b.rise(x))
    return x, a.rise(x) + b.rise(x)


def meet(a: Upright, b: Upright) -> tuple[float, ...] | None:
    """Where any two shapes meet vertically and the distance of their centres then [µm]; None if they cannot.

    The place is x, or x and z where one of them ends along z.
    """
    if isinstance(a, Pillar):
        return touch_of(a, b) if isinstance(b, Pillar) else meet(b, a)
    if isinstance(b, Pillar):
        met = touch_of(a.across(a.z_um), b)
        return None if met is None else (met[0], a.z_um, met[1])
    dx, dz = b.x_um - a.x_um, b.z_um - a.z_um
    if isinstance(a, RoundPillar) and isinstance(b, RoundPillar):  # in the plane through both axes
        apart = math.hypot(dx, dz)
        met = touch_of(a.profile, replace(b.profile, x_um=apart))
        if met is None or not apart:
            return None if met is None else (a.x_um, a.z_um, met[1])
        return a.x_um + met[0] * dx / apart, a.z_um + met[0] * dz / apart, met[1]
    # neither knows x from z, or right from left
    near, far = sorted((abs(dx), abs(dz)))
    found = _nested(replace(a, x_um=0.0, y_um=0.0, z_um=0.0), replace(b, x_um=near, y_um=0.0, z_um=far))
    if found is None:
        return None
    x, z = found[:2] if abs(dx) <= abs(dz) else found[1::-1]
    return a.x_um + math.copysign(1.0, dx) * x, a.z_um + math.copysign(1.0, dz) * z, found[2]


def gradient_of(aspect: float, across: Iterable[float]) -> float:
    """Length of an ellipse's gradient, times half of its height [-]: 1 all around a circle, and at its lowest point.

    Args:
        aspect: its height over its width.
        across: the place's horizontal distance from the middle over half of the width, along each coordinate [-].
    """
    return math.sqrt(1.0 - (1.0 - aspect**2) * sum(part**2 for part in across))


@lru_cache(maxsize=1024)  # a lattice has few pillars that differ in distance
def _nested(a: RoundPillar | SquarePillar, b: RoundPillar | SquarePillar) -> tuple[float, float, float] | None:
    """`meet` by bisection along z of the maximum along x.

    Where the sections do not meet, the way is the one on which they come nearer.
    """
    feet = [replace(one.foot, x_um=one.z_um) for one in (a, b)]  # arches along z
    shared = _shared(*feet)

    def along_x(z: float) -> tuple[float, float] | None:
        if min(foot.rise(z) for foot in feet) <= 0.0:
            return None
        return touch_of(a.across(z), b.across(z))

    def slope(z: float) -> float:
        met = along_x(z)
        arches = feet if met is None else [one.along(met[0]) for one in (a, b)]
        return arches[0].slope(z) + arches[1].slope(z)

    found = [] if shared is None else [(z, met) for z in _peak(slope, *shared) if (met := along_x(z)) is not None]
    if not found:
        return None
    z, (x, distance) = max(found, key=lambda one: one[1][1])
    return x, z, distance
