"""One panel of a figure over time: curves on a readable scale, and the paper's maxima wherever they lie."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from cellmech.figures.style import LAWS, SMALL, TINY, LawStyle, Quantity, printed, spread, text_width_in

BREAK = 1.6  # the paper's maxima get a strip of their own when they are this many times ours
LINE_HEIGHT = 0.068  # of the paper's labels, in heights of a whole panel
GAP_IN = 0.055  # between a line and its text [inches]
LABEL_IN = 0.72  # from an axis to its label [inches]
STEP_MARKER: dict[str, Any] = dict(ls="", marker="o", ms=2.6, mec="black", mew=0.35)
PAPER_MARKER: dict[str, Any] = dict(ls="", marker="<", ms=6.5, mec="black", mew=0.4)


class Panel:
    """Our curves in `main`; the paper's maxima beside them, or above in a `strip` of their own scale.

    Args:
        figure: to draw on.
        place: of the whole panel in the figure's grid.
        quantity: what is drawn, less its value at rest.
        ours: case -> times [s] and values, these less theirs at rest.
        looks: how to draw each case.
        paper: law -> printed maximum.
        less: what was taken off ours, to stand behind the quantity's name.
        meaning: of the quantity.
    """

    def __init__(
        self,
        figure: Figure,
        place: Any,
        quantity: Quantity,
        ours: Mapping[str, tuple[np.ndarray, np.ndarray]],
        looks: Mapping[str, LawStyle],
        paper: Mapping[str, float],
        less: str,
        meaning: str,
    ) -> None:
        self.quantity, self.paper, self.ours, self.looks = quantity, paper, ours, looks
        self.less, self.meaning = less, meaning
        low, high = (find(0.0, *(float(v) for _, y in self.ours.values() for v in y if v == v)) for find in (min, max))
        theirs = max((value - quantity.rest for value in paper.values()), default=0.0)
        self.strip: Axes | None = None
        self.whole = place.get_position(figure).height
        if theirs > BREAK * high:
            inner = place.subgridspec(2, 1, height_ratios=[1, 2.4], hspace=0.09)
            self.strip, self.main = figure.add_subplot(inner[0]), figure.add_subplot(inner[1])
            self.strip.set_ylim(0.0, 1.25 * theirs)
        else:
            self.main = figure.add_subplot(place)
            high = max(high, theirs)
        span = high - low or 1.0
        self.main.set_ylim(low - 0.04 * span, high + 0.12 * span)

    def draw(self, letter: str) -> None:
        """Curves, axes and the paper's maxima."""
        q, main = self.quantity, self.main
        for law, (t, values) in self.ours.items():
            look = self.looks[law]
            line: dict[str, Any] = dict(color=look.colour, lw=look.width, ls=look.dash, label=look.label)
            main.plot(t, values, **line, zorder=look.order, gid=f"law:{law}")
            main.plot(t, values, color=look.colour, zorder=3, **STEP_MARKER)
        (self.strip or main).set_title(f"({letter})  {q.symbol}: {self.meaning}", loc="left")
        main.set_ylabel(f"largest {q.symbol}" + f"{self.less}  [{q.unit or '–'}]")
        width = main.get_position().width * main.figure.get_figwidth()
        main.yaxis.set_label_coords(-LABEL_IN / width, 0.5)
        main.set_xlabel("time [s]")
        for axes in filter(None, (main, self.strip)):
            axes.set_xlim(0.0, max(float(t[-1]) for t, _ in self.ours.values()) or 1.0)
            axes.grid(color="#e2e2e2", lw=0.7)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
        main.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
        main.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 3, 5, 10]))
        main.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        if self.strip is not None:
            self._break(self.strip)
        if self.paper:
            self._mark_paper(self.strip or main)

    def _break(self, strip: Axes) -> None:
        """Show that the strip continues the axis on another scale."""
        strip.spines["bottom"].set_linestyle((0, (2, 3)))
        strip.tick_params(bottom=False, labelbottom=False)
        strip.yaxis.set_major_locator(MaxNLocator(3, prune="lower"))
        strip.set_facecolor("#f6f3ea")
        slash: dict[str, Any] = dict(marker=[(-1, -0.6), (1, 0.6)], ms=9, ls="", color="black", mew=1, clip_on=False)
        strip.plot([0], [0], transform=strip.transAxes, **slash)
        self.main.plot([0], [1], transform=self.main.transAxes, **slash)
        note = "axis broken: the paper's maxima, other scale"
        strip.text(0.012, 0.9, note, transform=strip.transAxes, va="top", fontsize=TINY)

    def _mark_paper(self, axes: Axes) -> None:
        """The printed maxima at the right edge, with labels that do not cover each other."""
        q, (low, high) = self.quantity, axes.get_ylim()
        gap = LINE_HEIGHT * self.whole / axes.get_position().height
        laws = sorted(self.paper, key=lambda law: self.paper[law])
        marks = [(self.paper[law] - q.rest - low) / (high - low) for law in laws]
        labels = spread(marks, gap, most=1.12 if self.strip is not None else 1.0)
        free: dict[str, Any] = dict(transform=axes.transAxes, clip_on=False)
        beside: dict[str, Any] = dict(transform=axes.transAxes, va="center", fontsize=SMALL)
        for law, mark, label in zip(laws, marks, labels, strict=True):
            colour = LAWS[law].colour
            axes.plot([0.955, 1.0], [mark, mark], color=colour, lw=1.6, **free)
            axes.plot([1.012], [mark], color=colour, gid=f"paper:{law}", zorder=4, **PAPER_MARKER, **free)
            axes.plot([1.03, 1.065], [mark, label], color="#777777", lw=0.7, **free)
            axes.text(1.075, label, f"{printed(self.paper[law])} {LAWS[law].label}", **beside)
        head = f"paper: {q.symbol}" + (f" [{q.unit}]" if q.unit else "")
        axes.text(1.075, max(labels) + 1.15 * gap, head, style="italic", **beside)

    def mark_failure(self, case: str) -> None:
        """A cross where a failed case stopped."""
        t, values = self.ours[case]
        self.main.plot(
            t[-1:], values[-1:], "X", ms=10, color=self.looks[case].colour, mec="black", clip_on=False, zorder=5
        )

    def mark_times(self, times_s: Iterable[float], text: str) -> None:
        """Dotted lines at times [s] inside the panel, each with a text at its top where no other stands.

        The top is free of curves; the text is on the side of the line where it has room.
        """
        low, high = self.main.get_xlim()
        axes_in = self.main.get_position().width * self.main.figure.get_figwidth()
        wide = (text_width_in(text, TINY) + 2 * GAP_IN) / axes_in * (high - low)
        taken = low
        for t_s in sorted(t for t in set(times_s) if 0.0 < t < high):
            self.main.axvline(t_s, color="#555555", lw=1.0, ls=":", zorder=1)
            start, side = (t_s, 1) if t_s + wide <= high else (t_s - wide, -1)
            if start < taken:
                continue
            taken = start + wide
            look: dict[str, Any] = dict(fontsize=TINY, color="#555555", va="top", ha="left" if side > 0 else "right")
            place, offset = (t_s, self.main.get_ylim()[1]), (72 * GAP_IN * side, -2)
            self.main.annotate(text, place, offset, textcoords="offset points", zorder=6, **look)
