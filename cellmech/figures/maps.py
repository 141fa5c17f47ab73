"""Four maps of the largest stress and strains in the nucleus over the two parameters of a sweep."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from cellmech.figures.grid import Extreme, Grid, Place, extremes
from cellmech.figures.results import StudyResult
from cellmech.figures.section import significant
from cellmech.figures.style import (
    FAULT_COLOUR,
    PAPER,
    QUANTITIES,
    SMALL,
    TINY,
    Quantity,
    less_rest,
    meaning_of,
    printed,
    provenance,
    rests,
)
from cellmech.scene.variants import value_text

COLOURS = "cividis_r"  # perceptually uniform, for colour-blind eyes and grey print alike; dark is large
HATCH: dict[str, Any] = dict(fc="#f0f0f0", ec="#8a8a8a", hatch="////", lw=0.0)
OURS: dict[str, Any] = {"max": dict(lw=3.2, ls="-"), "min": dict(lw=2.0, ls=(0, (2.2, 1.4)))}
THEIRS = {"max": "^", "min": "v"}
UNSOLVED = "x"
WORDS = {"max": "largest", "min": "smallest"}
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
READABLE = 6  # columns up to which numbers have their full size
DIGITS = 4  # of a panel's largest value
DECADES = 20.0  # largest over smallest size beyond which numbers have three digits each, and positive ones a log scale
LEFT = 0.075
FAULT_CHARACTERS = 310  # of two lines


def draw_maps(study: StudyResult, paper: Mapping[str, Any]) -> Figure:
    """Draw the figure. What has no result is hatched and says why, never filled from its neighbours.

    Args:
        study: of a sweep over two keys.
        paper: the printed numbers of this sweep, as `[fig4]` and `[fig6]` of paper_numbers.toml; {} for none.

    Raises:
        InputError: when the study varies other than two keys, or a number is none.
    """
    grid = Grid(study, paper)
    figure = Figure(figsize=(13.6, 13.0))
    top = 0.857 if study.faults() else 0.870
    place = figure.add_gridspec(2, 2, left=LEFT, right=0.955, bottom=0.150, top=top, wspace=0.25, hspace=0.43)
    for index, quantity in enumerate(QUANTITIES):
        MapPanel(figure.add_subplot(place[index // 2, index % 2]), grid, quantity).draw("abcd"[index])
    _legend(figure, grid)
    _notes(figure, study, bool(paper))
    return figure


class MapPanel:
    """One map: a colour and a number for each case, the extremes marked, the paper's in words below.

    Args:
        axes: to draw on.
        grid: the sweep.
        quantity: what is drawn, less its value at rest.
    """

    def __init__(self, axes: Axes, grid: Grid, quantity: Quantity) -> None:
        self.axes, self.grid, self.quantity = axes, grid, quantity
        values = grid.values(quantity)
        largest = float(np.nanmax(np.abs(values), initial=0.0))
        self.power = 3 * math.floor(math.log10(largest) / 3) if 0 < largest < 1 else 0
        self.values = values / 10.0**self.power
        self.places = extremes(self.values)
        sizes = np.abs(self.values[np.nan_to_num(self.values) != 0.0])
        self.decades = bool(sizes.size and sizes.max() > DECADES * sizes.min())
        self.logarithmic = self.decades and not np.any(self.values <= 0.0)

    def draw(self, letter: str) -> None:
        """Cells, axes, marks, words."""
        q, axes = self.quantity, self.axes
        axes.set_title(f"({letter})  {q.symbol}: {meaning_of(q, self.grid.study.cases.values())}", loc="left", pad=9)
        colours = axes.imshow(self.values, cmap=COLOURS, norm=self._norm(), origin="lower", aspect="auto")
        bar = axes.figure.colorbar(colours, ax=axes, fraction=0.046, pad=0.025)
        bar.set_label(self.label(), fontsize=10.5)
        if self.logarithmic and np.nanmax(self.values) < 100 * np.nanmin(self.values):  # hardly a power of ten
            bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            bar.ax.yaxis.set_minor_formatter(NullFormatter())
        bar.ax.tick_params(labelsize=SMALL)
        for row, column in np.ndindex(*self.grid.shape):
            self._cell((row, column), colours)
        self._frame_ours()
        self._mark_theirs(colours)
        rows, columns = self.grid.shape
        axes.set_xticks(range(columns), map(value_text, self.grid.x_values))
        axes.set_yticks(range(rows), map(value_text, self.grid.y_values))
        axes.set(xlabel=self.grid.x.axis_label, ylabel=self.grid.y.axis_label)
        axes.set_xticks(np.arange(columns - 1) + 0.5, minor=True)
        axes.set_yticks(np.arange(rows - 1) + 0.5, minor=True)
        axes.grid(which="minor", color="white", lw=1.5)
        axes.tick_params(which="both", length=0)
        axes.text(0.0, -0.165, self.words(), transform=axes.transAxes, va="top", fontsize=10.5, linespacing=1.5)

    def label(self) -> str:
        """Label of the quantity that the cells show."""
        q = self.quantity
        return f"largest {q.symbol}{less_rest(q, self.grid.study.cases.values())}  [{self.unit()}]"

    def number(self, value: float) -> str:
        """A value with as many digits as tell neighbours apart; over decades with three that are significant."""
        if self.decades:
            return significant(value)
        largest, span = float(np.nanmax(np.abs(self.values))), float(np.nanmax(self.values) - np.nanmin(self.values))
        digits = [DIGITS - 1 - math.floor(math.log10(largest))] if largest else [1]
        if span:
            digits.append(2 - math.floor(math.log10(span)))
        return f"{value:.{min(max(*digits, 0), 7)}f}".replace("-", "−")

    def words(self) -> str:
        """The extremes, here and in the paper; where they are the map shows."""
        theirs, lines = self._theirs(), []
        unit = f" [{self.unit()}]" if self.power else ""
        for kind, place in self.places.items():
            number = self.number(self.values[place])
            line = f"{WORDS[kind]}{unit}:  {number} here"
            if not self.grid.paper:
                line = f"{WORDS[kind]}{unit}:  {number} at {self.grid.at(place)}"
            elif kind not in theirs:
                line += f";  the paper names no {WORDS[kind]}"
            elif (value := theirs[kind].value) is None:
                line += ";  the value in the paper repeats its largest"
            else:
                line += f";  {self._translated(value)} in the paper"
            lines.append(line)
        return "\n".join(lines) or "no case was solved"

    def unit(self) -> str:
        """Unit of the numbers in the cells."""
        power = f"10{str(self.power).translate(RAISED)}" if self.power else ""
        return f"{power} {self.quantity.unit}".strip() or "–"

    def _translated(self, value: float) -> str:
        """A printed value in the panel's unit, and as printed."""
        q = self.quantity
        if not q.rest:
            return printed(value)
        above = (value - q.rest) / 10.0**self.power
        return f"{above:,.{0 if above >= 100 else 2}f} ({q.symbol} = {printed(value)})"

    def _norm(self) -> Normalize:
        if not self.places:
            return Normalize(0.0, 1.0)
        low, high = float(np.nanmin(self.values)), float(np.nanmax(self.values))
        if self.logarithmic:
            return LogNorm(low, high)
        return Normalize(low, high if high > low else low + 1.0)

    def _theirs(self) -> dict[str, Extreme]:
        found = {kind: self.grid.printed_extreme(kind, self.quantity) for kind in THEIRS}
        return {kind: extreme for kind, extreme in found.items() if extreme is not None}

    def _ink(self, place: Place, colours: Any) -> str:
        """Black or white, whichever reads better on a cell."""
        if np.isnan(self.values[place]):
            return "black"
        r, g, b, _ = matplotlib.colormaps[COLOURS](colours.norm(self.values[place]))
        return "black" if 0.299 * r + 0.587 * g + 0.114 * b > 0.5 else "white"

    def _cell(self, place: Place, colours: Any) -> None:
        row, column = place
        look: dict[str, Any] = dict(ha="center", va="center", gid=f"cell:{row},{column}")
        narrow = min(1.0, READABLE / self.grid.shape[1])
        if np.isnan(self.values[place]):
            self.axes.add_patch(Rectangle((column - 0.5, row - 0.5), 1, 1, zorder=1.5, gid="lack", **HATCH))
            box: dict[str, Any] = dict(boxstyle="round,pad=0.2", fc="white", ec="none")
            self.axes.text(
                column,
                row - 0.06,
                self.grid.lack(place),
                color=FAULT_COLOUR,
                fontsize=narrow * SMALL,
                bbox=box,
                **look,
            )
        else:
            text = self.number(self.values[place])
            ink = self._ink(place, colours)
            self.axes.text(column, row + 0.06, text, color=ink, fontsize=narrow * 11.5, **look)

    def _frame_ours(self) -> None:
        for kind, (row, column) in self.places.items():
            corner, size = (column - 0.44, row - 0.43), (0.88, 0.86)
            # black on white: a frame is seen on dark cells and on light ones
            for colour, more in (("white", 2.2), ("black", 0.0)):
                look = OURS[kind] | {"lw": OURS[kind]["lw"] + more} | ({"ls": "-"} if more else {})
                frame = Rectangle(corner, *size, fc="none", ec=colour, zorder=3 if more else 3.1, **look)
                frame.set_gid(f"here:{kind}" if not more else None)
                self.axes.add_patch(frame)

    def _mark_theirs(self, colours: Any) -> None:
        for kind, extreme in self._theirs().items():
            text = "paper" if extreme.value is None else f"paper {printed(extreme.value)}"
            self._mark(extreme.place, -0.28, THEIRS[kind], text, colours).set_gid(f"paper:{kind}")
        unsolved = self.grid.place_of(self.grid.paper.get("not_converged"))
        if unsolved is not None:
            self._mark(unsolved, 0.27, UNSOLVED, "paper", colours)

    def _mark(self, place: Place, up: float, marker: str, text: str, colours: Any) -> Line2D:
        """A marker with a word beside it, so far above a cell's middle."""
        (row, column), ink = place, self._ink(place, colours)
        self.axes.text(column - 0.27, row + up - 0.01, text, color=ink, fontsize=TINY, va="center", zorder=4)
        mark: Line2D = self.axes.plot(
            [column - 0.345], [row + up], marker=marker, ls="", ms=5.5, mew=1.6, mec=ink, color=ink, zorder=4
        )[0]
        return mark


