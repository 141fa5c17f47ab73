"""What the container image relies on; `make container-check` builds it and looks inside."""

import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from cli.programs import ENVIRONMENT
from mpi4py import MPI

from cellmech.fem.compiler import OPTIONS

ROOT = Path(__file__).resolve().parents[2]
OPEN_MPI = MPI.get_vendor()[1][0] if MPI.get_vendor()[0] == "Open MPI" else 0
SHARES = """
from mpi4py import MPI
from cellmech.fem.shared_memory import SEGMENT, release
world = MPI.COMM_WORLD
def named():
    return sum(SEGMENT in line and "(deleted)" not in line for line in open("/proc/self/maps"))
before, _, after = named(), release(world), world.allreduce(named())
assert world.allgather(b"x" * 100000) == [b"x" * 100000] * world.size
print(before > 0, after)
"""


def test_image_has_one_list_of_packages_with_the_set_up():
    steps = (ROOT / "Dockerfile").read_text()
    assert "RUN tools/setup.sh packages" in steps and "apt-get install" not in steps
    assert "pip install" not in steps and steps.count("FROM ") == 1


def test_forms_are_compiled_for_any_processor():
    """They are part of the image, which is built on one machine and runs on another."""
    flags = [*OPTIONS, *(sysconfig.get_config_var("CFLAGS") or "").split()]
    assert flags and not [flag for flag in flags if flag.startswith(("-march", "-mcpu", "-mtune=native"))]


@pytest.mark.skipif(OPEN_MPI < 5, reason="Open MPI 4 removes the names at its end, and warns if it cannot")
@pytest.mark.parametrize("ranks", [0, pytest.param(3, marks=pytest.mark.mpi)])
def test_shared_memory_has_no_name_while_it_is_used(ranks):
    launcher = ["mpirun", "-n", str(ranks)] if ranks else []
    command = [*launcher, sys.executable, "-c", SHARES]
    done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, timeout=60)
    assert (done.returncode, done.stdout) == (0, "True 0\n" * max(ranks, 1)), done.stderr
