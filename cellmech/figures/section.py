"""A part of a comparison as a table: the same rows become Markdown, CSV and HTML."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from cellmech.figures.table import markdown

NONE = "–"


@dataclass(frozen=True)
class Row:
    """One line of a table.

    Args:
        cells: for people.
        record: the same for machines, with all digits.
        tone: how well ours and theirs go together, one of `TONES`; "" when that is not the question.
    """

    cells: tuple[str, ...]
    record: Mapping[str, Any]
    tone: str = ""


@dataclass(frozen=True)
class Section:
    """A table with its heading.

    Args:
        stem: names it in the CSV.
        title: its heading.
        text: what it says and how to read it.
        header: of its columns.
        rows: its lines.
    """

    stem: str
    title: str
    text: str
    header: tuple[str, ...]
    rows: Sequence[Row] = field(default_factory=tuple)

    def markdown(self) -> str:
        """The section as Markdown that reads well on a terminal too."""
        return "\n\n".join([f"## {self.title}", self.text, markdown(self.header, [row.cells for row in self.rows])])

    def records(self) -> list[dict[str, Any]]:
        """Its lines for a CSV file; NaN becomes an empty cell."""
        return [{"section": self.stem} | {k: _finite(v) for k, v in row.record.items()} for row in self.rows]


TONES = {  # from the best to the worst
    "close": "within 5 %",
    "near": "within a factor 2",
    "off": "within a factor 10",
    "far": "further off",
    "other": "other sign",
    "none": "no result, or no number to compare with",
}


def tone_of(ratio: float) -> str:
    """The distance of a ratio from 1, one of `TONES`."""
    if not math.isfinite(ratio):
        return "none"
    if ratio <= 0:
        return "other"
    distance = max(ratio, 1 / ratio)
    return "close" if abs(ratio - 1) <= 0.05 else "near" if distance <= 2 else "off" if distance <= 10 else "far"


def significant(value: float, digits: int = 3) -> str:
    """A number with so many significant digits, never as a power of ten; `NONE` for NaN."""
    if not math.isfinite(value):
        return NONE
    if value == 0:
        return "0"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return _minus(f"{value:,.{decimals}f}")


def signal(value: float, rest: float = 0.0, error: float = math.nan) -> str:
    """A value with three significant digits of its difference from rest, and no more than its error leaves."""
    if not math.isfinite(value):
        return NONE
    size = abs(value - rest)
    decimals = 2 if size == 0 else min(8, max(0, 2 - math.floor(math.log10(size))))
    if math.isfinite(error) and error > 0:
        decimals = min(decimals, max(0, 1 - math.floor(math.log10(error))))
    return _minus(f"{value:,.{decimals}f}")


def yes(agrees: bool | None) -> str:
    """A verdict for people."""
    return NONE if agrees is None else "yes" if agrees else "no"


def plain(agrees: bool | None) -> str:
    """A verdict for machines; "" when there is none."""
    return "" if agrees is None else yes(agrees)


def verdict(agrees: bool | None) -> str:
    """The tone of a verdict."""
    return "none" if agrees is None else "close" if agrees else "far"


def _minus(text: str) -> str:
    return text.replace("-", "−")


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
