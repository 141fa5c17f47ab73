"""The audit as a picture: what each choice makes of each printed number."""

from __future__ import annotations

import math
import textwrap
from typing import Any, TypeAlias

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from cellmech.figures import FAULT_COLOUR, PAPER, QUANTITIES, SMALL, TINY, Quantity, provenance
from studies.paper.audit import CLOSE, Audit, Tried
from studies.paper.choices import QUESTIONS, SUBJECTS
from studies.paper.printed import LAWS, in_print

WIDTH_IN, HEIGHT_IN = 15.0, 8.2
LIMITS = {"sigma": (0.2, 400.0)}  # of the ratios that are shown
OTHERS = (7e-4, 4.0)
COLOURS = ("#d5312b", "#2f6fc4", "#3a9d45", "#b48a00", "#8c52b5", "#c8569a", "#00857c", "#f5921e")  # of the questions
PAIR_COLOUR, BAND_COLOUR = "#9a9a9a", "#cfe8cf"
Look: TypeAlias = tuple[tuple[str, Any], ...]
HEIGHT = 0.36  # of what the dots of a row are spread over, for one that is 1 high
NOTE = (
    "Ours / printed of the differences from rest (largest values in the nucleus), one dot for each run with a "
    "solution; 1 is agreement. Triangles: the other sign. At the right of each row: the printed value."
)


def draw_audit(audit: Audit) -> Figure:
    """Draw the ratios of all runs: a panel for each quantity, a line for each printed row."""
    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN))
    grid: dict[str, Any] = dict(left=0.085, right=0.965, bottom=0.185, top=0.815, wspace=0.21)
    panels = figure.subplots(1, len(QUANTITIES), sharey=True, gridspec_kw=grid)
    for axes, quantity in zip(panels, QUANTITIES, strict=True):
        _panel(axes, quantity, audit)
    panels[0].set_yticks(range(len(SUBJECTS)), [_label(subject.name) for subject in SUBJECTS])
    panels[0].set_ylim(len(SUBJECTS) - 0.5, -0.5)
    figure.text(0.012, 0.955, f"What open choices make of the numbers in {PAPER}", fontsize=15, weight="bold")
    _legend(figure)
    figure.text(0.012, 0.075, textwrap.fill(NOTE, 215), fontsize=SMALL, va="top")
    if audit.missing():
        figure.text(0.012, 0.1, f"{len(audit.missing())} runs are missing", fontsize=SMALL, color=FAULT_COLOUR)
    figure.text(0.012, 0.018, textwrap.fill(provenance(audit.study), 230), fontsize=TINY, color="#555555")
    return figure


def _label(name: str) -> str:
    return LAWS[name].label if name in LAWS else name


def _panel(axes: Axes, quantity: Quantity, audit: Audit) -> None:
    low, high = LIMITS.get(quantity.paper_key, OTHERS)
    rest = f" − {quantity.rest:g}" if quantity.rest else ""
    axes.set(xscale="log", xlim=(low, high))
    axes.set_title(f"{quantity.symbol}{rest}", pad=8)
    axes.set_xlabel("ours / printed")
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", color="#e4e4e4", lw=0.8)
    axes.set_axisbelow(True)
    axes.axvspan(1 - CLOSE, 1 + CLOSE, color=BAND_COLOUR, lw=0)
    axes.axvline(1, color="#5c9b5c", lw=0.8)
    for line, subject in enumerate(SUBJECTS):
        axes.axhline(line + 0.5, color="#d0d0d0", lw=0.8)
        value = audit.as_printed(subject).printed.get(quantity.paper_key)
        if value is None:
            axes.text(0.5, line, "not printed", transform=axes.get_yaxis_transform(), ha="center", va="center",
                      fontsize=SMALL, color="#888888")  # fmt: skip
            continue
        axes.text(1.02, line, in_print(quantity.paper_key, value), transform=axes.get_yaxis_transform(),
                  va="center", fontsize=TINY, color="#555555")  # fmt: skip
    for look, points in _dots(audit, quantity.paper_key, (low, high)).items():
        axes.plot(*zip(*points, strict=True), ls="none", clip_on=False, **dict(look))


def _dots(audit: Audit, quantity: str, limits: tuple[float, float]) -> dict[Look, list[tuple[float, float]]]:
    """Look -> places of the runs' dots; one choice at a time on top."""
    low, high = limits
    found: dict[Look, list[tuple[float, float]]] = {}
    for line, subject in enumerate(SUBJECTS):
        for tried in reversed(audit.of(subject)):
            ratio = tried.ratios.get(quantity, math.nan)
            if math.isfinite(ratio):
                x = min(max(ratio, low), high) if ratio > 0 else low
                height, look = _look(tried, ratio)
                found.setdefault(look, []).append((x, line + HEIGHT * height))
    return found


def _look(tried: Tried, ratio: float) -> tuple[float, Look]:
    """Where in its row, from -1 at the top to 1, and how a run is drawn."""
    questions, chosen = list(QUESTIONS), tried.trial.chosen
    other: dict[str, Any] = {} if ratio > 0 else {"marker": "<", "mfc": "none", "ms": 5.2, "mew": 1.0}
    if not chosen:
        return 0.0, tuple(({"marker": "|", "color": "black", "ms": 32, "mew": 1.6} | other).items())
    if len(chosen) > 1:
        look = {"marker": "o", "color": PAIR_COLOUR, "ms": 3.4, "alpha": 0.75}
        return 1.0, tuple((look | other).items())
    index = questions.index(next(iter(chosen)))
    return 2 * index / len(questions) - 1, tuple(({"marker": "o", "color": COLOURS[index], "ms": 5.2} | other).items())


def _legend(figure: Figure) -> None:
    dot: dict[str, Any] = dict(marker="o", ls="none", mec="none")
    handles: list[Any] = [Line2D([], [], color="black", lw=1.6, label="as printed")]
    handles += [
        Line2D([], [], color=colour, ms=6, label=question, **dot)
        for question, colour in zip(QUESTIONS, COLOURS, strict=True)
    ]
    handles += [Line2D([], [], color=PAIR_COLOUR, ms=4, label="two choices", **dot)]
    handles += [Patch(fc=BAND_COLOUR, ec="none", label=f"within {100 * CLOSE:g} %")]
    look: dict[str, Any] = dict(ncol=6, frameon=False, fontsize=SMALL, columnspacing=1.6, handletextpad=0.6)
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.006, 0.945), **look)
