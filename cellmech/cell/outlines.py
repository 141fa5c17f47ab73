"""Cell and nucleus of a scene as the mesh has them, where they are no circles or balls about the cell's centre."""

from __future__ import annotations

import numpy as np

from cellmech.mesh.cell_shape import BodyOutline, CellShape, symmetric_part, waves_of
from cellmech.scene.parts import LAYER_NAMES
from cellmech.scene.scene import Scene
from cellmech.scene.sizes import nucleus_semi_axes


def cell_shape(scene: Scene) -> CellShape | None:
    """Shapes of cell and nucleus, and the nucleus's place; None of circles or balls about one centre."""
    if scene.nucleus is None and scene.cell.aspect == 1.0:
        return None
    nucleoplasm, lamina, cytosol, membrane = (scene.outer_radius_um(name) for name in reversed(LAYER_NAMES))
    cell = None if scene.cell.aspect == 1.0 else cell_outline(scene)
    return CellShape((nucleoplasm, lamina, cytosol, membrane), nucleus_outline(scene), cell)


def nucleus_outline(scene: Scene) -> BodyOutline:
    """Shape and place of the nucleus."""
    points = scene.nucleus.outline_um if scene.nucleus is not None else None
    waves = symmetric_part(waves_of(points), range(len(scene.mirrors))) if points else ()
    return BodyOutline(nucleus_semi_axes(scene), scene.nucleus_offset_um, waves)


def cell_outline(scene: Scene) -> BodyOutline:
    """Shape of the cell."""
    return BodyOutline(scene.semi_axes_um, (0.0,) * (3 if scene.cell.geometry == "3d" else 2))


def points_of(outline: BodyOutline, angles_deg: tuple[float, float] = (0.0, 360.0), axes: str = "xy") -> np.ndarray:
    """An outline before the load, from the cell's centre [µm], shape (361, 2); of a ball its section or shadow.

    Args:
        outline: of the cell or its nucleus.
        angles_deg: between which they lie, from x, about the outline's own centre.
        axes: "xy", or in space "xz" for the outline from above.
    """
    first, last = angles_deg
    angle = np.radians(np.linspace(first, last, 361))
    e, plane = np.zeros((len(angle), len(outline.offset))), ["xyz".index(axis) for axis in axes]
    e[:, plane] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.asarray((np.array(outline.offset) + outline.reach(e)[:, None] * e)[:, plane])
