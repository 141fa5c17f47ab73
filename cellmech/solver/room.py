"""How much memory a solver takes, by what was measured, and how much there is."""

from __future__ import annotations

import ctypes
from contextlib import suppress
from pathlib import Path

from mpi4py import MPI

GIB = 2.0**30
# Bytes per unknown at 100,000 unknowns, all else of a run included, and the power of the unknowns by which they grow.
MUMPS = {2: (1.8e4, 0.3), 3: (2.2e4, 0.3)}
MULTIGRID = {2: (5.7e3, 0.0), 3: (7.2e3, 0.0)}
MEASURED_AT = 1e5
BASE = 0.2 * GIB  # the libraries


def needed_bytes(unknowns: int, order: int, multigrid: bool) -> float:
    """Memory that a body in space takes at most, all ranks together [bytes].

    Args:
        unknowns: of the displacement.
        order: of its polynomials; the first takes no more than the second.
        multigrid: whether it is solved by multigrid, not by MUMPS.
    """
    each, power = (MULTIGRID if multigrid else MUMPS)[max(order, 2)]
    return BASE + unknowns * each * (unknowns / MEASURED_AT) ** power


def give_back() -> None:
    """Give memory that is free again back to the system, which the C library keeps otherwise: others may want it."""
    with suppress(AttributeError, OSError):  # of the GNU C library alone
        ctypes.CDLL(None).malloc_trim(0)


def available_bytes(comm: MPI.Comm) -> float:
    """Memory that is free on all nodes of the ranks together [bytes]. Collective."""
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    found = comm.allreduce(_free_here() / node.size)
    node.Free()
    return float(found)


def _free_here() -> float:
    """Of this node, or of the control group that its processes are in [bytes]; infinite where nothing says so."""
    free = float("inf")
    with suppress(OSError, ValueError):
        entries = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
        free = 1024.0 * int(entries["MemAvailable"].split()[0])
    with suppress(OSError, ValueError):  # "max" is no number: no limit
        group = Path("/sys/fs/cgroup")
        used = int((group / "memory.current").read_text())
        free = min(free, float(int((group / "memory.max").read_text()) - used))
    return free


def refuse_without(needed: float, unknowns: int, comm: MPI.Comm, surely: float = 1.0) -> None:
    """Refuse a body that takes more than there is. Collective.

    Args:
        needed: memory that it takes [bytes].
        unknowns: of the displacement.
        comm: of its ranks.
        surely: share of it that it takes in any case [-], if it is estimated.

    Raises:
        MemoryError: on every rank, with how much coarser a mesh would fit.
    """
    if surely * needed <= (free := available_bytes(comm)):
        return
    wider = (needed / free) ** (1 / 3)  # memory grows a little faster than 1/size^3: it fits
    rule = f"{unknowns:,} unknowns need about {needed / GIB:.3g} GiB, {free / GIB:.3g} are free"
    raise MemoryError(f"{rule}. A mesh.size_um {wider:.2f} times as large would fit, or more ranks on further nodes")
