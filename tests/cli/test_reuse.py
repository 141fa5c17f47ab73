"""Cases whose outcome is known from another study, or from another case of this one, with a fake solver."""

import csv
import json
from pathlib import Path

import pytest
from cli import fake_case
from cli.programs import cases, program, tree

from cellmech.runs import reuse


def result(path):
    return json.loads(Path(path, "result.json").read_text(encoding="utf-8"))


def rows(study):
    with open(f"results/{study}/summary.csv", newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture
def earlier(fake, folder):
    """A study that has been solved; `two` has its cases under other names and titles, and one more."""
    Path("one.toml").write_text(cases("a", "fails", title="One"))
    Path("two.toml").write_text(cases("x", "y", "z", title="Two"))
    fake("one.toml")
    Path("results/one/a/fields_0000.vtu").write_bytes(b"\0\1")
    Path("results/one/a/checkpoint.npz").touch()
    Path("results/one/a/.partial-fields").touch()


def test_cases_solved_in_another_study_are_taken_over_whole(fake, earlier):
    outcome = fake("two.toml")
    assert (outcome.status, fake.solved) == (1, ("z",))
    assert "taken over from results/one: x, y (--fresh solves them here)\n" in outcome.out
    assert [(row["case"], row["status"]) for row in rows("two")] == [("x", "solved"), ("y", "failed"), ("z", "solved")]
    one, two = tree(Path("results/one/a")), tree(Path("results/two/x"))
    assert two.keys() == one.keys() - {"checkpoint.npz", ".partial-fields"}
    assert {name for name in two if two[name] != one[name]} == {"run.log", "scene.toml", "result.json"}
    assert b'title = "Two"' in two["scene.toml"]
    log = two["run.log"].decode()
    assert log == "taken over from results/one/a, whose log was:\n" + one["run.log"].decode()
    changed = {"case": "x", "scene": {**result("results/one/a")["scene"], "title": "Two"}}
    own = ("files", "content_hash")
    before, after = (
        {key: value for key, value in result(f"results/{path}").items() if key not in own}
        for path in ("one/a", "two/x")
    )
    assert after == before | changed


def test_damaged_result_does_not_hide_a_sound_one(fake, earlier):
    fake("two.toml")
    Path("results/one/a/history.csv").write_text("damaged")
    Path("three.toml").write_text(cases("x", title="Three"))
    outcome = fake("three.toml")
    assert (outcome.status, fake.solved) == (0, ())
    assert "taken over from results/two: x" in outcome.out


def test_case_taken_over_is_solved_already_in_the_next_run(fake, earlier):
    fake("two.toml")
    outcome = fake("two.toml")
    assert "already solved: x, z (--fresh solves them again)\nfailed before: y (--fresh tries again)\n" in outcome.out
    assert "taken over" not in outcome.out


def test_fresh_takes_nothing_over(fake, earlier):
    fake("two.toml", "--fresh")
    assert fake.solved == ("x", "y", "z")


def test_renamed_case_is_taken_over(fake, earlier):
    Path("one.toml").write_text(cases("b", "fails"))
    outcome = fake("one.toml")
    assert fake.solved == ()
    assert "taken over from results/one: b" in outcome.out
    assert [row["case"] for row in rows("one")] == ["b", "fails"]


@pytest.mark.parametrize(
    "content", ["", "[1]", '{"status": "solved"}', '{"input_hash": ["k"], "status": "solved"}', "3"]
)
def test_results_of_other_programs_beside_are_passed_over(fake, earlier, content):
    Path("results/a/b").mkdir(parents=True)
    Path("results/a/b/result.json").write_text(content)
    Path("results/file").touch()
    fake("two.toml")
    assert fake.solved == ("z",)


def test_case_that_goes_while_it_is_copied_is_solved(fake, earlier, monkeypatch):
    copy = reuse.shutil.copyfile

    def lost(source, target):
        copy(source, target)
        Path("results/one/a/result.json").unlink(missing_ok=True)

    monkeypatch.setattr(reuse.shutil, "copyfile", lost)
    fake("two.toml", "--only", "x")
    assert fake.solved == ("x",)
    assert not Path("results/two/x/fields_0000.vtu").exists()


def test_disk_that_refuses_the_copy_is_no_end(fake, earlier, monkeypatch):
    def full(source, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(reuse.shutil, "copyfile", full)
    fake("two.toml", "--only", "x")
    assert fake.solved == ("x",)


# Several studies in one command


@pytest.fixture
def twins(folder):
    """Two studies, the second with the cases of the first under other names."""
    Path("one.toml").write_text(cases("a", "b"))
    Path("two.toml").write_text(cases("x", "y", "z"))


def test_case_of_several_studies_is_solved_once(fake, twins):
    outcome = fake("one.toml", "two.toml")
    assert (outcome.status, fake.solved) == (0, ("a", "b", "z"))
    assert "the same case, solved once: one/a = two/x, one/b = two/y\n" in outcome.out
    assert "[3/3] two/z: solved" in outcome.out
    assert [row["case"] for row in rows("two")] == ["x", "y", "z"]
    assert result("results/two/y")["nucleus"] == result("results/one/b")["nucleus"]


@pytest.mark.mpi
def test_tables_do_not_depend_on_who_solved_the_twin(fake, twins):
    fake("two.toml", "--out", "alone/two")
    assert program("one.toml", "two.toml", ranks=2, program=(fake_case.__file__,)).status == 0
    assert Path("results/two/summary.csv").read_bytes() == Path("alone/two/summary.csv").read_bytes()


def test_internal_error_counts_for_the_twin_and_both_are_tried_again(fake, folder):
    Path("one.toml").write_text(cases("bug"))
    Path("two.toml").write_text(cases("x"))
    outcome = fake("one.toml", "two.toml")
    assert outcome.status == 1
    assert rows("two")[0]["reason"] == "internal error: ZeroDivisionError: one over nothing"
    fake("two.toml")
    assert fake.solved == ("x",)


def test_copy_for_the_twin_that_fails_is_a_failure(fake, twins, monkeypatch):
    def full(source, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(reuse.shutil, "copyfile", full)
    outcome = fake("one.toml", "two.toml")
    assert outcome.status == 1
    assert (
        "x failed: the disk refuses: results/one/a cannot be copied ([Errno 28] No space left on device)" in outcome.out
    )
    assert not Path("results/two/x/result.json").exists()
