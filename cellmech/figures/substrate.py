"""Pillars and flat as lines to draw (no DOLFINx)."""

from __future__ import annotations

import numpy as np

from cellmech.mechanics.obstacles import Pillar
from cellmech.scene.placement import placement
from cellmech.scene.scene import Scene
from cellmech.scene.substrate import Upright, standing

POINTS = 721


def depth_um(scene: Scene) -> float:
    """The z of the plane through the cell's centre [µm], in which it and its pillars are cut."""
    return placement(scene).centre[2] if scene.cell.geometry == "3d" else 0.0


def outline_of(pillar: Upright, z_um: float = 0.0) -> np.ndarray:
    """The closed outline of a pillar, in 3-D of its section at z [µm], shape (n, 2); empty where that misses it."""
    return np.array(pillar.outline(POINTS, z_um) or np.empty((0, 2)))


def footprints(scene: Scene, view: tuple[float, float, float, float]) -> list[np.ndarray]:
    """Outlines (x, z) of the pillars' feet that a view touches [µm], shape (n, 2) each; a ridge fills its length."""
    found = []
    for one in standing(scene):
        arch = one.arch
        if isinstance(arch, Pillar):
            x, z = arch.x_um + arch.half_width_um * np.array([-1, 1, 1, -1]), 2 * np.array(view)[[2, 2, 3, 3]]
            found.append(np.column_stack([x, z]))
        else:
            found.append(np.array(arch.foot.outline(POINTS)) + np.array([arch.x_um, arch.z_um]))
    return found


def surface_at(scene: Scene, x: np.ndarray) -> np.ndarray:
    """Height of the substrate's upper surface at x [µm]; -inf where there is none."""
    heights, z = np.full(len(x), -np.inf if scene.flat is None else scene.flat.y_um), depth_um(scene)
    for one in standing(scene):
        tops = [one.arch.top(at, z) for at in x.tolist()]
        heights = np.maximum(heights, [-np.inf if top is None else top for top in tops])
    return heights


def polygons(scene: Scene, view: tuple[float, float, float, float]) -> list[np.ndarray]:
    """Triangles that fill pillars and flat inside a view [µm], shape (n, 3, 2) each."""
    found = [fan for one in standing(scene) if len(fan := _fan(one.arch, depth_um(scene)))]
    if scene.flat is not None:
        x = np.array(view[:2])
        found.append(band(x, np.full(2, min(scene.flat.y_um, view[3])), view[2]))
    return found


def section_words(scene: Scene) -> str:
    """What figures show that draw the section of a cell in space; "" for one that is all section."""
    return f"section z = {depth_um(scene):g} µm" if scene.cell.geometry == "3d" else ""


def behind(scene: Scene) -> list[np.ndarray]:
    """Triangles that fill the middle sections of the pillars that the plane of the section misses [µm]."""
    missed = (one.arch for one in standing(scene) if not one.arch.outline(2, depth_um(scene)))
    return [_fan(arch, arch.z_um) for arch in missed if not isinstance(arch, Pillar)]


def _fan(arch: Upright, z_um: float) -> np.ndarray:
    rim = outline_of(arch, z_um)
    middle = np.broadcast_to([arch.x_um, arch.y_um], rim[1:].shape)
    return np.stack([middle, rim[:-1], rim[1:]], axis=1)


def band(x: np.ndarray, top: np.ndarray, bottom: float) -> np.ndarray:
    """Triangles between a line top(x) and a level below it [µm], shape (n, 3, 2)."""
    above, below = np.column_stack([x, np.maximum(top, bottom)]), np.column_stack([x, np.full(len(x), bottom)])
    return np.concatenate(
        [
            np.stack([below[:-1], below[1:], above[:-1]], axis=1),
            np.stack([below[1:], above[1:], above[:-1]], axis=1),
        ]
    )
