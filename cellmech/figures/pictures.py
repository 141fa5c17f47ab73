"""The pictures that a run leaves: the deformed cell of each case, coloured by its stress, and all on one sheet.

Run as a program of its own, so that a process that has solved does not load what draws, nor end with it.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cellmech.console import bear_any_text, say
from cellmech.errors import CellmechError, InputError
from cellmech.names import spelt
from cellmech.results.records import PARTIAL

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER, SHEET = "figures", "sheet.png"
FIELD = "sigma_mises_Pa"
PX_PER_IN = 110
FAST = {"compress_level": 3}  # a little larger, in half the time
MARK_WITHIN = 4096  # bytes from a picture's start that hold what it was drawn of


def picture_of(folder: Path, name: str) -> Path:
    """Where the picture of a case of a study lies."""
    return Path(spelt(folder / FOLDER / f"shape-{name}.png"))


def sheet_of(folder: Path) -> Path:
    """Where the sheet of a study lies."""
    return folder / FOLDER / SHEET


def is_drawn(path: Path, mark: str) -> bool:
    """Whether a picture is there and was drawn of what has this mark."""
    try:
        with open(path, "rb") as stream:
            return mark.encode() in stream.read(MARK_WITHIN)
    except OSError:
        return False


def draw_pictures(
    folder: Path,
    cases: Mapping[str, str],
    sheet: Sequence[str] = (),
    mark: str = "",
    title: str = "",
    missing: Mapping[str, str] | None = None,
    count: int = 0,
) -> Iterator[Path]:
    """Draw the pictures of cases, and their sheet; the path of each as it is written.

    Args:
        folder: of the study's results.
        cases: name -> mark of those that get a picture of their own.
        sheet: names of those that stand on the sheet; none for no sheet.
        mark: of the sheet.
        title: of the study.
        missing: name -> what is missing, of cases that cannot be drawn, for the sheet to say.
        count: of cases that could stand on the sheet, if more than do.

    Raises:
        CellmechError: for files that are missing or broken, or a folder that cannot be written to.
    """
    from cellmech.figures.results import StudyResult, differing
    from cellmech.figures.shape_figure import draw_case
    from cellmech.figures.shapes import case_name, draw_shapes
    from cellmech.figures.style import styled
    from cellmech.results.result import load

    found = {name: load(folder / name) for name in dict.fromkeys([*sheet, *cases])}
    study = StudyResult(folder, found, missing or {}, title, differing(found))
    if sheet:
        with styled():
            yield _write(draw_shapes(study, quantity=FIELD, px_per_in=PX_PER_IN, count=count), sheet_of(folder), mark)
    for name, own in cases.items():
        with styled():
            yield _write(
                draw_case(found[name], FIELD, PX_PER_IN, case_name(study, name)), picture_of(folder, name), own
            )


def _write(figure: Figure, path: Path, mark: str) -> Path:
    part = path.with_name(f"{PARTIAL}{os.getpid()}-{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            figure.savefig(part, dpi=PX_PER_IN, metadata={"Software": None, "Comment": mark}, pil_kwargs=FAST)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(str(path.parent), "", f"cannot be written to ({error.strerror or error})") from None
    return path


def main() -> int:
    """Draw what standard input asks for, as JSON of `draw_pictures`; prints the path of each."""
    bear_any_text()
    order: dict[str, Any] = json.load(sys.stdin)
    try:
        for path in draw_pictures(Path(order.pop("folder")), **order):
            say(str(path))
    except CellmechError as error:
        say(str(error), sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
