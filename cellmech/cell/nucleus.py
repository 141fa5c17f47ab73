"""The nucleus of a scene as the mesh has it, where it is no circle or ball about the cell's centre."""

from __future__ import annotations

import numpy as np

from cellmech.mesh.nucleus_shape import NucleusShape, symmetric_part, waves_of
from cellmech.scene.scene import Scene
from cellmech.scene.sizes import nucleus_semi_axes


def nucleus_shape(scene: Scene) -> NucleusShape | None:
    """Shape and place of a nucleus that is no circle or ball about the cell's centre; None of one that is."""
    nucleus, radius = scene.nucleus, scene.nucleus_radius_um
    if nucleus is None:
        return None
    shell, free = radius - scene.outer_radius_um("nucleoplasm"), scene.outer_radius_um("cytosol")
    waves = symmetric_part(waves_of(nucleus.outline_um), range(len(scene.mirrors))) if nucleus.outline_um else ()
    return NucleusShape(radius, shell, free, scene.nucleus_offset_um, nucleus_semi_axes(scene), waves)


def outline_of_nucleus(scene: Scene, count: int = 361, axes: str = "xy") -> np.ndarray:
    """Its outline before the load, from the cell's centre [µm], shape (count, 2); of a ball its section or shadow.

    Args:
        scene: whose it is.
        count: of points, the first again at the end.
        axes: "xy", or in space "xz" for the one from above.
    """
    angle, shape = np.linspace(0.0, 2 * np.pi, count), nucleus_shape(scene)
    if shape is None:
        return scene.nucleus_radius_um * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    e, plane = np.zeros((count, len(shape.offset))), ["xyz".index(axis) for axis in axes]
    e[:, plane] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.asarray((np.array(shape.offset) + shape.reach(e)[:, None] * e)[:, plane])
