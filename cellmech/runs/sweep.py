"""Cases over MPI ranks: each group of ranks takes the next case when it is free, world rank 0 hears how they get on.

What a case computes never depends on the group that has it.
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

from cellmech.causes import Cause, Reason
from cellmech.console import say
from cellmech.errors import CellmechError
from cellmech.results.archive import Record, refusal
from cellmech.results.records import LOG, RESULT, write_whole
from cellmech.results.sealed import sealed
from cellmech.runs.handout import Counter
from cellmech.runs.interrupts import Interrupts
from cellmech.runs.job import Job, Solve, solve_job
from cellmech.runs.messages import PAUSE_S, Post, Watcher

if TYPE_CHECKING:  # brings DOLFINx along, which --list and bad input need not wait for
    from cellmech.runs.case import Progress

GRACE_S = 10.0  # for the other ranks of a case to run into the error that one has met


def solve_jobs(
    jobs: list[Job], solve: Solve, world: MPI.Intracomm, ranks_per_case: int, watcher: Watcher, interrupts: Interrupts
) -> list[Record]:
    """Solve the cases, each on so many ranks, and write their files. Collective on world.

    Args:
        jobs: the cases, the same on every rank.
        solve: `case.solve_case`.
        world: all ranks; those that do not fill a group are idle.
        ranks_per_case: size of a group.
        watcher: told of the cases on world rank 0.
        interrupts: asked at every step.

    Returns:
        The contents of the result.json files on world rank 0, in the order of the jobs; [] elsewhere.
    """
    groups = world.size // ranks_per_case
    group = world.rank // ranks_per_case
    post, counter = Post(world, watcher), Counter(world)
    comm = world.Split(group if group < groups else MPI.UNDEFINED, world.rank)
    if comm != MPI.COMM_NULL:
        together = comm.Dup()  # a rank that has failed must not speak where the others still solve
        for index in hand_out(len(jobs), counter, together):
            _Attempt(index, jobs[index], comm, together, post, interrupts).run(solve)
        together.Free()
        comm.Free()
    post.close(len(jobs))
    counter.close()
    return [post.results[index] for index in range(len(jobs))] if world.rank == 0 else []


def hand_out(count: int, counter: Counter, group: MPI.Comm) -> Iterator[int]:
    """The numbers below `count` that fall to a group, each when it asks for it. Collective on the group."""
    while (index := group.bcast(counter.take() if group.rank == 0 else count)) < count:
        yield index


class _Attempt:
    """One case in the hands of one group."""

    def __init__(
        self, index: int, job: Job, comm: MPI.Comm, together: MPI.Comm, post: Post, interrupts: Interrupts
    ) -> None:
        self.index, self.job, self.comm, self.together, self.post = index, job, comm, together, post
        self.interrupts, self.lead, self.waits = interrupts, comm.rank == 0, False

    def run(self, solve: Solve) -> None:
        """Solve; whatever goes wrong, the group ends with the same result on every rank, or the whole job ends."""
        with ExitStack() as self.lock:  # on the folder: until what went wrong, too, is written there
            self._run(solve)

    def _run(self, solve: Solve) -> None:
        begun, trace = time.perf_counter(), ""
        result: Record | None = None
        reason: Reason | None = None
        if self.lead:
            self.post.started(self.index)
        try:
            result = solve_job(self.job, solve, self.comm, self.lock, self._report, self._wait)
        except CellmechError as error:
            reason = Reason(error.cause, str(error))
        except OSError as error:
            reason, trace = refusal(error), traceback.format_exc()
        except Exception as error:
            text = " ".join(str(error).split())  # one line; PETSc's have many
            if isinstance(error, MemoryError) and text:
                reason, trace = Cause.MEMORY.reason(told=text), traceback.format_exc()
            else:
                reason, trace = Cause.INTERNAL.reason(told=f"{type(error).__name__}: {text}"), traceback.format_exc()
        reason, trace = self._agree(reason, trace)
        if reason is not None:
            took = {"wall_s": time.perf_counter() - begun, "ranks": self.comm.size}
            scene = self.job.case.scene.model_dump(mode="json", by_alias=True)
            result = self.job.signed({**reason.as_record(), "scene": scene, **took})
            if self.lead:
                self._record(result, trace)
        assert result is not None
        if self.lead:
            self.post.finished(self.index, result)

    def _wait(self) -> None:
        if not self.waits:
            text = f"cellmech: {self.job.label}: waits for another process that is at work in {self.job.folder}"
            say(text, sys.stderr)
        self.waits = True
        self.interrupts.check()
        time.sleep(PAUSE_S)

    def _report(self, progress: Progress) -> None:
        self.interrupts.check()
        if self.lead:
            self.post.progressed(self.index, progress)

    def _agree(self, reason: Reason | None, trace: str) -> tuple[Reason | None, str]:
        """The fault on the first rank that met one. If the others go on solving, the job is ended."""
        arrival, deadline = self.together.Ibarrier(), time.monotonic() + GRACE_S
        while not arrival.Test():
            if reason is not None and time.monotonic() > deadline:
                self._abort(reason, trace)
            time.sleep(PAUSE_S / 10)
        met = self.together.allgather((reason, trace))
        return next((found for found in met if found[0] is not None), (None, ""))

    def _abort(self, reason: Reason, trace: str) -> None:
        place = f"rank {self.comm.rank} of {self.comm.size}"
        _append(self.job.folder / LOG, f"failed on {place} alone: {reason}\n{trace}")
        text = f"cellmech: {self.job.label}: {reason} (on {place} alone; all ranks are stopped)"
        say(text, sys.stderr)
        MPI.COMM_WORLD.Abort(1)

    def _record(self, result: Record, trace: str) -> None:
        """Leave on disk what is known of a case that fell over; if the disk is what failed, in the result only."""
        _append(self.job.folder / LOG, f"failed: {result['reason']}\n{trace}")
        try:
            write_whole(self.job.folder / RESULT, sealed(result))
        except OSError as error:
            result["reason"] += f" (and result.json cannot be written: {error})"


def _append(path: Path, text: str) -> None:
    try:
        with open(path, "a", encoding="utf-8") as stream:
            stream.write(text.rstrip("\n") + "\n")
    except OSError:
        pass  # the same text goes to the terminal
