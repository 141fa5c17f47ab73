"""How far ratios, ours / printed, are from 1: in logarithms, so that twice as large counts as half as large."""

from __future__ import annotations

import math
from collections.abc import Iterable

LOST = math.log(1000)  # what a number of the other sign counts, one without a solution, and the most any can


def log_ratio(ratio: float) -> float:
    """The ln of a ratio, within ± LOST; LOST where there is none."""
    return max(-LOST, min(LOST, math.log(ratio))) if ratio > 0 else LOST


def misfit(ratios: Iterable[float]) -> float:
    """Root mean square of the ln of ratios."""
    squares = [log_ratio(ratio) ** 2 for ratio in ratios]
    return math.sqrt(sum(squares) / len(squares))
