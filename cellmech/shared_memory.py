"""Open MPI leaves megabytes in /dev/shm of each process that was killed, Open MPI 5 of any without mpirun: not here."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

from mpi4py import MPI

SEGMENT = re.compile(r"/dev/shm/(sm|vader)_segment\.\S+")  # of Open MPI 5 and of 4


def release(world: MPI.Intracomm) -> None:
    """Take away the names of the memory that ranks share: it then ends with them, however they end. Collective.

    Nobody needs the names once every rank of a machine has mapped what the others share, which Open MPI does when it
    starts; where it does not, they stay.
    """
    mapped = {found[0] for found in SEGMENT.finditer(Path("/proc/self/maps").read_text())}
    here = world.Split_type(MPI.COMM_TYPE_SHARED)
    if here.allreduce(len(mapped) == here.size, MPI.LAND):
        for path in mapped:
            with suppress(FileNotFoundError):  # another rank was first
                os.unlink(path)
    here.Free()
