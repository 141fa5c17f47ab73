"""A nucleus that is no circle about the cell's centre: where it moves the points of a mesh that has it as one.

The nucleus's outline becomes c + rho(e) e, e the unit vectors from the cell's centre: an ellipse, or a sum of waves
around; in space the waves are those of the horizontal outline, and every section above or below is a copy of it.
The lamina keeps its thickness along e, what is inside follows in proportion, and from the outline to the membrane the
shift fades to nothing. So a mesh of circles serves for every shape, its layers and groups with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

WAVES = 12  # around an outline that is kept of its points
AROUND = 720  # samples of a polygon by angle
Waves = tuple[tuple[float, float], ...]  # real and imaginary parts, from the mean on [µm]


@dataclass(frozen=True)
class NucleusShape:
    """A nucleus's shape and place.

    Args:
        radius_um: of the circle or ball that is meshed [µm].
        shell_um: thickness of its lamina [µm].
        free_um: distance from the cell's centre at which nothing moves any more [µm].
        offset: of its centre from the cell's [µm], as many coordinates as the mesh has.
        semi_axes_um: of an ellipse, or an ellipsoid round about y, across and along y [µm].
        waves: of the outline's radius over the angle from x [µm], real and imaginary parts from the mean on: in the
            plane instead of an ellipse, in space instead of the ellipsoid's circle about y, as far as x and z go.
    """

    radius_um: float
    shell_um: float
    free_um: float
    offset: tuple[float, ...]
    semi_axes_um: tuple[float, float]
    waves: Waves = ()

    def reach(self, e: np.ndarray) -> np.ndarray:
        """rho [µm] in directions e from the nucleus's centre, unit vectors of shape (n, d)."""
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

    def moved(self, x: np.ndarray) -> np.ndarray:
        """Where points at x in the mesh of circles lie in the cell, from its centre [µm], shape (n, d) both."""
        r = np.linalg.norm(x, axis=1)
        up = np.zeros_like(x)
        up[:, 1] = 1.0
        e = np.divide(x, r[:, None], out=up, where=r[:, None] > 0)
        rho, inner = self.reach(e), self.radius_um - self.shell_um
        scaled = np.where(r < inner, (rho - self.shell_um) * r / inner, rho - self.radius_um + r)
        within = np.array(self.offset) + scaled[:, None] * e
        fades = np.clip((self.free_um - r) / (self.free_um - self.radius_um), 0.0, 1.0)[:, None]
        beyond = x + fades * (np.array(self.offset) + (rho - self.radius_um)[:, None] * e)
        return np.where((r <= self.radius_um)[:, None], within, beyond)


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
