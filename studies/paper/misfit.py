"""How far ratios, ours / printed, are from 1: in logarithms, so that twice as large counts as half as large."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

LOST = math.log(1000)  # what a number of the other sign counts, one without a solution, and the most any can


def log_ratio(ratio: float) -> float:
    """The ln of a ratio, within ± LOST; LOST where there is none."""
    return max(-LOST, min(LOST, math.log(ratio))) if ratio > 0 else LOST


def one_sided(
    residuals: Callable[[np.ndarray], np.ndarray], logs: np.ndarray, most: np.ndarray, step: float
) -> np.ndarray:
    """Derivatives of residuals by one-sided differences of the logarithms, towards the inside of the bounds.

    Args:
        residuals: of the logarithms of what is fitted, shape (n,).
        logs: where; shape (n_free,).
        most: upper bounds.
        step: of a difference.

    Returns:
        Shape (n, n_free).
    """
    here, columns = residuals(logs), []
    for index in range(len(logs)):
        moved = logs.copy()
        moved[index] += step if logs[index] + step < most[index] else -step
        columns.append((residuals(moved) - here) / (moved[index] - logs[index]))
    return np.column_stack(columns)


@dataclass
class Secants:
    """Derivatives by differences once, then by Broyden's rank-one updates from where residuals are known anyway.

    Args:
        residuals: of the logarithms of what is fitted, shape (n,).
        differences: their derivatives, shape (n, n_free).
    """

    residuals: Callable[[np.ndarray], np.ndarray]
    differences: Callable[[np.ndarray], np.ndarray]
    last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None  # where, residuals, derivatives

    def at(self, logs: np.ndarray) -> np.ndarray:
        """The derivatives there, shape (n, n_free)."""
        here = self.residuals(logs)
        if self.last is None:
            slopes = self.differences(logs)
        else:
            where, before, slopes = self.last
            step = logs - where
            slopes = slopes + np.outer(here - before - slopes @ step, step) / (step @ step)
        self.last = logs.copy(), here, slopes
        return slopes


def misfit(ratios: Iterable[float]) -> float:
    """Root mean square of the ln of ratios."""
    squares = [log_ratio(ratio) ** 2 for ratio in ratios]
    return math.sqrt(sum(squares) / len(squares))
