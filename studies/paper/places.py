"""Where the extremes are and in what order the cases come, in print and here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cellmech.figures import NONE, Row, Section, plain, signal, significant, verdict, yes
from studies.paper.numbers import NAMES, Number
from studies.paper.ours import Ours
from studies.paper.printed import RESTS, Paper

TIE = 0.01  # a lead over the runner-up of less than 1 % of the signal is called a near tie
SWEEPS = ("fig4", "fig6")
NAMED = ("fig2", "table3")
SERIES = {"fig2": "laws", "fig4": "fluid fractions", "fig6": "moduli"}
MAXIMA = ("sigma", "J1", "J2", "J3")
WORDS = {"max": "largest", "min": "smallest"}


@dataclass(frozen=True)
class Place:
    """An extreme or an order, in print and here.

    Args:
        table: where it is printed, or "all" for the three series together.
        quantity: "sigma", "J1", ...
        what: "largest", "smallest" or "order".
        printed: where, in print; "" when the paper does not say.
        ours: where, here; "" when not known.
        agrees: None when it cannot be said.
        value: ours there; NaN for an order.
        lead: of the first over the second, as part of its distance from rest; NaN when there is none.
        note: what else there is to say.
    """

    table: str
    quantity: str
    what: str
    printed: str
    ours: str
    agrees: bool | None
    value: float = math.nan
    lead: float = math.nan
    note: str = ""

    @property
    def counts(self) -> bool:
        """Whether it is one of the extremes to count: of the shape index, eq. 33's own reading only."""
        return self.what != "order" and bool(self.printed) and "half" not in self.quantity


Values = Mapping[str, float]
"""Label of a case -> value, NaN where there is none."""


def all_places(paper: Paper, ours: Ours, numbers: Sequence[Number]) -> list[Place]:
    """Every extreme and order the print has or implies, and ours where it is silent about a sweep."""
    by_name = [place for table in NAMED for place in _named(table, ours, numbers)]
    by_place = [place for table in SWEEPS for place in _swept(table, paper, ours)]
    return by_name + by_place + [*_series(paper, ours)]


def extremes(places: Iterable[Place]) -> tuple[int, int]:
    """How many extremes are where the paper has them, and of how many that can be judged."""
    known = [place.agrees for place in places if place.counts and place.agrees is not None]
    return sum(known), len(known)


def _named(table: str, ours: Ours, numbers: Sequence[Number]) -> Iterator[Place]:
    """Tables with a row for each case: largest, smallest and order of what is printed for two cases or more."""
    found: dict[tuple[str, str], dict[str, Number]] = {}
    for number in numbers:
        if number.table == table and not number.is_misprint:
            kind = number.kind if number.quantity == "SI" else ""
            found.setdefault((number.quantity, kind), {})[number.slot.label] = number
    for (quantity, kind), of in found.items():
        if len(of) < 2:
            continue
        any_number, printed = next(iter(of.values())), {label: number.theirs for label, number in of.items()}
        here = {slot.label: slot.value(any_number.key) for slot in ours.slots[table]}
        name = f"{quantity} ({kind.removeprefix('end, ')})" if kind else quantity
        for pick, what in ((max, "largest"), (min, "smallest")):
            yield _extreme(table, name, what, pick(printed, key=printed.__getitem__), here, any_number.rest)
        if len(of) > 2:
            yield _order(table, name, printed, here)


def _order(table: str, quantity: str, printed: Values, here: Values) -> Place:
    known = not any(map(math.isnan, here.values()))
    theirs, mine = (" > ".join(sorted(v, key=lambda label: -v[label])) for v in (printed, here))
    return Place(table, quantity, "order", theirs, mine if known else "", theirs == mine if known else None)


def _swept(table: str, paper: Paper, ours: Ours) -> Iterator[Place]:
    """A sweep's extremes, judged on the cases for which the paper has a solution."""
    slots = ours.slots[table]
    lost = paper.not_converged if table == "fig4" else {}
    theirs = {claim: row.place for row in paper.table(table).values() for claim in _claims(row.name)}
    for quantity in MAXIMA:
        key = _key(quantity)
        here = {slot.label: slot.value(key) for slot in slots if not (lost and slot.fits(lost))}
        extra = {slot.label: slot.value(key) for slot in slots if lost and slot.fits(lost)}
        for sense, what in WORDS.items():
            place = theirs.get((sense, quantity))
            label = ours.find(table, "", place).label if place else ""
            found = _extreme(table, quantity, what, label, here, RESTS[quantity])
            yield replace(found, note="; ".join(filter(None, [found.note, *_beyond(found, extra)])))


