"""A case that was killed on some number of ranks goes on on another."""

import csv
import sys
import time

import pytest
from cli.programs import ROOT, program, start

sys.path.append(str(ROOT / "benchmarks"))
from kill_sweep import kill_all

pytestmark = pytest.mark.mpi

SCENE = 'title = "half"\n[mesh]\nsize_um = 4.0\n[time]\nrtol = 1e-2\n'


DRIVEN = """[adhesion]
work_uJ_m2 = 0.5
[[actin]]
where = "basal"
stress_Pa = 1.0
start_s = 2000.0
[medium]
viscosity_Pa_s = 100.0
"""


def history(path):
    with open(path / "history.csv", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(("first", "then", "more"), [(2, 1, ""), (1, 3, ""), (2, 1, DRIVEN)])
def test_case_killed_on_some_ranks_goes_on_on_others(first, then, more, tmp_path):
    scene = tmp_path / "half.toml"
    whole, parts = tmp_path / "one" / "whole", tmp_path / "two" / "parts"  # side by side it would be taken over
    scene.write_text(SCENE + more)
    assert program(scene, "--out", whole, "--quiet", ranks=1).status == 0

    killed = start(scene, "--out", parts, "--ranks-per-case", first, "--quiet", ranks=first)
    while not (parts / "half" / "checkpoint.npz").exists():
        assert killed.poll() is None, killed.communicate()
        time.sleep(0.02)
    kill_all(killed)
    killed.communicate()
    assert not (parts / "half" / "result.json").exists()

    outcome = program(scene, "--out", parts, "--ranks-per-case", then, "--quiet", ranks=then)
    assert outcome.status == 0, outcome.err
    assert "goes on from the checkpoint" in (parts / "half" / "run.log").read_text()
    here, there = history(parts / "half"), history(whole / "half")
    assert [row["dt_s"] for row in here] == [row["dt_s"] for row in there]
    for key in there[0]:
        # round-off may decide a last iteration, and the place of a maximum may jump between equal values
        if key == "newton" or key.endswith((".x", ".y")):
            continue
        values = [(float(a[key] or 0.0), float(b[key] or 0.0)) for a, b in zip(here, there, strict=True)]
        largest = max(abs(b) for _, b in values)
        scale = 1.0 if key.startswith("share") else max(largest, 1e-3)  # shares: ratios of small numbers
        assert max(abs(a - b) for a, b in values) <= 1e-8 * scale, key
