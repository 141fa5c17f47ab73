"""Running the command line as a program, also under mpirun, and looking at what it leaves."""

import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FAKE = str(Path(__file__).with_name("fake_case.py"))
PATIENCE_S = 300  # on a busy machine with an empty compiler cache a study of some seconds takes minutes
COMPILES = "cellmech: waits for process "  # another test or run, which has the same compiler cache, and long
ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": str(ROOT),
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    "PRTE_MCA_hwloc_default_binding_policy": "none",
}


@dataclass
class Outcome:
    status: int
    out: str
    err: str


def cases(*names, title="Mine"):
    """The text of a study file with these cases, told apart by their load."""
    blocks = [f'[[case]]\nname = "{name}"\n"load.factor" = {i}\n' for i, name in enumerate(names, start=1)]
    return f'title = "{title}"\n' + "".join(blocks)


def start(*arguments, ranks=0, program=("-m", "cellmech.study")):
    """Start the command line as a program in the current folder, under mpirun if there are ranks."""
    launcher = ["mpirun", "-n", str(ranks)] if ranks else []
    return subprocess.Popen(
        [*launcher, sys.executable, *program, *map(str, arguments)],
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # this process may ignore it
    )


def end(process, seconds=PATIENCE_S):
    """Wait for a program; one that hangs is a failure."""
    try:
        out, err = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        pytest.fail(f"still running after {seconds} s")
    ours = [line for line in err.splitlines(keepends=True) if not line.startswith(COMPILES)]
    return Outcome(process.returncode, out, "".join(ours))


def program(*arguments, seconds=PATIENCE_S, **options):
    """Run the command line as a program."""
    return end(start(*arguments, **options), seconds)


def tree(folder):
    """Every path below a folder, with the content of the files."""
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}
