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


def solver(name):
    return json.loads(Path(f"results/my/{name}/result.json").read_text())["versions"]["world rank"]


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


def test_group_that_is_free_takes_the_next_case_and_nobody_waits_for_the_slow_one(folder):
    names = ["last of 8", *"abcdefg"]  # the first case ends when all others have
    Path("my.toml").write_text(cases(*names))
    assert fake("my.toml", "--ranks-per-case", 1, ranks=3).status == 0
    slow, *quick = [solver(name) for name in names]
    assert slow not in quick


def test_number_is_handed_out_while_rank_0_computes(folder):
    code = (
        "import time\nfrom mpi4py import MPI\nfrom cellmech.runs.handout import Counter\n"
        "world = MPI.COMM_WORLD\ncounter = Counter(world)\nstart = time.monotonic()\n"
        "while world.rank == 0 and time.monotonic() < start + 2.0: pass\n"
        "taken = [counter.take() for _ in range(50)]\nends = world.gather((time.monotonic(), taken))\ncounter.close()\n"
        "if world.rank == 0: print(*[end < start + 2.0 for end, _ in ends], sorted(sum((t for _, t in ends), [])))"
    )
    outcome = program(program=("-c", code), ranks=3)
    assert (outcome.out, outcome.status) == (f"False True True {list(range(150))}\n", 0)


def test_ranks_share_the_cases_where_these_are_fewer(folder):
    Path("my.toml").write_text(cases("a"))
    outcome = fake("my.toml", ranks=3)
    assert (outcome.status, ranks_of("a")) == (0, [3])
    assert "1 to solve on 3 MPI ranks: 1 at a time, 3 ranks each\n" in outcome.out


def test_ranks_of_a_case_do_not_depend_on_what_is_solved_already(folder):
    Path("my.toml").write_text(cases("a", "b", "c"))
    assert fake("my.toml", "--only", "a", "--only", "b").status == 0
    outcome = fake("my.toml", ranks=2)
    assert (outcome.status, ranks_of("c")) == (0, [1])
    assert "1 to solve on 2 MPI ranks: 1 at a time, 1 rank each; 1 idle\n" in outcome.out


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
