"""The command line of fits: `cellmech fit my.toml measured.toml --free layer.lamina.young_Pa=100:10000`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cellmech.console import say
from cellmech.errors import CellmechError, InputError
from cellmech.figures.section import significant
from cellmech.names import path_there, plain
from cellmech.results.archive import refusal
from cellmech.results.records import write_whole
from cellmech.results.sealed import json_text
from cellmech.runs.attended import Ranks, attend, start_solver
from cellmech.runs.command import Parser, check_folder, make_folder
from cellmech.runs.interrupts import Interrupts
from cellmech.scene.keys import is_known, unknown

if TYPE_CHECKING:
    import argparse

    from cellmech.runs.trials import Fitted

FREE = "--free"


def main(arguments: Sequence[str] | None = None, name: str = "cellmech fit") -> int:
    """Entry point; the exit status, the same on every rank."""
    return attend(lambda ranks, interrupts: _run(arguments, ranks, interrupts, name))


def parser(name: str = "cellmech fit") -> Parser:
    """The options."""
    found = Parser(
        prog=name,
        description="Find the values of keys at which a study's numbers come nearest to reference numbers. Started "
        "again, it goes on where it stopped.",
        epilog="Exit status: 0 fitted, 1 no solution or no more trials, 2 bad input, 130 or 143 after a signal.",
        add_help=False,
        allow_abbrev=False,
    )
    add = found.add_argument
    add("study", nargs="?", metavar="STUDY.toml", help="scene or study file")
    add("reference", nargs="?", metavar="REFERENCE.toml", help="the numbers, as cellmech compare reads them")
    add(
        FREE,
        nargs="+",
        action="extend",
        default=[],
        metavar="KEY=LEAST:MOST",
        help="a key to fit and its bounds, such as layer.lamina.young_Pa=100:10000; can be repeated",
    )
    add("--set", nargs="+", action="extend", default=[], metavar="KEY=VALUE", help="override a key in every case")
    add("--out", metavar="DIR", help="folder of the trials; results/<name of the study file>-fit if not given")
    add("--most", type=int, default=200, metavar="N", help="trials after which it ends; default: %(default)s")
    add("-h", "--help", action="store_true", help="print this and stop")
    return found


def _run(arguments: Sequence[str] | None, ranks: Ranks, interrupts: Interrupts, name: str) -> int:
    options = ranks.agree(lambda count: _understand(arguments, name))
    if options.help:
        if ranks.lead:
            say(parser(name).format_help().rstrip())
        return 0

    def load() -> Any:
        from cellmech.runs import fit

        return fit

    world, module = start_solver(ranks, interrupts, load)
    try:
        found: Fitted = module.fit(
            options.study,
            options.reference,
            options.free,
            options.out,
            overrides=options.set,
            most=options.most,
            comm=world,
            note=lambda trial: say(trial.line()) if ranks.lead else None,
            progress=lambda progress: interrupts.check(),
        )
        if ranks.lead:
            _close(found, options.out)
    except OSError as error:
        raise CellmechError(str(refusal(error))) from error
    return 0 if found.ended else 1


def _understand(arguments: Sequence[str] | None, name: str) -> argparse.Namespace:
    """The words read and checked, the folder made.

    Raises:
        InputError: for the first that is wrong.
    """
    options = parser(name).parse_intermixed_args(arguments)
    if options.help:
        return options
    if options.study is None or options.reference is None:
        rule = "must name a study file and a file of reference numbers"
        raise InputError("command line", "", rule, None, f"See {name} --help.")
    options.free = dict(_free(text) for text in options.free)
    if not options.free:
        hint = f"Such as {FREE} layer.lamina.young_Pa=100:10000."
        raise InputError(FREE, "", "must name a key to fit and its bounds", None, hint)
    if options.most < 1:
        raise InputError("--most", "", "must be >= 1", options.most)
    options.out = path_there(options.out or f"results/{plain(Path(options.study).stem)}-fit")
    from cellmech.figures.reference import read_references
    from cellmech.scene.studies import load_study

    load_study(options.study, options.set)  # before DOLFINx is loaded, and before anything is written
    read_references(Path(options.reference))
    check_folder(options.out)
    try:
        make_folder(options.out)
    except OSError as error:
        rule = f"must be a folder that can be made and written to ({error.strerror})"
        raise InputError("--out", "", rule, str(options.out)) from None
    return options


def _free(text: str) -> tuple[str, tuple[float, float]]:
    key, _, bounds = plain(text).partition("=")
    if not is_known(key):
        raise unknown(FREE, key, None if not bounds else bounds)
    try:
        least, most = map(float, bounds.split(":"))
    except ValueError:
        rule, hint = "must be KEY=LEAST:MOST with two numbers", f"Such as {FREE} {key}=100:10000."
        raise InputError(FREE, key, rule, bounds, hint) from None
    return key, (least, most)


def _close(found: Fitted, out: Path) -> None:
    """Say what was found, and write it."""
    best = found.best
    for key, value in best.values.items():
        error = f" ± {significant(found.errors[key], 2)}" if math.isfinite(found.errors[key]) else ""
        doubt = " (at its bound: the best value may lie beyond)" * (key in found.at_bounds)
        doubt += " (the numbers do not tell it, or only together with others)" * (key in found.untold)
        say(f"{key} = {value:.6g}{error}{doubt}")
    ended = "" if found.ended else "; not ended, go on with more trials: --most"
    say(f"rms {best.rms:.3g} of {len(best.residuals)} numbers after {len(found.trials)} trials{ended}")
    assert best.comparison is not None
    write_whole(out / "compare.md", best.comparison.markdown())
    write_whole(out / "compare.csv", best.comparison.csv())
    errors = {key: error if math.isfinite(error) else None for key, error in found.errors.items()}
    record = {"values": dict(best.values), "standard_errors": errors, "rms": best.rms, "trial": best.number}
    record |= {"trials": len(found.trials), "ended": found.ended, "at_bounds": list(found.at_bounds)}
    write_whole(out / "fit.json", json_text(record | {"untold": list(found.untold)}))
    say(f"fit.json, trials.csv and compare.md in {out}; to use it: --set {found.settings}")
