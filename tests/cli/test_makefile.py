"""The make targets: what they start, with the programs themselves replaced by echo."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ECHO = ("PLOTS=echo plots", "PAPER=echo paper", "STUDY=echo study")
OF_AN_OUTER_MAKE = ("MAKEFLAGS", "MFLAGS", "MAKEOVERRIDES", "MAKELEVEL", "N", "ARGS", "RESULTS", "SETTINGS")
TARGETS = [*(f"fig{n}" for n in range(1, 8)), *(f"table{n}" for n in range(1, 4))]
TARGETS += ["paper", "paper-runs", "figures-smoke", "compare", "report", "audit", "calibrate"]
TARGETS += ["movie", "lattice", "speed", "speed-error", "docs"]
TARGETS += ["verify", "accuracy", "defaults", "second-code", "mutants", "needs", "locking", "hard-cases"]
TARGETS += ["fuzz", "campaign", "container-check"]


def make(*arguments: str) -> subprocess.CompletedProcess[str]:
    env = {key: value for key, value in os.environ.items() if key not in OF_AN_OUTER_MAKE}
    return subprocess.run(["make", "SETUP=true", *arguments], cwd=ROOT, env=env, capture_output=True, text=True)


def started(done: subprocess.CompletedProcess[str]) -> list[str]:
    """What the echoes said, in order."""
    return [line for line in done.stdout.splitlines() if line.split(" ")[0] in ("study", "plots", "paper")]


def test_help_lists_every_target() -> None:
    listed = [line.split()[1] for line in make().stdout.splitlines()]
    assert set(TARGETS) <= set(listed)


def test_paper_solves_its_57_runs_in_one_command_and_then_draws_all() -> None:
    done = make("paper", *ECHO)
    lines = started(done)
    assert done.returncode == 0, done.stderr
    begins = ["study", "--no-pictures"]
    assert lines[0].split()[:6] == [*begins, *(f"studies/{stem}.toml" for stem in ("fig2", "fig4", "fig6", "fig7"))]
    assert lines[1].split()[:5] == [*begins, *(f"studies/{stem}.toml" for stem in ("fig3", "fig5", "table3"))]
    drawn = [line.split()[1] for line in lines if line.startswith("plots")]
    assert drawn == [*(f"fig{n}" for n in range(1, 8)), "table1", "table2", "table3", "table-fig2"]
    assert lines[-2:] == ["paper compare --results results", "paper report --results results"]


@pytest.mark.parametrize("goal", ["paper", "fig4"])
def test_a_failed_case_leaves_the_figures_and_a_bad_status(goal: str) -> None:
    done = make(goal, *ECHO[:2], "STUDY=false")
    assert done.returncode != 0
    assert any(line.startswith("plots fig4 --results results/fig4") for line in started(done))


def test_root_and_settings_reach_every_command() -> None:
    done = make("paper", *ECHO, "RESULTS=elsewhere", "SETTINGS=mesh.size_um=2 load.factor=3")
    for line in started(done):
        assert " elsewhere" in line
        assert ("--set mesh.size_um=2 load.factor=3" in line) == line.startswith("study")


def test_the_coarse_paper_has_a_root_of_its_own() -> None:
    lines = started(make("figures-smoke", *ECHO))
    assert len(lines) == len(started(make("paper", *ECHO)))
    assert all(" results/smoke" in line for line in lines)


@pytest.mark.parametrize("target", [*TARGETS[1:7], "table3"])
def test_a_figure_is_solved_then_drawn(target: str) -> None:
    assert [" ".join(line.split()) for line in started(make(target, *ECHO))] == [
        f"study --no-pictures studies/{target}.toml --out results/{target}",
        f"plots {target} --results results/{target} --out results/figures",
    ]


def test_the_audit_goes_on_after_cases_without_a_solution() -> None:
    assert started(make("audit", *ECHO))[0].split()[1:6] == [
        "--no-pictures",
        "studies/audit.toml",
        "studies/audit-pairs.toml",
        "--out",
        "results",
    ]
    done = make("audit", *ECHO[:2], "STUDY=false")
    assert done.returncode == 0 and started(done) == ["paper audit --results results"]
