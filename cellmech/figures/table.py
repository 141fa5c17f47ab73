"""The numbers of Figure 2 beside the paper's, as Markdown that reads well on a terminal too."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from cellmech.figures.results import CaseResult, StudyResult
from cellmech.figures.style import LAWS, PAPER, QUANTITIES, Quantity, printed, provenance

NAMES = {"sigma_mises": "σ_Mises [Pa]"}
RATIOS = ["here / paper", "same, of q − q0"]


def fig2_table(study: StudyResult, paper: Mapping[str, Any]) -> str:
    """Maxima, means and shares of the nucleus by law, each beside the paper's.

    Args:
        study: cases named after the laws.
        paper: the printed numbers by law, as `[fig2]` of paper_numbers.toml.
    """
    maxima, means, shares = [], [], []
    for law, case in study.cases.items():
        numbers = paper.get(law, {})
        for q in QUANTITIES:
            maxima.append(_maximum(case, q, numbers.get(q.paper_key)))
            means.append(_mean(case, q, numbers.get(f"share_{q.key}")))
            if q.rest:
                shares.append(_shares(case, q))
    key = ["law", "q"]
    parts = [
        f"## The nucleus at the four laws, beside the paper ({PAPER}, section 3.1)",
        "q0 is the value at rest: 2, 2, 1 for J1, J2, J3 and 0 for the stress. – : not printed, or no such number.",
        "### Largest value over time",
        markdown([*key, "here", "at t [s]", "paper", *RATIOS], maxima),
        "### Mean over the reference area at the end, and the nucleus's part of the cell's deformation",
        "Part: 100 · integral of q over the nucleus / area of the cell. The paper does not define its part; "
        "what it prints fits this, and then its mean is the part / 100 · area of the cell / area of the nucleus.",
        markdown([*key, "mean here", "paper's mean", *RATIOS, "part here [%]", "paper [%]"], means),
        "### The nucleus's part in two other senses, at the end",
        markdown([*key, "(max − q0) nucleus / cell", "∫(q − q0) nucleus / cell"], shares),
        provenance(study),
    ]
    return "\n\n".join(parts)


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose columns are aligned."""
    lines = [list(header), *map(list, rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(header))]
    text = [
        "| "
        + " | ".join(
            cell.ljust(w) if k < 2 else cell.rjust(w) for k, (cell, w) in enumerate(zip(line, widths, strict=True))
        )
        + " |"
        for line in lines
    ]
    text.insert(1, "|" + "|".join("-" * (w + 2) if k < 2 else "-" * (w + 1) + ":" for k, w in enumerate(widths)) + "|")
    return "\n".join(text)


def _head(case: CaseResult, q: Quantity) -> list[str]:
    return [LAWS[case.name].label + (" (failed)" if case.failure else ""), NAMES.get(q.key, q.key)]


def _maximum(case: CaseResult, q: Quantity, theirs: float | None) -> list[str]:
    ours = case.number(f"nucleus.{q.key}_max_over_time{q.suffix}")
    when = case.number(f"nucleus.{q.key}_max_time_s")
    paper = "–" if theirs is None else printed(theirs)
    return [*_head(case, q), _value(ours, q), _rounded(when, ",.0f"), paper, *_ratios(ours, theirs, q.rest)]


def _mean(case: CaseResult, q: Quantity, share: float | None) -> list[str]:
    ours, part = case.number(f"nucleus.{q.key}_mean{q.suffix}"), case.number(f"share_of_area_percent.{q.key}")
    implied = None if share is None else share / 100 * case.number("cell.area_um2") / case.number("nucleus.area_um2")
    paper = "–" if implied is None else _rounded(implied, ".2f")
    shown = "–" if share is None else f"{share:g}"
    return [*_head(case, q), _value(ours, q), paper, *_ratios(ours, implied, q.rest), _rounded(part, ".2f"), shown]


def _shares(case: CaseResult, q: Quantity) -> list[str]:
    values = (case.number(f"{kind}.{q.key}") for kind in ("share_of_max", "share_of_integral"))
    return [*_head(case, q), *(_rounded(value, ".3f") for value in values)]


def _ratios(ours: float, theirs: float | None, rest: float) -> list[str]:
    """Of q and of q − q0; the second is the first where q0 is 0."""
    if theirs is None:
        return ["–", "–"]
    raw = ours / theirs if theirs else math.nan
    bare = (ours - rest) / (theirs - rest) if theirs != rest else math.nan
    return [_rounded(raw, ".3f"), _rounded(bare, ".4f")]


def _value(value: float, q: Quantity) -> str:
    return _rounded(value, ".5f" if q.rest else ".4f")  # the signal of a strain is its difference from rest


def _rounded(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "–"
