"""The command line: `python -m cellmech.study` solves the cases of study files and keeps the results."""

from __future__ import annotations

import io
import os
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from mpi4py import MPI

from cellmech.archive import SUMMARY, finished, forget_tables, input_key, source_hash, write_tables
from cellmech.command import Command, parser, understand
from cellmech.errors import CellmechError, InputError
from cellmech.interrupts import Interrupted, Interrupts
from cellmech.post import Result, meet
from cellmech.progress import Plain, Quiet, on_terminal, results_table, say
from cellmech.sweep import Job, solve_jobs

T = TypeVar("T")


def agreed(world: MPI.Comm, make: Callable[[], T]) -> T:
    """What `make` returns on rank 0, on every rank; an error of ours that it raises there is raised on all."""
    outcome: tuple[Any, CellmechError | None] | None = None
    if world.rank == 0:
        try:
            outcome = make(), None
        except CellmechError as error:
            outcome = None, error
    meet(world)
    value, refusal = world.bcast(outcome)
    if refusal is not None:
        raise refusal
    return value


def load_case() -> Any:
    """The module that solves a case. DOLFINx takes seconds to load: bad input and --list do not wait for it."""
    from cellmech import case

    return case


def run(
    arguments: Sequence[str] | None, world: MPI.Comm, interrupts: Interrupts, load: Callable[[], Any] = load_case
) -> int:
    """Do what the command line says; the exit status. Collective on world.

    Args:
        arguments: of the command line, None for the process's own.
        world: all ranks.
        interrupts: entered.
        load: brings the module that solves a case: mesh_plan, solve_case, describe_case.

    Raises:
        CellmechError: on every rank.
    """
    command = agreed(world, lambda: understand(arguments, world.size))
    options = command.options
    if options.help or options.list:
        if world.rank == 0:
            names = [case.name for order in command.orders for case in order.chosen]
            say(parser().format_help().rstrip() if options.help else "\n".join(names))
        return 0
    case = load()
    interrupts.arm()
    if options.check:
        agreed(world, lambda: check(command, case))
        return 0
    return solve(command, case, world, interrupts)


def check(command: Command, case: Any) -> None:
    """Print what the cases will model and how large they are."""
    for order in command.orders:
        mesh_plan = case.mesh_plan(order.study.cases)
        for chosen in order.chosen:
            found = case.describe_case(chosen, MPI.COMM_SELF, mesh_plan)
            size = f"{found.cells:,} triangles, {found.dofs:,} unknowns, about {found.memory_MB:,.0f} MB"
            say("\n  ".join([f"{command.label(order, chosen)}: {size}", *found.model]))


def solve(command: Command, case: Any, world: MPI.Comm, interrupts: Interrupts) -> int:
    """Solve what is not solved yet, write and print the tables; the exit status. Collective on world."""
    options, first = command.options, world.rank == 0
    jobs, old = agreed(world, lambda: plan(command, case.mesh_plan))
    if first and not options.quiet:
        announce(command, world.size, len(jobs), old)
    labels = [job.label for job in jobs]
    served = sum(len(order.chosen) for order in command.orders) - len(jobs)
    with watch(options.quiet or not first)(labels, served, world.size // options.ranks_per_case) as watcher:
        results = solve_jobs(jobs, case.solve_case, world, options.ranks_per_case, watcher, interrupts)
    return agreed(world, lambda: close(command, old | dict(zip(labels, results, strict=True))))


def watch(quiet: bool) -> type[Quiet]:
    """How to tell of the cases."""
    if not quiet and on_terminal():
        from cellmech.display import Display  # rich is slow to load, too

        return Display
    return Quiet if quiet else Plain


def plan(command: Command, mesh_plan: Callable[..., Any]) -> tuple[list[Job], dict[str, Result]]:
    """The cases to solve, and by label the results that are there already, those of cases not chosen among them."""
    jobs: list[Job] = []
    old: dict[str, Result] = {}
    for order in command.orders:
        layers, before = mesh_plan(order.study.cases), len(jobs)
        names = {case.name for case in order.chosen}
        for case in order.study.cases:
            label, folder, key = command.label(order, case), order.out / case.name, input_key(case, layers)
            chosen, notes = case.name in names, list[str]()
            result = None if chosen and command.options.fresh else finished(folder, key, notes.append)
            if result is not None:
                old[label] = result
            elif chosen:
                jobs.append(Job(label, case, folder, layers, key, source_hash(), tuple(notes)))
        if len(jobs) > before:
            forget_tables(order.out)
    return jobs, old


def announce(command: Command, ranks: int, cases: int, old: Mapping[str, Result]) -> None:
    """Say which cases need not be solved, and how the others are spread over the ranks."""
    labels = [command.label(order, case) for order in command.orders for case in order.chosen]
    if served := [label for label in labels if label in old]:
        say(f"already solved: {', '.join(served[:10])}{', ...' * (len(served) > 10)} (--fresh solves them again)")
    if cases and ranks > 1:
        each = command.options.ranks_per_case
        busy = min(ranks // each, cases)
        idle = f"; {ranks - busy * each} idle" if ranks > busy * each else ""
        say(f"{cases} to solve on {ranks} MPI ranks: {busy} at a time, {each} rank{'s' * (each > 1)} each{idle}")


def close(command: Command, results: Mapping[str, Result]) -> int:
    """Write the tables, print them in short; the exit status.

    Raises:
        CellmechError: the tables cannot be written.
    """
    failed = 0
    for order in command.orders:
        cases = [case for case in order.study.cases if command.label(order, case) in results]
        here = [results[command.label(order, case)] for case in cases]
        try:
            write_tables(order.out, cases, here)
        except OSError as error:
            raise CellmechError(f"{order.out}: the summary cannot be written ({error.strerror})") from None
        bad = sum(result["status"] != "solved" for result in here)
        failed += bad
        if not command.options.quiet:
            table = results_table([case.name for case in cases], here)
            say(f"\n{order.study.title}: largest values in the nucleus at the end\n{table}\n")
        files = f"{SUMMARY} and a folder per case in {order.out}{os.sep}"
        say(f"{order.study.stem}: {len(here) - bad} of {len(here)} cases solved; {files}")
    return int(failed > 0)


def main(arguments: Sequence[str] | None = None, load: Callable[[], Any] = load_case) -> int:
    """Entry point; the exit status, the same on every rank. Arguments as for `run`."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a name this terminal cannot show must not stop a study
    world, status = MPI.COMM_WORLD, 1
    try:
        with Interrupts() as interrupts:
            status = run(arguments, world, interrupts, load)
    except CellmechError as error:
        status = 2 if isinstance(error, InputError) else 1
        if world.rank == 0:
            say(f"cellmech: error: {error}", sys.stderr)
    except Interrupted as stop:
        status = 128 + stop.signum
        if world.rank == 0:
            say(f"cellmech: stopped by {stop}; what is finished is kept, and the same command goes on", sys.stderr)
        if world.size > 1:
            sys.stdout.flush()
            os._exit(status)  # the other ranks may be waiting for this one: mpirun ends them
    except Exception:
        if world.size > 1:
            traceback.print_exc()
            world.Abort(1)  # likewise
        raise
    return status


if __name__ == "__main__":
    sys.exit(main())
