"""Tables as Markdown that reads well on a terminal too, and as CSV with all digits."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Container, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeAlias

from cellmech.errors import InputError
from cellmech.results.records import write_whole

NONE = "–"


class Value(NamedTuple):
    """A number: rounded in Markdown, all its digits in CSV; one that is not finite is a dash or an empty field."""

    number: float
    form: str

    def __str__(self) -> str:
        return format(self.number, self.form) if math.isfinite(self.number) else NONE


Cell: TypeAlias = str | Value


@dataclass(frozen=True)
class Table:
    """One table.

    Args:
        name: in the name of its CSV file, "" for a document's main one.
        heading: above it.
        text: between heading and table, "" for none.
        header: of the columns.
        rows: their cells.
    """

    name: str
    heading: str
    text: str
    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]

    def markdown(self) -> str:
        """Heading, text, table."""
        rows = [[str(cell) for cell in row] for row in self.rows]
        words = [k for k in range(len(self.header)) if not _is_numeric([row[k] for row in rows])]
        return "\n\n".join(filter(None, [f"### {self.heading}", self.text, markdown(self.header, rows, words)]))

    def csv(self) -> str:
        """The rows alone."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(self.header)
        writer.writerows([_field(cell) for cell in row] for row in self.rows)
        return stream.getvalue()


@dataclass(frozen=True)
class Document:
    """Tables that belong together."""

    title: str
    text: str
    tables: Sequence[Table]
    foot: str = ""

    def markdown(self) -> str:
        """All of it."""
        tables = [table.markdown() for table in self.tables]
        return "\n\n".join(filter(None, [f"## {self.title}", self.text, *tables, self.foot]))

    def save(self, out: Path, stem: str) -> list[Path]:
        """Write <stem>.md and a CSV file for each table.

        Raises:
            InputError: when the folder cannot be written to.
        """
        texts = {f"{stem}.md": self.markdown() + "\n"}
        texts |= {"-".join(filter(None, [stem, table.name])) + ".csv": table.csv() for table in self.tables}
        try:
            out.mkdir(parents=True, exist_ok=True)
            for name, text in texts.items():
                write_whole(out / name, text)
        except OSError as error:
            raise InputError("--out", str(out), f"cannot be written to ({error.strerror or error})") from None
        return [out / name for name in texts]


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]], words: Container[int] = (0, 1)) -> str:
    """A table whose columns are aligned: to the left those of words, to the right all others."""
    lines = [list(header), *map(list, rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(header))]
    text = [
        "| "
        + " | ".join(
            cell.ljust(w) if k in words else cell.rjust(w) for k, (cell, w) in enumerate(zip(line, widths, strict=True))
        )
        + " |"
        for line in lines
    ]
    text.insert(
        1, "|" + "|".join("-" * (w + 2) if k in words else "-" * (w + 1) + ":" for k, w in enumerate(widths)) + "|"
    )
    return "\n".join(text)


def ratios(ours: float, theirs: float | None, rest: float, their_rest: float | None = None) -> list[Cell]:
    """Ours / theirs, of q and of q − q0; dashes where there is nothing to compare with.

    Args:
        ours, theirs: q.
        rest: q0.
        their_rest: theirs, where it is another.
    """
    their_rest = rest if their_rest is None else their_rest
    if theirs is None:
        return [NONE, NONE]
    raw = ours / theirs if theirs else math.nan
    bare = (ours - rest) / (theirs - their_rest) if theirs != their_rest else math.nan
    return [Value(raw, ".3f"), Value(bare, ".4f")]


def _is_numeric(column: Sequence[str]) -> bool:
    """True if most of its cells are numbers."""
    given = [cell for cell in column if cell != NONE]
    return 2 * sum(cell.lstrip("−-")[:1].isdigit() for cell in given) > len(given)


def _field(cell: Cell) -> str:
    if isinstance(cell, Value):
        return repr(float(cell.number)) if math.isfinite(cell.number) else ""
    return "" if cell == NONE else cell
