"""The sheet that panels of deformed cells stand on: places, captions, legend and notes."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from cellmech.figures.render import View
from cellmech.figures.results import StudyResult
from cellmech.figures.style import FAULT_COLOUR, LAYER_COLOURS, SMALL, SUBSTRATE, TINY, provenance

WIDEST_IN, ALL_PANELS_IN = 4.6, 14.2  # of one panel, of a row of them
LEAST_WIDTH_IN = 9.0  # that the legend needs
LEFT_IN, GAP_IN, ABOVE_IN, BELOW_IN, LINE_IN = 0.6, 0.12, 1.55, 1.05, 0.22
UNDEFORMED: dict[str, Any] = dict(color="black", lw=0.8, ls=(0, (4, 3)))


class Sheet:
    """The figure and its places [inches].

    Args:
        columns: number of cases.
        view: what each panel shows [µm].
        factor: by which the lower row's displacements are magnified; 1 means that there is no such row.
        lines: of text below each column.
    """

    def __init__(self, columns: int, view: View, factor: int, lines: int) -> None:
        self.view, self.factor, self.rows = view, factor, 1 if factor == 1 else 2
        self.wide = min(WIDEST_IN, ALL_PANELS_IN / columns)
        self.tall = self.wide * (view[3] - view[2]) / (view[1] - view[0])
        self.below = BELOW_IN + lines * LINE_IN
        self.width = max(columns * (self.wide + GAP_IN) + 0.75, LEAST_WIDTH_IN)
        self.height = self.rows * (self.tall + 0.25) + ABOVE_IN + self.below
        self.figure = Figure(figsize=(self.width, self.height))

    def panel(self, row: int, column: int) -> Axes:
        """Axes of a panel."""
        low = self.height - ABOVE_IN - row * (self.tall + 0.25) - self.tall
        box = (self.left(column) / self.width, low / self.height, self.wide / self.width, self.tall / self.height)
        axes = self.figure.add_axes(box, xticks=[], yticks=[])
        axes.spines[:].set_color("#aaaaaa")
        return axes

    def left(self, column: int) -> float:
        """Left edge of a column."""
        return LEFT_IN + column * (self.wide + GAP_IN)

    def write(self, x: float, y: float, text: str, **look: Any) -> None:
        """Text at a place, from the lower left."""
        self.figure.text(x / self.width, y / self.height, text, **look)

    def write_below(self, column: int, lines: Sequence[str]) -> None:
        """Lines below a column."""
        self.write(
            self.left(column), self.below + 0.12, "\n".join(lines), fontsize=SMALL + 1, va="top", linespacing=1.5
        )

    def finish(self, study: StudyResult) -> None:
        """Legend and notes."""
        self._legend()
        self._notes(study)

    def _legend(self) -> None:
        handles: list[Any] = [Patch(fc=colour, ec="none", label=name) for name, colour in LAYER_COLOURS.items()]
        handles.append(Patch(fc=SUBSTRATE, ec="none", label="substrate"))
        handles.append(Line2D([], [], label="undeformed outline", **UNDEFORMED))
        corner = ((LEFT_IN - 0.1) / self.width, 1 - 0.47 / self.height)
        look: dict[str, Any] = dict(ncol=6, frameon=False, fontsize=SMALL + 1, columnspacing=1.4, handlelength=1.6)
        self.figure.legend(handles=handles, loc="upper left", bbox_to_anchor=corner, **look)

    def _notes(self, study: StudyResult) -> None:
        """Title, what is missing, how the magnified row is drawn, small print."""
        self.write(LEFT_IN, self.height - 0.38, study.title, fontsize=15, weight="bold")
        letters = int(13 * self.width)  # in a line of small print
        if study.faults():
            self.write(LEFT_IN, 0.76, study.complaint(letters), color=FAULT_COLOUR, fontsize=SMALL)
        if self.factor > 1:
            note = (
                f"Lower row: displacements from the lowest point of the cell are drawn {self.factor} times too large, "
                "and so is the distance between the substrate and the undeformed cell: what touches stays in touch, "
                "and a flat substrate looks curved."
            )
            self.write(LEFT_IN, 0.36, textwrap.fill(note, letters), fontsize=SMALL)
        self.write(LEFT_IN, 0.13, provenance(study), fontsize=TINY, color="#555555")
