"""A first scene file of one's own: `cellmech new my.toml`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cellmech.console import say
from cellmech.errors import InputError
from cellmech.names import plain
from cellmech.runs.attended import Ranks, attend
from cellmech.runs.command import Parser
from cellmech.scene.starter import GEOMETRIES, starter
from cellmech.scene.variants import name_fault

ENDING = ".toml"


def main(arguments: Sequence[str] | None = None, name: str = "cellmech new") -> int:
    """Entry point; the exit status."""

    def work(ranks: Ranks, interrupts: object) -> int:
        said = ranks.agree(lambda count: _new(arguments, name))
        if ranks.lead:
            say(said)
        return 0

    return attend(work)


def parser(name: str = "cellmech new") -> Parser:
    """The options."""
    about = "Write a scene file of a cell on pillars, with comments, to be changed. Nothing is overwritten."
    found = Parser(prog=name, description=about, add_help=False, allow_abbrev=False)
    found.add_argument("file", nargs="?", metavar="FILE.toml", help="the file to write")
    found.add_argument(
        "--geometry",
        choices=GEOMETRIES,
        default=GEOMETRIES[0],
        help="a cylinder on ridges, a ball on a round pillar or on a lattice; default: %(default)s",
    )
    found.add_argument("-h", "--help", action="store_true", help="print this and stop")
    return found


def _new(arguments: Sequence[str] | None, name: str) -> str:
    """Write what is asked for; what to say about it.

    Raises:
        InputError: for a name that no study can have, or a file that is there or cannot be written.
    """
    options = parser(name).parse_args(arguments)
    if options.help:
        return parser(name).format_help().rstrip()
    if options.file is None:
        raise InputError("command line", "", "must name the file to write", None, "Such as cellmech new my.toml.")
    path = Path(options.file)
    if path.suffix != ENDING:
        raise InputError(options.file, "", f"must end in {ENDING}", None, f"Such as {path.stem or 'my'}{ENDING}.")
    if fault := name_fault(plain(path.stem)):
        raise InputError(options.file, "", f"the file's name without its ending {fault}")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(starter(options.geometry))
    except FileExistsError:
        raise InputError(options.file, "", "is there already, and is not overwritten", None, "Name another.") from None
    except OSError as error:
        raise InputError(options.file, "", f"cannot be written ({error.strerror or error})") from None
    return f"{options.file} is written: change it, then cellmech check {options.file} and cellmech run {options.file}"
