"""The sheet that panels of deformed cells stand on: places, captions, legend and notes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from cellmech.figures.render import View
from cellmech.figures.results import StudyResult
from cellmech.figures.style import FAULT_COLOUR, LAYER_COLOURS, SMALL, SUBSTRATE, TINY, provenance, wrapped

WIDEST_IN, ALL_PANELS_IN, LEAST_PANEL_IN = {1: 7.2, 2: 5.6}, 14.2, 1.75  # of one panel, of a row, of one again
WIDEST_OF_MANY_IN = 4.6
LEFT_IN, GAP_IN, RIGHT_IN = 0.6, 0.16, 0.15
LINE_IN, TITLE_IN = 0.22, 0.31  # of a line of a report below a panel, of the title
HEADS = ((3.2, 13.0, SMALL), (2.2, 11.0, 8.5), (0.0, 9.0, 7.5))  # font sizes of captions from a width [inches] on
SPACING = 1.32  # of lines, in font sizes
BAR_IN, HANDLE_IN = 2.7, 1.5  # of a colour scale, of an entry of the legend
UNDEFORMED: dict[str, Any] = dict(color="black", lw=0.8, ls=(0, (4, 3)))


@dataclass(frozen=True)
class Caption:
    """What stands above a panel: its name, and what is said of its state."""

    name: str
    state: str
    fault: bool = False


def columns_of(count: int) -> int:
    """Panels in a row: all of up to four, else as many as leave the fewest places empty."""
    least = math.ceil(math.sqrt(count))
    return count if count <= 4 else min(range(least, least + 2 + least // 4), key=lambda n: (-count % n, n))


class Sheet:
    """The figure and its places [inches].

    Args:
        title: of the figure.
        lead: said of all panels.
        captions: one for each case.
        view: what each panel shows [µm].
        factor: by which each case's second panel is magnified; 1 means that there is no such panel.
        reports: lines below each case.
        notes: lines at the foot, and their colours.
        with_bar: whether a colour scale stands beside the legend, for panels whose layers have no colours.
    """

    def __init__(
        self,
        title: str,
        lead: str,
        captions: Sequence[Caption],
        view: View,
        factor: int = 1,
        reports: Sequence[Sequence[str]] = (),
        notes: Sequence[tuple[str, str]] = (),
        with_bar: bool = False,
    ) -> None:
        self.view, self.rows = view, 1 if factor == 1 else 2
        self.columns = columns_of(len(captions))
        widest = WIDEST_IN.get(self.columns, WIDEST_OF_MANY_IN)
        self.wide = max(min(widest, ALL_PANELS_IN / self.columns), LEAST_PANEL_IN)
        self.tall = self.wide * (view[3] - view[2]) / (view[1] - view[0])
        self.width = LEFT_IN + self.columns * (self.wide + GAP_IN) - GAP_IN + RIGHT_IN
        self.size, self.small = next((head, small) for least, head, small in HEADS if self.wide >= least)
        self.captions = [self._wrapped(caption) for caption in captions]
        self.names = max(len(name) for name, _, _ in self.captions) * SPACING * self.size / 72 + 0.02
        self.above = self.names + max(len(state) for _, state, _ in self.captions) * SPACING * self.small / 72 + 0.14
        self.report = max(map(len, reports), default=0) * LINE_IN
        self.reports = reports
        self.block = self.above + self.rows * (self.tall + 0.12) + self.report + 0.1
        inside = self.width - LEFT_IN - RIGHT_IN
        self.title, self.lead = wrapped(title, inside, 15, "bold"), wrapped(lead, inside, SMALL + 1)
        self.notes = [(line, colour) for text, colour in notes for line in wrapped(text, inside, SMALL)]
        count, beside = (2, BAR_IN + 0.15) if with_bar else (len(LAYER_COLOURS) + 2, 0.0)
        self.entries = max(int((inside - beside) / HANDLE_IN), 1)  # of the legend in a row
        legend = max(0.28 * math.ceil(count / self.entries), 0.56 if with_bar else 0.0)
        self.head = 0.2 + TITLE_IN * len(self.title) + LINE_IN * len(self.lead) + legend + 0.2
        self.foot = 0.4 + 0.19 * len(self.notes)
        rows = math.ceil(len(captions) / self.columns)
        self.height = self.head + rows * self.block + self.foot
        self.figure = Figure(figsize=(self.width, self.height))

    def _wrapped(self, caption: Caption) -> tuple[list[str], list[str], bool]:
        inside = self.wide - 0.04
        return (
            wrapped(caption.name, inside, self.size, "bold"),
            wrapped(caption.state, inside, self.small),
            caption.fault,
        )

    def panel(self, index: int, row: int) -> Axes:
        """Axes of a case's panel: row 0 true to scale, 1 magnified."""
        top = self._top(index) - self.above - row * (self.tall + 0.12)
        box = (self._left(index), top - self.tall, self.wide, self.tall)
        low = [value / of for value, of in zip(box, (self.width, self.height) * 2, strict=True)]
        axes = self.figure.add_axes(low, xticks=[], yticks=[])
        axes.spines[:].set_color("#aaaaaa")
        return axes

    def _left(self, index: int) -> float:
        return LEFT_IN + index % self.columns * (self.wide + GAP_IN)

    def _top(self, index: int) -> float:
        return self.height - self.head - index // self.columns * self.block

    def write(self, x: float, y: float, text: str, **look: Any) -> None:
        """Text at a place, from the lower left."""
        self.figure.text(x / self.width, y / self.height, text, **look)

    def finish(self, study: StudyResult, bar: Any = None) -> None:
        """Captions, reports, title, legend, notes.

        Args:
            study: whose origin the small print tells.
            bar: draws a colour scale into axes; None where layers are coloured.
        """
        middle: dict[str, Any] = dict(ha="center", va="top", linespacing=SPACING - 0.12)
        for index, (name, state, fault) in enumerate(self.captions):
            x, top = self._left(index) + self.wide / 2, self._top(index)
            self.write(x, top, "\n".join(name), fontsize=self.size, weight="bold", **middle)
            colour = FAULT_COLOUR if fault else "black"
            self.write(x, top - self.names, "\n".join(state), fontsize=self.small, color=colour, **middle)
        for index, lines in enumerate(self.reports):
            y = self._top(index) - self.above - self.rows * (self.tall + 0.12)
            look: dict[str, Any] = dict(fontsize=SMALL + 1, va="top", linespacing=1.5)
            self.write(self._left(index), y, "\n".join(lines), **look)
        y = self.height - 0.2
        for line in self.title:
            self.write(LEFT_IN, y, line, fontsize=15, weight="bold", va="top")
            y -= TITLE_IN
        for line in self.lead:
            self.write(LEFT_IN, y, line, fontsize=SMALL + 1, va="top")
            y -= LINE_IN
        self._legend(y - 0.05, bar)
        for row, (line, colour) in enumerate(reversed(self.notes)):
            self.write(LEFT_IN, 0.36 + 0.19 * row, line, color=colour, fontsize=SMALL)
        origin = wrapped(provenance(study), self.width - LEFT_IN - RIGHT_IN, TINY)
        more = " …" if len(origin) > 1 else ""
        self.write(LEFT_IN, 0.13, origin[0] + more, fontsize=TINY, color="#555555")

    def _legend(self, top: float, bar: Any) -> None:
        handles: list[Any] = []
        left = LEFT_IN
        if bar is None:
            handles += [Patch(fc=colour, ec="none", label=name) for name, colour in LAYER_COLOURS.items()]
        else:
            box = (left / self.width, (top - 0.3) / self.height, BAR_IN / self.width, 0.11 / self.height)
            bar(self.figure.add_axes(box))
            left += BAR_IN + 0.15
        handles.append(Patch(fc=SUBSTRATE, ec="none", label="substrate"))
        handles.append(Line2D([], [], label="undeformed outline", **UNDEFORMED))
        corner = ((left - 0.1) / self.width, (top + 0.03) / self.height)
        look: dict[str, Any] = dict(frameon=False, fontsize=SMALL + 1, columnspacing=1.4, handlelength=1.6)
        self.figure.legend(handles=handles, ncol=self.entries, loc="upper left", bbox_to_anchor=corner, **look)
