"""Figures and tables of the paper from files on disk: python -m cellmech.plots fig1|fig2|fig3|table-fig2.

Nothing is solved and DOLFINx is not needed. Exit status: 0; 1 when a case is missing or failed (the figure shows the
others and says so); 2 for bad input.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cellmech.errors import CellmechError, InputError
from cellmech.figures.results import StudyResult, read_study
from cellmech.figures.style import LAWS, save, style
from cellmech.study_file import load_study, read_toml

PAPER_NUMBERS = Path(__file__).resolve().parents[1] / "studies" / "paper_numbers.toml"


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; the exit status is returned."""
    options = _parser().parse_args(arguments)
    try:
        return int(options.run(options))
    except CellmechError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2 if isinstance(error, InputError) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m cellmech.plots", description="Figures and tables from result files."
    )
    commands = parser.add_subparsers(required=True, metavar="FIGURE")
    out = argparse.ArgumentParser(add_help=False)
    out.add_argument("--out", type=Path, default=Path("results/figures"), metavar="DIR", help="default: %(default)s")
    study = argparse.ArgumentParser(add_help=False)
    study.add_argument("--results", type=Path, default=Path("results/fig2"), metavar="DIR", help="default: %(default)s")
    paper = argparse.ArgumentParser(add_help=False)
    paper.add_argument("--paper", type=Path, default=PAPER_NUMBERS, metavar="FILE", help="the paper's printed numbers")

    def add(name: str, run: Any, about: str, *parents: argparse.ArgumentParser) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=about, description=about, parents=list(parents))
        command.set_defaults(run=run)
        return command

    add("fig1", _fig1, "initial geometry of a scene", out).add_argument(
        "--scene", metavar="FILE", help="scene or study file (its first case); default: Table 1"
    )
    add("fig2", _fig2, "stress and strain in the nucleus against time", study, paper, out)
    add("fig3", _fig3, "deformed cells", study, out)
    add("table-fig2", _table, "maxima, means and shares beside the paper's, as Markdown", study, paper)
    return parser


def _fig1(options: argparse.Namespace) -> int:
    from cellmech.figures.geometry_figure import draw_geometry

    scene = load_study(options.scene).cases[0].scene
    with style():
        _say(save(draw_geometry(scene), options.out, "fig1"))
    return 0


def _fig2(options: argparse.Namespace) -> int:
    from cellmech.figures.curves import draw_curves

    study, paper = read_study(options.results, LAWS), _paper(options.paper)
    with style():
        _say(save(draw_curves(study, paper), options.out, "fig2"))
    return _complain(study)


def _fig3(options: argparse.Namespace) -> int:
    from cellmech.figures.shapes import draw_shapes

    study = read_study(options.results, LAWS)
    with style():
        _say(save(draw_shapes(study), options.out, "fig3"))
    return _complain(study)


def _table(options: argparse.Namespace) -> int:
    from cellmech.figures.table import fig2_table

    study = read_study(options.results, LAWS)
    print(fig2_table(study, _paper(options.paper)))
    return _complain(study)


def _paper(path: Path) -> Mapping[str, Any]:
    numbers = read_toml(str(path)).get("fig2")
    if not isinstance(numbers, dict):
        raise InputError(str(path), "fig2", "there must be such a table, with one row for each law")
    return numbers


def _say(paths: Sequence[Path]) -> None:
    for path in paths:
        print(path)


def _complain(study: StudyResult) -> int:
    """Name the cases that are missing or failed; 1 when there are any."""
    complaint = study.complaint()
    if complaint:
        print(f"warning: {study.folder}: {complaint}", file=sys.stderr)
    return 1 if complaint else 0


if __name__ == "__main__":
    sys.exit(main())
