"""The normal law of a scene's obstacles as one curve: pull across the gap, push where the surface is pressed in."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from cellmech.figures.style import SMALL
from cellmech.mechanics.normal_law import pull_at, push_at
from cellmech.scene.scene import Scene

POINTS = 1001
BEYOND = 1.25  # of the range is drawn


def draw_contact_law(scene: Scene) -> Figure:
    """Pressure on the surface [Pa] over the gap [µm]; positive pushes the cell off, negative pulls it."""
    settings, adhesion = scene.contact, scene.adhesion
    kappa, width = settings.penalty_Pa_per_um, getattr(settings, settings.width_key)
    figure = Figure(figsize=(7.0, 4.6))
    axes = figure.add_axes((0.12, 0.13, 0.84, 0.72))
    reach, deepest, told, work, length = 5 * width, -2 * width, "nothing adheres", 0.0, 1.0
    if adhesion is not None:
        work, length = adhesion.work_uJ_m2, adhesion.range_um
        reach, deepest = BEYOND * length, -pull_at(-length / 2, work, length) / kappa
        told = f"work of adhesion {work:g} µJ/m² (shaded), range {length:g} µm"
    gap = np.linspace(deepest, reach, POINTS)
    push = np.array([push_at(-g, kappa, width, settings.on_surface) for g in gap])
    pulled = np.array([pull_at(-g, work, length) for g in gap])
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.axvline(0.0, color="0.6", linewidth=0.8)
    axes.plot(gap, push - pulled, color="0.1", linewidth=1.6)
    axes.fill_between(gap, -pulled, 0.0, where=gap >= 0, color="tab:blue", alpha=0.25, linewidth=0)
    axes.set_xlabel("gap between cell and obstacle [µm]; negative: penetration")
    axes.set_ylabel("pressure on the cell [Pa]; negative: pull")
    axes.set_title(f"Normal law: penalty {kappa:g} Pa/µm\n{told}", fontsize=SMALL + 2, loc="left")
    return figure
