"""Plane waves in all directions of space through isotropic solids, in the principal axes of their strain.

W is a function of t = tr E, q = tr E^2, d = det E. In the principal axes of E, with strains e_i, stretches l_i and
stresses s_i, cof E = diag(c_i) and a wave along n, |n| = 1, the acoustic tensor is, but for the rotation of F,

    Q_ij = l_i l_j L_ij n_i n_j + delta_ij sum_k (s_k + l_i^2 D_ik) n_k^2,
    L_ij = sum_ab W_ab g_ai g_bj + W_q + W_d/2 (t - e_i - e_j),   g_t = 1, g_q = 2 e, g_d = c,
    D_ik = W_q + W_d/2 (e_i + e_k - t).

Of s_k + l_i^2 D_ik for i != k each is what a wave along k with points that move along i sees. For most laws and strains
no other wave sees less, which a condition on matrices tells, and nothing has to be searched. Elsewhere an octant of
directions is, as signs of n do not matter.

Source: Ogden (1984), Non-Linear Elastic Deformations, 6.2.7 and 6.3; the form in E is ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

AXES = 3
PAIRS = tuple(combinations(range(AXES), 2))
GRID = 6  # steps of each angle over the octant's quarter turn
AT_ONCE = 5000  # points of one search
FOLLOWED, ZOOMS = 400, 14  # points whose least direction is followed down, each time at half the distance
ROUND_OFF = 1e-12  # of an eigenvalue over mu
ROUNDING = 1e-13  # of the coupled part, which may be much larger


@dataclass(frozen=True)
class SpaceWaves:
    """The acoustic tensors of n points, over mu, in principal axes.

    Args:
        straight: s_k + l_i^2 D_ik [-], shape (3, 3, n).
        coupled: l_i l_j L_ij [-], shape (3, 3, n).
    """

    straight: np.ndarray
    coupled: np.ndarray

    @classmethod
    def of(cls, e: np.ndarray, first: np.ndarray, second: np.ndarray) -> SpaceWaves:
        """From principal strains, shape (3, n), W's derivatives by t, q, d, and those by tt, tq, td, qq, qd, dd."""
        (w_t, w_q, w_d), t, squared = first, e.sum(axis=0), 1 + 2 * e
        c = np.stack([e[1] * e[2], e[2] * e[0], e[0] * e[1]])
        s = w_t + 2 * w_q * e + w_d * c
        g = np.stack([np.ones_like(e), 2 * e, c])
        hessian = second[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
        both = e[:, None] + e[None]
        L = np.einsum("abn,ain,bjn->ijn", hessian, g, g) + w_q + w_d / 2 * (t - both)
        D = w_q + w_d / 2 * (both - t)
        stretch = np.sqrt(np.maximum(squared, 0.0))
        return cls(s[None] + squared[:, None] * D, stretch[:, None] * stretch[None] * L)

    def __getitem__(self, rows: np.ndarray) -> SpaceWaves:
        """Those of some of the points."""
        return SpaceWaves(self.straight[..., rows], self.coupled[..., rows])

    def tensor(self, n: np.ndarray) -> np.ndarray:
        """Q [-] along directions n, shape (3, m, points), or of one for each point; shape (m, points, 3, 3)."""
        Q = np.einsum("i...p,j...p,ijp->...pij", n, n, self.coupled)
        Q[..., range(AXES), range(AXES)] += np.einsum("ikp,k...p->...pi", self.straight, n * n)
        return Q

    def least(self, known: float = np.inf) -> tuple[np.ndarray, np.ndarray]:
        """The least eigenvalue [-] of each point, exact where it is the least of all, and its direction (3, n).

        Args:
            known: an eigenvalue of another point; those that cannot be below it are not searched.
        """
        across = np.where(np.eye(AXES, dtype=bool)[..., None], np.inf, self.straight).reshape(AXES * AXES, -1)
        slowest = np.argmin(across, axis=0)
        least = across[slowest, np.arange(across.shape[1])]
        direction = np.eye(AXES)[:, slowest % AXES]
        lowest, found = min(least.min(initial=np.inf), known), []
        left = np.flatnonzero(self._may_be_below(lowest - ROUND_OFF))
        while len(left):
            some, left = left[:AT_ONCE], left[AT_ONCE:]
            value, place = self[some]._on_a_grid()
            if value.min() < lowest:
                lowest = float(value.min())
                left = left[self[left]._may_be_below(lowest - ROUND_OFF)]
            first = np.argsort(value)[:FOLLOWED]
            found.append((value[first], some[first], place[:, first]))
        if found:
            value, rows, place = (np.concatenate(parts, axis=-1) for parts in zip(*found, strict=True))
            first = np.argsort(value)[:FOLLOWED]
            rows = rows[first]
            value, lower = self[rows]._followed(place[:, first])
            better = value < least[rows]
            least[rows[better]], direction[:, rows[better]] = value[better], lower[:, better]
        return least, direction

    def _may_be_below(self, level: float) -> np.ndarray:
        """False where no eigenvalue is below a level, which no straight one of i != k is; shape (n,).

        With w_i = n_i v_i, what a wave along n whose points move along v sees is over the level by
        w.M w + sum_ik T_ik v_i^2 n_k^2 >= sum_i (M_ii + T_ii) w_i^2 + 2 sum_i<k (M_ik w_i w_k + t_ik |w_i w_k|), where
        M is the coupled part, T what the straight one is over the level, t_ik^2 = T_ik T_ki. For all signs of w that is
        a matrix for w >= 0, which is copositive or not.

        Sources: Simpson and Spector, Arch. Rational Mech. Anal. 84 (1983) 55; Hadeler, Linear Algebra Appl. 49 (1983).
        """
        T, M = self.straight - level, self.coupled
        t = np.sqrt(np.maximum(T * np.swapaxes(T, 0, 1), 0.0))
        size = np.abs(M).max(axis=(0, 1), initial=0.0)
        own = np.stack([M[i, i] + T[i, i] for i in range(AXES)]) + ROUNDING * size
        g, safe = np.sqrt(np.maximum(own, 0.0)), own.min(axis=0) >= 0
        for signs in ((1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)):
            both = {(i, j): signs[i] * signs[j] * M[i, j] + t[i, j] for i, j in PAIRS}
            over = [both[i, j] + g[i] * g[j] for i, j in PAIRS]
            safe &= np.min(over, axis=0) >= 0
            together = g[0] * g[1] * g[2] + sum(both[i, j] * g[AXES - i - j] for i, j in PAIRS)
            safe &= together + np.sqrt(2 * np.maximum(np.prod(over, axis=0), 0.0)) >= 0
        return ~safe

    def _on_a_grid(self) -> tuple[np.ndarray, np.ndarray]:
        """The least eigenvalue along some directions, about, and the angles of its direction, shape (2, n)."""
        angles = np.pi / 2 / GRID * np.arange(GRID + 1)
        grid = np.array([(theta, phi) for theta in angles for phi in angles])
        found = np.stack([_about_least(self.tensor(_directions(*pair))) for pair in grid[:, :, None]])
        low = np.argmin(found, axis=0)
        return found[low, np.arange(found.shape[1])], grid[low].T

    def _followed(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The least eigenvalue down from these angles, shape (2, n), and its direction, shape (3, n)."""
        value, step = _least_eigenvalue(self.tensor(_directions(*place))), np.pi / 2 / GRID
        moves = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b]
        for _ in range(ZOOMS):
            step /= 2
            for a, b in moves:
                trial = place + step * np.array([[a], [b]])
                there = _least_eigenvalue(self.tensor(_directions(*trial)))
                lower = there < value
                value, place = np.where(lower, there, value), np.where(lower, trial, place)
        return value, _directions(*place)


def _directions(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Unit vectors at an azimuth and an elevation [rad], shape (3, n)."""
    return np.stack([np.cos(phi) * np.cos(theta), np.cos(phi) * np.sin(theta), np.sin(phi)])


def _least_eigenvalue(Q: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.eigvalsh(Q)[..., 0])


def _about_least(Q: np.ndarray) -> np.ndarray:
    """The least eigenvalue to half the digits, ten times faster: by the cosine form of the cubic's roots.

    Source: Smith (1961), Eigenvalues of a symmetric 3 x 3 matrix, Comm. ACM 4, 168.
    """
    a, b, c = (Q[:, k, k] for k in range(AXES))
    f, g, h = Q[:, 0, 1], Q[:, 0, 2], Q[:, 1, 2]
    mean = (a + b + c) / 3
    a, b, c = a - mean, b - mean, c - mean
    spread = np.sqrt((a * a + b * b + c * c + 2 * (f * f + g * g + h * h)) / 6)
    half_det = (a * (b * c - h * h) - f * (f * c - h * g) + g * (f * h - b * g)) / 2
    cosine = np.clip(half_det / np.maximum(spread**3, np.finfo(float).tiny), -1.0, 1.0)
    return np.asarray(mean + 2 * spread * np.cos(np.arccos(cosine) / 3 + 2 * np.pi / 3))
