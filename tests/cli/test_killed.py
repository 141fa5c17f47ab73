"""A sweep under mpirun that is killed with SIGKILL and goes on, by benchmarks/kill_sweep.py with few cases."""

import time
from contextlib import suppress
from pathlib import Path

import pytest
from cli import programs
from cli.programs import ROOT, end, start
from held_compiler import held_compiler

STUDY = """
title = "killed"
[mesh]
size_um = 6.0
[time]
rtol = 0.02
[sweep]
"layer.nucleoplasm.young_Pa" = [10, 30, 50]
"""


def shared_memory():
    """What Open MPI keeps there."""
    return set(Path("/dev/shm").glob("*_segment.*"))


def in_use():
    """Paths of the files that processes have mapped."""
    found = set()
    for maps in Path("/proc").glob("[0-9]*/maps"):
        with suppress(OSError):  # it has just ended, or is another user's
            found.update(Path(line.split()[-1]) for line in maps.read_text().splitlines() if " /dev/shm/" in line)
    return found


@pytest.fixture(autouse=True)
def no_shared_memory_left():
    """Ranks and mpirun killed all at once leave theirs: nobody is left to remove it."""
    before = shared_memory()
    yield
    left = shared_memory() - before
    time.sleep(1.0)  # what others have made at this moment is mapped by then
    for path in left - in_use():
        with suppress(OSError):  # another user's
            path.unlink()


@pytest.fixture
def held(folder, monkeypatch):
    """Until this file is there, a compilation of the interrupted sweep stays under way."""
    path, gate = held_compiler(folder, caches="*/kill-sweep-*", path=str(ROOT))
    monkeypatch.setitem(programs.ENVIRONMENT, "PYTHONPATH", path)
    yield gate
    gate.touch()


@pytest.mark.mpi
@pytest.mark.slow
def test_killed_sweep_ends_with_the_tables_of_one_left_alone(folder, held):
    """Killed in the middle of a compilation, at the first checkpoint, and once more."""
    (folder / "my.toml").write_text(STUDY)
    sweep = start("my.toml", "--kills", 3, program=(str(ROOT / "benchmarks" / "kill_sweep.py"),))
    first = next((line for line in sweep.stdout if line.startswith("kill ")), "")
    held.touch()
    outcome = end(sweep, seconds=600)
    assert outcome.status == 0, outcome.err
    second, *_, last = [line for line in outcome.out.splitlines() if line.startswith(("kill ", "summary"))]
    assert first == "kill 1, at the first compilation: killed while compiling; 0 cases done, 0 with a checkpoint\n"
    assert "1 with a checkpoint" in second or "2 with a checkpoint" in second
    assert last == "summary.csv and all histories are equal, byte for byte"
