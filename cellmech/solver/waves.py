"""Plane waves in a strained solid: their acoustic tensors, and the direction in which the weakest runs.

Source: Ogden (1984), Non-Linear Elastic Deformations, 6.2.7.
"""

from __future__ import annotations

from typing import Any

import numpy as np

DIRECTIONS = 12  # of the first scan over half a turn
REFINEMENTS = 8  # parabolas through three directions, each on a quarter of the width before
ROUND_OFF = 1e-12  # of an eigenvalue over mu


class Waves:
    """The acoustic tensors of n points, from `moduli`, shape (13, n).

    Q(N) = Q_0 + Q_c cos 2 theta + Q_s sin 2 theta for N = (cos theta, sin theta): three times Q11, Q12, Q22.
    """

    def __init__(self, values: np.ndarray) -> None:
        along_x, along_y, between = (_acoustic(values, theta) for theta in (0.0, np.pi / 2, np.pi / 4))
        mean = (along_x + along_y) / 2
        self.q = np.stack([mean, (along_x - along_y) / 2, between - mean])

    def __getitem__(self, rows: Any) -> Waves:
        """Those of some of the points."""
        part = object.__new__(Waves)
        part.q = self.q[..., rows]
        return part

    def tensor(self, theta: Any) -> np.ndarray:
        """Q11, Q12, Q22 [-] at one angle or at one for each point [rad], shape (3, n)."""
        return self.q[0] + self.q[1] * np.cos(2 * theta) + self.q[2] * np.sin(2 * theta)

    def least(self, theta: Any) -> np.ndarray:
        """The smaller eigenvalue [-] at one angle or at one for each point [rad], shape (n,)."""
        q11, q12, q22 = self.tensor(theta)
        half = (q11 - q22) / 2
        return (q11 + q22) / 2 - np.sqrt(half * half + q12 * q12)


def _acoustic(values: np.ndarray, theta: float) -> np.ndarray:
    """Q11, Q12, Q22 at one direction, shape (3, n).

    Q = (N . S N) I + F B^T (dS/dE) B F^T, where a wave a makes (dE11, dE12, dE22) = B F^T a.
    """
    c, s = np.cos(theta), np.sin(theta)
    f11, f12, f21, f22, s11, s12, s22, h11, h12, h13, h22, h23, h33 = values
    b = np.array([[c, 0.0], [s / 2, c / 2], [0.0, s]])
    r = (h11, h12, h13), (h12, h22, h23), (h13, h23, h33)
    m11, m12, m22 = (
        sum(b[p, i] * b[q, k] * r[p][q] for p in range(3) for q in range(3) if b[p, i] * b[q, k])
        for i, k in ((0, 0), (0, 1), (1, 1))
    )
    along = c * c * s11 + c * s * s12 + s * s * s22
    return np.stack(
        [
            along + f11 * f11 * m11 + 2 * f11 * f12 * m12 + f12 * f12 * m22,
            f11 * f21 * m11 + (f11 * f22 + f12 * f21) * m12 + f12 * f22 * m22,
            along + f21 * f21 * m11 + 2 * f21 * f22 * m12 + f22 * f22 * m22,
        ]
    )


def least_over_directions(waves: Waves) -> tuple[np.ndarray, np.ndarray]:
    """The least eigenvalue over all directions [-] and the angle where it is [rad], at each point.

    A scan finds each point's valley; a parabola tells how far its bottom may lie below the lowest direction of the
    scan. Only where that could be the lowest of all points is it followed down, to the last digits.
    """
    width = np.pi / DIRECTIONS
    scan = np.stack([waves.least(width * k) for k in range(DIRECTIONS)])
    low = np.argmin(scan, axis=0)
    points = np.arange(scan.shape[1])
    least, at = scan[low, points], low * width
    drop, _ = _parabola(scan[low - 1, points], least, scan[(low + 1) % DIRECTIONS, points])
    deep = np.flatnonzero((least - 2 * drop <= np.min(least - drop)) & (drop > ROUND_OFF))
    some, value, angle = waves[deep], least[deep], at[deep]
    for _ in range(REFINEMENTS):
        _, move = _parabola(some.least(angle - width), value, some.least(angle + width))
        trial = angle + width * move
        lower = some.least(trial)
        value, angle = np.where(lower < value, [lower, trial], [value, angle])
        width /= 4
    least[deep], at[deep] = value, angle
    return least, at


def _parabola(left: np.ndarray, middle: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depth of the lowest point of a parabola below its middle, and its place, between -1 and 1."""
    bend, slope = left - 2 * middle + right, left - right
    move = np.clip(np.divide(slope, 2 * bend, out=np.zeros_like(middle), where=bend > ROUND_OFF), -1, 1)
    return slope * move / 2 - bend * move**2 / 2, move
