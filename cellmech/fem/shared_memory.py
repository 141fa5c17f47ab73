"""Open MPI 5 (Debian 13) leaves 16 MB in /dev/shm for each process that ran without mpirun or was killed: not here."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from mpi4py import MPI

SEGMENT = "/dev/shm/sm_segment."


def release(world: MPI.Intracomm) -> None:
    """Take away the names of the memory that ranks share: it then ends with them, however they end. Collective.

    Nobody needs the names once every rank of a machine has mapped what the others share, which Open MPI does when it
    starts; where it does not, they stay.
    """
    try:
        lines = Path("/proc/self/maps").read_text().splitlines()
    except OSError:  # a machine without /proc: what there is stays
        lines = []
    mapped = {line[line.index(SEGMENT) :] for line in lines if SEGMENT in line}
    here = world.Split_type(MPI.COMM_TYPE_SHARED)
    if here.allreduce(len(mapped) == here.size, MPI.LAND):
        for path in mapped:
            with suppress(FileNotFoundError):  # another rank was first
                os.unlink(path)
    here.Free()
