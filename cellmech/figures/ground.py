"""Pillars and flat below a cell in space, as surfaces to draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cellmech.scene.scene import Scene
from cellmech.scene.substrate import Upright, standing

PILLAR, FLAT = "pillar", "flat"
GRID = 90  # points along each edge of the box in which a pillar's surface is looked for


@dataclass(frozen=True)
class Ground:
    """What a cell in space stands on, within a vertical cylinder.

    Args:
        scene: its pillars and flat.
        middle: a point of the cylinder's axis [µm], shape (3,).
        rim: its radius [µm].
    """

    scene: Scene
    middle: np.ndarray
    rim: float

    def surfaces(self, lowest: float = -np.inf) -> list[tuple[str, Any]]:
        """Each as `PILLAR` or `FLAT` and its surface above a level [µm], for pyvista; what is below it is left out.

        Args:
            lowest: the level [µm].
        """
        import pyvista

        flat = self.scene.flat
        level = flat.y_um if flat is not None and flat.y_um > lowest else None
        floor = lowest if level is None else level
        arches = [one.arch for one in standing(self.scene) if self._shown(one.arch)]
        found = [(PILLAR, self._pillar(arch, floor)) for arch in arches]
        if level is not None:
            centre = (self.middle[0], level, self.middle[2])
            found.append((FLAT, pyvista.Disc(center=centre, inner=0.0, outer=self.rim, normal=(0, 1, 0), c_res=180)))
        return [(name, surface) for name, surface in found if surface.n_points]

    def _shown(self, arch: Upright) -> bool:
        """Whether a pillar stands below the cell, or whole within the rim."""
        w, z = arch.half_width_um, getattr(arch, "z_um", self.middle[2])
        away = np.abs([arch.x_um - self.middle[0], z - self.middle[2]])
        return bool(
            np.hypot(*np.maximum(away - w, 0.0)) < self.scene.semi_axes_um[0] or np.hypot(*(away + w)) < self.rim
        )

    def _pillar(self, arch: Upright, floor: float) -> Any:
        """The surface of a pillar above a level, cut off at the rim."""
        import pyvista

        w, reach = 1.03 * arch.half_width_um, 1.03 * self.rim
        z = getattr(arch, "z_um", None)
        deep = (self.middle[2] - reach, self.middle[2] + reach) if z is None else (z - w, z + w)
        low = np.array([arch.x_um - w, max(arch.y_um, floor), deep[0]])
        high = np.array([arch.x_um + w, arch.y_um + 1.03 * arch.height_um, deep[1]])
        grid = pyvista.ImageData(dimensions=(GRID,) * 3, spacing=(high - low) / (GRID - 1), origin=low)
        places = np.asarray(grid.points)
        inside = np.minimum(arch.level_set(places.T), 1.0 - from_axis(places, self.middle) / self.rim)
        if high[1] <= low[1]:
            return pyvista.PolyData()
        surface = grid.contour([0.0], scalars=inside)
        surface.clear_data()
        return surface


def from_axis(points: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Distance of points from the vertical axis through a middle [µm]."""
    return np.hypot(points[..., 0] - middle[0], points[..., 2] - middle[2])
