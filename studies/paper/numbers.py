"""Each printed number beside ours."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cellmech.figures import QUANTITIES, Pair, Row, Section, signal, significant
from studies.paper.ours import Ours, Slot
from studies.paper.printed import LAWS, NUCLEUS_PERCENT, RESTS, TABLES, Paper, PrintedRow, half_digit, in_print

NAMES = {"sigma": "σ_Mises [Pa]", "SI": "shape index"} | {f"share_{k}": f"share of {k} [%]" for k in ("J1", "J2", "J3")}
TITLES = {
    "fig2": "Figure 2: the four laws, 18,000 s (section 3.1)",
    "fig4": "Figure 4: fluid fractions of lamina and nucleoplasm, 18,000 s (section 3.2)",
    "fig6": "Figure 6: moduli of lamina and nucleoplasm, 18,000 s (section 3.3)",
    "table3": "Table 3: S1, S2, S3, 24,000 s (section 3.4)",
}
HALF_DISC = 2 * math.pi**2 / (math.pi + 2) ** 2
OUTLINES = {"full": ("full outline", 1.0), "half_outline": ("half outline", HALF_DISC)}
"""What SI may be taken of: name, and its value for a circle."""
OUTLINES |= {"half_area_full_perimeter": ("half the area, full perimeter", 0.5)}
ROWS = {  # what the paper gives the rows of its sweeps for
    "max_sigma": "largest σ",
    "max_strain": "largest J1, J2, J3",
    "max_J1_J2": "largest J1, J2",
    "max_J3": "largest J3",
    "min_J1_J2": "smallest J1, J2",
    "min_J3": "smallest J3",
}
PAPERS_MAXIMA = {q.paper_key: q for q in QUANTITIES}


@dataclass(frozen=True, kw_only=True)
class Number(Pair):
    """A printed number and ours; theirs is known to half a unit of its last digit.

    Args:
        table, row: where it is printed.
        quantity: "sigma", "J1", "share_J1", "SI", ..., or "mean_J1" for what a printed share implies.
        kind: what ours is.
        slot: our case.
        key: of ours in result.json, dotted.
        note: what else there is to say.
    """

    table: str
    row: str
    quantity: str
    kind: str
    slot: Slot
    key: str
    note: str = ""

    @property
    def score(self) -> float:
        """The ratio that counts: of the differences from rest; raw for a shape index, whose rest is not known."""
        return self.ratio if self.quantity == "SI" else self.ratio_from_rest

    @property
    def is_misprint(self) -> bool:
        """Whether the paper itself contradicts the printed value."""
        return self.note.startswith("misprint")


def all_numbers(paper: Paper, ours: Ours) -> list[Number]:
    """Every printed number; a shape index three times, once for each outline it may be of."""
    return [number for row in paper.rows for number in _numbers_of(row, ours.at(row))]


def judged(numbers: Iterable[Number]) -> list[Number]:
    """The numbers to count: no misprints, and of the shape index the nearest of three."""
    return [n for n in numbers if not n.is_misprint and (n.quantity != "SI" or n.note or math.isnan(n.ours))]


def _numbers_of(row: PrintedRow, slot: Slot) -> Iterator[Number]:
    pairs = [(name, value, "") for name, value in row.values.items()]
    for name, value in row.misprints.items():
        elsewhere = f"{in_print(name, row.values[name])} elsewhere" if name in row.values else "repeats the largest"
        pairs.append((name, value, f"misprint: {elsewhere}"))
    for name, value, note in pairs:
        rest = RESTS[name]
        if name == "SI":
            found = [
                _number(row, name, f"end, {label}", value, rest, slot, f"shape_index.{key}")
                for key, (label, rest) in OUTLINES.items()
            ]
            nearest = min(found, key=lambda number: math.inf if math.isnan(number.ours) else abs(number.ours - value))
            for number in found:
                mark = "nearest of the three" if number is nearest and not math.isnan(number.ours) else ""
                yield replace(number, note=mark)
        elif name.startswith("share_"):
            key = f"share_of_area_percent.{name.removeprefix('share_')}"
            yield _number(row, name, "end", value, rest, slot, key, note)
        else:
            q = PAPERS_MAXIMA[name]
            kind, tail = ("over time", "_max_over_time") if row.table == "fig2" else ("end", "_max")
            key = f"nucleus.{q.key}{tail}{q.suffix}"
            yield _number(row, name, kind, value, rest, slot, key, note)


def _number(
    row: PrintedRow, quantity: str, kind: str, value: float, rest: float, slot: Slot, key: str, note: str = ""
) -> Number:
    """A printed value beside our number of this key."""
    return Number(
        table=row.table,
        row=row.name,
        quantity=quantity,
        kind=kind,
        theirs=value,
        uncertainty=half_digit(quantity, value),
        rest=rest,
        ours=slot.value(key),
        error=slot.error(key),
        slot=slot,
        key=key,
        note=note,
    )


def implied_means(numbers: Iterable[Number]) -> list[Number]:
    """The nuclear means that the printed shares imply, beside ours: mean = share/100 · area of cell / of nucleus."""
    found = []
    for number in numbers:
        if number.quantity.startswith("share_"):
            q, factor = number.quantity.removeprefix("share_"), number.slot.area_ratio / 100
            key = f"nucleus.{q}_mean"
            mean = replace(
                number,
                quantity=f"mean_{q}",
                kind="end",
                theirs=number.theirs * factor,
                uncertainty=number.uncertainty * factor,
                rest=RESTS[q],
                ours=number.slot.value(key),
                error=number.slot.error(key),
                key=key,
                note="",
            )
            found.append(mean)
    return found


def number_sections(numbers: Sequence[Number]) -> list[Section]:
    """The printed numbers, a section for each figure or table."""
    header = ("row", "quantity", "printed", "ours", "±", "ours/printed", "of q − q0", "sign", "remark")
    return [
        Section(table, TITLES[table], _TEXTS[table], header, [_row(n) for n in numbers if n.table == table])
        for table in TABLES
    ]


def mean_section(means: Sequence[Number]) -> Section:
    """The implied means, all tables together."""
    text = (
        "The paper does not define its share (“contribution to the total cell deformation”, up to 163 %). All its "
        "values fit 100 · integral over the nucleus / area of the cell; then they are nuclear means, mean = share/100 "
        f"· area of the cell / area of the nucleus, with {NUCLEUS_PERCENT:g} % of the area in the nucleus. A share is "
        "printed to 1 %, so an implied mean is known to ± 0.02."
    )
    header = ("row", "quantity", "implied", "ours", "±", "ours/implied", "of q − q0", "sign", "remark")
    return Section("mean", "Means over the nucleus that the printed shares imply", text, header, [*map(_row, means)])


def row_label(number: Number) -> str:
    """The row of a printed table for people."""
    if number.row in LAWS or number.row not in ROWS:
        return number.slot.label
    return f"{number.slot.label} ({ROWS[number.row]})"


def quantity_label(number: Number) -> str:
    """The quantity for people, with what ours is where there is a choice."""
    if number.quantity.startswith("mean_"):
        return f"mean {number.quantity.removeprefix('mean_')}"
    name = NAMES.get(number.quantity, number.quantity)
    return f"{name}, {number.kind.removeprefix('end, ')}" if number.quantity == "SI" else name


def _row(number: Number) -> Row:
    n, mean = number, number.quantity.startswith("mean_")
    remark = n.slot.reason or n.note
    if not remark and abs(n.theirs - n.rest) <= n.uncertainty:
        remark = "the print is the value at rest"
    cells = (
        row_label(n),
        quantity_label(n),
        f"{n.theirs:.2f}" if mean else in_print(n.quantity, n.theirs),
        signal(n.ours, n.rest, n.error),
        significant(n.error, 1),
        significant(n.ratio),
        significant(n.ratio_from_rest, 2),
        n.sign,
        remark,
    )
    record: dict[str, Any] = {"table": n.table, "row": n.row, "case": n.slot.name}
    record |= {f"at_{key}": n.slot.parameter(key) for key in n.slot.axes}
    record |= {"quantity": n.quantity, "kind": n.kind, "printed": n.theirs, "printed_half_digit": n.uncertainty}
    record |= n.judgement() | {"status": n.slot.status}
    return Row(cells, record | {"remark": remark}, n.tone)


_TEXTS = {
    "fig2": "Largest values in the nucleus over time. All fluid fractions are 0.5.",
    "fig4": "Largest values in the nucleus at the end, at the places the paper names. Neo-Hookean, which is inferred.",
    "fig6": "Largest values in the nucleus at the end, at the places the paper names. Neo-Hookean, which is inferred.",
    "table3": "Largest values in the nucleus at the end, Saint-Venant. The paper does not say of which outline it "
    "takes the shape index: all three are shown, each measured from its value for a circle (1, 0.747, 0.5).",
}
