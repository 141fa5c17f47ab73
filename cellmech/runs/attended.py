"""A command that may solve, from its words to its exit status: on all ranks, with one message, and stopped in order."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from cellmech import surroundings
from cellmech.console import bear_any_text, say
from cellmech.errors import CellmechError, InputError
from cellmech.runs.interrupts import Interrupted, Interrupts

if TYPE_CHECKING:  # it starts MPI, which --help, --list and bad input do without
    from mpi4py import MPI

T = TypeVar("T")


class Ranks:
    """The ranks that do what the command line says: this process alone until there is something to compute."""

    def __init__(self) -> None:
        self.world: MPI.Intracomm | None = None
        if surroundings.launched() or "mpi4py.MPI" in sys.modules:
            self.start()

    def start(self) -> MPI.Intracomm:
        """Start MPI, unless it has been; all ranks."""
        if self.world is None:
            world = surroundings.start_mpi().COMM_WORLD
            from cellmech.fem import shared_memory

            shared_memory.release(world)
            self.world = world
        return self.world

    @property
    def lead(self) -> bool:
        """True if this process speaks for all."""
        return surroundings.task() == 0 if self.world is None else self.world.rank == 0

    @property
    def several(self) -> bool:
        """True if others may be waiting for this process."""
        return self.world is not None and self.world.size > 1

    def agree(self, make: Callable[[int], T]) -> T:
        """What one rank makes of the number of ranks, on every rank; an error is raised on all. Collective.

        Raises:
            CellmechError: on every rank.
        """
        if self.world is None:
            return make(1)
        from cellmech.runs.messages import agreed

        world = self.world
        return agreed(world, lambda: make(world.size))


def attend(work: Callable[[Ranks, Interrupts], int]) -> int:
    """Do the work of a command line; the exit status, the same on every rank.

    Args:
        work: collective; returns the exit status.
    """
    surroundings.open_streams()
    bear_any_text()
    ranks, status = Ranks(), 1
    try:
        surroundings.refuse_other_numpy()
        with Interrupts() as interrupts:
            status = work(ranks, interrupts)
    except CellmechError as error:
        status = 2 if isinstance(error, InputError) else 1
        if ranks.lead:
            say(f"cellmech: error: {error}", sys.stderr)
    except Interrupted as stop:
        status = 128 + stop.signum
        if ranks.lead:
            say(f"cellmech: stopped by {stop}; what is finished is kept, and the same command goes on", sys.stderr)
        if ranks.several:
            sys.stdout.flush()
            os._exit(status)  # the other ranks may be waiting for this one: mpirun ends them
    except Exception:
        if ranks.world is not None and ranks.several:
            traceback.print_exc()
            ranks.world.Abort(1)  # likewise
        raise
    return status


def start_solver(ranks: Ranks, interrupts: Interrupts, load: Callable[[], T]) -> tuple[MPI.Intracomm, T]:
    """MPI started and what solves loaded; signals are ours again afterwards. Collective.

    Raises:
        CellmechError: a library cannot be loaded.
    """
    try:
        world, loaded = ranks.start(), load()
    except ImportError as error:  # no such package, or too few files may be open to load it
        raise CellmechError(f"a library cannot be loaded: {error}") from error
    interrupts.arm()
    return world, loaded
