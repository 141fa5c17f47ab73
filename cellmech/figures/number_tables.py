"""The numbers of Figure 2 and Table 3 beside the paper's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cellmech.figures.nucleus import OUTLINES, nearest_words, start_um
from cellmech.figures.results import StudyResult
from cellmech.figures.style import LAWS, PAPER, QUANTITIES, Quantity, printed_form, provenance, rests
from cellmech.figures.table import NONE, Cell, Document, Table, Value, ratios
from cellmech.results.result import Result

NAMES = {"sigma_mises": "σ_Mises [Pa]"}
RATIOS = ["here / paper", "same, of q − q0"]


def fig2_table(study: StudyResult, paper: Mapping[str, Any]) -> Document:
    """Maxima, means and shares of the nucleus by law, each beside the paper's.

    Args:
        study: cases named after the laws.
        paper: the printed numbers by law, as `[fig2]` of paper_numbers.toml.
    """
    maxima, means, shares = [], [], []
    for law, case in study.cases.items():
        numbers = paper.get(law, {})
        for q in QUANTITIES:
            maxima.append(_maximum_over_time(case, q, numbers.get(q.paper_key)))
            means.append(_mean(case, q, numbers.get(f"share_{q.key}")))
            if q.rest:
                shares.append(_shares(case, q))
    key = ["law", "q"]
    plane = any(case.scene.cell.geometry == "plane" for case in study.cases.values())
    measure = "area" if plane else "volume"
    meaning = (
        f"Part: 100 · integral of q over the nucleus / {measure} of the cell. The paper does not define its part; "
        "what it prints fits this, and then its mean is the part / 100 · area of the cell / area of the nucleus."
    )
    tables = [
        Table("", "Largest value over time", "", [*key, "here", "at t [s]", "paper", *RATIOS], maxima),
        Table(
            "means",
            f"Mean over the reference {measure} at the end, and the nucleus's part of the cell's deformation",
            meaning,
            [*key, "mean here", "paper's mean", *RATIOS, "part here [%]", "paper [%]"],
            means,
        ),
        Table(
            "shares",
            "The nucleus's part in two other senses, at the end",
            "",
            [*key, "(max − q0) nucleus / cell", "∫(q − q0) nucleus / cell"],
            shares,
        ),
    ]
    title = f"The nucleus at the four laws, beside the paper ({PAPER}, section 3.1)"
    return Document(title, _at_rest(study), tables, provenance(study))


def table3(study: StudyResult, paper: Mapping[str, Any]) -> Document:
    """Table 3: maxima and shape index of the nucleus in S1, S2, S3 at the end, beside the paper's.

    Args:
        study: S1, S2, S3.
        paper: the printed numbers by simulation, as `[table3]` of paper_numbers.toml.
    """
    maxima: list[list[Cell]] = []
    indices: list[list[Cell]] = []
    distances: list[list[Cell]] = []
    for name, case in study.cases.items():
        numbers = paper.get(name, {})
        maxima += [_maximum(case, q, numbers.get(q.paper_key)) for q in QUANTITIES]
        indices += [_index(case, outline, numbers.get("SI")) for outline in OUTLINES]
        now = case.get("lamina_pillar_distance_um")
        distances.append(
            [_label(case), "lamina to pillar, on the axis", Value(now, ".3f"), Value(start_um(case), ".3f")]
        )
        nearest = f"nucleus to the nearest obstacle{nearest_words(case)}"
        distances.append([_label(case), nearest, Value(case.get("nucleus_obstacle_distance_um"), ".3f"), NONE])
    circle = (
        "SI = 4π · area / perimeter² (eq. 33). The paper does not say of which outline; its cell is a half, so all "
        "three readings are given, and q0 is what each gives for a circle."
    )
    key = ["simulation", "q"]
    tables = [
        Table("", "Largest value at the end", "", [*key, "here", "paper", *RATIOS], maxima),
        Table(
            "shape",
            "Shape index at the end",
            circle,
            ["simulation", "outline", "here", "q0", "paper", *RATIOS],
            indices,
        ),
        Table(
            "distance",
            "Distance [µm]",
            "",
            ["simulation", "between", "at the end", "at the start"],
            distances,
        ),
    ]
    ends = ", ".join(sorted({f"{case.scene.time.end_s:,.0f} s" for case in study.cases.values()}))
    return Document(
        f"Table 3: the nucleus at {ends} ({PAPER}, section 3.4)", _at_rest(study), tables, provenance(study)
    )


def _at_rest(study: StudyResult) -> str:
    values = rests(study.cases.values())
    lead = f"q0 is the value at rest: {values} for J1, J2, J3 and 0 for the stress."
    print_ = "" if values == "2, 2, 1" else " In print it is 2, 2, 1."
    return f"{lead}{print_} {NONE} : not printed, or no such number."


def _label(case: Result) -> str:
    return (LAWS[case.name].label if case.name in LAWS else case.name) + (" (failed)" if case.failure else "")


def _head(case: Result, q: Quantity) -> list[Cell]:
    return [_label(case), NAMES.get(q.key, q.key)]


def _maximum(case: Result, q: Quantity, theirs: float | None) -> list[Cell]:
    ours = case.get(f"nucleus.{q.key}_max{q.suffix}")
    return [*_head(case, q), _value(ours, q), _printed(theirs), *ratios(ours, theirs, case.rest(q.key), q.rest)]


def _maximum_over_time(case: Result, q: Quantity, theirs: float | None) -> list[Cell]:
    ours = case.get(f"nucleus.{q.key}_max_over_time{q.suffix}")
    when = Value(case.get(f"nucleus.{q.key}_max_time_s"), ",.0f")
    return [*_head(case, q), _value(ours, q), when, _printed(theirs), *ratios(ours, theirs, case.rest(q.key), q.rest)]


def _mean(case: Result, q: Quantity, share: float | None) -> list[Cell]:
    ours, part = (
        case.get(f"nucleus.{q.key}_mean{q.suffix}"),
        case.get(f"share_of_{'area' if case.scene.cell.geometry == 'plane' else 'volume'}_percent.{q.key}"),
    )
    implied = None if share is None else share / 100 * case.get("cell.area_um2") / case.get("nucleus.area_um2")
    paper: Cell = NONE if implied is None else Value(implied, ".2f")
    shown: Cell = NONE if share is None else Value(share, "g")
    return [
        *_head(case, q),
        _value(ours, q),
        paper,
        *ratios(ours, implied, case.rest(q.key), q.rest),
        Value(part, ".2f"),
        shown,
    ]


def _shares(case: Result, q: Quantity) -> list[Cell]:
    values = [case.get(f"{kind}.{q.key}") for kind in ("share_of_max", "share_of_integral")]
    return [*_head(case, q), *(Value(value, ".3f") for value in values)]


def _index(case: Result, outline: tuple[str, str, float], theirs: float | None) -> list[Cell]:
    key, name, circle = outline
    ours = case.get(f"shape_index.{key}")
    known: list[Cell] = [_label(case), name, Value(ours, ".4f"), Value(circle, ".4f"), _printed(theirs)]
    return [*known, *ratios(ours, theirs, circle)]


def _value(value: float, q: Quantity) -> Value:
    return Value(value, ".5f" if q.rest else ".4f")  # the signal of a strain is its difference from rest


def _printed(theirs: float | None) -> Cell:
    return NONE if theirs is None else Value(theirs, printed_form(theirs))
