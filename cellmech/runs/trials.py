"""Trials of a fit: values between bounds, what comes of them, and how well the numbers tell them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cellmech.figures.comparison import Comparison

STEP = 0.02  # of a difference: in the logarithm of a value, or of the width of bounds that are not both positive
LOOSE = 1e-6  # of the largest singular value: below it the numbers do not tell a direction


@dataclass(frozen=True)
class Trial:
    """One set of values and what comes of it.

    Args:
        number: from 1 on; names its folder.
        values: by key, in the keys' units.
        comparison: of its numbers with the reference; None where a case has no solution.
        residuals: (ours - theirs) / weight, shape (n,); infinite where a case has no solution.
        failure: why there is no solution, "" where there is one.
    """

    number: int
    values: Mapping[str, float]
    comparison: Comparison | None
    residuals: np.ndarray
    failure: str = ""

    @property
    def rms(self) -> float:
        """Root mean square of the residuals [-]."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    def line(self) -> str:
        """For people."""
        told = f"no solution: {self.failure}" if self.failure else f"rms {self.rms:.4g}"
        return f"trial {self.number}: {', '.join(f'{key} = {x:.6g}' for key, x in self.values.items())}: {told}"


@dataclass(frozen=True)
class Fitted:
    """How a fit ended.

    Args:
        best: the trial of the least sum of squares.
        errors: standard error of each value, in the key's unit; NaN where the numbers do not tell.
        at_bounds: keys whose value lies at a bound: the best one may lie beyond.
        untold: keys that no number depends on, or only together with others.
        trials: all of them, in their order.
        ended: True if the fit came to its end, False if it ran out of trials.
    """

    best: Trial
    errors: Mapping[str, float]
    at_bounds: tuple[str, ...]
    untold: tuple[str, ...]
    trials: Sequence[Trial]
    ended: bool

    @property
    def settings(self) -> str:
        """The values as the words of --set."""
        return " ".join(f"{key}={value:.6g}" for key, value in self.best.values.items())


@dataclass(frozen=True)
class Scale:
    """A key's values between its bounds as 0 to 1, by their logarithm where both are positive."""

    least: float
    most: float

    @property
    def by_ratio(self) -> bool:
        """Whether equal ratios count alike, not equal differences."""
        return self.least > 0

    @property
    def step(self) -> float:
        """Of a difference, in shares of the width."""
        return min(STEP / math.log(self.most / self.least), 0.5) if self.by_ratio else STEP

    def value(self, share: float) -> float:
        """The value at a share of the way."""
        if self.by_ratio:
            return min(max(self.least * (self.most / self.least) ** share, self.least), self.most)
        return self.least + share * (self.most - self.least)

    def share(self, value: float) -> float:
        """Its inverse."""
        if self.by_ratio:
            return math.log(value / self.least) / math.log(self.most / self.least)
        return (value - self.least) / (self.most - self.least)

    def slope(self, share: float) -> float:
        """Derivative of the value."""
        return self.value(share) * math.log(self.most / self.least) if self.by_ratio else self.most - self.least


def standard_errors(
    scales: Mapping[str, Scale], where: np.ndarray, residuals: np.ndarray, slopes: np.ndarray, weighed: bool
) -> tuple[dict[str, float], tuple[str, ...]]:
    """Standard errors of fitted values, in the keys' units, and the keys that the numbers do not tell.

    Args:
        scales: by key.
        where: the values as shares of the way between bounds, shape (free,).
        residuals: shape (n,).
        slopes: their derivatives there, shape (n, free).
        weighed: whether every weight is an uncertainty, to be taken at its word; else the scatter that is left is it.

    Returns:
        NaN for each where one is not told, or where as many numbers as keys leave no scatter.
    """
    keys = list(scales)
    _, sizes, directions = np.linalg.svd(slopes)
    loose = directions[np.append(sizes, np.zeros(len(keys) - len(sizes))) <= LOOSE * sizes[0]]
    untold = tuple(key for index, key in enumerate(keys) if np.abs(loose[:, index]).max(initial=0) > 0.1)
    spare = len(residuals) - len(keys)
    scatter = 1.0 if weighed else float(residuals @ residuals) / spare if spare > 0 else math.nan
    variance = scatter * np.diag(np.linalg.pinv(slopes.T @ slopes, LOOSE**2))
    each = zip(scales.items(), where, variance, strict=True)
    errors = {key: math.sqrt(v) * scale.slope(float(x)) for (key, scale), x, v in each}
    return {key: math.nan if key in untold else error for key, error in errors.items()}, untold
