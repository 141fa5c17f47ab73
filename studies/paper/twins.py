"""Numbers that must go together: shares, and cases that are the same; and the case the paper could not solve."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from cellmech.figures import NONE, QUANTITIES, Row, Section, signal, significant, verdict, yes
from studies.paper.numbers import NAMES, ROWS
from studies.paper.ours import Ours
from studies.paper.places import TABLE_NAMES
from studies.paper.printed import NUCLEUS_PERCENT, RESTS, Paper, PrintedRow, half_digit, in_print

TWINS = (  # two rows that are one state, and why
    ("table3", "S1", "fig2", "saint-venant", "S1 at 24,000 s = Saint-Venant at 18,000 s"),
    ("fig6", "max_J1_J2", "fig2", "neo-hookean", "base case of Fig. 6 = neo-Hookean of Fig. 2"),
)


def share_section(paper: Paper, ours: Ours) -> Section:
    """The printed shares of J2 beside what those of J1 and J3 make of the identity."""
    text = (
        f"If a share is {NUCLEUS_PERCENT:g} times the nuclear mean, J2 = J1² − 2 J3 ties the three together (exactly "
        "where the strain is uniform; else J2's is larger). Fits: within the rounding of the print, ±."
    )
    header = (
        "row",
        "printed share of J2",
        "from those of J1, J3",
        "±",
        "fits",
        "ours",
        "from ours",
        "remark",
    )
    rows = [row for row in paper.rows if {"share_J1", "share_J2"} <= row.values.keys()]
    return Section(
        "share", "The three shares among each other", text, header, [_share(paper, ours, row) for row in rows]
    )


def _share(paper: Paper, ours: Ours, row: PrintedRow) -> Row:
    slot, source = ours.at(row), _with_share_of_J3(paper, row)
    J1, J2, J3 = row.values["share_J1"], row.values["share_J2"], source.values["share_J3"]
    expected = _share_of_J2(J1, J3)
    half = half_digit("share_J1", J1)
    slack = half * (1 + 2 * J1 / NUCLEUS_PERCENT + 2)  # rounding of J2, J1, J3
    fits = abs(expected - J2) <= slack
    mine = [slot.value(f"share_of_area_percent.{q}") for q in ("J1", "J2", "J3")]
    our_expected = _share_of_J2(mine[0], mine[2])
    remark = slot.reason or ("" if source is row else f"share of J3: {ROWS.get(source.name, source.name)}")
    head = (f"{TABLE_NAMES[row.table]}: {slot.label}", f"{J2:.0f}", f"{expected:.1f}", significant(slack, 2), yes(fits))
    cells = (*head, signal(mine[1], 50), signal(our_expected, 50), remark)
    record: dict[str, Any] = {"table": row.table, "row": row.name, "case": slot.name, "quantity": "share_J2"}
    record |= {"printed": J2, "expected": expected, "slack": slack, "fits": yes(fits), "ours": mine[1]}
    return Row(cells, record | {"our_expected": our_expected, "remark": remark}, verdict(fits))


def _share_of_J2(J1: float, J3: float) -> float:
    return J1**2 / NUCLEUS_PERCENT - 2 * J3


def _with_share_of_J3(paper: Paper, row: PrintedRow) -> PrintedRow:
    """The row itself, or the one of its table that is given for an extreme of the same sense."""
    sense = row.name.partition("_")[0]
    others = [r for r in paper.table(row.table).values() if r.name.startswith(f"{sense}_")]
    return next(r for r in (row, *others) if "share_J3" in r.values)


def twin_section(paper: Paper, ours: Ours) -> Section:
    """Rows of the print that are one and the same state, beside ours."""
    text = (
        "Nothing moves after the ramp, and the base case of Fig. 6 has Fig. 2's inputs. Values at the end; the print's "
        "of Fig. 2 are maxima over time, which are no smaller. Difference: of ours, as part of the distance from rest. "
        "Same: the printed ones agree within their digits."
    )
    header = ("one state", "quantity", "printed", "and", "same", "ours", "and", "difference")
    return Section("twin", "States that are printed twice", text, header, list(_twins(paper, ours)))


def _twins(paper: Paper, ours: Ours) -> Iterator[Row]:
    for table_a, name_a, table_b, name_b, why in TWINS:
        a, b = paper.table(table_a).get(name_a), paper.table(table_b).get(name_b)
        if a is None or b is None:
            continue
        slots = ours.at(a), ours.at(b)
        for q in QUANTITIES:
            if not (q.paper_key in a.values and q.paper_key in b.values):
                continue
            theirs = a.values[q.paper_key], b.values[q.paper_key]
            room = sum(half_digit(q.paper_key, value) for value in theirs)
            same = abs(theirs[0] - theirs[1]) < room - 1e-9
            x, y = (slot.value(f"nucleus.{q.key}_max{q.suffix}") for slot in slots)
            difference = abs(x - y) / abs(y - q.rest) if y != q.rest else math.nan
            shown = (
                NONE if math.isnan(difference) else f"{100 * difference:.1g} %" if difference > 1e-5 else "< 0.001 %"
            )
            head = (
                why,
                NAMES.get(q.paper_key, q.paper_key),
                *(in_print(q.paper_key, value) for value in theirs),
                yes(same),
            )
            record: dict[str, Any] = {"table": table_a, "row": name_a, "case": slots[0].name, "quantity": q.paper_key}
            record |= {"kind": why, "printed": theirs[0], "printed_twin": theirs[1], "same": yes(same)}
            record |= {"ours": x, "our_twin": y, "our_difference": difference}
            yield Row((*head, signal(x, q.rest), signal(y, q.rest), shown), record, verdict(same))


def unsolved_section(paper: Paper, ours: Ours) -> Section:
    """What came of the case for which the paper found no solution."""
    text = "The one of its 57 simulations that the paper could not bring to convergence."
    header = ("case", "status", "steps", "Newton iterations", "σ_Mises [Pa]", "J1", "J2", "J3", "remark")
    slot = ours.find("fig4", "", paper.not_converged)
    values = {q.paper_key: slot.value(f"nucleus.{q.key}_max{q.suffix}") for q in QUANTITIES}
    counts = [slot.value("steps"), slot.value("newton_iterations")]
    shown = (NONE if math.isnan(count) else f"{count:.0f}" for count in counts)
    cells = (slot.label, slot.status, *shown, *(signal(v, RESTS[name]) for name, v in values.items()), slot.reason)
    record: dict[str, Any] = {"table": "fig4", "case": slot.name, "status": slot.status, "remark": slot.reason}
    record |= {"steps": counts[0], "newton": counts[1], **values}
    row = Row(cells, record, verdict(slot.status == "solved"))
    return Section("unsolved", "The case the paper could not solve", text, header, [row])
