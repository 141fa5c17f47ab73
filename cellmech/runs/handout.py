"""Numbers handed out over MPI, each once, to whichever rank asks next. No rank serves the others."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

ITEM = np.dtype(np.int64)


class Counter:
    """Counts 0, 1, 2, ... for all ranks of a communicator together.

    The count lies in a window of rank 0's memory, which the ranks of one machine share: rank 0 may be deep in a solve.
    That takes memory allocated by MPI: with memory of our own (Win.Create) the others would wait for rank 0. A rank
    on another machine, too, may have to wait until rank 0 next calls MPI.

    Args:
        comm: all ranks that may ask; collective here and in `close`.
    """

    def __init__(self, comm: MPI.Intracomm) -> None:
        first = comm.rank == 0
        self._window = MPI.Win.Allocate(ITEM.itemsize if first else 0, ITEM.itemsize, comm=comm)
        if first:
            self._window.Lock(0)
            self._window.tomemory()[:] = bytes(ITEM.itemsize)
            self._window.Unlock(0)
        comm.Barrier()

    def take(self) -> int:
        """The next number. Not collective."""
        number = np.empty(1, ITEM)
        self._window.Lock(0)
        self._window.Fetch_and_op(np.ones(1, ITEM), number, 0, 0, MPI.SUM)
        self._window.Unlock(0)
        return int(number[0])

    def close(self) -> None:
        """Give the memory back, once nobody asks any more."""
        self._window.Free()
