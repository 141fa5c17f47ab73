"""Times of a run that are one and the same: the one rule for outputs, the ramp's end, load steps and the end."""

from __future__ import annotations

from collections.abc import Iterable

CLOSEST = 1e-9  # of the run's end: times nearer to each other are one


def apart(earlier: float, later: float, end_s: float) -> bool:
    """True if a time [s] lies so far before another that a run which ends at `end_s` can stop at both."""
    return later - earlier >= CLOSEST * end_s * (1 - 1e-6)  # for times written as the sum of both


def distinct(wanted: Iterable[float], others: Iterable[float], end_s: float) -> tuple[float, ...]:
    """Times to stop at [s], rising: all that are wanted, and the end, and of the others those apart from them.

    Args:
        wanted: times that are hit exactly, apart from each other and from the end.
        others: times of the program's own, of which one that is nearly a wanted one gives way to it.
        end_s: no time is later.
    """
    kept = [t for t in wanted if 0 < t < end_s] + [end_s]
    for t in others:
        if all(apart(t, k, end_s) or apart(k, t, end_s) for k in (0.0, *kept)) and t < end_s:
            kept.append(t)
    return tuple(sorted(kept))
