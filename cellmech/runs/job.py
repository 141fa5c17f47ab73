"""A case and its folder: solved there once, by one process at a time."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from mpi4py import MPI

from cellmech.results.archive import Record, alone_in, finished, forget, signed
from cellmech.results.records import CaseFolder
from cellmech.runs.messages import agreed
from cellmech.scene.case import Case

if TYPE_CHECKING:  # they bring DOLFINx along, which --list and bad input need not wait for
    from cellmech.runs.case import MeshPlan, Progress

Report: TypeAlias = "Callable[[Progress], None]"
Solve: TypeAlias = "Callable[[Case, CaseFolder, MPI.Comm, MeshPlan, Report], Record]"


@dataclass(frozen=True)
class Job:
    """A case to solve, and where its files go.

    Args:
        label: what the user reads; the case's name, told apart if there are several studies.
        case: the case.
        folder: of its files.
        plan: which layers its mesh keeps apart.
        key: ties the result to its inputs, `archive.input_key`.
        source: ties it to the program, `archive.source_hash` at the start.
        notes: first lines of run.log.
        fresh: whether it is solved anew whatever is there.
    """

    label: str
    case: Case
    folder: Path
    plan: MeshPlan
    key: str
    source: str
    notes: tuple[str, ...] = ()
    fresh: bool = False

    def signed(self, record: Record) -> Record:
        """A result with what ties it to the job."""
        return signed(record, self.case.name, self.source, self.key)


def solve_job(
    job: Job, solve: Solve, comm: MPI.Comm, lock: ExitStack, report: Report, wait: Callable[[], None] | None = None
) -> Record:
    """Solve a case into its folder, unless its result is there. Collective.

    Args:
        job: the case.
        solve: `case.solve_case`.
        comm: the ranks that share it.
        lock: keeps other processes from the folder until it is closed: the caller may have a failure to write there.
        report: told of every accepted step.
        wait: called again and again while another process is at work in the folder; without it that is an error.

    Returns:
        The content of result.json.

    Raises:
        CellmechError: the case cannot be set up.
        OSError: the disk refuses, or another process is at work there.
    """

    def enter() -> Record | None:
        lock.enter_context(alone_in(job.folder, wait))
        if job.fresh:
            forget(job.folder)
        return finished(job.folder, job.key)

    if (found := agreed(comm, enter)) is not None:
        return found
    folder = CaseFolder(job.folder, comm, job.key)
    try:
        folder.agree()
        for note in job.notes:
            folder.log(note)
        result = job.signed(solve(job.case, folder, comm, job.plan, report))
        folder.finish(result)
        return result
    finally:
        folder.close()
