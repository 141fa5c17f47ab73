"""Progress of a study, for a person at a terminal."""

from __future__ import annotations

from contextlib import suppress

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from cellmech.runs.progress import Plain, where

REFRESH_EVERY_S = 0.25


class Display(Plain):
    """A display that is renewed in place: for terminals."""

    def __enter__(self) -> Display:
        self._live = Live(self._picture(), console=Console(), auto_refresh=False, transient=True)
        self._live.start()
        self._next = 0.0
        return self

    def __exit__(self, *error: object) -> None:
        """Leave the terminal as it was."""
        with suppress(OSError):  # here and below: the terminal has been closed
            self._live.stop()

    def line(self, text: str) -> None:
        """Print a line above the display."""
        with suppress(OSError):
            self._live.update(self._picture())
            self._live.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def tick(self) -> None:
        """Renew the display, if that is due."""
        if self.clock() >= self._next:
            self._next = self.clock() + REFRESH_EVERY_S
            with suppress(OSError):
                self._live.update(self._picture(), refresh=True)

    def _picture(self) -> Group:
        table = Table.grid(padding=(0, 2))  # Text: a name is no markup
        for _ in range(3):
            table.add_column(no_wrap=True)
        for index, run in sorted(self.running.items()):
            table.add_row(Text(self.labels[index]), ProgressBar(total=1.0, completed=run.share, width=16), where(run))
        return Group(Text(self.state()), table)
