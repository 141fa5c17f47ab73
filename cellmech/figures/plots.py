"""Figures from files on disk, by what they show: python -m cellmech.plots shape|field|history|map|outline|geometry|….

The figures and tables of the paper are fig1 to fig7 and table1 to table3.

Nothing is solved and DOLFINx is not needed. Exit status: 0; 1 when a case is missing or failed (the figure shows the
others and says so); 2 for bad input.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from cellmech.console import bear_any_text, say
from cellmech.errors import CellmechError, InputError
from cellmech.figures.paper_plots import add_paper
from cellmech.figures.results import StudyResult, read_all, read_study
from cellmech.figures.saving import complain, draw_and_save
from cellmech.names import path_there
from cellmech.results.result import load
from cellmech.scene.studies import load_study
from cellmech.surroundings import open_streams, refuse_other_numpy

IN_SPACE = Path("results/geometries/law=neo-hookean,geometry=3d")


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
    geometry = add("geometry", _geometry, "a scene before the load, with its dimensions")
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

    add("fig1", _geometry, "the paper's: initial geometry of a scene").add_argument(
        "--scene", metavar="FILE", help=scene
    )
    add_paper(add, scene)
    return parser


def _geometry(options: argparse.Namespace) -> int:
    from cellmech.figures.geometry_figure import draw_geometry

    return draw_and_save(options, draw_geometry, load_study(options.scene).cases[0].scene)


def _contact_law(options: argparse.Namespace) -> int:
    from cellmech.figures.contact_law import draw_contact_law

    return draw_and_save(options, draw_contact_law, load_study(options.scene).cases[0].scene)


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
                status |= complain(study)
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
    return draw_and_save(options, draw_curves, study) or complain(study)


def _map(options: argparse.Namespace) -> int:
    from cellmech.figures.maps import draw_maps

    study = read_all(options.folder)
    return draw_and_save(options, draw_maps, study, {}) or complain(study)


def _outline(options: argparse.Namespace) -> int:
    from cellmech.figures.outlines import draw_outlines

    study = _shown(options.folder)
    return draw_and_save(options, draw_outlines, study) or complain(study)


def _pictures(options: argparse.Namespace) -> int:
    from cellmech.figures.pictures import draw_pictures

    status = 0
    for folder in options.folder:
        study = read_all(folder)
        names = [name for name, case in study.cases.items() if (case.folder / "fields.pvd").is_file()]
        sheet = names if len(names) > 1 else []
        for path in draw_pictures(folder, dict.fromkeys(names, ""), sheet, title=study.title):
            say(str(path))
        status |= complain(study)
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
