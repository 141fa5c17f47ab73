"""Flat triangles as pictures, to scale: in the plane by matplotlib's rasteriser, in space by pyvista off-screen.

Without EGL, VTK crashes the process instead of raising, so `probe` tries it in another process first.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.colors import to_rgba
from matplotlib.transforms import Affine2D

from cellmech.errors import CellmechError
from cellmech.figures.body import START, SUBDIVISIONS, read_body
from cellmech.figures.style import LAYER_COLOURS
from cellmech.scene.scene import Scene

OVERSAMPLING = 2
WINDOW = ("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # no X server is looked for; the user's setting counts
PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True)
plotter.add_mesh(pyvista.Sphere(), color="black")
assert plotter.screenshot(return_img=True).min() < 128, "the picture is empty"
"""
PROBE_SECONDS = 120
View = tuple[float, float, float, float]  # x and y limits [µm]
Colour: TypeAlias = str | np.ndarray  # of all, or of triangles' corners, 0 to 255, shape (n, 3, 3)


def probe() -> None:
    """Make sure that drawing works here.

    Raises:
        CellmechError: when it does not; the text says what to install.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-c", PROBE],
            env={WINDOW[0]: WINDOW[1]} | os.environ,
            capture_output=True,
            text=True,
            timeout=PROBE_SECONDS,
        )
        if done.returncode == 0:
            return
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        why = f"VTK crashed, signal {-done.returncode}" if done.returncode < 0 else last
    except subprocess.TimeoutExpired:
        why = f"no picture within {PROBE_SECONDS} s"
    raise CellmechError(
        f"pyvista cannot draw off-screen here ({why[:200]}). "
        "Install EGL: apt-get install --no-install-recommends libegl1"
    )


@dataclass(frozen=True)
class Shape:
    """A cell as flat triangles.

    Args:
        reference: corners at the start [µm], shape (n, 3, 2).
        displacement: of the corners [µm], shape (n, 3, 2).
        layer: code of each triangle's layer, shape (n,).
        values: of a field at the corners, shape (n, 3).
    """

    reference: np.ndarray
    displacement: np.ndarray
    layer: np.ndarray
    values: np.ndarray

    def moved(self, pivot: np.ndarray, magnify: float = 1.0) -> np.ndarray:
        """Corners with displacements about the pivot's magnified: X + p + N (u - p)."""
        return self.reference + pivot + magnify * (self.displacement - pivot)


def read_shape(path: Path, scene: Scene, quantity: str | None = None, pieces: int = SUBDIVISIONS) -> Shape:
    """Read a field file: the whole cell, of one in space the section that lay in the plane of its centre, z = const.

    Args:
        path: of the file.
        scene: of the case.
        quantity: a scalar of the file.
        pieces: as a `Body` has them.

    Raises:
        InputError: for a file that is broken or has other content, or for a scalar that is not there.
    """
    section = read_body(path, scene, quantity, pieces).section(part=START)
    return Shape(section.start[..., :2], (section.now - section.start)[..., :2], section.layer, section.values)


def by_layer(layer: np.ndarray) -> np.ndarray:
    """The layers' colours at the corners of triangles, 0 to 255; shape (n, 3, 3).

    Args:
        layer: code of each triangle's layer, shape (n,).
    """
    palette = np.array([[int(colour[i : i + 2], 16) for i in (1, 3, 5)] for colour in LAYER_COLOURS.values()])
    return np.repeat(palette[layer, None].astype(np.uint8), 3, axis=1)


def picture(parts: Sequence[tuple[np.ndarray, Colour]], view: View, width_px: int) -> np.ndarray:
    """An image of flat triangles on white, shape (height, width, 3), values 0 to 255.

    Args:
        parts: corners of triangles [µm], shape (n, 3, 2), and their colour; each lies above those before it.
        view: what is shown [µm].
        width_px: width of the image; the height follows from the view.
    """
    width, height = window(view, width_px)
    canvas = RendererAgg(width, height, 72)
    to_pixels = (
        Affine2D().translate(-view[0], -view[2]).scale(width / (view[1] - view[0]), height / (view[3] - view[2]))
    )
    x0, x1, y0, y1 = view
    paper = np.array([[(x0, y0), (x1, y0), (x1, y1)], [(x0, y0), (x1, y1), (x0, y1)]])
    for triangles, colour in [(paper, "white"), *parts]:
        if len(triangles):
            corners = np.ascontiguousarray(triangles, dtype=float)
            canvas.draw_gouraud_triangles(canvas.new_gc(), corners, _opaque(colour, len(triangles)), to_pixels)
    return _averaged(np.asarray(canvas.buffer_rgba())[..., :3])


def _opaque(colour: Colour, count: int) -> np.ndarray:
    """Colours of triangles' corners as shares of 1 with their opacity, shape (count, 3, 4)."""
    if isinstance(colour, str):
        return np.broadcast_to(to_rgba(colour), (count, 3, 4))
    return np.concatenate([colour / 255.0, np.ones((count, 3, 1))], axis=-1)


def window(view: View, width_px: int) -> tuple[int, int]:
    """Width and height of the window of a picture [px], which is drawn larger than it is given."""
    x0, x1, y0, y1 = view
    return width_px * OVERSAMPLING, round(width_px * (y1 - y0) / (x1 - x0)) * OVERSAMPLING


def shot(plotter: Any) -> np.ndarray:
    """What a plotter shows, averaged to the size that is given; shape (height, width, 3)."""
    return _averaged(plotter.screenshot(return_img=True)[..., :3])


def _averaged(image: np.ndarray) -> np.ndarray:
    total = np.zeros((image.shape[0] // OVERSAMPLING, image.shape[1] // OVERSAMPLING, 3), dtype=np.uint16)
    for i in range(OVERSAMPLING):
        for j in range(OVERSAMPLING):
            total += image[i::OVERSAMPLING, j::OVERSAMPLING]
    return (total // OVERSAMPLING**2).astype(np.uint8)


def look(colour: Colour) -> dict[str, Any]:
    """A colour, or the colours of triangles' corners, as pyvista takes them."""
    if isinstance(colour, str):
        return {"color": colour}
    return {"scalars": colour.reshape(-1, 3), "rgb": True}


def surface_of(corners: np.ndarray) -> Any:
    """Triangles as a pyvista surface, each with corners of its own; they have shape (n, 3, 3)."""
    import pyvista

    faces = np.column_stack([np.full(len(corners), 3), np.arange(3 * len(corners)).reshape(-1, 3)])
    return pyvista.PolyData(corners.reshape(-1, 3), faces.ravel())
