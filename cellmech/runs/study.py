"""The command line: `python -m cellmech.study` solves the cases of study files and keeps the results."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from cellmech.console import on_terminal, say
from cellmech.errors import CellmechError
from cellmech.results.archive import SUMMARY, Record, merge_tables, refusal
from cellmech.results.sealed import SEAL, json_text
from cellmech.runs.attended import Ranks, attend, start_solver
from cellmech.runs.command import NAME, Command, parser, understand
from cellmech.runs.interrupts import Interrupts
from cellmech.runs.progress import Plain, Quiet, results_table

if TYPE_CHECKING:  # they start MPI, which --help, --list and bad input do without
    from mpi4py import MPI

    from cellmech.runs.agenda import Agenda


def load_case() -> Any:
    """The module that solves a case. DOLFINx takes seconds to load: bad input and --list do not wait for it."""
    from cellmech.runs import case

    return case


def run(
    arguments: Sequence[str] | None, ranks: Ranks, interrupts: Interrupts, load: Callable[[], Any], name: str
) -> int:
    """Do what the command line says; the exit status. Collective.

    Args:
        arguments: of the command line, None for the process's own.
        ranks: all of them.
        interrupts: entered.
        load: brings the module that solves a case: mesh_plan, solve_case, describe_case.
        name: of the command, for its help.

    Raises:
        CellmechError: on every rank.
    """
    command = ranks.agree(lambda count: understand(arguments, count, name))
    options = command.options
    if options.help or options.list:
        names = [case.name for order in command.orders for case in order.chosen]
        listed = json_text({"cases": names}).rstrip() if options.json else "\n".join(names)
        text = parser(name).format_help().rstrip() if options.help else listed
        if ranks.lead and text:  # a shard may be empty
            say(text)
        return 0
    if not command.orders:
        empty = f"nothing to solve: shard {options.shard} has no case"
        if ranks.lead:
            say(json_text({"studies": []}).rstrip() if options.json else empty)
        return 0
    world, case = start_solver(ranks, interrupts, load)
    if options.check:
        from cellmech.runs.messages import agreed

        agreed(world, lambda: check(command, case))
        return 0
    return solve(command, case, world, interrupts)


def check(command: Command, case: Any) -> None:
    """Print what the cases will model and how large they are.

    Raises:
        CellmechError: a case has no mesh, or the disk refuses what meshing needs.
    """
    from mpi4py import MPI

    cases = {}
    for order in command.orders:
        for chosen in order.chosen:
            try:
                found = case.describe_case(chosen, MPI.COMM_SELF, case.mesh_plan(chosen.scene))
            except OSError as error:
                raise CellmechError(f"{command.label(order, chosen)}: {refusal(error)}") from error
            cases[command.label(order, chosen)] = asdict(found)
            if command.options.json:
                continue
            elements = "tetrahedra" if chosen.scene.cell.geometry == "3d" else "triangles"
            size = f"{found.cells:,} {elements}, {found.dofs:,} unknowns, about {found.memory_MB:,.0f} MB"
            if found.estimated:
                size = f"about {found.cells:.2g} {elements} and {found.dofs:.2g} unknowns (estimated, not meshed), "
                size += f"about {found.memory_MB / 1024:,.3g} GiB"
            say("\n  ".join([f"{command.label(order, chosen)}: {size}", *found.model]))
    if command.options.json:
        say(json_text({"cases": cases}).rstrip())


def solve(command: Command, case: Any, world: MPI.Intracomm, interrupts: Interrupts) -> int:
    """Solve what is not solved yet, write and print the tables; the exit status. Collective on world."""
    from cellmech.runs.agenda import draw_up
    from cellmech.runs.messages import agreed
    from cellmech.runs.sweep import solve_jobs

    quiet, each = command.options.quiet, command.ranks_per_case
    agenda = agreed(world, lambda: draw_up(command, case.mesh_plan))
    if world.rank == 0:
        announce(command, agenda, world.size)
    labels = [job.label for job in agenda.jobs]
    with watch(quiet or world.rank > 0)(labels, len(agenda.known), world.size // each) as watcher:
        results = solve_jobs(agenda.jobs, case.solve_case, world, each, watcher, interrupts)
    return agreed(world, lambda: close(command, agenda, dict(zip(labels, results, strict=True))))


def watch(quiet: bool) -> type[Quiet]:
    """The class of the listener that tells of the cases."""
    if not quiet and on_terminal():
        from cellmech.runs.display import Display  # rich is slow to load, too

        return Display
    return Quiet if quiet else Plain


def announce(command: Command, agenda: Agenda, ranks: int) -> None:
    """Say which cases need not be solved, and how the others are spread over the ranks; if quiet, of failures only."""
    known = {label: result for label, result in agenda.known.items() if label not in agenda.sources}
    failed = {label: result["reason"] for label, result in agenda.known.items() if result["status"] != "solved"}
    if command.options.quiet:
        for label, reason in failed.items():
            say(f"cellmech: {label}: failed before: {reason} (--fresh tries again)", sys.stderr)
        return
    say_names("already solved", (label for label in known if label not in failed), " (--fresh solves them again)")
    say_names("failed before", (label for label in known if label in failed), " (--fresh tries again)")
    for folder in dict.fromkeys(source.parent for source in agenda.sources.values()):
        here = (label for label, source in agenda.sources.items() if source.parent == folder)
        say_names(f"taken over from {folder}", here, " (--fresh solves them here)")
    say_names("the same case, solved once", (f"{job.label} = {twin.label}" for twin, job in agenda.twins))
    if (cases := len(agenda.jobs)) and ranks > 1:
        each = command.ranks_per_case
        busy = min(ranks // each, cases)
        idle = f"; {ranks - busy * each} idle" if ranks > busy * each else ""
        say(f"{cases} to solve on {ranks} MPI ranks: {busy} at a time, {each} rank{'s' * (each > 1)} each{idle}")


def say_names(what: str, labels: Iterable[str], hint: str = "") -> None:
    """Say something of cases, if there are any."""
    if names := list(labels):
        say(f"{what}: {', '.join(names[:10])}{', ...' * (len(names) > 10)}{hint}")


def close(command: Command, agenda: Agenda, solved: Mapping[str, Record]) -> int:
    """Write the tables, print them in short; the exit status.

    Raises:
        CellmechError: the tables cannot be written.
    """
    from cellmech.runs.agenda import attach_errors, share_with_twin
    from cellmech.runs.pictures import leave_pictures

    shared = {twin.label: share_with_twin(twin, job, solved[job.label]) for twin, job in agenda.twins}
    results, studies = {**agenda.known, **solved, **shared}, []
    for order, keys in zip(command.orders, agenda.keys, strict=True):
        errors = attach_errors(command, order, results)
        known = {case.name: results[command.label(order, case)] for case in order.chosen}
        here = merge_tables(order.out, order.study.cases, keys, known)
        if not command.options.quiet:
            width = shutil.get_terminal_size().columns if on_terminal() else None
            table = results_table(list(here), list(here.values()), width)
            say(f"\n{order.study.title}: largest values in the nucleus at the end\n{table}\n")
            for name, lines in errors.items():
                say("\n".join([f"{name}: {lines[0]}", *lines[1:]]))
        bare = {
            name: {key: record[key] for key in record if key not in ("files", SEAL)} for name, record in here.items()
        }
        studies.append({"study": order.study.stem, "title": order.study.title, "out": str(order.out), "cases": bare})
        if not command.options.no_pictures:
            leave_pictures(order, here, command.options.quiet)
        if command.options.json:
            continue
        good = sum(result["status"] == "solved" for result in here.values())
        left = f", {more} not yet" if (more := len(order.study.cases) - len(here)) else ""
        files = f"{SUMMARY} and a folder per case in {order.out}{os.sep}"
        say(f"{order.study.stem}: {good} of {len(here)} cases solved{left}; {files}")
    if command.options.json:
        say(json_text({"studies": studies}).rstrip())
    return int(any(result["status"] != "solved" for result in results.values()))


def main(arguments: Sequence[str] | None = None, load: Callable[[], Any] = load_case, name: str = NAME) -> int:
    """Entry point; the exit status, the same on every rank. Arguments as for `run`."""
    return attend(lambda ranks, interrupts: run(arguments, ranks, interrupts, load, name))
