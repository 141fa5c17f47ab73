"""What the columns of result files mean, `cellmech/results/columns.csv`, from the page that says it, docs/files.md.

    python tools/columns.py

writes the file anew, from which each study's columns.csv is made; `make docs` does so, and a test fails where it is
old.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE, FILE = ROOT / "docs" / "files.md", ROOT / "cellmech" / "results" / "columns.csv"


def rows(text: str) -> Iterator[tuple[str, str, str]]:
    """Name, unit and meaning of each number in the tables about result.json; `.J2` goes on from the name before it."""
    part = text[text.index("## Numbers of result.json") : text.index("## Fields")]
    for line in part.splitlines():
        if not line.startswith("| `"):
            continue
        first, *unit, meaning = (cell.strip() for cell in line.strip("|").split("|"))
        name = ""
        for found in re.findall(r"`([^`]+)`", first):
            name = name.rpartition(".")[0] + found if found.startswith(".") else found
            members = re.findall(r"`([^`]+)`", meaning)
            if meaning == ", ".join(
                f"`{member}`" for member in members
            ):  # a table, of which the names say what they are
                yield from ((f"{name}.{one}", "", f"of the elements: {one.replace('_', ' ')}") for one in members)
                continue
            yield name, "".join(unit), re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", meaning).replace("`", "")


def table() -> str:
    """The file's content."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(("name", "unit", "meaning"))
    writer.writerows(rows(PAGE.read_text(encoding="utf-8")))
    return stream.getvalue()


if __name__ == "__main__":
    FILE.write_text(table(), encoding="utf-8")
