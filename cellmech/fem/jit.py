"""Compiling forms, expressions and elements once, safely, and evaluating them.

FFCx marks a compilation by the C file it is about to write; a killed compiler leaves that file behind and every later
run waits for it and fails. Compilations here are serialised by a lock the operating system releases with the
process, and what a killed one left is removed under that lock.
"""

from __future__ import annotations

import fcntl
import logging
import math
import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np
from mpi4py import MPI

from cellmech.causes import Cause
from cellmech.console import say
from cellmech.errors import CompilerError
from cellmech.fem import compiler, fenicsx
from cellmech.sources import cache_directory

T = TypeVar("T")

PAUSE_S, TELL_S = 0.02, 15.0  # between two looks at the lock; a compilation takes less
TIMEOUT_S = 600  # for which FFCx waits for a compilation; without locks one that began earlier is taken for dead
_looked_at: dict[Path, int] = {}  # when each cache directory last changed before it was looked through [ns]


@contextmanager
def _compiling(comm: MPI.Comm) -> Iterator[dict[str, Any]]:
    """The options to compile with, while no other process compiles into the same place. Collective.

    Raises:
        OSError: on every rank, if the disk refuses the place.
    """
    with ExitStack() as stack:
        fault, directory, options = "", Path("~/.cache/cellmech"), []
        try:
            if comm.rank == 0:
                directory = cache_directory()
                stack.enter_context(_alone(directory))
                options = compiler.options(fenicsx.tables_mark())
        except OSError as error:  # must not leave the other ranks waiting
            fault = str(error.strerror)
        if comm.size > 1:
            fault, directory, options = comm.bcast((fault, directory, options))
        if fault:
            rule = f"compiled equations cannot be kept there ({fault})"
            raise OSError(f"{directory}: {rule}. Name another place with XDG_CACHE_HOME.")
        stack.enter_context(compiler.clean_environment(directory))
        stack.enter_context(fenicsx.own_parameters())
        yield {"cache_dir": str(directory), "cffi_extra_compile_args": options, "timeout": TIMEOUT_S}


@contextmanager
def _alone(directory: Path) -> Iterator[None]:
    """Let one process at a time compile; what a killed one left is removed."""
    directory.mkdir(parents=True, exist_ok=True)
    with open(os.open(directory / "lock", os.O_RDWR | os.O_CREAT), "r+", errors="replace") as lock:
        locked = _take(lock, directory / "lock")
        if _looked_at.get(directory) != directory.stat().st_mtime_ns:
            for source in directory.glob("libffcx_*.c"):
                with suppress(FileNotFoundError):  # without locks another process may be faster
                    dead = locked or time.time() - source.stat().st_mtime > TIMEOUT_S
                    if dead and not source.with_suffix(".c.cached").exists():
                        source.unlink()
            _looked_at[directory] = directory.stat().st_mtime_ns
        with _quiet():
            yield


def _take(lock: IO[str], place: Path) -> bool:
    """Wait for the lock; who waits for long, maybe for a process that has been suspended, is told for which.

    False on a file system without locks. Two that compile the same there still wait for each other, as FFCx does.
    """
    told_at = time.monotonic() + TELL_S
    while True:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            break
        except BlockingIOError:
            if time.monotonic() > told_at:
                told_at = math.inf
                lock.seek(0)
                holder = lock.read(20).strip() or "?"
                text = f"cellmech: waits for process {holder}, which compiles equations and holds {place}"
                say(text, sys.stderr)
            time.sleep(PAUSE_S)
        except OSError:
            return False
    with suppress(OSError):  # a full disk: the number is for a message only
        os.pwrite(lock.fileno(), f"{os.getpid():<10}".encode(), 0)
    return True


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the compiler's command lines, which setuptools logs, and FFCx's advice off the user's terminal."""
    root = logging.getLogger()
    level, disabled = root.level, root.manager.disable
    logging.disable(logging.INFO)  # setuptools lowers the root logger's own level while it compiles
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(disabled)
        root.setLevel(level)


def _compiled(comm: MPI.Comm, make: Callable[[dict[str, Any]], T]) -> T:
    """The result of `make`, called with options to compile with; again if what is kept cannot be loaded. Collective.

    Raises:
        CompilerError: on every rank, if there is no compiler that works.
        OSError: likewise, if the disk refuses the place.
    """
    with _compiling(comm) as options:
        fault: Exception | None = None
        try:
            made = make(options)
        except Exception as caught:
            fault = caught
        again = fault is not None and comm.rank == 0 and _removed(Path(options["cache_dir"]), str(fault))
        if comm.bcast(again) if comm.size > 1 else again:
            return make(options)
        lacking = compiler.fault(fault) if fault is not None else ""
        if lacking := comm.bcast(lacking) if comm.size > 1 else lacking:
            raise CompilerError(str(Cause.COMPILER.reason(told=lacking))) from fault
        if fault is not None:
            raise fault
        return made


def _removed(directory: Path, fault: str) -> bool:
    """Remove what a power cut has cut short, which no run could ever load; whether there was any.

    That is the module that the error names, and any that is said to be there and has no library.
    """
    found = False
    with suppress(OSError):  # then the error that was met is told
        libraries = {path.name.partition(".")[0] for path in directory.glob("libffcx_*.so")}
        for mark in directory.glob("libffcx_*.c.cached"):
            name = mark.name.partition(".")[0]
            if name in fault or name not in libraries:
                mark.unlink()  # first: what a kill leaves now is a compilation that was killed
                for path in directory.glob(f"{name}.*"):
                    path.unlink()
                found = True
    return found


def compile_form(form: Any, comm: MPI.Comm) -> Any:
    """The compiled form (collective on comm)."""
    return _compiled(comm, lambda options: fenicsx.compiled_form(form, options))


def displacement_space(mesh: Any, degree: int, bubble: bool = False) -> Any:
    """Continuous Lagrange vectors of this degree on a mesh, or P2 with a cubic bubble (collective)."""
    return _compiled(mesh.comm, lambda options: fenicsx.displacement_space(mesh, degree, options, bubble))


def pressure_space(mesh: Any, degree: int = 1) -> Any:
    """Functions of this degree on each cell of a mesh, free to jump between cells (collective)."""
    return _compiled(mesh.comm, lambda options: fenicsx.discontinuous_space(mesh, degree, options))


def cellwise_space(mesh: Any) -> Any:
    """Functions constant on each cell of a mesh (collective)."""
    return _compiled(mesh.comm, lambda options: fenicsx.discontinuous_space(mesh, 0, options))


class PointValues:
    """A UFL expression evaluated at fixed reference points of many cells.

    Args:
        expression: scalar, vector or tensor UFL expression.
        points: reference points [-], shape (n_points, 2).
        comm: communicator of the mesh.
    """

    def __init__(self, expression: Any, points: np.ndarray, comm: MPI.Comm) -> None:
        points = np.asarray(points, dtype=float)
        self._expression = _compiled(comm, lambda options: fenicsx.compiled_expression(expression, points, options))
        self.n_points, self._mesh = len(points), fenicsx.mesh_of(expression)
        self.value_size = math.prod(expression.ufl_shape)

    def __call__(self, cells: np.ndarray) -> np.ndarray:
        """Values at the points of the cells, shape (n_cells, n_points, value_size)."""
        values = fenicsx.evaluate(self._expression, self._mesh, cells)
        return values.reshape(len(cells), self.n_points, self.value_size)  # also of no cells
