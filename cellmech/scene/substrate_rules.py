"""What the cell stands on: nothing overlaps, or eq. 27 would count a force twice, and mirrors find symmetry."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cellmech.scene.breach import Breach
from cellmech.scene.inputs import Inputs
from cellmech.scene.limits import below, told
from cellmech.scene.placement import TIE
from cellmech.scene.substrate import MOST_PILLARS, Standing, Upright, crowded, endless, standing, symmetric
from cellmech.scene.substrate_parts import Array
from cellmech.scene.touch import meet

PLANES = {"x": "x = 0", "z": "z = 0", "xz": "x = 0 and z = 0"}


def of_substrate(scene: Inputs) -> Iterator[Breach]:
    """Arrays that are too many, too close or not symmetric; pillars, and a flat, that overlap others."""
    for i, pillar in enumerate(scene.pillar):
        if pillar.width_um is not None:
            rule = f"must not stand beside pillar.{i}.half_width_um (µm)"
            yield Breach(f"pillar.{i}.width_um", rule, pillar.width_um, "Write one of the two.")
    if scene.array is not None:
        yield from _array(scene, scene.array)
    yield from _pillars(scene)
    yield from _flat(scene)


def _array(scene: Inputs, array: Array) -> Iterator[Breach]:
    closest = _closest(array)
    if array.count != 1 and not below(array.width_um, closest):
        rule = f"must be less than {told(closest)} µm: the array would overlap itself"
        hint = f"array.pitch_um is {told(array.pitch_um)} µm, from middle to middle."
        yield Breach("array.width_um", rule, array.width_um, hint)
    if crowded(scene):
        rule = f"must leave at most {MOST_PILLARS:,} pillars within reach of the cell (µm)"
        yield Breach("array.pitch_um", rule, array.pitch_um, "Or set array.count, the number along a side.")
    arches = [stand.arch for stand in standing(scene) if isinstance(stand.pillar, str)]
    for axis in scene.mirrors:
        if not symmetric(arches, axis):
            rule = f"must be another: the array is not its own mirror image at {PLANES[axis]}"
            shape = "full" if axis == "x" else "half"
            hint = f'Set cell.shape = "{shape}", or change array.offset_um or array.count.'
            yield Breach("cell.shape", rule, scene.cell.shape, hint)


def _closest(array: Array) -> float:
    """The width at which an array's neighbours meet at their feet [µm], as these are seen from above."""
    if endless(array) or array.lattice == "square":
        return array.pitch_um
    e = array.exponent if array.profile == "square" else 2.0
    return array.pitch_um * min(1.0, (0.5**e + math.sqrt(0.75) ** e) ** (1.0 / e))


def _pillars(scene: Inputs) -> Iterator[Breach]:
    """Pillars that overlap one another, or a mirror image, or one of the array."""
    row = sorted(standing(scene), key=lambda pillar: _left(pillar.arch))
    for i, one in enumerate(row):
        right = one.arch.x_um + one.arch.half_width_um * (1 - TIE)
        for other in row[i + 1 :]:
            if _left(other.arch) >= right:
                break  # in the order of their left ends: all further ones start beyond this pillar
            of_array = isinstance(one.pillar, str) and isinstance(other.pillar, str)
            both_mirrored = one.mirrored and other.mirrored  # the originals say the same
            if not of_array and not both_mirrored and _overlap(one.arch, other.arch):
                yield _pillar_breach(scene, one, other)


def _flat(scene: Inputs) -> Iterator[Breach]:
    """A flat that rises above a pillar's foot, unless it buries the pillar deeper than a cell could sink."""
    if scene.flat is None:
        return
    level = scene.flat.y_um
    feet = {f"pillar.{i}": (pillar.y_um, pillar.height_um) for i, pillar in enumerate(scene.pillar)}
    if scene.array is not None:
        feet["the array"] = scene.array.y_um, scene.array.height_um
    for name, (foot, height) in feet.items():
        if foot + TIE * height < level < foot + height + scene.radius_um:
            rule = f"must be <= {told(foot)} µm, the foot of {name}: the two would overlap"
            hint = "Both would push a cell that touches both: raise the pillar, lower the flat, or set flat = false."
            yield Breach("flat.y_um", rule, level, hint)


def _left(arch: Upright) -> float:
    return arch.x_um - arch.half_width_um


def _overlap(a: Upright, b: Upright) -> bool:
    met = meet(a, b)
    return met is not None and met[-1] - abs(a.y_um - b.y_um) > TIE * (a.height_um + b.height_um)


def _pillar_breach(scene: Inputs, *both: Standing) -> Breach:
    """Of two that overlap: the one that is written, the later one of two."""
    one, other = sorted(both, key=lambda p: (1, "", 0) if isinstance(p.pillar, str) else (0, p.mirrored, -p.pillar))
    index, space = int(one.pillar), scene.cell.geometry == "3d"
    apart = told(one.arch.half_width_um + other.arch.half_width_um)
    hint = f"Their middles must be {apart} µm apart along x (the sum of the half-widths)."
    if space:
        hint = f"Their middles must be farther apart: the sum of the half-widths is {apart} µm."
    name = f"the {other.pillar}" if isinstance(other.pillar, str) else f"pillar.{other.pillar}"
    if other.mirrored:
        name = "its own mirror image" if one.pillar == other.pillar else f"the mirror image of {name}"
        name += f" at {PLANES[other.mirrored]}"
        mirrors = f"A {scene.cell.shape} cell mirrors its pillars."
        hint += f" {'Off the axis a pillar is a ring.' if scene.cell.geometry == 'axisymmetric' else mirrors}"
    return Breach(f"pillar.{index}.x_um", f"must not overlap {name} (µm)", scene.pillar[index].x_um, hint)
