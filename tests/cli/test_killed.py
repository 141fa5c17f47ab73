"""A sweep under mpirun that is killed with SIGKILL and goes on, by benchmarks/kill_sweep.py with few cases."""

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


@pytest.fixture
def held(folder, monkeypatch):
    """Until this file is there, a compilation of the interrupted sweep stays under way."""
    compiler, gate = held_compiler(folder, caches="*/kill-sweep-*")
    monkeypatch.setitem(programs.ENVIRONMENT, "CC", compiler)
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
