"""Sizes as an experiment gives them: radii of cell and nucleus, thicknesses of shells, turned into outer radii."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cellmech.scene.breach import Breach
from cellmech.scene.inputs import Inputs
from cellmech.scene.parts import Nucleus

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
    """Sizes that are written twice, and thicknesses that leave nothing inside."""
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


def semi_axes(radius: float, aspect: float, solid: bool) -> tuple[float, float]:
    """Across and along y, of an ellipse of a circle's area, or an ellipsoid round about y of a ball's volume [µm]."""
    wide = radius * aspect ** (-1 / 3 if solid else -1 / 2)
    return wide, aspect * wide


def _radius(scene: Inputs, body: str) -> float | None:
    table = getattr(scene, body)
    return None if table is None else table.radius_um
