"""The figures and tables of the paper, from the results of its studies; its fig1 is the geometry of any scene."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from cellmech.errors import InputError
from cellmech.figures.results import StudyResult, read_planned
from cellmech.figures.saving import complain, draw_and_save, print_and_save
from cellmech.names import path_there
from cellmech.scene.studies import load_study
from cellmech.scene.toml_file import read_toml

STUDIES = Path(__file__).resolve().parents[2] / "studies"
PAPER_NUMBERS = STUDIES / "paper_numbers.toml"


def add_paper(add: Callable[..., argparse.ArgumentParser], scene: str) -> None:
    """Add the commands of fig2 to fig7 and of the tables.

    Args:
        add: makes a command of a name, what it runs, and what is to be said of it.
        scene: what is to be said of a scene file.
    """

    def add_study(name: str, run: Any, about: str, study: str, numbers: str) -> None:
        command = add(name, run, about)
        results = Path("results") / study
        command.add_argument("--results", type=path_there, default=results, metavar="DIR", help="default: %(default)s")
        command.set_defaults(numbers=numbers)
        _add_study_file(command, study)
        _add_paper(command)

    add_study("fig2", _curves, "the paper's: stress and strain in the nucleus against time", "fig2", "fig2")
    add_study("fig3", _shapes, "the paper's: deformed cells at the four laws", "fig3", "fig2")
    add_study("fig4", _maps, "the paper's: maps over the fluid fractions", "fig4", "fig4")
    add_study("fig5", _shapes, "the paper's: deformed cells at the largest strains of Figures 4 and 6", "fig5", "fig4")
    add_study("fig6", _maps, "the paper's: maps over the moduli", "fig6", "fig6")
    add_study("fig7", _described_shapes, "the paper's: deformed cells in S1, S2, S3", "fig7", "table3")
    add("table1", _table1, "parameters, beside the paper's").add_argument("--scene", metavar="FILE", help=scene)
    table2 = add("table2", _table2, "the simulations S1, S2, S3")
    _add_study_file(table2, "table3")
    _add_paper(table2)
    table2.set_defaults(numbers="table3")
    add_study("table3", _table3, "maxima and shape index in S1, S2, S3", "table3", "table3")
    add_study("table-fig2", _table_fig2, "maxima, means and shares at the four laws", "fig2", "fig2")


def _add_study_file(command: argparse.ArgumentParser, stem: str) -> None:
    about = "the study file, which says what cases there are; default: %(default)s"
    command.add_argument("--study", type=path_there, default=STUDIES / f"{stem}.toml", metavar="FILE", help=about)


def _add_paper(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--paper", type=path_there, default=PAPER_NUMBERS, metavar="FILE", help="the paper's printed numbers"
    )


def _curves(options: argparse.Namespace) -> int:
    from cellmech.figures.curves import draw_curves

    study = _study(options)
    return draw_and_save(options, draw_curves, study, _paper(options)) or complain(study)


def _maps(options: argparse.Namespace) -> int:
    from cellmech.figures.maps import draw_maps

    study = _study(options)
    return draw_and_save(options, draw_maps, study, _paper(options)) or complain(study)


def _shapes(options: argparse.Namespace) -> int:
    from cellmech.figures.shapes import draw_shapes

    study = _study(options)
    return draw_and_save(options, partial(draw_shapes, magnify=True), study) or complain(study)


def _described_shapes(options: argparse.Namespace) -> int:
    from cellmech.figures.nucleus import nucleus_lines
    from cellmech.figures.shapes import draw_shapes

    study, paper = _study(options), _paper(options)
    draw = partial(draw_shapes, report=lambda case: nucleus_lines(case, paper), magnify=True)
    return draw_and_save(options, draw, study) or complain(study)


def _table1(options: argparse.Namespace) -> int:
    from cellmech.figures.parameter_tables import table1

    return print_and_save(options, table1(load_study(options.scene).cases[0].scene))


def _table2(options: argparse.Namespace) -> int:
    from cellmech.figures.parameter_tables import table2

    return print_and_save(options, table2(load_study(options.study), _paper(options)))


def _table3(options: argparse.Namespace) -> int:
    from cellmech.figures.number_tables import table3

    study = _study(options)
    return print_and_save(options, table3(study, _paper(options))) or complain(study)


def _table_fig2(options: argparse.Namespace) -> int:
    from cellmech.figures.number_tables import fig2_table

    study = _study(options)
    return print_and_save(options, fig2_table(study, _paper(options))) or complain(study)


def _study(options: argparse.Namespace) -> StudyResult:
    return read_planned(options.results, load_study(options.study))


def _paper(options: argparse.Namespace) -> Mapping[str, Any]:
    numbers = read_toml(str(options.paper)).get(options.numbers)
    if not isinstance(numbers, dict):
        raise InputError(str(options.paper), options.numbers, "there must be such a table")
    return numbers
