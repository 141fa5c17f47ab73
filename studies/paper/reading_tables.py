"""What readings of the paper come to, as tables."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import replace

from cellmech.figures import NONE, Row, Section, significant, tone_of
from studies.paper.numbers import Number, row_label
from studies.paper.places import MAXIMA, TABLE_NAMES
from studies.paper.readings import LIMITS, RESOLVED, Score, misfits, within


def reading_section(scores: Sequence[Score]) -> Section:
    """The readings as a table."""
    header = ("reading", "rms", "median", *LIMITS, "shares ± 1", "± 3", "order of laws", "extremes")
    text = (
        f"{len(scores[0].of())} printed maxima and shape indices and {len(scores[0].of(shares=True))} shares; rms and "
        "median of |ln(ours/print)| on q − q0; a number without a solution of ours counts as a factor 1000. The order "
        "of the four laws is counted for σ, J1, J2, J3; extremes: how many are where the paper has them, – where not "
        "all 57 runs are there. All readings were chosen with these numbers in sight."
    )
    rows = []
    for one in scores:
        (rms, median), near = misfits(one.logs()), within(one.logs())
        shares = [one.shares_within(1), one.shares_within(3)]
        cells = (one.reading.text, significant(rms, 2), significant(median, 2), *map(str, [*near, *shares]))
        record = {"reading": one.reading.name, "rms": rms, "median": median}
        record |= dict(zip(LIMITS, near, strict=True)) | {"shares_1": shares[0], "shares_3": shares[1]}
        record |= dict(zip(("extremes", "extremes_of"), one.places or (None, None), strict=True))
        places = "{} of {}".format(*one.places) if one.places else NONE
        rows.append(Row((*cells, f"{one.order_of_laws()} of 4", places), record))
    return Section("reading", "Readings of the paper", text, header, rows)


def beside_section(first: Score, best: Score) -> Section:
    """Number by number: the print, the inputs as printed, and the best reading."""
    header = ("row", "quantity", "printed", "inputs as printed", "best reading", "of q − q0")
    text = f"Best reading: {best.reading.text}. Last column: (ours − q0)/(printed − q0) in it, raw for shape indices."
    before = {(n.table, n.row, n.quantity): n for n in first.numbers}
    rows = []
    for n in best.numbers:
        old = before[n.table, n.row, n.quantity].ours
        ratio = n.score
        mine, theirs = (NONE if math.isnan(value) else f"{value:.4g}" for value in (n.ours, old))
        share = NONE if math.isnan(ratio) else significant(ratio, 2)
        record = {"table": n.table, "row": n.row, "quantity": n.quantity, "printed": n.theirs, "as_printed": old}
        record |= {"best": n.ours, "ratio": ratio}
        cells = (f"{TABLE_NAMES[n.table]}, {row_label(n)}", n.quantity, f"{n.theirs:g}", theirs, mine, share)
        rows.append(Row(cells, record, tone_of(ratio)))
    return Section("beside", "The printed numbers in both readings", text, header, rows)


def resolved_section(scores: Mapping[str, Score]) -> Section:
    """Readings beside the same on a mesh that resolves them, on the numbers that both have."""
    header = ("reading", "numbers", "rms", "median", *LIMITS, "shares ± 3", *(f"median of {q}" for q in MAXIMA))
    text = (
        "Measures as above, on the numbers for which both meshes have a solution; then the medians of ours / printed, "
        "of q − q0, by quantity."
    )
    rows = []
    for names in RESOLVED.items():
        if scores.keys() >= set(names):
            rows += [_resolved_row(one) for one in in_common([scores[name] for name in names])]
    return Section("resolved", "On a mesh that resolves the layers", text, header, rows)


def in_common(scores: Sequence[Score]) -> list[Score]:
    """The scores on those numbers alone for which each has a solution."""
    known = [{_place(n) for n in one.numbers if not math.isnan(n.ours)} for one in scores]
    both = set.intersection(*known)
    return [replace(one, numbers=[n for n in one.numbers if _place(n) in both]) for one in scores]


def _place(number: Number) -> tuple[str, str, str]:
    return number.table, number.row, number.quantity


def _resolved_row(one: Score) -> Row:
    logs = one.logs()
    (rms, median), near, shares = misfits(logs), within(logs), one.shares_within(3)
    middles = {q: statistics.median(n.score for n in one.of() if n.quantity == q) for q in MAXIMA}
    measures = (significant(rms, 2), significant(median, 2), *map(str, near), f"{shares} of {len(one.of(shares=True))}")
    cells = (one.reading.text, str(len(logs)), *measures, *(significant(m, 2) for m in middles.values()))
    record = {"reading": one.reading.name, "numbers": len(logs), "rms": rms, "median": median, "shares_3": shares}
    return Row(cells, record | dict(zip(LIMITS, near, strict=True)) | {f"median_{q}": m for q, m in middles.items()})
