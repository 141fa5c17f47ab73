"""The command line read and checked: which cases of which studies, where to, and how."""

from __future__ import annotations

import argparse
import difflib
import itertools
import os
import re
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn

from cellmech.errors import InputError
from cellmech.names import plain, spelt
from cellmech.results.accuracy import ALL_PARTS, Refinement, refinements
from cellmech.results.archive import COLUMNS, SUMMARY, TIMINGS
from cellmech.scene.case import Case
from cellmech.scene.studies import Study, load_study

MAIN_JOB = Path("studies/fig2.toml")
NAME = "python -m cellmech.study"


class Parser(argparse.ArgumentParser):
    """Raises what it dislikes: the message must come from one rank."""

    def error(self, message: str) -> NoReturn:
        """As argparse calls it."""
        raise InputError("command line", "", message, None, f"See {self.prog} --help.")


def parser(name: str = NAME) -> argparse.ArgumentParser:
    """The options of the command of that name."""
    found = Parser(
        prog=name,
        description="Solve the cases of study files. Started again, it goes on where it stopped.",
        epilog="Exit status: 0 all cases solved, 1 some failed, 2 bad input, 130 or 143 after Ctrl-C or SIGTERM.",
        add_help=False,
        allow_abbrev=False,
    )
    add = found.add_argument
    add("study", nargs="*", metavar="STUDY.toml", help="study files; studies/fig2.toml if none is given")
    add(
        "--out",
        metavar="DIR",
        help="folder of the results, with several studies one below it for each; "
        "results/<name of the study file> if not given",
    )
    add(
        "--set",
        nargs="+",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="override a key in every case, such as --set load.factor=2",
    )
    add("--only", action="append", default=[], metavar="CASE", help="solve this case only; can be repeated")
    add("--list", action="store_true", help="print the names of the cases and stop")
    add("--check", action="store_true", help="print what each case will model and its size, and solve nothing")
    add("--fresh", action="store_true", help="solve again what has been solved")
    add(
        "--ranks-per-case",
        type=int,
        metavar="N",
        help="MPI ranks that share a case; 1 if not given, more where there are fewer cases than ranks",
    )
    add("--accuracy", action="store_true", help="solve each case refined, too, and report the error of every number")
    add("--shard", metavar="I/N", help="take every N-th of the cases, from the I-th on: for N machines at once")
    add("--no-pictures", action="store_true", help="leave no pictures of the deformed cells")
    add("--quiet", action="store_true", help="print errors and one last line only")
    add("--json", action="store_true", help="print one JSON object and, like --quiet, errors: for scripts")
    add("-h", "--help", action="store_true", help="print this and stop")
    return found


@dataclass(frozen=True)
class Order:
    """One study, and what is wanted of it.

    Args:
        study: with all its cases: the mesh plan, and so the result of a case, depends on them.
        out: folder of the results.
        chosen: the cases to solve.
        parts: of their error that are asked for.
    """

    study: Study
    out: Path
    chosen: tuple[Case, ...]
    parts: tuple[str, ...] = ()

    def refined(self, case: Case) -> tuple[Refinement, ...]:
        """The runs that show the error of a case; none if it is not asked for."""
        return refinements(case.scene, self.parts) if self.parts else ()


@dataclass(frozen=True)
class Command:
    """A command line that has been understood and checked.

    Args:
        options: as written.
        orders: the studies of which there are cases to solve.
        ranks_per_case: as written or chosen. It depends on the command alone, not on what is solved already: going on
            after an interruption must not change the last digits.
    """

    options: argparse.Namespace
    orders: tuple[Order, ...]
    ranks_per_case: int = 1

    def label(self, order: Order, case: Case, refinement: Refinement | None = None) -> str:
        """The name that the user reads for a case, or for one of its refinements."""
        name = case.name if len(self.orders) == 1 else f"{order.study.stem}/{case.name}"
        return name if refinement is None else f"{name} [{refinement.name}]"


