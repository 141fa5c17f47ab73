"""The paper's numbers beside ours: python -m cellmech.paper compare|report [--results DIR] [--out DIR].

Files are read and written, nothing is solved and DOLFINx is not needed. Exit status: 0; 1 when a case is missing or
failed (the output names it); 2 for bad input.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from cellmech.errors import CellmechError, InputError
from cellmech.paper.comparison import Comparison, compare
from cellmech.paper.printed import PAPER_NUMBERS
from cellmech.records import write_whole


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; the exit status is returned."""
    options = _parser().parse_args(arguments)
    try:
        comparison = compare(options.results, options.paper)
        options.run(options, comparison)
    except CellmechError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1
    faults = comparison.ours.unsolved()
    if faults:
        print(f"warning: {options.results}: not complete: {'; '.join(faults)}", file=sys.stderr)
    return 1 if faults else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m cellmech.paper", description="The paper's numbers beside ours.")
    commands = parser.add_subparsers(required=True, metavar="WHAT")
    for name, run, about, out in (
        (
            "compare",
            _compare,
            "every printed number beside ours: compare.md and compare.csv",
            "DIR of --results/figures",
        ),
        ("report", _report, "one page with figures, comparison and statistics: report.html", "DIR of --results"),
    ):
        command = commands.add_parser(name, help=about, description=about)
        command.add_argument(
            "--results",
            type=Path,
            default=Path("results"),
            metavar="DIR",
            help="has a folder a study; default: %(default)s",
        )
        command.add_argument("--out", type=Path, metavar="DIR", help=f"where to write; default: {out}")
        command.add_argument("--paper", type=Path, default=PAPER_NUMBERS, metavar="FILE", help="the printed numbers")
        command.set_defaults(run=run)
    return parser


def _compare(options: argparse.Namespace, comparison: Comparison) -> None:
    out = options.out or options.results / "figures"
    print("\n".join(comparison.reading()))
    _write(out / "compare.md", comparison.markdown())
    _write(out / "compare.csv", comparison.csv())


def _report(options: argparse.Namespace, comparison: Comparison) -> None:
    from cellmech.paper.report import report_html  # brings Jinja2 and Pillow along

    _write((options.out or options.results) / "report.html", report_html(options.results, comparison))


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text)
    except OSError as error:
        raise InputError("--out", str(path.parent), f"cannot be written to ({error.strerror or error})") from None
    print(path)


if __name__ == "__main__":
    sys.exit(main())
