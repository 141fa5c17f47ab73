"""A small share of `make fuzz`: hostile files through `--check`, always the same ones, in this process."""

import json
import os
import sys
from pathlib import Path

import pytest
from cli.programs import Outcome, tree
from hostile import attempts, wrong
from hypothesis import HealthCheck, Phase, given, seed, settings
from odd_scenes import wrong_solve

from cellmech.errors import MeshError
from cellmech.runs.study import main
from cellmech.scene import studies


def answers(capsys, number):
    """What is wrong with the answers to so many files, and how often each status came."""
    faults, statuses = [], {}

    @seed(1)
    @settings(
        max_examples=number,
        phases=[Phase.generate],
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(attempts())
    def go(attempt):
        try:
            Path(attempt.name).write_bytes(attempt.content)
        except OSError:
            return  # no file can have this name
        before = tree(Path())
        outcome = Outcome(main([attempt.name, "--check", *attempt.arguments]), *capsys.readouterr())
        statuses[outcome.status] = statuses.get(outcome.status, 0) + 1
        if fault := wrong(outcome.status, outcome.out, outcome.err, attempt):
            faults.append((fault, attempt.name, attempt.content[:500], attempt.arguments))
        if tree(Path()) != before:
            faults.append(("something was written", attempt))
        os.unlink(attempt.name)

    go()
    return faults, statuses


def test_hostile_files_are_checked_or_refused_with_one_message_and_nothing_is_written(folder, capsys):
    faults, statuses = answers(capsys, 200)
    assert faults == []
    assert statuses[0] > 20 and statuses[2] > 100


def fail():
    raise MeshError("of another kind")


BREAKS = {
    "exception": lambda: {}["no such key"],
    "status": fail,
    "two lines": lambda: print("cellmech: warning", file=sys.stderr),
    "file": lambda: Path("litter").touch(),
}


@pytest.mark.parametrize("kind", BREAKS)
def test_program_that_is_wrong_does_not_pass(folder, capsys, monkeypatch, kind):
    """The judge itself: each of its rules is broken once."""
    before = studies.check_names

    def broken(names, where):
        BREAKS[kind]()
        before(names, where)

    monkeypatch.setattr(studies, "check_names", broken)
    if kind == "exception":
        with pytest.raises(KeyError):
            answers(capsys, 30)
    else:
        assert answers(capsys, 30)[0]


FELL_OVER = {
    "a contact thicker than the cell": {"contact.form": "volume-printed", "contact.volume_width_um": 50.0},
}


@pytest.mark.parametrize("kind", FELL_OVER)
def test_scene_that_once_fell_over_is_solved_or_says_why_not(folder, capsys, kind):
    Path("my.toml").write_text("[mesh]\nsize_um = 5.0\n[time]\nrtol = 0.02\n")
    sets = [f"{key}={value}" for key, value in FELL_OVER[kind].items()]
    status = main(["my.toml", "--out", "out", "--quiet", "--set", *sets])
    out, err = capsys.readouterr()
    assert wrong_solve({"status": status, "out": out, "err": err}, Path("out/my"))[0] == ""


GOOD = {"status": "solved", "reason": "", "cause": "", "steps": 3}
FAILED = {**GOOD, "status": "failed", "reason": "slides: no equilibrium", "cause": "slides"}
BUG = {**FAILED, "reason": "internal error: X", "cause": "internal"}
TOLD = "cellmech: my: failed: slides: no equilibrium\n"


@pytest.mark.parametrize(
    ("status", "err", "result", "fault"),
    [
        (0, "", GOOD, ""),
        (1, TOLD, FAILED, ""),
        (1, "", FAILED, "status and messages do not fit the result"),
        (0, "", FAILED, "status and messages do not fit the result"),
        (0, "Traceback", GOOD, "status and messages do not fit the result"),
        (2, "cellmech: error: my.toml", None, "status 2"),
        (None, "the process ended with -11", None, "status None"),
        (1, "cellmech: my: failed: internal error: X\n", BUG, "internal error: X"),
        (0, "", {**GOOD, "fields": False}, "the last state is not saved"),
    ],
)
def test_judge_of_solved_scenes(folder, status, err, result, fault):
    Path("out").mkdir()
    if result is not None:
        Path("out/result.json").write_text(json.dumps(result))
        if result.get("fields", True):
            Path("out/fields.pvd").touch()
    assert wrong_solve({"status": status, "out": "", "err": err}, Path("out"))[0] == fault
