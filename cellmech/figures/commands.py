"""Reports and comparisons from the command line: `python -m cellmech.report`, `python -m cellmech.compare`.

Nothing is solved and DOLFINx is not needed. Exit status: 0; 1 when a case failed or is missing (the output names it);
2 for bad input.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cellmech.console import bear_any_text, say
from cellmech.errors import CellmechError, InputError
from cellmech.names import path_there
from cellmech.results.records import write_whole
from cellmech.surroundings import open_streams, refuse_other_numpy

if TYPE_CHECKING:
    from cellmech.figures.results import StudyResult

MOST_FAULTS = 60  # that are named


def compare_main(arguments: Sequence[str] | None = None, name: str = "python -m cellmech.compare") -> int:
    """The command line of `compare`, called so; the exit status is returned."""
    return run_command(compare_parser(name), arguments, _compare)


def report_main(arguments: Sequence[str] | None = None, name: str = "python -m cellmech.report") -> int:
    """The command line of `report`, called so; the exit status is returned."""
    return run_command(report_parser(name), arguments, _report)


def compare_parser(name: str = "python -m cellmech.compare") -> argparse.ArgumentParser:
    """The arguments of `compare`."""
    parser = _parser(name, "A study's numbers beside reference numbers: compare.md and compare.csv.")
    parser.add_argument("reference", type=path_there, metavar="REFERENCE.toml", help="the numbers to compare with")
    parser.add_argument("--out", type=path_there, metavar="DIR", help="where to write; default: STUDYDIR/figures")
    return parser


def report_parser(name: str = "python -m cellmech.report") -> argparse.ArgumentParser:
    """The arguments of `report`."""
    parser = _parser(name, "A study's results as one page: report.html.")
    parser.add_argument("--reference", type=path_there, metavar="FILE", help="TOML file of numbers to compare with")
    parser.add_argument("--draw", action="store_true", help="draw each deformed cell into STUDYDIR/figures before")
    parser.add_argument("--out", type=path_there, metavar="DIR", help="where to write; default: STUDYDIR")
    return parser


def _parser(name: str, about: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=name, description=about)
    parser.add_argument("results", type=path_there, metavar="STUDYDIR", help="folder of the study's results")
    return parser


def run_command(
    parser: argparse.ArgumentParser,
    arguments: Sequence[str] | None,
    command: Callable[[argparse.Namespace], list[str]],
) -> int:
    """Read the command line and do what it says; the exit status is returned.

    Args:
        parser: of the command line; what it reads has the folder that it is about as `results`.
        arguments: the words; those of the process if None.
        command: does it; what is missing or failed is returned, a line each.
    """
    open_streams()
    bear_any_text()
    options = parser.parse_args(arguments)
    try:
        refuse_other_numpy()
        faults = command(options)
    except CellmechError as error:
        say(f"error: {error}", sys.stderr)
        return 2 if isinstance(error, InputError) else 1
    if faults:
        more = f"; and {len(faults) - MOST_FAULTS} more" if len(faults) > MOST_FAULTS else ""
        text = "; ".join(faults[:MOST_FAULTS]) + more
        say(f"warning: {options.results}: not complete: {text}", sys.stderr)
    return 1 if faults else 0


def _compare(options: argparse.Namespace) -> list[str]:
    from cellmech.figures.comparison import compare

    comparison = compare(options.results, options.reference)
    say("\n".join(comparison.reading()))
    out = options.out or options.results / "figures"
    write_text(out / "compare.md", comparison.markdown())
    write_text(out / "compare.csv", comparison.csv())
    return comparison.study.faults()


def _report(options: argparse.Namespace) -> list[str]:
    from cellmech.figures.comparison import compare
    from cellmech.figures.page import report
    from cellmech.figures.results import read_all

    study = read_all(options.results)
    if options.draw:
        _draw(study)
    comparison = compare(options.results, options.reference) if options.reference else None
    write_text((options.out or options.results) / "report.html", report(study, comparison))
    return study.faults()


def _draw(study: StudyResult) -> None:
    """The deformed cell of each case that has fields, into `figures` of the study's folder."""
    from cellmech.figures.pictures import draw_pictures

    names = [name for name, case in study.cases.items() if (case.folder / "fields.pvd").is_file()]
    for path in draw_pictures(study.folder, dict.fromkeys(names, "")):
        say(str(path))


def write_text(path: Path, text: str) -> None:
    """Write a text file whole, its folder made if need be, and say its name.

    Raises:
        InputError: when the folder cannot be written to.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text)
    except OSError as error:
        raise InputError("--out", str(path.parent), f"cannot be written to ({error.strerror or error})") from None
    say(str(path))
