"""What makes sense in one geometry only: a plane, a body turned about an axis, or space."""

from __future__ import annotations

from collections.abc import Iterator

from cellmech.scene.breach import Breach
from cellmech.scene.inputs import Inputs
from cellmech.scene.substrate import endless
from cellmech.scene.substrate_parts import Array, Pillar

SHAPES = {"plane": ("half", "full"), "axisymmetric": ("half",), "3d": ("quarter", "half", "full")}
ONLY_IN_SPACE = 'belongs to cell.geometry = "3d" only'


def of_geometry(scene: Inputs) -> Iterator[Breach]:
    """The keys that the geometry has no room for, and the places that a cell of this shape cannot have."""
    cell = scene.cell
    shapes = SHAPES[cell.geometry]
    if cell.shape not in shapes:
        words = " or ".join(f'"{shape}"' for shape in shapes)
        hint = (
            "The half disc is turned about x = 0 and makes the whole cell." if cell.geometry == "axisymmetric" else ""
        )
        yield Breach("cell.shape", f"must be {words} where cell.geometry is {cell.geometry}", cell.shape, hint)
    if cell.geometry != "plane" and cell.trace != "3d":
        rule = f'must be "3d" where cell.geometry is {cell.geometry}'
        yield Breach("cell.trace", rule, cell.trace, "It has no plane.")
    yield from _ridges(scene) if cell.geometry == "3d" else _of_space(scene)
    if cell.geometry == "axisymmetric":
        yield from _around_an_axis(scene)
    for axis, middle in zip("xz", scene.centre_um, strict=False):
        if axis in scene.mirrors and middle != 0.0:
            hint = 'Set cell.shape = "full" for a cell off the axis.'
            yield Breach(f"cell.centre_{axis}_um", f"must be 0 µm for a {cell.shape} cell", middle, hint)


def _ridges(scene: Inputs) -> Iterator[Breach]:
    """Places along z, and lattices, of pillars that are endless along it."""
    hint = "Ridges are endless along z."
    for i, pillar in enumerate(scene.pillar):
        if pillar.profile == "ridge" and pillar.z_um != 0.0:
            yield Breach(f"pillar.{i}.z_um", "must be 0 µm for a ridge", pillar.z_um, hint)
    if (array := scene.array) is not None and endless(array):
        if array.offset_um[1] != 0.0:
            yield Breach("array.offset_um.1", "must be 0 µm for ridges", array.offset_um[1], hint)
        if array.lattice != "square":
            yield Breach("array.lattice", 'must be "square" for ridges, which stand in a row', array.lattice, hint)


def _of_space(scene: Inputs) -> Iterator[Breach]:
    """Keys of 3-D in another geometry."""
    if scene.cell.centre_z_um != 0.0:
        yield Breach("cell.centre_z_um", f"{ONLY_IN_SPACE} (µm)", scene.cell.centre_z_um)
    tables: dict[str, Pillar | Array | None] = {f"pillar.{i}": pillar for i, pillar in enumerate(scene.pillar)}
    for name, table in (tables | {"array": scene.array}).items():
        if isinstance(table, Pillar) and table.z_um != 0.0:
            yield Breach(f"{name}.z_um", f"{ONLY_IN_SPACE} (µm)", table.z_um)
        if table is not None and table.profile is not None:
            shown = "a ridge" if scene.cell.geometry == "plane" else "round, or a ring"
            yield Breach(f"{name}.profile", ONLY_IN_SPACE, table.profile, f"Every pillar is {shown} here.")
    yield from _ridges(scene)


def _around_an_axis(scene: Inputs) -> Iterator[Breach]:
    if scene.array is not None:
        hint = "What is turned about an axis is round: rings, not a lattice."
        yield Breach("array", "must be left out where cell.geometry is axisymmetric", "a lattice", hint)
    for i, pillar in enumerate(scene.pillar):
        if pillar.x_um < 0.0:
            rule = "must be >= 0 µm, the radius of its ring, where cell.geometry is axisymmetric"
            yield Breach(f"pillar.{i}.x_um", rule, pillar.x_um, "0 is a round pillar on the axis.")