def _beyond(found: Place, extra: Values) -> Iterator[str]:
    for label, value in extra.items():
        if value > found.value if found.what == "largest" else value < found.value:
            yield f"{label}, unsolved in print, goes beyond: {signal(value, RESTS[found.quantity])}"


def _claims(row: str) -> list[tuple[str, str]]:
    """What a row of a sweep is given for: "min_J1_J2" -> smallest J1, smallest J2."""
    sense, *of = row.split("_")
    return [(sense, quantity) for quantity in (("J1", "J2", "J3") if of == ["strain"] else of)]


def _series(paper: Paper, ours: Ours) -> Iterator[Place]:
    """Section 4: which of the three series has the largest value of each quantity."""
    for quantity in MAXIMA:
        printed = {name: paper.largest(table, quantity) for table, name in SERIES.items()}
        here = {}
        for table, name in SERIES.items():
            lost = paper.not_converged if table == "fig4" else {}
            slots = [slot for slot in ours.slots[table] if not (lost and slot.fits(lost))]
            here[name] = _worst(max, [slot.value(_key(quantity)) for slot in slots])
        yield _extreme("all", quantity, "largest", max(printed, key=printed.__getitem__), here, RESTS[quantity])


def _worst(pick: Callable[[Sequence[float]], float], values: Sequence[float]) -> float:
    return math.nan if any(map(math.isnan, values)) else pick(values)


def _extreme(table: str, quantity: str, what: str, printed: str, here: Values, rest: float) -> Place:
    sign = 1 if what == "largest" else -1
    known = {label: value for label, value in here.items() if not math.isnan(value)}
    gone = f"{len(here) - len(known)} of {len(here)} cases without a result" if len(known) < len(here) else ""
    if not known:
        return Place(table, quantity, what, printed, "", None, note=gone)
    first, *others = sorted(known, key=lambda label: -sign * known[label])
    signal_size = abs(known[first] - rest)
    lead = abs(known[first] - known[others[0]]) / signal_size if others and signal_size else math.nan
    agrees: bool | None = first == printed
    if not printed or printed not in known or (agrees and gone):
        agrees = None
    tie = f"near tie with {others[0]}" if lead < TIE else ""
    note = "; ".join(filter(None, [gone, tie]))
    return Place(table, quantity, what, printed, first, agrees, known[first], lead, note)


def _key(quantity: str) -> str:
    return "nucleus.sigma_mises_max_Pa" if quantity == "sigma" else f"nucleus.{quantity}_max"


def place_section(places: Sequence[Place]) -> Section:
    """The extremes and orders as a table."""
    text = (
        "Fig. 4 is judged on the 24 cases the paper could solve. Lead: how far the first is ahead of the second, as "
        "part of its distance from rest; the place says little where it is small."
    )
    header = ("in", "quantity", "", "print", "ours", "value", "lead", "agree", "remark")
    return Section("place", "Orders and places of the extremes", text, header, [_row(place) for place in places])


def _row(p: Place) -> Row:
    rest = 1.0 if "full outline)" in p.quantity else RESTS.get(p.quantity, 0.0)
    lead = f"{significant(100 * p.lead, 2)} %" if math.isfinite(p.lead) else NONE
    name = NAMES.get(p.quantity, p.quantity).removesuffix(" [Pa]").removesuffix(" [%]")
    head = (TABLE_NAMES[p.table], name, p.what, p.printed or "not said", p.ours or NONE)
    cells = (*head, signal(p.value, rest), lead, yes(p.agrees), p.note)
    record: dict[str, Any] = {"table": p.table, "quantity": p.quantity, "what": p.what, "printed_at": p.printed}
    record |= {"ours_at": p.ours, "ours": p.value, "lead": p.lead, "agrees": plain(p.agrees), "remark": p.note}
    return Row(cells, record, verdict(p.agrees))


TABLE_NAMES = {"fig2": "Fig. 2", "fig4": "Fig. 4", "fig6": "Fig. 6", "table3": "Table 3", "all": "all three series"}
