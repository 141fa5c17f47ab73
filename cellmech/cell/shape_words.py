"""Cell and nucleus that are no circles or balls about one centre, in words: their shapes, beside what was measured."""

from __future__ import annotations

import numpy as np

from cellmech.cell.outlines import nucleus_outline
from cellmech.fem.curves import Moments, moments
from cellmech.mesh.cell_shape import WAVES, BodyOutline, radius_of, radius_of_polygon, waves_of
from cellmech.scene.scene import Scene

LOOKS = 720  # at an outline, around
PLANES = {"x": "x = 0", "xz": "x = 0 and z = 0"}


def cell_words(scene: Scene) -> str | None:
    """Size of a cell before the load that is no circle or ball; None of one that is."""
    if scene.cell.aspect == 1.0:
        return None
    (wide, high), flat = scene.semi_axes_um, scene.cell.geometry == "plane"
    content = "area" if flat else "volume"
    told = (
        f"{'an ellipse' if flat else 'an ellipsoid'}, {2 * wide:.4g} um wide and {2 * high:.4g} um high before the load"
    )
    return f"{told}, its {content} that of a {'circle' if flat else 'ball'} of {scene.radius_um:g} um in radius"


def nucleus_words(scene: Scene) -> str | None:
    """Shape and place of the nucleus, and how near they come to a measured outline; None of a circle or ball."""
    written, shape = scene.nucleus, nucleus_outline(scene)
    if written is None:
        return None
    place = ", ".join(f"{at:g}" for at in shape.offset)
    if written.outline_um is None:
        wide, high = shape.semi_axes_um
        return f"{2 * wide:.4g} um wide, {2 * high:.4g} um high, its centre at ({place}) um from the cell's"
    points = np.array(written.outline_um)
    told = f"an outline of {len(points)} points as {WAVES} waves around, its centroid at ({place}) um: "
    return told + _beside(scene, shape, points) + _distances(scene, points)


def _beside(scene: Scene, shape: BodyOutline, points: np.ndarray) -> str:
    """Sizes of the shape beside those of the points."""
    angle, space = 2 * np.pi * np.arange(LOOKS) / LOOKS, scene.cell.geometry == "3d"
    radius = radius_of(shape.waves, angle)
    found, asked = _around(radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)), _around(points)
    area = "projected area" if space else "area"
    told = f"{area} {found.area:.4g} um2 (of the points {asked.area:.4g}), "
    told += f"{'horizontal ' * space}shape index {found.shape_index:.3f} ({asked.shape_index:.3f}), "
    if scene.cell.geometry == "axisymmetric":
        turned = (_turned(angle, radius), _turned(*radius_of_polygon(points)))
        told += "volume {:.4g} um3 ({:.4g} the mean of its two halves'), ".format(*turned)
    elif space:
        high = shape.semi_axes_um[1]
        told += f"{2 * high:.4g} um high, volume {4 / 3 * high * found.area:.4g} um3, "
    return told


def _around(points: np.ndarray) -> Moments:
    return moments(np.stack([points, np.roll(points, -1, axis=0)], axis=1))


def _turned(angle: np.ndarray, radius: np.ndarray) -> float:
    """Volume [µm^3] of what a half of an outline makes, turned about x = 0, the mean of its two halves'.

    It is pi int |x| dA, that is pi/3 int rho^3 |cos| over the angles, which lie evenly.
    """
    return float(2 * np.pi**2 / 3 * np.mean(radius**3 * np.abs(np.cos(angle))))


def _distances(scene: Scene, points: np.ndarray) -> str:
    """How far the waves lie from the points, and the points from their mirror images."""
    angle, radius = radius_of_polygon(points)
    told = f"at most {np.abs(radius_of(waves_of(points), angle) - radius).max():.2g} um from the points"
    if not scene.mirrors:
        return told
    images = [angle, np.pi - angle, -angle, np.pi + angle][: 2 ** len(scene.mirrors)]
    radii = [np.interp(image, angle, radius, period=2 * np.pi) for image in images]
    told += f"; made symmetric about {PLANES[scene.mirrors]}: the mean of what was measured and its mirror images, "
    return told + f"whose radii differ by up to {np.ptp(radii, axis=0).max():.2g} um"
