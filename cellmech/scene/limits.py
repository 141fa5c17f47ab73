"""Limits as they are told and kept: whoever enters the number of a message is never refused for its rounding."""

from __future__ import annotations

ROUNDING = 1e-12  # share of the numbers compared that is taken for their rounding
DIGITS = 13  # of a limit in a message: nearer to it than `ROUNDING`


def below(value: float, limit: float, *terms: float) -> bool:
    """True if a value lies below a limit by more than rounding.

    Args:
        value: as entered or computed.
        limit: likewise, in the same unit.
        terms: larger numbers of which they are differences or sums: their rounding counts.
    """
    return value < limit - ROUNDING * max(map(abs, (value, limit, *terms)))


def told(limit: float) -> str:
    """A limit for a message: with all the digits that count."""
    return f"{limit:.{DIGITS}g}"
