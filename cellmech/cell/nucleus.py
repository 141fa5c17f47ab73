"""The nucleus of a scene as the mesh has it, where it is no circle or ball about the cell's centre."""

from __future__ import annotations

import numpy as np

from cellmech.mesh.nucleus_shape import NucleusShape, waves_of
from cellmech.scene.scene import Scene
from cellmech.scene.sizes import semi_axes


def nucleus_shape(scene: Scene) -> NucleusShape | None:
    """Shape and place of a nucleus that is no circle or ball about the cell's centre; None of one that is."""
    nucleus, radius = scene.nucleus, scene.nucleus_radius_um
    if nucleus is None:
        return None
    shell, free = radius - scene.outer_radius_um("nucleoplasm"), scene.outer_radius_um("cytosol")
    axes = semi_axes(radius, nucleus.aspect, scene.cell.geometry != "plane")
    waves = waves_of(nucleus.outline_um) if nucleus.outline_um else ()
    return NucleusShape(radius, shell, free, scene.nucleus_offset_um, axes, waves)


def outline_of_nucleus(scene: Scene, count: int = 361) -> np.ndarray:
    """Its outline before the load, from the cell's centre, in x and y [µm], shape (count, 2); of a ball its section."""
    angle, shape = np.linspace(0.0, 2 * np.pi, count), nucleus_shape(scene)
    e = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if shape is None:
        return scene.nucleus_radius_um * e
    return np.array(shape.offset[:2]) + shape.reach(e)[:, None] * e
