"""The largest stress and strain in the nucleus against time, a curve for each case."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cellmech.errors import InputError
from cellmech.figures.panel import PAPER_MARKER, STEP_MARKER, Panel
from cellmech.figures.results import StudyResult
from cellmech.figures.shapes import case_name
from cellmech.figures.style import (
    FAULT_COLOUR,
    PAPER,
    QUANTITIES,
    SMALL,
    TINY,
    LawStyle,
    Quantity,
    less_rest,
    looks_of,
    meaning_of,
    provenance,
    rests,
    text_width_in,
)

LEFT_IN, WIDE_IN, TALL_IN = 1.02, 13.6, 7.0
ROW_IN, ABOVE_IN, BELOW_IN = 0.26, 1.28, 1.15  # of the legend; above the panels without it; below them


def draw_curves(study: StudyResult, paper: Mapping[str, Any] | None = None) -> Figure:
    """Draw the largest stress and strains in the nucleus against time, a curve for each case.

    Args:
        study: its cases.
        paper: printed maxima by law, as `[fig2]` of paper_numbers.toml, for cases named after laws.

    Raises:
        InputError: for a history that is missing or broken, or when no case has one of several times.
    """
    cases, paper = study.holding("history.csv"), paper or {}
    columns = {q: f"nucleus.{q.key}_max{q.suffix}" for q in QUANTITIES}
    curves = {name: case.history("t_s", *columns.values()) for name, case in cases.items()}
    if all(len(of["t_s"]) < 2 for of in curves.values()):
        hint = "Such cases have their end only; time.history = true computes the way there."
        raise InputError(str(study.folder), "", "holds no case with several times", None, hint)
    names = {name: case_name(study, name) for name in cases}
    looks = {name: replace(look, label=names[name]) for name, look in looks_of(list(cases)).items()}
    handles = _handles(looks, any(_printed(paper, q, cases) for q in QUANTITIES))
    longest = max(text_width_in(str(handle.get_label()), SMALL + 0.5) for handle in handles) + 0.75
    columns_of_legend = max(int((WIDE_IN - LEFT_IN) / longest), 1)
    head = ABOVE_IN + ROW_IN * math.ceil(len(handles) / columns_of_legend) + 0.22 * bool(study.faults())
    height = head + TALL_IN + BELOW_IN
    figure = Figure(figsize=(WIDE_IN, height))
    left, marked = LEFT_IN / WIDE_IN, len(handles) > len(cases) + 1
    place: dict[str, Any] = dict(left=left, bottom=BELOW_IN / height, top=1 - head / height)
    space: dict[str, Any] = dict(right=0.868, wspace=0.62) if marked else dict(right=0.97, wspace=0.24)
    grid = figure.add_gridspec(2, 2, hspace=0.34, **place, **space)
    for index, (quantity, column) in enumerate(columns.items()):
        ours = {name: (of["t_s"], of[column] - cases[name].rest(quantity.key)) for name, of in curves.items()}
        less, meaning = less_rest(quantity, cases.values()), meaning_of(quantity, cases.values())
        where, printed = grid[index // 2, index % 2], _printed(paper, quantity, cases)
        panel = Panel(figure, where, quantity, ours, looks, printed, less, meaning)
        panel.draw("abcd"[index])
        for name, case in cases.items():
            if case.failure:
                panel.mark_failure(name)
        panel.mark_times((case.scene.ramp_end_s for case in cases.values()), "full weight")
    look: dict[str, Any] = dict(loc="upper left", ncol=columns_of_legend, frameon=False, fontsize=SMALL + 0.5)
    corner = (left - 0.005, 1 - 0.62 / height)
    figure.legend(handles=handles, bbox_to_anchor=corner, handlelength=3.2, columnspacing=1.4, **look)
    _notes(figure, study, head, marked)
    return figure


def _printed(paper: Mapping[str, Any], quantity: Quantity, cases: Iterable[str]) -> dict[str, float]:
    return {name: float(paper[name][quantity.paper_key]) for name in cases if quantity.paper_key in paper.get(name, {})}


def _handles(looks: Mapping[str, LawStyle], with_paper: bool) -> list[Line2D]:
    lines = [Line2D([], [], color=of.colour, lw=of.width, ls=of.dash, label=of.label) for of in looks.values()]
    lines.append(Line2D([], [], color="#888888", label="computed time step", **STEP_MARKER))
    if with_paper:
        lines.append(Line2D([], [], color="#888888", label="the paper's printed maximum", **PAPER_MARKER))
    return lines


def _notes(figure: Figure, study: StudyResult, head: float, marked: bool) -> None:
    """Title, what is missing, how the axes are meant, small print."""
    height, left = figure.get_figheight(), LEFT_IN / WIDE_IN
    title = "Largest stress and strain in the nucleus while the cell settles"
    figure.text(left, 1 - 0.32 / height, study.title, fontsize=15, weight="bold")
    figure.text(left, 1 - 0.56 / height, title, fontsize=11.5)
    if study.faults():
        place = (left, 1 - (head - 0.42) / height)
        figure.text(*place, study.complaint(150), color=FAULT_COLOUR, fontsize=SMALL)
    rest = f"Strains are drawn less their value at rest (J₁, J₂, J₃ = {rests(study.cases.values())}). "
    paper = f"The paper ({PAPER}, section 3.1) prints maxima only, not when they occur." if marked else ""
    figure.text(left, 0.38 / height, rest + paper, fontsize=SMALL)
    figure.text(left, 0.16 / height, provenance(study), fontsize=TINY, color="#555555")
