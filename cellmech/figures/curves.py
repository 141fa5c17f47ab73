"""Figure 2: the largest stress and strain in the nucleus against time, one curve per law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cellmech.errors import InputError
from cellmech.figures.panel import PAPER_MARKER, STEP_MARKER, Panel
from cellmech.figures.results import StudyResult
from cellmech.figures.style import (
    FAULT_COLOUR,
    LAWS,
    PAPER,
    QUANTITIES,
    SMALL,
    TINY,
    Quantity,
    less_rest,
    meaning_of,
    provenance,
    rests,
)

LEFT = 0.075


def draw_curves(study: StudyResult, paper: Mapping[str, Any]) -> Figure:
    """Draw the figure.

    Args:
        study: cases named after the laws.
        paper: the printed maxima by law, as `[fig2]` of paper_numbers.toml.

    Raises:
        InputError: for a history that is missing or broken, or a case that is not named after a law.
    """
    for name in study.cases:
        if name not in LAWS:
            raise InputError(str(study.folder), "case", f"must be named after a law ({', '.join(LAWS)})", name)
    cases = study.holding("history.csv")
    columns = {q: f"nucleus.{q.key}_max{q.suffix}" for q in QUANTITIES}
    curves = {law: case.history("t_s", *columns.values()) for law, case in cases.items()}
    figure = Figure(figsize=(13.6, 9.4))
    grid = figure.add_gridspec(2, 2, left=LEFT, right=0.868, bottom=0.125, top=0.855, wspace=0.62, hspace=0.34)
    for index, (quantity, column) in enumerate(columns.items()):
        ours = {law: (of["t_s"], of[column] - cases[law].rest(quantity.key)) for law, of in curves.items()}
        less = less_rest(quantity, cases.values())
        place, meaning = grid[index // 2, index % 2], meaning_of(quantity, cases.values())
        panel = Panel(figure, place, quantity, ours, _printed(paper, quantity), less, meaning)
        panel.draw("abcd"[index])
        for law, case in cases.items():
            if case.failure:
                panel.mark_failure(law)
        for end in {case.scene.ramp_end_s for case in cases.values()}:
            panel.mark_time(end, "full weight")
    _legend(figure, list(cases))
    _notes(figure, study)
    return figure


def _printed(paper: Mapping[str, Any], quantity: Quantity) -> dict[str, float]:
    return {law: float(paper[law][quantity.paper_key]) for law in LAWS if quantity.paper_key in paper.get(law, {})}


def _legend(figure: Figure, laws: list[str]) -> None:
    looks = [LAWS[law] for law in laws]
    handles = [Line2D([], [], color=look.colour, lw=look.width, ls=look.dash, label=look.label) for look in looks]
    handles.append(Line2D([], [], color="#888888", label="computed time step", **STEP_MARKER))
    handles.append(Line2D([], [], color="#888888", label="the paper's printed maximum", **PAPER_MARKER))
    place: dict[str, Any] = dict(loc="upper left", bbox_to_anchor=(LEFT - 0.005, 0.944), ncol=6, frameon=False)
    figure.legend(handles=handles, fontsize=SMALL + 0.5, handlelength=3.2, columnspacing=1.4, **place)


def _notes(figure: Figure, study: StudyResult) -> None:
    """Title, what is missing, how the axes are meant, small print."""
    title = "Largest stress and strain in the nucleus while the cell settles"
    figure.text(LEFT, 0.972, study.title, fontsize=15, weight="bold")
    figure.text(LEFT, 0.950, title, fontsize=11.5)
    if study.faults():
        figure.text(LEFT, 0.896, study.complaint(150), color=FAULT_COLOUR, fontsize=SMALL)
    rest = f"Strains are drawn less their value at rest (J₁, J₂, J₃ = {rests(study.cases.values())}). "
    paper = f"The paper ({PAPER}, section 3.1) prints maxima only, not when they occur."
    figure.text(LEFT, 0.042, rest + paper, fontsize=SMALL)
    figure.text(LEFT, 0.018, provenance(study), fontsize=TINY, color="#555555")
