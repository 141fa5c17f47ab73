"""What the cell stands on: the pillars of a scene, their mirror images, and those of its array."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

from cellmech.mechanics import obstacles
from cellmech.mechanics.pillars import RoundPillar, SquarePillar
from cellmech.scene.inputs import Inputs
from cellmech.scene.substrate_parts import Array, Pillar

Upright: TypeAlias = obstacles.Pillar | RoundPillar | SquarePillar
Shape: TypeAlias = Literal["quarter", "half", "full"]

# Half widths of the cell within which an array's pillars might be touched: a ball pressed to half its height becomes
# sqrt(2) times as wide.
FILLED = 1.5
MOST_PILLARS = 1000  # of an array: 30 along a side, a pitch of 0.9 µm below Table 1's cell
SLACK = 1e-9  # of a reach, so that rounding takes no pillar away on one side only
DIGITS = 9  # of places in a lattice [µm]: those of a symmetric one are symmetric to the last bit
MIRRORED = " mirrored"  # in the label of a mirror image, after its pillar's
IMAGES = {"": "", "x": MIRRORED, "z": f"{MIRRORED} in z", "xz": f"{MIRRORED} in x and z"}


class Standing(NamedTuple):
    """A pillar of the scene, or a mirror image of one.

    Args:
        pillar: its index, or the name of a pillar of the array: "array" with its column and row.
        mirrored: the coordinates along which it is the image: "", "x", "z" or "xz".
        arch: its shape.
    """

    pillar: int | str
    mirrored: str
    arch: Upright

    @property
    def label(self) -> str:
        """For people, one of its own."""
        return (self.pillar if isinstance(self.pillar, str) else f"pillar {self.pillar}") + IMAGES[self.mirrored]


def standing(scene: Inputs, shape: Shape | None = None) -> tuple[Standing, ...]:
    """Every pillar with its mirror images, none of one that stands on the plane of the mirror, and the array's.

    An array has no images: it goes on to the other side by itself.

    Args:
        scene: whose pillars they are.
        shape: what is to be modelled of the cell, if not what the scene says.
    """
    mirrors = scene.mirrors if shape is None else {"full": "", "half": "x", "quarter": "xz"}[shape]
    return _standing(mirrors, scene.pillar, scene.array, scene.centre_um, scene.semi_axes_um[0])


@lru_cache(maxsize=256)  # the cases of a sweep mostly share one substrate
def _standing(
    mirrors: str, pillars: tuple[Pillar, ...], array: Array | None, centre: tuple[float, ...], half_width: float
) -> tuple[Standing, ...]:
    found = []
    for index, pillar in enumerate(pillars):
        images = {"": upright(pillar)}
        for axis in mirrors:
            images |= {name + axis: mirrored(arch, axis) for name, arch in images.items() if _off(arch, axis)}
        found += [Standing(index, name, arch) for name, arch in images.items()]
    if array is not None:
        one = upright(pillar_of(array))
        for name, x, z in _lattice(array, half_width):
            arch: Upright = replace(one, x_um=centre[0] + x)
            if not isinstance(arch, obstacles.Pillar):
                arch = replace(arch, z_um=centre[-1] + z)
            found.append(Standing(name, "", arch))
    return tuple(found)


def pillar_of(array: Array) -> Pillar:
    """One pillar of an array, as a table of its own would say it, at x = z = 0."""
    keys = ("profile", "y_um", "width_um", "height_um", "exponent")
    return Pillar.model_validate({name: getattr(array, name) for name in keys})


def upright(pillar: Pillar) -> Upright:
    """The shape of a pillar, endless along z if it has no profile."""
    x, y, z, w, h, e = (getattr(pillar, n) for n in ("x_um", "y_um", "z_um", "half_width_um", "height_um", "exponent"))
    if endless(pillar):
        return obstacles.Pillar(x, y, w, h, e)
    return (SquarePillar if pillar.profile == "square" else RoundPillar)(x, y, z, w, h, e)


def endless(table: Pillar | Array) -> bool:
    """Whether its pillars are ridges: those of a plane have no profile."""
    return table.profile in (None, "ridge")


def mirrored(arch: Upright, axis: str) -> Upright:
    """Its mirror image at x = 0 or z = 0, itself where it is endless along that."""
    if axis == "x":
        return replace(arch, x_um=-arch.x_um)
    return arch if isinstance(arch, obstacles.Pillar) else replace(arch, z_um=-arch.z_um)


def _off(arch: Upright, axis: str) -> bool:
    return mirrored(arch, axis) != arch


def symmetric(arches: Iterable[Upright], axis: str) -> bool:
    """Whether shapes, taken together, are their own mirror image at x = 0 or z = 0."""
    arches = set(arches)
    return arches == {mirrored(arch, axis) for arch in arches}


def facing(scene: Inputs) -> tuple[Standing, ...]:
    """Those that the modelled part of the cell can meet.

    A body turned about its axis has no mirror image. In 3-D what lies beyond a plane of symmetry is never met; in the
    plane it is kept, as it costs little.
    """
    if scene.cell.geometry == "axisymmetric":
        return tuple(stand for stand in standing(scene) if not stand.mirrored)
    beyond = scene.mirrors if scene.cell.geometry == "3d" else ""
    return tuple(stand for stand in standing(scene) if all(_reaches_over(stand.arch, axis) for axis in beyond))


def _reaches_over(arch: Upright, axis: str) -> bool:
    """Whether any of it lies on the positive side."""
    if axis == "z" and isinstance(arch, obstacles.Pillar):
        return True
    return bool(getattr(arch, f"{axis}_um") + arch.half_width_um > 0.0)


def smallest_shape(scene: Inputs) -> Shape:
    """The least part of a cell in 3-D that makes a whole with its mirror images: what an unwritten `shape` means.

    Pillars that are written one by one count with their images at x = 0, as in the plane; an array as it is. A measured
    outline is whole only in a full cell.
    """
    array = [stand.arch for stand in standing(scene, "full") if isinstance(stand.pillar, str)]
    aside = scene.nucleus_offset_um
    measured = scene.nucleus is not None and scene.nucleus.outline_um is not None
    if measured or not symmetric(array, "x") or aside[0] != 0.0:
        return "full"
    whole = scene.cell.centre_z_um == 0.0 == aside[-1] and symmetric(
        (stand.arch for stand in standing(scene, "half")), "z"
    )
    return "quarter" if whole else "half"


def crowded(scene: Inputs) -> bool:
    """Whether an array is to fill the reach of the cell with more than `MOST_PILLARS`."""
    array = scene.array
    if array is None or array.count != "fill":
        return False
    reach = _reach(array, scene.semi_axes_um[0])
    if endless(array):
        return 2 * reach / array.pitch_um > MOST_PILLARS
    return math.pi * reach**2 / (array.pitch_um * _row_um(array)) > MOST_PILLARS


def _reach(array: Array, half_width: float) -> float:
    return FILLED * half_width + array.width_um / 2


def _row_um(array: Array) -> float:
    """Between the rows of a lattice [µm]."""
    return array.pitch_um * (math.sqrt(3) / 2 if array.lattice == "hexagonal" else 1.0)


def _lattice(array: Array, half_width: float) -> Iterator[tuple[str, float, float]]:
    """Names and places, from the cell's centre [µm], of an array's pillars; only the x of ridges means anything."""
    pitch, (x0, z0) = array.pitch_um, array.offset_um
    if endless(array):
        for i in _numbers(array, x0 / pitch, array.count, _reach(array, half_width) / pitch):
            yield f"array {i}", round(i * pitch - x0, DIGITS), 0.0
        return
    step, reach = _row_um(array), _reach(array, half_width)
    for j in _numbers(array, z0 / step, array.count, reach / step):
        between = array.lattice == "hexagonal" and j % 2 == 1
        shift, count = (0.5 if between else 0.0), array.count
        if between and isinstance(count, int):
            count = max(count - 1, 1)
        z = round(j * step - z0, DIGITS)
        for i in _numbers(array, x0 / pitch - shift, count, reach / pitch):
            x = round((i + shift) * pitch - x0, DIGITS)
            if array.count != "fill" or math.hypot(x, z) <= reach * (1 + SLACK):
                yield f"array {i},{j}", x, z


def _numbers(array: Array, middle: float, count: int | str, reach: float) -> range:
    """Whole numbers about a middle: so many, or all within reach."""
    if isinstance(count, int):
        first = math.ceil(middle - count / 2)
        return range(first, first + count)
    return range(math.ceil(middle - reach - SLACK), math.floor(middle + reach + SLACK) + 1)
