"""A cell, or its nucleus, that is no circle about the cell's centre: where it moves the points of a mesh of circles.

The nucleus ends at c + rho(e) e, e the unit vectors from the cell's centre: an ellipse, or a sum of waves around; in
space the waves are those of the horizontal outline, and every section above or below is a copy of it. The cell ends at
rho(e) e, an ellipse. Lamina and membrane keep their thickness along e, what is inside the lamina follows in proportion,
and between nucleus and membrane the one shift fades into the other. So a mesh of circles serves for every shape, its
layers and groups with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

WAVES = 12  # around an outline that is kept of its points
AROUND = 720  # samples of a polygon by angle
Waves = tuple[tuple[float, float], ...]  # real and imaginary parts, from the mean on [µm]


@dataclass(frozen=True)
class BodyOutline:
    """The outline of a cell or a nucleus before the load.

    Args:
        semi_axes_um: of an ellipse, or an ellipsoid round about y, across and along y [µm].
        offset: of its centre from the cell's [µm], as many coordinates as the mesh has.
        waves: of the outline's radius over the angle from x [µm], real and imaginary parts from the mean on: in the
            plane instead of an ellipse, in space instead of the ellipsoid's circle about y, as far as x and z go.
    """

    semi_axes_um: tuple[float, float]
    offset: tuple[float, ...]
    waves: Waves = ()

    def reach(self, e: np.ndarray) -> np.ndarray:
        """rho [µm] in directions e from its centre, unit vectors of shape (n, d)."""
        across: float | np.ndarray
        across, high = self.semi_axes_um
        if self.waves:
            across = radius_of(self.waves, np.arctan2(e[:, -1], e[:, 0]))
            if e.shape[1] == 2:
                return across
        return np.asarray(1 / np.sqrt((1.0 - e[:, 1] ** 2) / across**2 + e[:, 1] ** 2 / high**2))

    def beyond(self, x: np.ndarray) -> np.ndarray:
        """How far points at x from the cell's centre lie beyond the outline, along rays from its own [µm]."""
        way = x - np.array(self.offset)
        length = np.linalg.norm(way, axis=1)
        return np.asarray(length - self.reach(way / np.maximum(length, np.finfo(float).tiny)[:, None]))


@dataclass(frozen=True)
class CellShape:
    """The shapes of a cell and its nucleus.

    Args:
        radii_um: of the circles or balls that are meshed [µm]: nucleoplasm, nucleus, cytosol, cell.
        nucleus: its outline.
        cell: its own, about its centre; None for the circle.
    """

    radii_um: tuple[float, float, float, float]
    nucleus: BodyOutline
    cell: BodyOutline | None = None

    def moved(self, x: np.ndarray) -> np.ndarray:
        """Where points at x in the mesh of circles lie in the cell, from its centre [µm], shape (n, d) both."""
        nucleoplasm, nucleus, free, rim = self.radii_um
        shell = nucleus - nucleoplasm
        r = np.linalg.norm(x, axis=1)
        up = np.zeros_like(x)
        up[:, 1] = 1.0
        e = np.divide(x, r[:, None], out=up, where=r[:, None] > 0)
        rho, offset = self.nucleus.reach(e), np.array(self.nucleus.offset)
        scaled = np.where(r < nucleoplasm, (rho - shell) * r / nucleoplasm, rho - nucleus + r)
        within = offset + scaled[:, None] * e
        fades = np.clip((free - r) / (free - nucleus), 0.0, 1.0)[:, None]
        beyond = x + fades * (offset + (rho - nucleus)[:, None] * e)
        if self.cell is not None:
            beyond += (1.0 - fades) * (self.cell.reach(e) - rim)[:, None] * e
        return np.where((r <= nucleus)[:, None], within, beyond)

    def on_circle(self, offset: Sequence[float]) -> tuple[tuple[float, ...], float]:
        """Where a place of the cell's outline is in the mesh of circles, and how much longer a length along it is here.

        Args:
            offset: of the place from the cell's centre [µm]; of one outside, that is so much farther there, too.

        Returns:
            The offset there [µm]; lengths along the outline here over there [-].
        """
        if self.cell is None:
            return tuple(offset), 1.0
        rim, length, (wide, high) = self.radii_um[-1], math.hypot(*offset), self.cell.semi_axes_um
        e = np.array(offset) / length
        rho = float(self.cell.reach(e[None])[0])
        squares = [high**2 if k == 1 else wide**2 for k in range(len(offset))]
        normal = e / np.array(squares)
        cosine = float(e @ normal) / float(np.linalg.norm(normal))
        return tuple((e * length * rim / rho).tolist()), rho / (rim * cosine)


def radius_of(waves: Waves, angle: np.ndarray) -> np.ndarray:
    """An outline's radius [µm] at angles from x, shape (n,) both."""
    at, k = angle[:, None], np.arange(len(waves))
    real, imaginary = np.array(waves).T
    return np.asarray((real * np.cos(k * at) - imaginary * np.sin(k * at)).sum(axis=1))


def radius_of_polygon(points: npt.ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """`AROUND` angles from x, evenly once around, and a polygon's radius there [µm].

    It lies about (0, 0), from which each ray meets it once, but for steps as small as pixels: there the radius goes to
    and fro between them.
    """
    ends = np.array(points, dtype=float)
    steps = np.arange(8)[:, None] / 8
    dense = np.concatenate([a + steps * (b - a) for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True)])
    angle, radius = np.unwrap(np.arctan2(dense[:, 1], dense[:, 0])), np.linalg.norm(dense, axis=1)
    start, turn = angle[0], 2 * np.pi
    angle = np.where(angle < start, angle + turn, np.where(angle >= start + turn, angle - turn, angle))
    order = np.argsort(angle, kind="stable")
    angle, radius = angle[order], radius[order]
    at = start + turn * np.arange(AROUND) / AROUND
    return at, np.interp(at, np.append(angle, start + turn), np.append(radius, radius[0]))


def waves_of(points: npt.ArrayLike) -> Waves:
    """The first waves of a polygon's radius over the angle [µm] (`radius_of_polygon`)."""
    at, around = radius_of_polygon(points)
    found = np.fft.rfft(around) / AROUND * np.exp(-1j * np.arange(AROUND // 2 + 1) * at[0])
    found[1:] *= 2
    return tuple((float(w.real), float(w.imag)) for w in found[: WAVES + 1])


def symmetric_part(waves: Waves, axes: Sequence[int]) -> Waves:
    """Waves of the mean of an outline's radius and its mirror images' [µm].

    Args:
        waves: of the outline.
        axes: 0 if it is mirrored at the line where its first coordinate is 0, 1 for the second.
    """
    found = np.array([complex(*wave) for wave in waves])
    signs = {0: (-1.0) ** np.arange(len(found)), 1: np.ones(len(found))}  # angles become pi less them, or minus them
    for axis in axes:
        found = (found + signs[axis] * found.conj()) / 2
    return tuple((float(w.real), float(w.imag)) for w in found)
