"""The Gmsh script of a disc, and the element sizes it asks for."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from cellmech.mesh.disc import DiscSpec, Footprint
from cellmech.mesh.geo_script import GeoScript, Sector
from cellmech.mesh.sizes import Zone, distance, graded_sizes, sizes_at

THIN = 0.2  # of the outer radius: a layer below it is thin
LOOSE = 1.5  # size of the elements of a thin layer without structure, over its thickness
BOTTOM, SIDE, TOP = (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)


def size_expressions(spec: DiscSpec) -> list[str]:
    """Gmsh MathEval expressions in x and y whose least is the element size [µm] in the right half of a disc."""
    x0, y0 = spec.centre
    touch = ((x0, y0 - spec.interfaces[-1][1]),) if spec.touch is None else spec.touch
    zones = [Zone(at, spec.contact_size_um, spec.contact_zone_um) for at in touch]
    return graded_sizes(spec, zones) + [_footprint_size(spec, foot) for foot in spec.footprints]


def _footprint_size(spec: DiscSpec, foot: Footprint) -> str:
    """Size that a footprint asks for: the same number of elements across it, however narrow it is."""
    x0, y0 = spec.centre
    dx, dy = foot.at
    middle, spread = sum(foot.edges) / 2, (foot.edges[1] - foot.edges[0]) / 2
    share, least = spec.grading.foot / foot.fineness, spec.least_size_um(foot)
    edge = f"abs({distance(x0 + abs(dx), y0 + dy)} - {middle:.9g}) - {spread:.9g}"
    into = f"max(0, {spec.interfaces[-1][1]:.12g} - {distance(x0, y0)})"
    return f"max({least:.9g}, {share:.9g} * ({edge})) + {spec.grading.ankle} * {into}"


def disc_script(spec: DiscSpec) -> str:
    """Gmsh script of a disc; groups are its layers, "outer", "nucleus_outline" and, for the half, "axis"."""
    return disc_sectors(spec)[0].text()


def disc_sectors(spec: DiscSpec) -> tuple[GeoScript, list[Sector]]:
    """Script of a disc and its right sector, then, in a full disc, the left one."""
    script = GeoScript(spec.centre)
    radii = sorted({radius for _, radius in spec.interfaces} | {spec.nucleus_radius_um})
    across = [0, *(_elements_across(spec, *pair) for pair in pairwise(radii))]
    sectors = [script.sector(radii, (BOTTOM, SIDE, TOP), across, solid=True)]
    if spec.shape == "full":
        sectors.append(script.sector(radii, (BOTTOM, (-1.0, 0.0), TOP), across, solid=True))
        script.mirror(*sectors)
    layers: dict[str, list[int]] = {}
    for k, radius in enumerate(radii):
        name = next(name for name, outer in spec.interfaces if radius <= outer)
        layers.setdefault(name, []).extend(number for sector in sectors for number in sector.annuli[k].surfaces)
    for name, numbers in layers.items():
        script.group(2, name, numbers)
    for name, k in (("outer", -1), ("nucleus_outline", radii.index(spec.nucleus_radius_um))):
        script.group(1, name, [arc for sector in sectors for arc in sector.arcs[k]])
    if spec.shape == "half":
        script.group(1, "axis", [*sectors[0].start, *sectors[0].end])
    loose = [pair for pair, n in zip(pairwise(radii), across[1:], strict=True) if not n]
    script.sizes(
        size_expressions(spec) + [_loose_size(spec, *pair) for pair in loose if _is_thin(spec, *pair)], spec.order
    )
    return script, sectors


def _is_thin(spec: DiscSpec, inner: float, outer: float) -> bool:
    """True if a layer would have a structure but for the footprints."""
    return bool(spec.footprints) and _elements_across(replace(spec, footprints=()), inner, outer) > 0


def _loose_size(spec: DiscSpec, inner: float, outer: float) -> str:
    """Size that an unstructured thin layer asks for, so that its triangles are not flat."""
    away = f"max(0, abs({distance(*spec.centre)} - {(inner + outer) / 2:.12g}) - {(outer - inner) / 2:.12g})"
    return f"{LOOSE * (outer - inner):.12g} + {spec.grading.growth} * {away}"


def _elements_across(spec: DiscSpec, inner: float, outer: float) -> int:
    """Elements across a structured annulus, 0 for one whose elements are small enough to need no structure.

    Nor has one structure in which a footprint asks for more elements, all around, than triangles as large as the layer
    is thick would be.
    """
    angle = np.linspace(-np.pi / 2, np.pi / 2, 361)
    middle = (inner + outer) / 2
    size = _sizes_at(spec, middle * np.cos(angle), middle * np.sin(angle))
    least = spec.thin_layers if outer - inner < THIN * spec.interfaces[-1][1] else 1
    if size.max() * least <= outer - inner:
        return 0
    across = max(least, math.ceil((outer - inner) / (spec.grading.elongation * size.min())))
    along = np.pi * outer / (LOOSE * (outer - inner))
    return (
        0 if spec.footprints and across > least and across * np.sum(np.pi / 360 * middle / size) > 2 * along else across
    )


def _sizes_at(spec: DiscSpec, dx: np.ndarray, dy: np.ndarray) -> np.ndarray:
    """Element sizes [µm] at points that lie dx, dy from the centre, in the right half."""
    return sizes_at(size_expressions(spec), spec.centre, dx, dy)


def resolves(spec: DiscSpec, foot: Footprint) -> bool:
    """True if the elements are small enough for a footprint wherever its edges may lie."""
    rim, start = spec.interfaces[-1][1], math.atan2(foot.at[1], abs(foot.at[0]))
    angle = start + np.array([side * edge / rim for edge in foot.edges for side in (-1.0, 1.0)])
    size = _sizes_at(spec, np.abs(rim * np.cos(angle)), rim * np.sin(angle))
    return bool(np.all(size <= spec.grading.foot / foot.fineness * foot.scale_um))
