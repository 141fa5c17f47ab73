"""Figure 7's words below each cell: roundness of the nucleus, and distance of the pillar."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cellmech.cell.outlines import nucleus_outline, points_of
from cellmech.results.result import Result
from cellmech.scene.placement import placement
from cellmech.scene.substrate import standing

OUTLINES = (  # what a shape index may be taken of: key, name, its value for a circle
    ("full", "full outline", 1.0),
    ("half_outline", "half outline", 2 * math.pi**2 / (math.pi + 2) ** 2),
    ("half_area_full_perimeter", "half area, full perimeter", 0.5),
)


def nucleus_lines(case: Result, paper: Mapping[str, Any]) -> list[str]:
    """Shape index in its three readings beside the printed one, and the lamina's distance from the pillar.

    Args:
        case: whose end is meant.
        paper: the printed numbers by case, as `[table3]` of paper_numbers.toml.
    """
    theirs = (paper.get(case.name) or {}).get("SI")
    lines = ["Shape index of the nucleus" + (f"  (paper: {theirs:g}, outline not stated)" if theirs else "")]
    for key, name, circle in OUTLINES:
        lines.append(f"    {name}: {_shown(case.get(f'shape_index.{key}'), '.4f')}   ({circle:.4g} for a circle)")
    distance = _shown(case.get("lamina_pillar_distance_um"), ".3f")
    lines.append(f"Lamina to pillar: {distance} µm   ({start_um(case):.3f} µm at the start)")
    nearest = _shown(case.get("nucleus_obstacle_distance_um"), ".3f")
    lines.append(f"Nucleus to the nearest obstacle{nearest_words(case)}: {nearest} µm")
    return lines


def nearest_words(case: Result) -> str:
    """The obstacle that is nearest to the nucleus, after a comma; "" without one."""
    name = case.result.get("nucleus_obstacle")
    return f", {name}" if name else ""


def start_um(case: Result) -> float:
    """The lamina's distance from the pillar below it before the load acts [µm]; NaN without one."""
    x, y, *z = placement(case.scene).centre
    tops = [top for stand in standing(case.scene) if (top := stand.arch.top(x, *z)) is not None]
    lowest = float(points_of(nucleus_outline(case.scene))[:, 1].min())
    return y + lowest - max(tops) if tops else math.nan


def _shown(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "–"
