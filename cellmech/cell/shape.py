"""The nucleus as a microscope measures it, on its deformed outline or surface: `nucleus_shape` of result.json."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx import fem

from cellmech.fem.curves import Moments, below, moments, ranges
from cellmech.fem.outline import Outline
from cellmech.fem.surface import Surface


def nucleus_shape(
    boundary: Outline | Surface, u: fem.Function, half: bool, turned: bool, top_um: float | None
) -> dict[str, Any]:
    """Lengths, section, and outside the plane the solid, of the whole nucleus. Collective.

    Perimeter, area and tilt are of the section: the plane's own, the one through the axis, or in space the one square
    to z through the centroid. The tilt is the angle from x to its longer principal axis; None where x = 0 mirrors the
    cell, and of a circle.

    Args:
        boundary: the nucleus's; in space it knows its mirror planes.
        u: displacement.
        half: whether an outline is half of one.
        turned: whether an outline bounds a body of revolution about x = 0.
        top_um: level of the highest pillar top in reach, if there is one [µm].

    Returns:
        `lowest_um`, `highest_um`, `height_um`, `width_um`, `aspect` (height over width), `centroid_um`, `perimeter_um`,
        `area_um2`, `tilt_deg`; `indentation_um`, the depth of the lowest point below the level, and `below_tops`, the
        share of area or volume below it, both None without one. Outside the plane `volume_um3`, `surface_um2`,
        `sphericity`, `projection_area_um2`, `projection_shape_index`; in space `depth_um`, along z.
    """
    if isinstance(boundary, Surface):
        return _in_space(boundary, u, top_um)
    x = boundary.nodes(u)
    edges = ranges(x)
    parts = [moments(x).values]
    if top_um is not None:
        parts.append(moments(below(x, top_um, *edges[..., 1])).values)
    modelled, *under = (Moments(part) for part in boundary.comm.allreduce(np.array(parts)))
    outer = [-edges[0].min(axis=0, initial=np.inf), edges[1].max(axis=0, initial=-np.inf)]
    low, high = np.max(boundary.comm.allgather(outer), axis=0) * [[-1.0], [1.0]]
    if half:
        low[0] = -high[0]
    section = modelled.mirrored if half else modelled
    shape = _lengths(low, high, top_um) | _section(section, None if half else section.tilt_deg)
    if not turned:
        share = under[0].area / modelled.area if under else None
        return shape | {"centroid_um": section.centroid.tolist(), "below_tops": share}
    surface, volume, y = modelled.turned
    share = under[0].turned[1] / volume if under else None
    solid = _solid(volume, surface, np.pi * float(high[0]) ** 2, 1.0)
    return shape | solid | {"centroid_um": [0.0, y], "below_tops": share}


def _in_space(boundary: Surface, u: fem.Function, top_um: float | None) -> dict[str, Any]:
    surface, volume, centroid = boundary.content(u)
    low, high = boundary.box(u)
    section, shadow = boundary.section_moments(u, 2, float(centroid[2])), moments(boundary.shadow(u))
    return {
        **_lengths(low, high, top_um),
        "depth_um": float(high[2] - low[2]),
        **_section(section, None if 0 in boundary.mirrored else section.tilt_deg),
        **_solid(volume, surface, shadow.area, shadow.shape_index),
        "centroid_um": centroid.tolist(),
        "below_tops": None if top_um is None else boundary.volume_below(u, top_um) / volume,
    }


def _lengths(low: np.ndarray, high: np.ndarray, top_um: float | None) -> dict[str, float | None]:
    (width, height), lowest = (high - low)[:2].tolist(), float(low[1])
    return {
        "lowest_um": lowest,
        "highest_um": float(high[1]),
        "height_um": height,
        "width_um": width,
        "aspect": height / width,
        "indentation_um": None if top_um is None else top_um - lowest,
    }


def _section(section: Moments, tilt_deg: float | None) -> dict[str, float | None]:
    return {"perimeter_um": section.length, "area_um2": section.area, "tilt_deg": tilt_deg}


def _solid(volume: float, surface: float, projection: float, index: float) -> dict[str, float]:
    """With the sphericity: the surface of the ball of this volume over the surface [-]."""
    return {
        "volume_um3": volume,
        "surface_um2": surface,
        "sphericity": float(np.cbrt(np.pi) * np.cbrt(6 * volume) ** 2 / surface),
        "projection_area_um2": projection,
        "projection_shape_index": index,
    }
