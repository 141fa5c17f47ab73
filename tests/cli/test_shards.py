"""Cases of a study split over processes that know nothing of each other, with a fake solver."""

import csv
import fcntl
import subprocess
import sys
from pathlib import Path
from threading import Thread

import pytest
from cli.programs import ENVIRONMENT, FAKE, ROOT, cases, end, start, tree

from cellmech.errors import InputError
from cellmech.results.archive import LOCK, merge_tables
from cellmech.results.sealed import sealed
from cellmech.runs.command import understand
from cellmech.scene.studies import load_study

NAMES = ("a", "b", "fails", "c", "d")


def rows(path="results/my/summary.csv"):
    with open(path, newline="", encoding="utf-8") as stream:
        return [row["case"] for row in csv.DictReader(stream)]


@pytest.fixture
def whole(fake, folder):
    """summary.csv of the study solved in one go."""
    Path("my.toml").write_text(cases(*NAMES))
    fake("my.toml", "--out", "whole/my")
    return Path("whole/my/summary.csv").read_bytes()


def test_shards_take_every_nth_case_and_leave_the_table_of_all(fake, whole):
    assert (fake("my.toml", "--shard", "3/3").status, fake.solved) == (1, ("fails",))
    assert rows() == ["fails"]
    files = tree(Path("results/my/fails"))
    assert (fake("my.toml", "--shard", "2/3").status, fake.solved) == (0, ("b", "d"))
    assert rows() == ["b", "fails", "d"]
    outcome = fake("my.toml", "--shard", "1/3")
    assert (outcome.status, fake.solved) == (0, ("a", "c"))
    assert "my: 4 of 5 cases solved; summary.csv" in outcome.out
    assert Path("results/my/summary.csv").read_bytes() == whole
    assert tree(Path("results/my/fails")) == files


def test_cases_are_counted_through_all_studies_and_a_shard_may_be_empty(fake, folder):
    for name in ("one", "two"):
        Path(f"{name}.toml").write_text(cases("a", "b", "c"))
    shards = [fake("one.toml", "two.toml", "--list", "--shard", f"{i}/4").out.split() for i in range(1, 5)]
    assert shards == [["a", "b"], ["b", "c"], ["c"], ["a"]]
    outcome = fake("one.toml", "--shard", "4/4")
    assert (outcome.status, outcome.out, fake.solved) == (0, "nothing to solve: shard 4/4 has no case\n", ())
    assert not Path("results").exists()


@pytest.mark.parametrize("text", ["3/2", "a/b", "0/4", "2", "1/0", "-1/2", "1/2/3", "1/ 2", "\u0661/\u0662", ""])
def test_shard_that_is_none_is_refused(whole, text):
    with pytest.raises(InputError, match=r"--shard: must be I/N with whole numbers, I from 1 to N; got"):
        understand(["my.toml", f"--shard={text}"], ranks=1)


def test_shards_at_once_leave_the_table_of_all(whole):
    shards = [start("my.toml", "--shard", f"{i}/3", program=(FAKE,)) for i in range(1, 4)]
    assert [end(shard).status for shard in shards] == [0, 0, 1]
    assert Path("results/my/summary.csv").read_bytes() == whole


def test_fresh_shard_leaves_the_cases_of_others(fake, whole):
    fake("my.toml")
    before = tree(Path("results/my"))
    fake("my.toml", "--shard", "1/2", "--fresh")
    assert fake.solved == ("a", "fails", "d")
    after = tree(Path("results/my"))
    assert {name for name in after if after[name] != before[name]} == {
        "a/result.json", "fails/result.json", "d/result.json", "timings.csv",
    }  # fmt: skip


def test_tables_hold_what_others_have_solved_until_their_lock_is_ours(folder):
    Path("my.toml").write_text(cases("a", "b"))
    mine = load_study("my.toml").cases
    Path("b").mkdir()
    merging = Thread(
        target=merge_tables, args=(folder, mine, {"a": "k", "b": "l"}, {"a": {"status": "solved", "reason": ""}})
    )
    with open(LOCK, "a") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        merging.start()
        merging.join(0.3)
        assert merging.is_alive() and not Path("summary.csv").exists()
        Path("b/result.json").write_text(sealed({"status": "solved", "reason": "", "input_hash": "l"}))
    merging.join()
    assert rows("summary.csv") == ["a", "b"]


def test_slurm_example_gives_each_task_of_the_array_its_shard(folder):
    Path("my.toml").write_text(cases(*NAMES))
    tasks = {"PYTHON": sys.executable, "SLURM_ARRAY_TASK_ID": "2", "SLURM_ARRAY_TASK_COUNT": "3"}
    script = ["bash", ROOT / "studies/slurm.sh", "my.toml", "--list"]
    listed = subprocess.run(script, env=ENVIRONMENT | tasks, capture_output=True, text=True)
    assert (listed.stdout, listed.stderr) == ("b\nd\n", "")


def test_slurm_example_of_one_large_case_gives_it_all_ranks(folder):
    Path("my.toml").write_text(cases("a"))
    tasks = {"PYTHON": sys.executable, "SLURM_NTASKS": "0"}
    script = ["bash", ROOT / "studies/slurm-large.sh", "my.toml", "--list"]
    refused = subprocess.run(script, env=ENVIRONMENT | tasks, capture_output=True, text=True)
    assert refused.returncode != 0 and "--ranks-per-case" in refused.stderr
    listed = subprocess.run(script, env=ENVIRONMENT | tasks | {"SLURM_NTASKS": "1"}, capture_output=True, text=True)
    assert (listed.stdout, listed.stderr) == ("a\n", "")
