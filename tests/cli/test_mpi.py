"""The command line under mpirun, with a fake solver."""

import csv
import json
from pathlib import Path

import pytest
from cli.programs import FAKE, cases, program

pytestmark = pytest.mark.mpi


def fake(*arguments, ranks=0):
    return program(*arguments, ranks=ranks, program=(FAKE,))


def ranks_of(*names):
    return [json.loads(Path(f"results/my/{name}/result.json").read_text())["ranks"] for name in names]


def test_summary_does_not_depend_on_the_ranks(folder):
    Path("my.toml").write_text(cases("a", "b", "fails", "c", "d"))
    assert fake("my.toml", "--out", "serial").status == 1
    for ranks, each in ((2, 1), (3, 2)):
        outcome = fake("my.toml", "--out", f"out{ranks}", "--ranks-per-case", each, ranks=ranks)
        assert outcome.status == 1
        assert outcome.out.count("my: 4 of 5 cases solved") == 1
        assert Path(f"out{ranks}/summary.csv").read_bytes() == Path("serial/summary.csv").read_bytes()


def test_groups_share_a_case_and_ranks_left_over_are_idle(folder):
    Path("my.toml").write_text(cases("a", "b", "c"))
    outcome = fake("my.toml", "--ranks-per-case", 2, ranks=3)
    assert (outcome.status, ranks_of("a", "b", "c")) == (0, [2, 2, 2])
    assert "3 to solve on 3 MPI ranks: 1 at a time, 2 ranks each; 1 idle" in outcome.out
    assert Path("results/my/a/run.log").read_text() == "law neo-hookean on 2\n"


def test_more_ranks_than_cases(folder):
    Path("my.toml").write_text(cases("a"))
    outcome = fake("my.toml", ranks=3)
    assert (outcome.status, ranks_of("a")) == (0, [1])
    assert "1 to solve on 3 MPI ranks: 1 at a time, 1 rank each; 2 idle" in outcome.out


def test_second_run_serves_on_another_number_of_ranks(folder):
    Path("my.toml").write_text(cases("a", "b"))
    assert fake("my.toml").status == 0
    outcome = fake("my.toml", ranks=2)
    assert outcome.status == 0
    assert "already solved: a, b" in outcome.out


@pytest.mark.parametrize("each", [1, 2])
def test_bug_that_all_ranks_of_a_case_meet_fails_the_case_only(folder, each):
    Path("my.toml").write_text(cases("bug", "b", "c"))
    outcome = fake("my.toml", "--ranks-per-case", each, ranks=2)
    assert outcome.status == 1
    assert outcome.err.count("cellmech: bug: failed: internal error: ZeroDivisionError: one over nothing") == 1
    with open("results/my/summary.csv", newline="") as stream:
        assert [row["status"] for row in csv.DictReader(stream)] == ["failed", "solved", "solved"]
    assert Path("results/my/bug/run.log").read_text().count("Traceback") == 1


def test_bug_on_one_rank_of_a_case_ends_the_job_with_its_message(folder):
    Path("my.toml").write_text(cases("bug-on-one-rank", "b"))
    outcome = fake("my.toml", "--ranks-per-case", 2, ranks=2)
    assert outcome.status == 1
    assert outcome.err.count("cellmech: bug-on-one-rank: internal error: ZeroDivisionError: one over nothing") == 1
    assert "Traceback" not in outcome.err
    log = Path("results/my/bug-on-one-rank/run.log").read_text()
    assert "failed on rank 1 of 2 alone" in log and "in solve_case" in log
    assert not Path("results/my/bug-on-one-rank/result.json").exists()
