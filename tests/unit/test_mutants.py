"""The list of mutants does not rot: each one applies, and the test that must see it exists (see `make mutants`)."""

import dataclasses
import sys
from pathlib import Path

import pytest
from cli.programs import ROOT

sys.path.append(str(ROOT / "tools"))
from mutants import Mutant, faults, read, word_of

GOOD = Mutant(
    "bdf1",
    "wrong",
    "cellmech/solver/bdf.py",
    "omega = h / steps[1]",
    "omega = 0.0",
    f"tests/unit/{Path(__file__).name}",
)
GOOD = dataclasses.replace(GOOD, test=f"{GOOD.test}::test_every_mutant_applies_and_its_test_exists")


def test_every_mutant_applies_and_its_test_exists():
    assert faults(read()) == []


def test_mutants_are_spread_over_the_program():
    mutants = read()
    assert len(mutants) >= 20
    parts = {Path(m.file).stem for m in mutants}
    assert parts >= {
        "kinematics",
        "laws",
        "materials",
        "fluid",
        "contact",
        "balance",
        "bdf",
        "time_steps",
        "energy_balance",
    }
    assert parts >= {
        "newton",
        "det_f",
        "rigid_modes",
        "samples",
        "observables",
        "outline",
        "setup",
        "placement",
        "checkpoint",
    }


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"old": "omega"}, "times in cellmech/solver/bdf.py, not once"),
        ({"old": "no such text"}, "occurs 0 times"),
        ({"file": "cellmech/none.py"}, "occurs 0 times"),
        ({"new": GOOD.old}, "changes nothing"),
        ({"test": GOOD.test + "_not"}, "there is no test"),
        ({"test": "tests/unit/none.py::test_x"}, "there is no test"),
        ({"test": "tests/unit/test_bdf.py"}, "there is no test"),
    ],
)
def test_mutant_that_cannot_be_tried_is_named_with_the_reason(change, fault):
    (found,) = faults([dataclasses.replace(GOOD, **change)])
    assert found.startswith("bdf1: ") and fault in found


def test_names_of_mutants_are_unique():
    assert faults([GOOD]) == []
    assert faults([GOOD, GOOD]) == ["bdf1: this name comes twice"]


def test_mutant_changes_one_place_for_a_while(tmp_path):
    (tmp_path / GOOD.file).parent.mkdir(parents=True)
    text = (ROOT / GOOD.file).read_text()
    (tmp_path / GOOD.file).write_text(text)
    with GOOD.applied(tmp_path):
        changed = (tmp_path / GOOD.file).read_text()
        assert changed.count(GOOD.new) == 1 and changed.replace(GOOD.new, GOOD.old) == text
    assert (tmp_path / GOOD.file).read_text() == text


@pytest.mark.parametrize(
    ("status", "out", "word"),
    [
        (1, "E   assert 1 == 2\n1 failed in 0.1s\n", "killed"),
        (0, "1 passed in 0.1s\n", "SURVIVES"),
        (1, "", "NO TEST RUN (status 1)"),  # No module named pytest
        (2, "1 error in 0.1s\n", "NO TEST RUN (status 2)"),
    ],
)
def test_mutant_is_killed_by_a_failed_test_only(status, out, word):
    assert word_of(status, out) == word
