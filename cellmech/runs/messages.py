"""Word of the cases on its way to world rank 0, and waiting that leaves the cores to those who compute."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from mpi4py import MPI

from cellmech.errors import CellmechError
from cellmech.results.archive import Record

if TYPE_CHECKING:  # brings DOLFINx along
    from cellmech.runs.case import Progress

PAUSE_S = 0.05  # between two looks at what one waits for
REPORT_EVERY_S = 0.5  # at most, per group

T = TypeVar("T")


class Watcher(Protocol):
    """The listener on world rank 0, who is told about the cases by their number."""

    def started(self, index: int) -> None:
        """A group has begun with a case."""

    def progressed(self, index: int, progress: Progress) -> None:
        """A case has made a step."""

    def finished(self, index: int, result: Record) -> None:
        """A case has come to its end, good or bad."""

    def tick(self) -> None:
        """Some time has passed."""


class Post:
    """Messages from the first ranks of the groups to world rank 0. Nobody waits for one to arrive.

    Args:
        world: all ranks.
        watcher: told of each message, on rank 0.
    """

    def __init__(self, world: MPI.Comm, watcher: Watcher) -> None:
        self.comm, self.watcher = world.Dup(), watcher
        self.results: dict[int, Record] = {}
        self._sent: list[MPI.Request] = []
        self._arriving: list[Any] = []
        self._next_report = 0.0

    def started(self, index: int) -> None:
        """A case begins; its first step is told of at once."""
        self._next_report = 0.0
        self._send(index, None)

    def progressed(self, index: int, progress: Progress) -> None:
        """A case has made a step; told now and then only, so that rank 0 is not flooded."""
        now = time.monotonic()
        if self.comm.rank == 0 or now >= self._next_report:
            self._next_report = now + REPORT_EVERY_S
            self._send(index, progress)

    def finished(self, index: int, result: Record) -> None:
        """A case has ended."""
        self._send(index, result)

    def _send(self, index: int, content: Progress | Record | None) -> None:
        if self.comm.rank == 0:
            self._receive(index, content)
            self._drain()
        else:
            self._sent = [request for request in self._sent if not request.Test()]
            self._sent.append(self.comm.isend((index, content), 0))

    def _drain(self) -> None:
        while (message := self.comm.improbe()) is not None:
            self._arriving.append(message.irecv())  # a long one needs its sender, who may be deep in a solve
        waiting = []
        for request in self._arriving:
            arrived, content = request.test()
            if arrived:
                self._receive(*content)
            else:
                waiting.append(request)
        self._arriving = waiting
        self.watcher.tick()

    def _receive(self, index: int, content: Progress | Record | None) -> None:
        if content is None:
            self.watcher.started(index)
        elif isinstance(content, dict):
            self.results[index] = content
            self.watcher.finished(index, content)
        else:
            self.watcher.progressed(index, content)

    def close(self, count: int) -> None:
        """Wait until rank 0 has so many results and every rank is here. Collective."""
        while self.comm.rank == 0 and len(self.results) < count:
            self._drain()
            time.sleep(PAUSE_S)
        for request in self._sent:
            wait(request)
        meet(self.comm)
        self.comm.Free()


def wait(request: MPI.Request) -> None:
    """Wait for a request without keeping a core busy."""
    while not request.Test():
        time.sleep(PAUSE_S)


def meet(comm: MPI.Comm) -> None:
    """A barrier that does not keep the waiting ranks' cores busy. Collective."""
    wait(comm.Ibarrier())


def together(world: MPI.Comm, make: Callable[[], T]) -> T:
    """The result of `make` on this rank; an error of ours or the disk's on any rank is raised on all. Collective."""
    made: list[T] = []
    fault: CellmechError | OSError | None = None
    try:
        made.append(make())
    except (CellmechError, OSError) as error:
        fault = error
    for met in world.allgather(fault):
        if met is not None:
            raise met
    return made[0]


def agreed(world: MPI.Comm, make: Callable[[], T]) -> T:
    """The result of `make` on rank 0, on every rank; an error of ours or the disk's is raised on all. Collective."""
    outcome: tuple[Any, CellmechError | OSError | None] | None = None
    if world.rank == 0:
        try:
            outcome = make(), None
        except (CellmechError, OSError) as error:
            outcome = None, error
    meet(world)
    value, refusal = world.bcast(outcome)
    if refusal is not None:
        raise refusal
    return value
