"""Variable-step BDF2: coefficients, local error, step control. No finite elements here.

Hairer, Norsett & Wanner, Solving ODEs I, III.5 (variable-step BDF) and II.4 (step control).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


def coefficients(steps: Sequence[float]) -> tuple[float, float, float]:
    """(a0, a1, a2) [1/s] with du/dt at t = a0 u(t) + a1 u(t - h) + a2 u(t - h - h_n).

    Args:
        steps: step sizes [s], the current one first; a single one gives BDF1 (a2 = 0).
    """
    h = steps[0]
    if len(steps) == 1:
        return 1 / h, -1 / h, 0.0
    omega = h / steps[1]
    return (1 + 2 * omega) / (1 + omega) / h, -(1 + omega) / h, omega**2 / (1 + omega) / h


def extrapolation(steps: Sequence[float]) -> np.ndarray:
    """Weights that extrapolate values at earlier times to the current one by the polynomial through them.

    Args:
        steps: step sizes [s], the current one first; value k was taken sum(steps[:k + 1]) before now.
    """
    ages = np.cumsum(steps)
    others = [np.delete(ages, k) for k in range(len(ages))]
    return np.array([np.prod(other / (other - age)) for age, other in zip(ages, others, strict=True)])


def error_factor(steps: Sequence[float]) -> float:
    """Local error of the step over (solution - `extrapolation`), Milne's device.

    With at least three steps: BDF2 against the quadratic predictor (2/11 at equal steps). With one or two there is
    no third difference yet; the lower-order comparison (backward Euler, or the linear predictor) is returned, which
    overestimates.
    """
    if len(steps) == 1:
        return 0.5
    # the derivative formula errs by u'''/6 h (h + h_n), the solution by 1/a0 of that, the predictor by ages[2] of it
    a0 = coefficients(steps[:2])[0]
    return float((1 / a0) / (np.cumsum(steps)[-1] + 1 / a0))


@dataclass(frozen=True)
class Controller:
    """Elementary step control for a method of order 2.

    Args:
        rtol: tolerated local error of a step, relative [-].
        safety: aimed-at share of rtol.
        shrink, grow: limits of the ratio of neighbouring steps; BDF2 is zero-stable up to 1 + sqrt 2.
    """

    rtol: float
    safety: float = 0.9
    shrink: float = 0.2
    grow: float = 2.2

    def accepts(self, error: float) -> bool:
        """True if a step with this relative error [-] stands."""
        return error <= self.rtol

    def factor(self, error: float) -> float:
        """Next step over this one [-], rounded so that round-off, as of other ranks, leaves the steps alone."""
        if error <= 0:
            return self.grow
        return round(float(np.clip(self.safety * (self.rtol / error) ** (1 / 3), self.shrink, self.grow)), 3)