def _legend(figure: Figure, grid: Grid) -> None:
    handles: list[Any] = [
        Patch(fc="none", ec="black", label=WORDS[k] + " here" * bool(grid.paper), **OURS[k]) for k in OURS
    ]
    labels = {THEIRS[kind]: f"the paper's {WORDS[kind]}, as printed" for kind in THEIRS if grid.paper}
    if grid.place_of(grid.paper.get("not_converged")) is not None:
        labels[UNSOLVED] = "not solved in the paper"
    look: dict[str, Any] = dict(ls="", ms=7, mew=1.8, color="black")
    handles += [Line2D([], [], marker=marker, label=label, **look) for marker, label in labels.items()]
    if grid.study.faults():
        handles.append(Patch(label="no value", **HATCH))
    place: dict[str, Any] = dict(loc="upper left", bbox_to_anchor=(LEFT - 0.012, 0.944), ncol=6, frameon=False)
    figure.legend(handles=handles, fontsize=SMALL + 0.5, columnspacing=1.5, **place)


def _notes(figure: Figure, study: StudyResult, with_paper: bool) -> None:
    """Title, what is missing, how to read the numbers, small print."""
    ends = sorted({case.scene.time.end_s for case in study.cases.values()})
    when = " and ".join(f"{end:,.0f}" for end in ends)
    figure.text(LEFT, 0.970, study.title, fontsize=15, weight="bold")
    lead = f"Largest stress and strains in the nucleus at t = {when} s, one cell of a map for each simulation."
    figure.text(LEFT, 0.949, lead, fontsize=11.5)
    if study.faults():
        lines = textwrap.wrap(study.complaint(FAULT_CHARACTERS), FAULT_CHARACTERS // 2 + 5)
        figure.text(LEFT, 0.9155, "\n".join(lines), color=FAULT_COLOUR, fontsize=SMALL, va="top")
    rest = f"Strains are shown less their value at rest ({rests(study.cases.values())} for $J_1$, $J_2$, $J_3$). "
    figure.text(LEFT, 0.040, rest + f"Paper: {PAPER}." * with_paper, fontsize=SMALL)
    figure.text(LEFT, 0.020, provenance(study), fontsize=TINY, color="#555555")
