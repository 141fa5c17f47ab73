"""Surroundings of the process that must not change what it computes: streams, launchers, others' variables.

Nothing heavy is imported here: it has to run before MPI, PETSc and DOLFINx look around for themselves.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from cellmech.errors import CellmechError, InputError

RANK = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "PMI_FD")  # one of them has whom an MPI launcher has started
STEP = ("SLURM_STEP_ID", "SLURM_STEPID")  # by which Open MPI takes a process for one that srun has started
# What Open MPI needs for a process alone: no daemon, which version 4 looks for in PATH, and no network.
LONE = {"OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_btl": "self", "OMPI_MCA_pml": "ob1"}
OF_OTHERS = ("OMPI_MCA_", "SLURM_", "FLUX_", "JSM_")  # settings, and launchers that Open MPI looks for
LEAST_MB = 800  # of addresses: the libraries take 550, and OpenBLAS 134 in one piece
STREAMS = (("stdin", "r"), ("stdout", "w"), ("stderr", "w"))  # by their numbers


def open_streams() -> None:
    """Open standard input, output and error on /dev/null where they are closed, as cron and daemons leave them.

    The first file that is opened would get the number of one that is closed, and what C prints would go into a result.
    """
    for number, (name, mode) in enumerate(STREAMS):
        try:
            os.fstat(number)
        except OSError:
            opened = os.open(os.devnull, os.O_RDWR)
            os.dup2(opened, number) if opened != number else os.set_inheritable(number, True)
            if opened != number:
                os.close(opened)
        stream = getattr(sys, name)
        if stream is None or getattr(stream, "closed", False):
            setattr(sys, name, open(os.devnull, mode))  # UFL asks standard output whether it is a terminal


@contextmanager
def changed_environment(changes: Mapping[str, str | None]) -> Iterator[None]:
    """Set these variables, or take away those that are None, while the block lasts."""
    before = {name: os.environ.get(name) for name in changes}
    try:
        _set(changes)
        yield
    finally:
        _set(before)


def _set(variables: Mapping[str, str | None]) -> None:
    for name, value in variables.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


def launched() -> bool:
    """True if an MPI launcher has started this process, perhaps beside others; one that nobody has is alone."""
    return any(name in os.environ for name in RANK)


def task() -> int:
    """Number of this process among those that one call of srun has started; 0 if it has started none."""
    return _number("SLURM_PROCID") if _by_srun() else 0


def _number(name: str) -> int:
    text = os.environ.get(name, "")
    return int(text) if text.isdecimal() else 0


def _by_srun() -> bool:
    """True if srun itself has started this process, not somebody in a shell that srun has."""
    if not any(name in os.environ for name in STEP):
        return False
    if _number("SLURM_PROCID") > 0:
        return True
    try:
        return Path(f"/proc/{os.getppid()}/comm").read_text().strip() == "slurmstepd"
    except OSError:
        return False


def start_mpi() -> Any:
    """MPI's module, MPI started; whoever has started it before has settled how.

    A process that no launcher has started is alone. In a shell of srun's Open MPI takes it for one that srun has
    started, and ends it before it can speak: there it does not get to see that shell's step.

    Raises:
        InputError: srun has started several processes that cannot find each other.
        CellmechError: a limit on memory leaves no room for anything.
    """
    refuse_without_room()
    alone = not launched()
    tasks = _number("SLURM_STEP_NUM_TASKS") or _number("SLURM_NTASKS")
    if alone and tasks > 1 and _by_srun():
        rule = f"has started {tasks} processes without PMIx, by which MPI's ranks find each other"
        raise InputError("srun", "", rule, None, f"Start them with mpirun -n {tasks}, or with srun --mpi=pmix.")
    with changed_environment(_lone() if alone else {}):
        from mpi4py import MPI
    return MPI


def _lone() -> dict[str, str | None]:
    """Variables to change while MPI starts in a process that is alone: what they tell of others is wrong there."""
    theirs = [name for name in os.environ if name.startswith(OF_OTHERS)]
    place = tempfile.gettempdir()  # one that can be written to, as TMPDIR's may not
    temporary = {"TMPDIR": place} if os.access(place, os.W_OK) else {}
    return {**dict.fromkeys(theirs), **LONE, **temporary}


def refuse_without_room() -> None:
    """Refuse a limit on memory (ulimit -v) under which libraries do not load, or OpenBLAS asks for its own for ever.

    Raises:
        CellmechError: with the limit.
    """
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_MB * 10**6:
        got = f"the limit on memory (ulimit -v) is {limit // 1024} kB"
        raise CellmechError(f"{got}: less than {LEAST_MB} MB is not enough to begin. Raise it: ulimit -v unlimited")


def refuse_other_numpy() -> None:
    """Refuse a NumPy of another major version than the one that Debian's DOLFINx was built with.

    pip brings it along with packages of others, and puts it before Debian's: what is compiled then fails to load.

    Raises:
        CellmechError: with what to do.
    """
    found = [one for one in metadata.distributions(name="numpy") if one.version]
    if found and found[0].version.split(".")[0] != found[-1].version.split(".")[0]:
        place = f" in {found[0].locate_file('')}".rstrip("/")
        raise CellmechError(
            f"NumPy {found[0].version}{place} is not the {found[-1].version} that DOLFINx was built with: "
            f"remove it with {sys.executable} -m pip uninstall -y numpy, then make setup"
        )


def start_petsc() -> None:
    """Start PETSc without the options that its variables and files hold: they would reach every object of ours.

    Nor does it take signals over: it would answer a pipe that is closed, which Python takes for an error, by a crash.

    Whoever has started it before has settled them; `fenicsx.own_options` then keeps them away while a case is solved.

    Raises:
        InputError: PETSC_DIR hides Debian's PETSc.
    """
    if find_spec("petsc4py") is None and (place := os.environ.get("PETSC_DIR")):
        raise InputError(
            "PETSC_DIR", "", "names another PETSc, which has no petsc4py", place, "Take it away with unset."
        )
    import petsc4py

    hidden = [name for name in os.environ if name.startswith("PETSC_OPTIONS")]
    with changed_environment(dict.fromkeys(hidden)):
        petsc4py.init(["-skip_petscrc", "-no_signal_handler"])


@contextmanager
def some_home() -> Iterator[None]:
    """Have a home while the block lasts, where there is none: DOLFINx looks for it when it is imported."""
    with changed_environment({} if home() is not None else {"HOME": tempfile.gettempdir()}):
        yield


def home() -> Path | None:
    """The user's folder, None if nothing says which it is."""
    try:
        with changed_environment({} if os.environ.get("HOME") else {"HOME": None}):
            return Path.home()
    except (RuntimeError, KeyError):
        return None
