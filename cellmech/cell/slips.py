"""Likely slips in a scene that breaks no rule: told by --check, and not of the result."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from pydantic import BaseModel

from cellmech.cell.footing import feet
from cellmech.cell.outlines import nucleus_outline, points_of
from cellmech.cell.placed import Placed
from cellmech.mechanics.obstacles import Pillar
from cellmech.scene.parts import LAYER_NAMES
from cellmech.scene.scene import Scene
from cellmech.scene.substrate import standing

USUAL_MEDIUM = 950.0  # kg/m3 beside the default cell's 1,000: what is heavier by a twentieth, as cells are in culture
METRES = 2e-4  # a length below it may be one in metres: 200 µm
LEAST_PA = {"lamina": 10.0, "membrane": 1.0, "cytosol": 1.0, "nucleoplasm": 1.0}  # a modulus below may be one in kPa
HIGH_UM = 3.0  # above the pillar tops: a nucleus that starts higher is not indented by them soon
SHALLOW = 0.1  # of the membrane: a penetration beyond it is no longer that of a hard obstacle
CLOSE = 0.2  # of a pillar's width: neighbours closer than that may have their width for half of it


def slips(placed: Placed) -> dict[str, str]:
    """What its author may not have meant, by what it is about.

    Args:
        placed: the scene and its cell in its place.
    """
    scene = placed.scene
    parts = (
        _weight(placed),
        _height(placed),
        _penetration(placed),
        _metres(scene),
        _kilopascals(scene),
        _widths(scene),
    )
    return {name: text for part in parts for name, text in part}


def _weight(placed: Placed) -> Iterator[tuple[str, str]]:
    cell = placed.scene.cell
    if placed.weight > 0 and not cell.medium_density_kg_m3:
        told = "cell.medium_density_kg_m3 is 0, so the cell has its whole weight, as the paper's has"
        if (left := cell.density_kg_m3 - USUAL_MEDIUM) > 0:
            told += f"; in medium of {USUAL_MEDIUM:g} kg/m3 it would have {100 * left / cell.density_kg_m3:.2g} % of it"
        yield "weight", told


def _height(placed: Placed) -> Iterator[tuple[str, str]]:
    """The nucleus beside the tops of the pillars below the cell."""
    scene, (x, y, *_) = placed.scene, placed.centre
    tops = [
        s.arch.y_um + s.arch.height_um
        for s in standing(scene)
        if abs(s.arch.x_um - x) < scene.semi_axes_um[0] + s.arch.half_width_um
    ]
    above = y + float(points_of(nucleus_outline(scene))[:, 1].min()) - max(tops, default=math.inf)
    if above > HIGH_UM:
        yield "nucleus", f"it starts {above:.3g} um above the pillar tops, which reach it only through what is between"


def expected_depth_um(placed: Placed) -> float:
    """How deep the cell's weight pushes it into an obstacle, as Hertz's pressure has it, 0 where not known [µm]."""
    scene = placed.scene
    found = feet(scene, placed.weight, placed.contact.pressure_at) if scene.cell.geometry != "3d" else ()
    n = sum(scene.copies if foot.at[0] + placed.centre[0] > 0.0 else 1 for foot in found)
    deepest = 0.0
    for foot in found:
        half_width = math.sqrt(foot.edges[0] * foot.edges[1])
        if scene.cell.geometry == "plane":
            largest = 2.0 * placed.weight / n / (math.pi * half_width)
        elif foot.at[0] == 0.0:
            largest = 1.5 * placed.weight / n / (math.pi * half_width**2)
        else:
            largest = 2.0 * placed.weight / n / (2.0 * math.pi * abs(foot.at[0])) / (math.pi * half_width)
        deepest = max(deepest, largest / scene.contact.penalty_Pa_per_um)
    return deepest


def _penetration(placed: Placed) -> Iterator[tuple[str, str]]:
    scene = placed.scene
    membrane = scene.outer_radius_um("membrane") - scene.inner_radius_um("membrane")
    if scene.contact.on_surface and (depth := expected_depth_um(placed)) > SHALLOW * membrane:
        raised = scene.contact.penalty_Pa_per_um * depth / (SHALLOW * membrane)
        yield (
            "penetration",
            f"the weight is expected to push the cell about {depth:.2g} um into an obstacle, more than a tenth of the "
            f"membrane, {membrane:g} um: contact.penalty_Pa_per_um from about {raised:.2g} on keeps it out",
        )


def _written(table: BaseModel, start: str = "") -> Iterator[tuple[str, float]]:
    """The numbers that a scene has written, by dotted key."""
    for name in table.model_fields_set:
        value = getattr(table, name)
        for key, one in enumerate(value) if isinstance(value, tuple) else (("", value),):
            dotted = f"{start}{name}" + (f".{key}" if isinstance(value, tuple) else "")
            if isinstance(one, BaseModel):
                yield from _written(one, f"{dotted}.")
            elif isinstance(one, float):
                yield dotted, one


def _metres(scene: Scene) -> Iterator[tuple[str, str]]:
    for key, value in sorted(_written(scene)):
        of_place = key.split(".")[0] in ("cell", "layer", "pillar", "array", "flat") and "_um" in key
        if of_place and 0.0 < abs(value) < METRES:
            yield key, f"{value:g} um is {1e3 * value:.3g} nm: in metres it would be {1e6 * value:g} um"


def _kilopascals(scene: Scene) -> Iterator[tuple[str, str]]:
    for name in LAYER_NAMES:
        young = scene.layer_young_Pa(name)
        if young < LEAST_PA[name] and "young_Pa" in scene.layer_of(name).model_fields_set:
            key = f"layer.{name}.young_Pa"
            yield key, f"{young:g} Pa is very soft: in kPa it would be {1e3 * young:g} Pa"


def _widths(scene: Scene) -> Iterator[tuple[str, str]]:
    """Pillars written one by one that all but touch their neighbours."""
    row = sorted((s for s in standing(scene) if isinstance(s.pillar, int)), key=lambda s: s.arch.x_um)
    for one, other in pairwise(row):
        if not (isinstance(one.arch, Pillar) and isinstance(other.arch, Pillar)):
            continue
        widest = max((one, other), key=lambda s: s.arch.half_width_um)
        width = 2.0 * widest.arch.half_width_um
        gap = other.arch.x_um - one.arch.x_um - one.arch.half_width_um - other.arch.half_width_um
        if gap < CLOSE * width:
            told = f"{width / 2:g} um is half of its width; between it and its neighbour are {max(gap, 0):.3g} um"
            yield f"pillar.{widest.pillar}.half_width_um", f"{told}. If it is the whole width, write width_um"