def understand(arguments: Sequence[str] | None, ranks: int, name: str = NAME) -> Command:
    """Read and check everything the user wrote, the folders of the results included; solve nothing.

    Raises:
        InputError: for the first thing that is wrong; nothing has been written then.
    """
    options = parser(name).parse_intermixed_args(arguments)
    options.quiet |= options.json
    if options.help:
        return Command(options, ())
    paths, sets = list(options.study), []
    for first, *more in options.set:  # `--set a=1 b=2 file.toml`: what has no "=" is a file
        sets += [first, *(text for text in more if "=" in text)]
        paths += [text for text in more if "=" not in text]
    n, shard = options.ranks_per_case, _shard(options.shard)
    if n is not None and not 1 <= n <= ranks:
        hint = f"Start it with mpirun -n {n}, or leave the option out." if n > ranks else ""
        raise InputError("--ranks-per-case", "", f"must be from 1 to the number of MPI ranks, {ranks}", n, hint)
    if options.out == "":
        raise InputError("--out", "", "must name a folder", "")
    studies = [load_study(path, sets) for path in paths or [_main_job()]]
    orders = _sharded(_orders(studies, options), *shard)
    count = sum(1 + len(order.refined(case)) for order in orders for case in order.chosen)
    if not options.list:
        _check_folders(orders, make=not options.check)
    return Command(options, orders, n or max(ranks // max(count, 1), 1))


def _shard(text: str | None) -> tuple[int, int]:
    """I and N of --shard I/N."""
    if text is None:
        return 1, 1
    match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    first, step = map(int, match.groups()) if match else (0, 0)
    if not 1 <= first <= step:
        hint = "Such as --shard 2/3 for the second of three; Slurm counts so with --array=1-3."
        raise InputError("--shard", "", "must be I/N with whole numbers, I from 1 to N", text, hint)
    return first, step


def _sharded(orders: Sequence[Order], first: int, step: int) -> tuple[Order, ...]:
    """Every `step`-th of the chosen cases from the `first` on, counted through all studies."""
    numbers = itertools.count()
    kept = (
        replace(order, chosen=tuple(case for case in order.chosen if next(numbers) % step == first - 1))
        for order in orders
    )
    return tuple(order for order in kept if order.chosen)


def _main_job() -> Path:
    if MAIN_JOB.exists():
        return MAIN_JOB
    path = Path(__file__).resolve().parents[2] / MAIN_JOB
    if not path.exists():
        raise InputError(
            str(MAIN_JOB), "", "there is no such file", None, "Name a study file, or start in the project's folder."
        )
    return path


def _orders(studies: Sequence[Study], options: argparse.Namespace) -> tuple[Order, ...]:
    names = [case.name for study in studies for case in study.cases]
    only = [plain(name) for name in options.only]
    for name in only:
        if name not in names:
            close = difflib.get_close_matches(name, names, 3, 0.5)
            hint = f"Did you mean {' or '.join(close)}?" if close else "--list prints the names."
            raise InputError("--only", "", "there is no such case", name, hint)
    orders: dict[Path, Order] = {}
    for study in studies:
        out = Path("results") / study.stem if options.out is None else Path(options.out)
        if options.out is not None and len(studies) > 1:
            out = out / study.stem
        out = Path(spelt(out))
        if out in orders:
            rule = f"must differ in name from {orders[out].study.path}: both would write into {out}"
            raise InputError(str(study.path), "", rule, None, "Start them one after the other, each with its --out.")
        chosen = tuple(case for case in study.cases if not only or case.name in only)
        orders[out] = Order(study, out, chosen, ALL_PARTS if options.accuracy else study.accuracy)
    return tuple(orders.values())


def _check_folders(orders: Sequence[Order], make: bool) -> None:
    """Refuse results folders that cannot be written to; make those that are missing, all of them or none."""
    made: list[Path] = []
    try:
        for order in orders:
            for path in (order.out, *(order.out / case.name for case in order.chosen)):
                check_folder(path)
            for path in (order.out / SUMMARY, order.out / TIMINGS, order.out / COLUMNS):
                if path.is_dir():
                    raise InputError("--out", "", "must not hold a folder with the name of a file to write", str(path))
        for order in orders if make else ():
            made += make_folder(order.out)
    except OSError as error:
        _remove(made)
        rule = f"must be a folder that can be made and written to ({error.strerror})"
        raise InputError("--out", "", rule, str(order.out), "Name another with --out.") from None
    except BaseException:
        _remove(made)
        raise


def make_folder(folder: Path, tries: int = 5) -> list[Path]:
    """Make a folder with those above it, and prove that files can be made in it; returns what has been made.

    Raises:
        OSError: it cannot be; what has been made is removed.
    """
    made: list[Path] = []
    try:
        for path in reversed([path for path in (folder, *folder.parents) if not path.exists()]):
            with suppress(FileExistsError):  # another process has just made it
                path.mkdir()
                made.append(path)
        with tempfile.TemporaryFile(dir=folder):
            pass  # permissions do not tell of read-only and full disks
    except FileNotFoundError:  # another process, refused, has just removed what it had made
        _remove(made)
        if not tries:
            raise
        return make_folder(folder, tries - 1)
    except OSError:
        _remove(made)
        raise
    return made


def _remove(made: Sequence[Path]) -> None:
    for path in reversed(made):
        with suppress(OSError):  # another process has put something there
            path.rmdir()


def check_folder(path: Path) -> None:
    """Refuse a place for results that is no folder or cannot be written to.

    Raises:
        InputError: naming what is in the way.
    """
    nearest = next(folder for folder in (path, *path.absolute().parents) if os.path.lexists(folder))
    if not nearest.is_dir():
        raise InputError("--out", "", f"must be a folder, but {nearest} is none", str(path), "Name another with --out.")
    if not os.access(nearest, os.W_OK | os.X_OK):
        rule = f"must be writable, and {nearest} is not"
        raise InputError("--out", "", rule, str(path), "Name another folder with --out.")
