"""Figures from files on disk, by what they show: python -m cellmech.plots shape|field|history|map|outline|geometry|….

The figures and tables of the paper are fig1 to fig7 and table1 to table3.

Nothing is solved and DOLFINx is not needed. Exit status: 0; 1 when a case is missing or failed (the figure shows the
others and says so); 2 for bad input.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from cellmech.console import bear_any_text, say
from cellmech.errors import CellmechError, InputError
from cellmech.figures.results import StudyResult, read_all, read_planned, read_study
from cellmech.figures.table import Document
from cellmech.names import path_there
from cellmech.results.result import load
from cellmech.scene.studies import load_study
from cellmech.scene.toml_file import read_toml
from cellmech.surroundings import open_streams, refuse_other_numpy

STUDIES = Path(__file__).resolve().parents[2] / "studies"
IN_SPACE = Path("results/geometries/law=neo-hookean,geometry=3d")
PAPER_NUMBERS = STUDIES / "paper_numbers.toml"


def main(arguments: Sequence[str] | None = None, name: str = "python -m cellmech.plots") -> int:
    """The command line of that name; the exit status is returned."""
    open_streams()
    bear_any_text()
    options = _parser(name).parse_args(arguments)
    try:
        refuse_other_numpy()  # before Matplotlib, which needs the one that it was built with
        return int(options.run(options))
    except CellmechError as error:
        say(f"error: {error}", sys.stderr)
        return 2 if isinstance(error, InputError) else 1


def _parser(name: str = "python -m cellmech.plots") -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=name, description="Figures and tables from result files, into --out.")
    commands = parser.add_subparsers(required=True, metavar="FIGURE")

    def add(name: str, run: Any, about: str) -> argparse.ArgumentParser:
        command: argparse.ArgumentParser = commands.add_parser(name, help=about, description=about)
        command.add_argument(
            "--out", type=path_there, default=Path("results/figures"), metavar="DIR", help="default: %(default)s"
        )
        command.add_argument("--stem", default=name, metavar="NAME", help="of the files written; default: %(default)s")
        command.set_defaults(run=run)
        return command

    def add_study(name: str, run: Any, about: str, study: str, numbers: str) -> None:
        command = add(name, run, about)
        results = Path("results") / study
        command.add_argument("--results", type=path_there, default=results, metavar="DIR", help="default: %(default)s")
        command.set_defaults(numbers=numbers)
        _add_study_file(command, study)
        _add_paper(command)

    results = "folder of a study's results, or of one case"

    def add_shown(name: str, run: Any, about: str, several: bool = False) -> argparse.ArgumentParser:
        command = add(name, run, about)
        command.add_argument("folder", type=path_there, nargs="+" if several else None, metavar="DIR", help=results)
        return command

    shape = add("shape", _shape, "the deformed cell; of a study all its cases on a sheet; in 3-D cut open")
    shape.add_argument("folder", type=path_there, nargs="*", metavar="DIR", help=results)
    shape.add_argument("--case", type=path_there, nargs="+", default=[], metavar="DIR", help="the same")
    shape.add_argument("--field", help="scalar of the field files to colour by; default: the layers")
    field = add("field", _shape, "a field on the deformed cell, such as sigma_mises, J1, pressure")
    field.add_argument("field", metavar="FIELD", help="scalar of the field files")
    field.add_argument("folder", type=path_there, nargs="+", metavar="DIR", help=results)
    field.set_defaults(case=[])
    for command in (shape, field):
        command.add_argument("--magnify", action="store_true", help="on a sheet: displacements magnified, too")
    add_shown("history", _history, "stress and strain in the nucleus against time")
    add_shown("map", _map, "maps of stress and strain in the nucleus over the two keys that a study varies")
    add_shown("outline", _outline, "outlines of cell and nucleus of all cases in one drawing")
    add_shown("pictures", _pictures, "what a run leaves: each deformed cell, and the sheet, into figures of DIR", True)
    scene = "scene or study file (its first case); default: Table 1"
    geometry = add("geometry", _fig1, "a scene before the load, with its dimensions")
    geometry.add_argument("scene", nargs="?", metavar="FILE", help=scene)
    law = add("contact-law", _contact_law, "push and pull of a scene's obstacles, one curve over the gap")
    law.add_argument("--scene", metavar="FILE", help=scene)
    turn = add("turntable", _turntable, "film of one case in 3-D, cut open, that turns once about the vertical")
    about = "folder of the case; default: %(default)s"
    turn.add_argument("--case", type=path_there, default=IN_SPACE, metavar="DIR", help=about)
    turn.add_argument("--field", help="scalar of the field files to colour by; default: the layers")
    files = add("paraview", _paraview, "files for ParaView of one case: the whole cell by layer, and what it stands on")
    files.add_argument("--case", type=path_there, default=IN_SPACE, metavar="DIR", help=about)
    film = add("movie", _movie, "film of a field of one case, over the times at which its fields were written")
    case = Path("results/movie/movie")
    film.add_argument(
        "--case", type=path_there, default=case, metavar="DIR", help="folder of the case; default: %(default)s"
    )
    film.add_argument("--field", default="J1", help="scalar of the field files; default: %(default)s")
    film.add_argument("--magnify", type=float, default=1.0, help="displacements; default: %(default)g")

    add("fig1", _fig1, "the paper's: initial geometry of a scene").add_argument("--scene", metavar="FILE", help=scene)
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
    return parser


def _add_study_file(command: argparse.ArgumentParser, stem: str) -> None:
    about = "the study file, which says what cases there are; default: %(default)s"
    command.add_argument("--study", type=path_there, default=STUDIES / f"{stem}.toml", metavar="FILE", help=about)


def _add_paper(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--paper", type=path_there, default=PAPER_NUMBERS, metavar="FILE", help="the paper's printed numbers"
    )


def _fig1(options: argparse.Namespace) -> int:
    from cellmech.figures.geometry_figure import draw_geometry

    return _draw(options, draw_geometry, load_study(options.scene).cases[0].scene)


def _contact_law(options: argparse.Namespace) -> int:
    from cellmech.figures.contact_law import draw_contact_law

    return _draw(options, draw_contact_law, load_study(options.scene).cases[0].scene)


def _curves(options: argparse.Namespace) -> int:
    from cellmech.figures.curves import draw_curves

    study = _study(options)
    return _draw(options, draw_curves, study, _paper(options)) or _complain(study)


def _maps(options: argparse.Namespace) -> int:
    from cellmech.figures.maps import draw_maps

    study = _study(options)
    return _draw(options, draw_maps, study, _paper(options)) or _complain(study)


def _shapes(options: argparse.Namespace) -> int:
    from cellmech.figures.shapes import draw_shapes

    study = _study(options)
    return _draw(options, partial(draw_shapes, magnify=True), study) or _complain(study)


def _described_shapes(options: argparse.Namespace) -> int:
    from cellmech.figures.nucleus import nucleus_lines
    from cellmech.figures.shapes import draw_shapes

    study, paper = _study(options), _paper(options)
    draw = partial(draw_shapes, report=lambda case: nucleus_lines(case, paper), magnify=True)
    return _draw(options, draw, study) or _complain(study)


def _shape(options: argparse.Namespace) -> int:
    from cellmech.figures.shape_figure import draw_case
    from cellmech.figures.shapes import draw_shapes
    from cellmech.figures.style import save, scalar, styled

    folders = [*options.folder, *options.case] or [Path("results/fig2/neo-hookean")]
    quantity, status = scalar(options.field) if options.field else None, 0
    for folder in folders:
        stem = options.stem if len(folders) == 1 else f"{options.stem}-{folder.resolve().name}"
        with styled():
            if _is_case(folder):
                figure = draw_case(load(folder), quantity)
            else:
                study = read_all(folder)
                figure = draw_shapes(study, quantity=quantity, magnify=options.magnify)
                status |= _complain(study)
            for path in save(figure, options.out, stem):
                say(str(path))
    return status


def _is_case(folder: Path) -> bool:
    return (folder / "result.json").is_file()


def _shown(folder: Path) -> StudyResult:
    """The results of a study, or of a case as those of a study of its own."""
    if not _is_case(folder):
        return read_all(folder)
    study = read_study(folder.parent, [folder.name])
    return replace(study, title=study.cases[folder.name].scene.title or folder.name)


def _history(options: argparse.Namespace) -> int:
    from cellmech.figures.curves import draw_curves

    study = _shown(options.folder)
    return _draw(options, draw_curves, study) or _complain(study)


def _map(options: argparse.Namespace) -> int:
    from cellmech.figures.maps import draw_maps

    study = read_all(options.folder)
    return _draw(options, draw_maps, study, {}) or _complain(study)


def _outline(options: argparse.Namespace) -> int:
    from cellmech.figures.outlines import draw_outlines

    study = _shown(options.folder)
    return _draw(options, draw_outlines, study) or _complain(study)


def _pictures(options: argparse.Namespace) -> int:
    from cellmech.figures.pictures import draw_pictures

    status = 0
    for folder in options.folder:
        study = read_all(folder)
        names = [name for name, case in study.cases.items() if (case.folder / "fields.pvd").is_file()]
        sheet = names if len(names) > 1 else []
        for path in draw_pictures(folder, dict.fromkeys(names, ""), sheet, title=study.title):
            say(str(path))
        status |= _complain(study)
    return status


def _turntable(options: argparse.Namespace) -> int:
    from cellmech.figures.film import make_turntable
    from cellmech.figures.style import styled

    path = options.out / f"{options.stem}.gif"
    with styled():
        count = make_turntable(load(options.case), path, options.field)
    say(f"{path}: {count} pictures")
    return 0


def _paraview(options: argparse.Namespace) -> int:
    from cellmech.figures.paraview_files import write_paraview

    count = write_paraview(load(options.case), options.out, options.stem)
    say(f"{options.out / options.stem}.pvd: {count} times")
    return 0


def _movie(options: argparse.Namespace) -> int:
    from cellmech.figures.field_picture import make_film
    from cellmech.figures.style import styled

    path = options.out / f"{options.stem}.gif"
    with styled():
        count = make_film(load(options.case), path, options.field, options.magnify)
    say(f"{path}: {count} pictures")
    return 0


def _table1(options: argparse.Namespace) -> int:
    from cellmech.figures.parameter_tables import table1

    return _print(options, table1(load_study(options.scene).cases[0].scene))


def _table2(options: argparse.Namespace) -> int:
    from cellmech.figures.parameter_tables import table2

    return _print(options, table2(load_study(options.study), _paper(options)))


def _table3(options: argparse.Namespace) -> int:
    from cellmech.figures.number_tables import table3

    study = _study(options)
    return _print(options, table3(study, _paper(options))) or _complain(study)


def _table_fig2(options: argparse.Namespace) -> int:
    from cellmech.figures.number_tables import fig2_table

    study = _study(options)
    return _print(options, fig2_table(study, _paper(options))) or _complain(study)


def _study(options: argparse.Namespace) -> StudyResult:
    return read_planned(options.results, load_study(options.study))


def _paper(options: argparse.Namespace) -> Mapping[str, Any]:
    numbers = read_toml(str(options.paper)).get(options.numbers)
    if not isinstance(numbers, dict):
        raise InputError(str(options.paper), options.numbers, "there must be such a table")
    return numbers


def _draw(options: argparse.Namespace, draw: Any, *of: Any) -> int:
    from cellmech.figures.style import save, styled

    with styled():
        for path in save(draw(*of), options.out, options.stem):
            say(str(path))
    return 0


def _print(options: argparse.Namespace, document: Document) -> int:
    document.save(options.out, options.stem)
    say(document.markdown())
    return 0


def _complain(study: StudyResult) -> int:
    """Name the cases that are missing or failed; 1 when there are any."""
    complaint = study.complaint()
    if complaint:
        say(f"warning: {study.folder}: {complaint}", sys.stderr)
    return 1 if complaint else 0
