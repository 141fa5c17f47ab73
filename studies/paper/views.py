"""What the page shows of the comparison: matrices of ratios, dots on a scale, stresses beside their bounds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from cellmech.figures import signal, significant
from studies.paper.bounds import Bounded, bounds
from studies.paper.comparison import Comparison
from studies.paper.numbers import NAMES, TITLES, Number, row_label
from studies.paper.places import TABLE_NAMES, Place
from studies.paper.printed import TABLES, in_print

DECADES = (-4, 2)
"""The scale of ratios, as powers of ten."""
LANES = {  # name -> quantities
    "σ_Mises": ("sigma",),
    "J1 − 2": ("J1",),
    "J2 − 2": ("J2",),
    "J3 − 1": ("J3",),
    "nuclear means": ("mean_J1", "mean_J2", "mean_J3"),
    "shape index": ("SI",),
}

ORDER = ("σ", "J1", "J2", "J3", "share of J1", "share of J2", "share of J3", "mean J1", "mean J2", "mean J3", "shape")


@dataclass(frozen=True)
class Cell:
    """One number of a matrix."""

    ratio: str
    ours: str
    printed: str
    tone: str
    remark: str


@dataclass(frozen=True)
class Matrix:
    """Printed rows against quantities; None where nothing is printed."""

    title: str
    columns: Sequence[str]
    rows: Sequence[tuple[str, Sequence[Cell | None]]]


@dataclass(frozen=True)
class Dot:
    """A ratio on the scale: how far from its left end [%], which table it is of, whether the sign is the other one."""

    left: float
    table: str
    other_sign: bool
    title: str


@dataclass(frozen=True)
class Bar:
    """A printed stress, the least it could be, and ours, in percent of the axis; None where there is none."""

    label: str
    least: float
    printed: float
    ours: float | None
    title: str


def matrices(comparison: Comparison) -> list[Matrix]:
    """The printed numbers by table, then the nuclear means."""
    plain = [number for number in comparison.numbers if not number.is_misprint]
    found = [_matrix(TITLES[table], [n for n in plain if n.table == table]) for table in TABLES]
    return [*found, _matrix("Nuclear means that the printed shares imply", comparison.means, in_table=True)]


def _matrix(title: str, numbers: Iterable[Number], in_table: bool = False) -> Matrix:
    columns: dict[str, None] = {}
    rows: dict[str, dict[str, Cell]] = {}
    for number in numbers:
        label = f"{TABLE_NAMES[number.table]}: {row_label(number)}" if in_table else row_label(number)
        column = _column(number)
        columns[column] = None
        rows.setdefault(label, {})[column] = _cell(number)
    order = sorted(columns, key=_rank)
    return Matrix(title, order, [(label, [cells.get(column) for column in order]) for label, cells in rows.items()])


def _column(number: Number) -> str:
    if number.quantity == "SI":
        return f"shape index, {number.kind.removeprefix('end, ')}"
    return NAMES.get(number.quantity, number.quantity.replace("mean_", "mean "))


def _cell(n: Number) -> Cell:
    printed = f"{n.theirs:.2f}" if n.quantity.startswith("mean_") else in_print(n.quantity, n.theirs)
    ratio = significant(n.ratio_from_rest, 2)
    return Cell(
        ratio, n.slot.status if n.slot.reason else signal(n.ours, n.rest, n.error), printed, n.tone, n.slot.reason
    )


def extremes(places: Sequence[Place]) -> dict[str, dict[str, dict[str, Place]]]:
    """Table -> quantity -> "largest" or "smallest" -> place, of those to count and those the print is silent about."""
    found: dict[str, dict[str, list[Place]]] = {name: {} for name in TABLE_NAMES.values()}
    for place in places:
        if place.what != "order" and "half" not in place.quantity:
            name = NAMES.get(place.quantity.partition(" (")[0], place.quantity).partition(" [")[0]
            found[TABLE_NAMES[place.table]].setdefault(name, []).append(place)
    return {
        table: {name: {place.what: place for place in of[name]} for name in sorted(of, key=_rank)}
        for table, of in found.items()
    }


def _rank(name: str) -> int:
    """Where a quantity comes in a table, by its name there."""
    return next(k for k, start in enumerate(ORDER) if name.startswith(start))


def lanes(comparison: Comparison) -> dict[str, list[Dot]]:
    """The ratios of q − q0 on one scale, a lane for each kind of quantity."""
    numbers = [*comparison.judged(), *comparison.means]
    return {name: [*_dots(n for n in numbers if n.quantity in of)] for name, of in LANES.items()}


def _dots(numbers: Iterable[Number]) -> Iterator[Dot]:
    low, high = DECADES
    for n in numbers:
        ratio = n.ratio_from_rest
        if math.isfinite(ratio) and ratio:
            left = min(1.0, max(0.0, (math.log10(abs(ratio)) - low) / (high - low)))
            title = f"{TABLE_NAMES[n.table]}, {row_label(n)}, {_column(n)}: × {significant(ratio, 2)}"
            yield Dot(round(100 * left, 2), n.table, ratio < 0, title)


def ticks() -> list[tuple[float, str]]:
    """Where the scale's powers of ten are [%], and their names."""
    low, high = DECADES
    return [(100 * (k - low) / (high - low), f"{10.0**k:g}") for k in range(low, high + 1)]


def bars(rows: Sequence[Bounded]) -> tuple[list[Bar], float]:
    """The printed stresses beside the least their strains allow, and the length of the axis [Pa]."""
    known = [(row, max(b)) for row in rows if (b := [x for x in bounds(row.slot, row.printed) if math.isfinite(x)])]
    stresses = [v for row, least in known for v in (least, row.printed["sigma"], row.ours["sigma"]) if math.isfinite(v)]
    length = float(math.ceil(1.05 * max(stresses, default=1.0)))
    found = []
    for row, least in known:
        printed, ours = row.printed["sigma"], row.ours["sigma"]
        title = (
            f"printed {in_print('sigma', printed)} Pa, at least {significant(least)} Pa; ours {significant(ours)} Pa"
        )
        mine = 100 * ours / length if math.isfinite(ours) else None
        found.append(Bar(row.label, 100 * least / length, 100 * printed / length, mine, title))
    return found, length
