"""Field files to pictures: pyvista draws the layers off-screen, in the paper's colours and to scale.

The only module that draws with VTK. Without EGL, VTK crashes the process instead of raising, so `probe` tries it in
another process first.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cellmech.errors import CellmechError, InputError
from cellmech.figures.style import LAYER_COLOURS, SUBSTRATE
from cellmech.results.result import read_grid

SUBDIVISIONS = 4  # of an element's edge, so that curved edges look curved
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
    """

    reference: np.ndarray
    displacement: np.ndarray
    layer: np.ndarray

    def moved(self, pivot: np.ndarray, magnify: float = 1.0) -> np.ndarray:
        """Corners with displacements about the pivot's magnified: X + p + N (u - p)."""
        return self.reference + pivot + magnify * (self.displacement - pivot)


def read_shape(path: Path, half: bool) -> Shape:
    """Read a field file; a half cell is completed by its mirror image at x = 0.

    Raises:
        InputError: for a file that is broken or has other content.
    """
    try:
        grid = read_grid(path)
        cells = np.concatenate([nodes for _, nodes in sorted(grid.cells_dict.items())])
        points, moved = np.asarray(grid.points)[:, :2], np.asarray(grid.point_data["displacement_um"])[:, :2]
        layer = np.asarray(grid.cell_data["layer"])
        if not np.all(np.isfinite(moved)) or cells.shape[1] not in (3, 6) or len(cells) != len(layer):
            raise ValueError("its cells or displacements are not those of a cell")
    except (AttributeError, KeyError, ValueError, OSError, UserWarning) as error:
        raise InputError(str(path), "", f"is no field file of this program ({_brief(error)})") from None
    corners = _subdivide(np.stack([points[cells], moved[cells]]), SUBDIVISIONS if cells.shape[1] == 6 else 1)
    layer = np.repeat(layer, corners.shape[1] // len(cells))
    if half:
        mirrored = corners[:, :, ::-1] * np.array([-1.0, 1.0])  # corners reversed: the triangles stay counter-clockwise
        corners, layer = np.concatenate([corners, mirrored], axis=1), np.concatenate([layer, layer])
    return Shape(corners[0], corners[1], layer)


def _brief(error: Exception) -> str:
    return " ".join(str(error).split())[:120]


def _subdivide(values: np.ndarray, n: int) -> np.ndarray:
    """Values at the corners of n² flat triangles per element, (2, cells, nodes, 2) -> (2, cells n², 3, 2)."""
    number = {(i, j): k for k, (i, j) in enumerate((i, j) for j in range(n + 1) for i in range(n + 1 - j))}
    up = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in number if i + j < n]
    down = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in number if i + j < n - 1]
    triangles = np.array([[number[corner] for corner in three] for three in up + down])
    r, s = (np.array(list(number)) / n).T
    t = 1 - r - s
    shape = (
        [t, r, s]
        if values.shape[2] == 3
        else [
            t * (2 * t - 1),
            r * (2 * r - 1),
            s * (2 * s - 1),
            4 * t * r,
            4 * r * s,
            4 * s * t,
        ]
    )  # VTK's order of nodes: corners, then the middles of edges 01, 12, 20
    found = np.einsum("kp,xekc->xepc", np.array(shape), values)[:, :, triangles]
    return found.reshape(2, -1, 3, 2)


def picture(
    corners: np.ndarray,
    layer: np.ndarray,
    ground: Sequence[np.ndarray],
    view: View,
    width_px: int,
    ground_colour: str = SUBSTRATE,
) -> np.ndarray:
    """An image of the cell on its substrate on white, shape (height, width, 3), values 0 to 255.

    Args:
        corners: of the cell's triangles [µm], shape (n, 3, 2).
        layer: code of each triangle's layer, shape (n,).
        ground: triangles of the substrate [µm], shape (m, 3, 2) each.
        view: what is shown [µm].
        width_px: width of the image; the height follows from the view.
        ground_colour: of the substrate.
    """
    os.environ.setdefault(*WINDOW)
    import pyvista

    x0, x1, y0, y1 = view
    size = (width_px * OVERSAMPLING, round(width_px * (y1 - y0) / (x1 - x0)) * OVERSAMPLING)
    plotter = pyvista.Plotter(off_screen=True, window_size=size)
    try:
        plotter.set_background("white")
        for triangles in ground:
            _add(plotter, triangles, ground_colour, -1.0)
        for code, colour in enumerate(LAYER_COLOURS.values()):
            _add(plotter, corners[layer == code], colour, 0.0)
        _look_at(plotter, view)
        image = plotter.screenshot(return_img=True)
    finally:
        plotter.close()
    steps = [image[i::OVERSAMPLING, j::OVERSAMPLING, :3] for i in range(OVERSAMPLING) for j in range(OVERSAMPLING)]
    return (sum(step.astype(np.uint16) for step in steps) // len(steps)).astype(np.uint8)


def _look_at(plotter: Any, view: View) -> None:
    """Look along −z at exactly this view, without perspective."""
    x0, x1, y0, y1 = view
    plotter.enable_parallel_projection()
    plotter.camera.focal_point = ((x0 + x1) / 2, (y0 + y1) / 2, 0.0)
    plotter.camera.position = ((x0 + x1) / 2, (y0 + y1) / 2, 10.0 * (y1 - y0))
    plotter.camera.up = (0.0, 1.0, 0.0)
    plotter.camera.parallel_scale = (y1 - y0) / 2
    plotter.renderer.ResetCameraClippingRange()


def _add(plotter: Any, triangles: np.ndarray, colour: str, z: float) -> None:
    import pyvista

    if len(triangles):
        points = np.column_stack([triangles.reshape(-1, 2), np.full(3 * len(triangles), z)])
        faces = np.column_stack([np.full(len(triangles), 3), np.arange(len(points)).reshape(-1, 3)])
        plotter.add_mesh(pyvista.PolyData(points, faces.ravel()), color=colour, lighting=False, render=False)
