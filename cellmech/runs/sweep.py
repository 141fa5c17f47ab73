"""Cases over MPI ranks: each group of ranks takes the next case when it is free, world rank 0 hears how they get on.

What a case computes never depends on the group that has it.
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from mpi4py import MPI

from cellmech.console import say
from cellmech.errors import CellmechError
from cellmech.results.archive import INTERNAL, Record, alone_in, finished, refusal, signed
from cellmech.results.records import LOG, RESULT, CaseFolder, write_whole
from cellmech.results.sealed import sealed
from cellmech.runs.handout import Counter
from cellmech.runs.interrupts import Interrupts
from cellmech.runs.messages import PAUSE_S, Post, Watcher, agreed
from cellmech.scene.case import Case

if TYPE_CHECKING:  # they bring DOLFINx along, which --list and bad input need not wait for
    from cellmech.runs.case import MeshPlan, Progress

GRACE_S = 10.0  # for the other ranks of a case to run into the error that one has met

Solve: TypeAlias = "Callable[[Case, CaseFolder, MPI.Comm, MeshPlan, Callable[[Progress], None]], Record]"


@dataclass(frozen=True)
class Job:
    """A case to solve, and where its files go.

    Args:
        label: what the user reads; the case's name, told apart if there are several studies.
        case: the case.
        folder: of its files.
        plan: which layers its mesh keeps apart.
        key: ties the result to its inputs, `records.input_key`.
        source: ties it to the program, `records.source_hash` at the start.
        notes: first lines of run.log.
    """

    label: str
    case: Case
    folder: Path
    plan: MeshPlan
    key: str
    source: str
    notes: tuple[str, ...] = ()


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
        begun, result, reason, trace = time.perf_counter(), None, "", ""
        if self.lead:
            self.post.started(self.index)
        try:
            result = self._solve(solve)
        except CellmechError as error:
            reason = str(error)
        except OSError as error:
            reason, trace = refusal(error), traceback.format_exc()
        except Exception as error:
            text = " ".join(str(error).split())  # one line; PETSc's have many
            reason, trace = f"{INTERNAL}: {type(error).__name__}: {text}", traceback.format_exc()
        reason, trace = self._agree(reason, trace)
        if reason or result is None:
            took = {"wall_s": time.perf_counter() - begun, "ranks": self.comm.size}
            scene = self.job.case.scene.model_dump(mode="json", by_alias=True)
            result = self._complete({"status": "failed", "reason": reason, "scene": scene, **took})
            if self.lead:
                self._record(result, trace)
        if self.lead:
            self.post.finished(self.index, result)

    def _solve(self, solve: Solve) -> Record:
        """Solve, unless another process has brought the result since the start. Collective."""

        def enter() -> Record | None:
            self.lock.enter_context(alone_in(self.job.folder, self._wait))
            return finished(self.job.folder, self.job.key)

        return agreed(self.comm, enter) or self._solve_alone(solve)

    def _wait(self) -> None:
        if not self.waits:
            text = f"cellmech: {self.job.label}: waits for another process that is at work in {self.job.folder}"
            say(text, sys.stderr)
        self.waits = True
        self.interrupts.check()
        time.sleep(PAUSE_S)

    def _solve_alone(self, solve: Solve) -> Record:
        folder = CaseFolder(self.job.folder, self.comm, self.job.key)
        try:
            folder.agree()
            for note in self.job.notes:
                folder.log(note)
            result = self._complete(solve(self.job.case, folder, self.comm, self.job.plan, self._report))
            folder.finish(result)
            return result
        finally:
            folder.close()

    def _report(self, progress: Progress) -> None:
        self.interrupts.check()
        if self.lead:
            self.post.progressed(self.index, progress)

    def _complete(self, result: Record) -> Record:
        return signed(result, self.job.case.name, self.job.source, self.job.key)

    def _agree(self, reason: str, trace: str) -> tuple[str, str]:
        """What went wrong on the first rank where something did. If the others go on solving, the job is ended."""
        arrival, deadline = self.together.Ibarrier(), time.monotonic() + GRACE_S
        while not arrival.Test():
            if reason and time.monotonic() > deadline:
                self._abort(reason, trace)
            time.sleep(PAUSE_S / 10)
        met = self.together.allgather((reason, trace))
        return next((found for found in met if found[0]), ("", ""))

    def _abort(self, reason: str, trace: str) -> None:
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
