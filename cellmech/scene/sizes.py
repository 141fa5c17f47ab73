"""Sizes as an experiment gives them: radii of cell and nucleus, thicknesses of shells, turned into outer radii."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from cellmech.scene.breach import Breach
from cellmech.scene.inputs import Inputs, semi_axes
from cellmech.scene.limits import below, told
from cellmech.scene.outline_points import area_um2
from cellmech.scene.parts import LAYER_NAMES, Nucleus

SMALLEST_CELL = 1e-3  # µm: a radius below it is one in metres
THINNEST_LAYER = 1e-4  # of the cell's radius, 1 nm of Table 1's cell: thinner is no continuum, and no mesh
SHELLS = (("cell", "membrane", "cytosol"), ("nucleus", "lamina", "nucleoplasm"))  # a body, its shell, what is inside


def outer_radii(scene: Inputs) -> dict[str, Any]:
    """What changes of a scene where sizes are written: the layers, and the sizes themselves, which are done with.

    A shell keeps its thickness if its body's radius is all that is written. What is said twice stays for `of_sizes`.
    """
    if any(True for _ in of_sizes(scene)):
        return {}
    layers: dict[str, Any] = {}
    for body, shell, inside in SHELLS:
        outer, inner = getattr(scene.layer, shell), getattr(scene.layer, inside)
        radius, thickness = _radius(scene, body), outer.thickness_um
        if radius is None and thickness is None:
            continue
        usual = outer.outer_radius_um - inner.outer_radius_um
        rim = outer.outer_radius_um if radius is None else radius
        layers[shell] = outer.model_copy(update={"outer_radius_um": rim, "thickness_um": None})
        if thickness is not None or "outer_radius_um" not in inner.model_fields_set:
            within = float(f"{rim - (usual if thickness is None else thickness):.12g}")
            layers[inside] = inner.model_copy(update={"outer_radius_um": within})
    if not layers:
        return {}
    found: dict[str, Any] = {
        "layer": scene.layer.model_copy(update=layers),
        "cell": scene.cell.model_copy(update={"radius_um": None}),
    }
    if scene.nucleus is not None:
        left = scene.nucleus.model_copy(update={"radius_um": None})
        found["nucleus"] = None if left == Nucleus() else left
    return found


def of_sizes(scene: Inputs) -> Iterator[Breach]:
    """Sizes that are written in metres, or twice, and thicknesses that leave nothing inside."""
    yield from _in_metres(scene)
    for body, shell, inside in SHELLS:
        outer, inner = getattr(scene.layer, shell), getattr(scene.layer, inside)
        radius, thickness = _radius(scene, body), outer.thickness_um
        if inner.thickness_um is not None:
            key, hint = f"layer.{inside}.thickness_um", f"Set layer.{shell}.thickness_um, or outer radii."
            yield Breach(key, "must be of membrane or lamina (µm)", inner.thickness_um, hint)
        if radius is not None and "outer_radius_um" in outer.model_fields_set:
            rule = f"must not stand beside layer.{shell}.outer_radius_um (µm)"
            yield Breach(f"{body}.radius_um", rule, radius, "Write one of the two.")
        if thickness is not None and "outer_radius_um" in inner.model_fields_set:
            rule = f"must not stand beside layer.{inside}.outer_radius_um (µm)"
            yield Breach(f"layer.{shell}.thickness_um", rule, thickness, "Write one of the two.")
        rim = outer.outer_radius_um if radius is None else radius
        if thickness is not None and thickness >= rim:
            yield Breach(f"layer.{shell}.thickness_um", f"must be less than the {body}'s radius, {rim:g} µm", thickness)


def _in_metres(scene: Inputs) -> Iterator[Breach]:
    """Radii and thicknesses, as they are written, that are too small for a cell: what is derived of them says less."""
    layers = {name: getattr(scene.layer, name) for name in LAYER_NAMES}
    key, radius = "layer.membrane.outer_radius_um", scene.radius_um
    if scene.cell.radius_um is not None:
        key, radius = "cell.radius_um", scene.cell.radius_um
    if radius < SMALLEST_CELL and scene.mesh.size_um > radius:
        rule = f"is in µm, and must be >= {SMALLEST_CELL:g} µm where mesh.size_um is larger"
        yield Breach(key, rule, radius, _as_metres(radius))
    least = THINNEST_LAYER * radius
    written = {"nucleus.radius_um": _radius(scene, "nucleus")}
    written |= {f"layer.{name}.outer_radius_um": one.outer_radius_um for name, one in layers.items()}
    written |= {f"layer.{name}.thickness_um": one.thickness_um for name, one in layers.items()}
    for key, value in written.items():
        if value is not None and below(value, least):
            rule = f"is in µm, and must be >= {told(least)} µm, {THINNEST_LAYER:g} of the cell's radius"
            yield Breach(key, rule, value, _as_metres(value) if least <= 1e6 * value <= radius else "")


def _as_metres(value: float) -> str:
    micrometres = float(f"{1e6 * value:.6g}")
    return f"In metres it would be {micrometres:g} µm: write {micrometres!r}."


def nucleus_semi_axes(scene: Inputs) -> tuple[float, float]:
    """Across and along y, of the nucleus [µm]; a measured outline's in 3-D, where it is horizontal, from its area."""
    nucleus, solid = scene.nucleus or Nucleus(), scene.cell.geometry != "plane"
    if nucleus.outline_um is None:
        return semi_axes(scene.nucleus_radius_um, nucleus.aspect, solid)
    wide = math.sqrt(abs(area_um2(nucleus.outline_um)) / math.pi)
    return wide, nucleus.aspect * wide


def _radius(scene: Inputs, body: str) -> float | None:
    table = getattr(scene, body)
    return None if table is None else table.radius_um
