"""All commands under one name: `cellmech run my.toml`, or `python -m cellmech run my.toml`."""

from __future__ import annotations

import argparse
import difflib
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import cellmech
from cellmech.console import bear_any_text, say
from cellmech.errors import InputError
from cellmech.surroundings import open_streams


class Command(NamedTuple):
    """A command: what it does, and the module and function that do it; `words` follow the user's."""

    about: str
    module: str
    function: str = "main"
    words: tuple[str, ...] = ()


COMMANDS = {
    "new": Command("write a first scene of your own, with comments, to be changed", "cellmech.runs.new"),
    "check": Command(
        "print what scenes will model and their size; solve nothing", "cellmech.runs.study", words=("--check",)
    ),
    "run": Command("solve the cases of scene and study files, or go on with them", "cellmech.runs.study"),
    "plot": Command("draw figures and tables from results", "cellmech.figures.plots"),
    "report": Command("make one page of a study's results", "cellmech.figures.commands", "report_main"),
    "compare": Command("set a study's numbers beside reference numbers", "cellmech.figures.commands", "compare_main"),
    "fit": Command(
        "find values of keys at which numbers come nearest to reference numbers", "cellmech.runs.fit_command"
    ),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; the exit status. What a command needs is imported for it alone."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    name = words[0] if words else "--help"
    if name in COMMANDS:
        command = COMMANDS[name]
        do = getattr(import_module(command.module), command.function)
        return int(do([*words[1:], *command.words], name=f"cellmech {name}"))
    open_streams()
    bear_any_text()
    if name in ("-h", "--help"):
        say(_help())
    elif name == "--version":
        say(f"cellmech {cellmech.__version__}")
    else:
        say(f"cellmech: error: {_unknown(name)}", sys.stderr)
        return 2
    return 0


def _help() -> str:
    parser = argparse.ArgumentParser(
        prog="cellmech",
        usage="cellmech COMMAND ...",
        description="A cell that settles on micropillars: how far it deforms, and where the stress is.",
        epilog="cellmech COMMAND --help has a command's options. Exit status: 0 done, 1 a case failed, 2 bad input.",
        add_help=False,
    )
    commands = parser.add_argument_group("commands")
    for name, command in COMMANDS.items():
        commands.add_argument(name, help=command.about)
    parser.add_argument("--version", action="store_true", help="print the version")
    return parser.format_help().rstrip()


def _unknown(name: str) -> InputError:
    close = difflib.get_close_matches(name, COMMANDS, 1)
    hint = f"Did you mean {close[0]}?" if close else "See cellmech --help."
    if Path(name).suffix == ".toml":
        hint = f"Did you mean cellmech run {name}?"
    return InputError("command line", "", f"must begin with a command: {', '.join(COMMANDS)}", name, hint)


if __name__ == "__main__":
    sys.exit(main())
