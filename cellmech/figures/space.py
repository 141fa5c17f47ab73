"""Cells in space as pictures: cut open towards the viewer, with the whole nucleus, on their pillars.

Without perspective, so lengths across the line of sight are true.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import Colormap, LogNorm, Normalize

from cellmech.figures.body import INSIDE, Body, Patch
from cellmech.figures.ground import PILLAR, Ground, from_axis
from cellmech.figures.render import WINDOW, Shape, View, by_layer, look, shot, surface_of, window
from cellmech.figures.style import FADED, LAYER_COLOURS, SUBSTRATE
from cellmech.scene.scene import Scene

ELEVATION_DEG, AZIMUTH_DEG = 22.0, 45.0  # of the viewer above the horizon, and from x towards z, into the cut
AROUND = 1.45  # radii from the cell's axis to the rim of what it stands on
DEEPEST = 1.2  # radii below the cell's lowest point down to which substrate is drawn
LINE, LINE_PX = 0.004, 6.0  # of the nucleus's outline: radius, in radii of the rim, and width
LIT: dict[str, Any] = dict(ambient=0.4, diffuse=0.65)
FIELD_COLOURS = "viridis"
OUTLIERS = 1.0  # percent of the values
DECADES = 3  # of a stress that are told apart below its largest value


@dataclass(frozen=True)
class Paint:
    """How triangles are coloured: by layer, or by the values of a field.

    Args:
        norm: of the field's values; None to colour layers.
        colours: of the field.
    """

    norm: Normalize | None = None
    colours: Colormap | None = None

    def __call__(self, patch: Patch | Shape) -> np.ndarray:
        """Colours of its corners, 0 to 255, shape (n, 3, 3)."""
        if self.norm is None or self.colours is None:
            return by_layer(patch.layer)
        shade: np.ndarray = self.colours(self.norm(patch.values), bytes=True)
        return shade[..., :3]


def scale_of(values: np.ndarray, quantity: str) -> Normalize:
    """A scale for a field's values, which few at a contact or in the lamina must not set alone.

    Of a stress the decades below its largest, as layers differ a hundredfold; of others all but `OUTLIERS` at each end.
    """
    low, high = float(values.min()), float(values.max())
    if quantity.endswith("_Pa") and low >= 0.0 < high:
        return LogNorm(max(low, high / 10**DECADES), high, clip=True)
    low, high = (float(end) for end in np.percentile(values, [OUTLIERS, 100 - OUTLIERS]))
    return Normalize(low, high if high > low else low + 1.0, clip=True)


def beyond(norm: Normalize | None) -> str:
    """At which ends a scale of `scale_of` goes on, as matplotlib names it."""
    return "min" if isinstance(norm, LogNorm) else "both"


class Stage:
    """A cell on its substrate, ready to be seen from any side.

    Args:
        body: the cell.
        scene: its pillars and flat.
        paint: its colours.
    """

    def __init__(self, body: Body, scene: Scene, paint: Paint) -> None:
        self.middle = body.middle
        outside = body.surface("membrane").whole(body.mirrors)
        nucleus = body.surface("lamina").whole(body.mirrors)
        bottom = float(outside.now[..., 1].min())
        away = from_axis(outside.now, self.middle)
        self.rim = max(AROUND * scene.semi_axes_um[0], 1.1 * float(away.max()))
        self.cell = [self._opened(_surface(outside, paint))]
        self.cell += [self._face(_without_nucleus(body.section(axis)), axis, paint) for axis in "xz"]
        self.nucleus = _surface(nucleus, paint)
        self.ring = [self._line(nucleus, axis) for axis in "xz"]
        found = Ground(scene, self.middle, self.rim).surfaces(bottom - DEEPEST * scene.radius_um)
        self.ground = [(surface, SUBSTRATE if name == PILLAR else FADED) for name, surface in found]
        self.view = self._view(outside.now[..., 1], away)

    def _view(self, up: np.ndarray, away: np.ndarray) -> View:
        """What holds all of it from every azimuth [µm]: across, and up from where the axis meets y = 0."""
        tilt = np.radians(ELEVATION_DEG)
        rise, swing = up * np.cos(tilt), away * np.sin(tilt)
        floors = [surface.bounds[2] * np.cos(tilt) - self.rim * np.sin(tilt) for surface, _ in self.ground]
        low, high, margin = min([float((rise - swing).min()), *floors]), float((rise + swing).max()), 0.02 * self.rim
        return -self.rim - margin, self.rim + margin, low - margin, high + margin

    def _opened(self, surface: Any) -> Any:
        """Without the quarter of x and z beyond the middle."""
        left = surface.clip("x", origin=self.middle)
        return left.merge(surface.clip("-x", origin=self.middle).clip("z", origin=self.middle))

    def _face(self, section: Patch, axis: str, paint: Paint) -> Any:
        """The half of a section that bounds that quarter."""
        surface = surface_of(section.now)
        surface.cell_data["colour"] = paint(section).mean(axis=1).astype(np.uint8)  # clipping would blend corners
        return surface.clip("-z" if axis == "x" else "-x", origin=self.middle)

    def _line(self, nucleus: Patch, axis: str) -> Any:
        """Where the nucleus comes out of that face, thick enough to be seen on it."""
        beside = self.middle + INSIDE * self.rim * np.eye(3)["xyz".index(axis)]
        line = surface_of(nucleus.now).slice(axis, origin=beside)
        return line.clip("-z" if axis == "x" else "-x", origin=self.middle).tube(radius=LINE * self.rim)

    def image(self, width_px: int, azimuth_deg: float = AZIMUTH_DEG) -> np.ndarray:
        """What is seen from an azimuth, shape (height, width, 3), values 0 to 255."""
        os.environ.setdefault(*WINDOW)
        import pyvista

        plotter = pyvista.Plotter(off_screen=True, window_size=window(self.view, width_px))
        try:
            plotter.set_background("white")
            self._look_from(plotter, azimuth_deg)
            for surface, colour in self.ground:
                plotter.add_mesh(surface, color=colour, smooth_shading=True, render=False, **LIT)
            outside, *faces = self.cell
            coloured: dict[str, Any] = dict(scalars="colour", rgb=True, render=False)
            plotter.add_mesh(outside, smooth_shading=True, **coloured, **LIT)
            for face in faces:
                plotter.add_mesh(face, lighting=False, **coloured)
            plotter.add_mesh(self.nucleus, smooth_shading=True, **coloured, **LIT)
            for line in self.ring:
                plotter.add_mesh(line, color="black", lighting=False, render=False)
            plotter.add_silhouette(self.nucleus, color="black", line_width=LINE_PX)
            plotter.renderer.ResetCameraClippingRange()
            return shot(plotter)
        finally:
            plotter.close()

    def _look_from(self, plotter: Any, azimuth_deg: float) -> None:
        """At the view, which is measured from the point of the axis at y = 0."""
        tilt, turn = np.radians(ELEVATION_DEG), np.radians(azimuth_deg)
        toward = np.array([np.cos(tilt) * np.cos(turn), np.sin(tilt), np.cos(tilt) * np.sin(turn)])
        up = np.array([-np.sin(tilt) * np.cos(turn), np.cos(tilt), -np.sin(tilt) * np.sin(turn)])
        low, high = self.view[2:]
        focus = np.array([self.middle[0], 0.0, self.middle[2]]) + (low + high) / 2 * up
        plotter.enable_parallel_projection()
        plotter.camera.focal_point = tuple(focus)
        plotter.camera.position = tuple(focus + 10 * (high - low) * toward)
        plotter.camera.up = tuple(up)
        plotter.camera.parallel_scale = (high - low) / 2


def _without_nucleus(section: Patch) -> Patch:
    beyond = section.layer > list(LAYER_COLOURS).index("lamina")
    return Patch(section.corners[beyond], section.layer[beyond])


def _flat(patch: Patch, paint: Paint) -> Any:
    surface = surface_of(patch.now)
    surface.point_data["colour"] = look(paint(patch))["scalars"]
    return surface


def _surface(patch: Patch, paint: Paint) -> Any:
    """With normals that neighbours share, and so looks smooth."""
    return _flat(patch, paint).clean(tolerance=1e-6).compute_normals(split_vertices=False)
