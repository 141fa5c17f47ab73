"""The verification table: its bounds are two-sided, and no failure is missing from it."""

import csv
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ladder import FAIL, PASS, Ladder, Table

TESTS = Path(__file__).parents[1]
MEMBERS = """
import pytest

def test_no_member():
    raise RuntimeError

def test_good(ladder):
    ladder("good", ours=1.0, reference=1.0)

@pytest.mark.by_hand
def test_slow(ladder):
    ladder("slow", ours=[1.0, 2.2], reference=[1.0, 2.0], abs=0.1)

def test_broken(ladder):
    raise RuntimeError
"""


def stated(**row):
    """The verdict of one row, and whether stating it failed the test."""
    ladder = Ladder(Table())
    way = row.pop("way", None)
    try:
        (getattr(ladder, way) if way else ladder)("case", **row)
    except pytest.fail.Exception:
        assert ladder.failed
    (row,) = ladder.table.rows.values()
    assert ladder.failed == (row.verdict == FAIL)
    return row.verdict


@pytest.mark.parametrize(
    ("row", "verdict"),
    [
        ({"ours": 1.04, "reference": 1.0, "rel": 0.05}, PASS),
        ({"ours": 0.96, "reference": 1.0, "rel": 0.05}, PASS),
        ({"ours": 1.06, "reference": 1.0, "rel": 0.05}, FAIL),
        ({"ours": 0.94, "reference": 1.0, "rel": 0.05}, FAIL),
        ({"ours": 0.94, "reference": 1.0, "rel": 0.05, "abs": 0.1}, PASS),
        ({"ours": [0.0, 1e-3], "abs": 1e-4}, FAIL),
        ({"ours": 0.0}, PASS),
        ({"ours": 1e-300}, FAIL),
        ({"ours": [1.0, np.nan], "reference": 1.0, "rel": 1.0}, FAIL),
        ({"way": "order", "errors": [1.0, 0.25, 0.0625], "expected": 2.0, "within": 0.1}, PASS),
        ({"way": "order", "errors": [1.0, 0.20], "expected": 2.0, "within": 0.1}, FAIL),
        ({"way": "order", "errors": [1.0, 0.30], "expected": 2.0, "within": 0.1}, FAIL),
        ({"way": "order", "errors": [1.0, np.nan, 0.1], "expected": 2.0, "within": 0.1}, FAIL),
        ({"way": "order", "errors": [9.0, 1.0], "expected": 2.0, "within": 0.1, "sizes": [3.0, 1.0]}, PASS),
        ({"way": "between", "ours": [0.4, 0.6], "low": 0.39, "high": 0.61}, PASS),
        ({"way": "between", "ours": [0.4, 0.6], "low": 0.41, "high": 0.61}, FAIL),
        ({"way": "between", "ours": [0.4, 0.6], "low": 0.39, "high": 0.59}, FAIL),
        ({"way": "between", "ours": np.nan, "low": 0.0, "high": 1.0}, FAIL),
    ],
)
def test_row_passes_within_its_bounds_on_both_sides_only(row, verdict):
    assert stated(**row) == verdict


def test_of_equal_cases_the_worst_stays():
    ladder = Ladder(Table())
    for ours in (1.01, 1.03, 1.02):
        ladder("case", ours=ours, reference=1.0, rel=0.05)
    (row,) = ladder.table.rows.values()
    assert row.cells == ("case", "1", "1.03", "0.03", "0.05", "", PASS)


def test_table_holds_the_members_alone_the_slow_and_the_broken_ones_too(tmp_path):
    (tmp_path / "conftest.py").write_text('pytest_plugins = ["ladder"]\n')
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = by_hand\n")
    (tmp_path / "test_members.py").write_text(MEMBERS)
    command = [sys.executable, "-m", "pytest", "--ladder", "out", "-q", "-p", "no:cacheprovider"]
    environment = {key: value for key, value in os.environ.items() if key != "PYTEST_ADDOPTS"}
    environment["PYTHONPATH"] = str(TESTS)
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert done.returncode == 1
    with open(tmp_path / "out" / "verify.csv", newline="", encoding="utf-8") as file:
        rows = {row["case"]: row for row in csv.DictReader(file)}
    assert {case: row["verdict"] for case, row in rows.items()} == {
        "good": PASS,
        "slow": FAIL,
        "test_members.py::test_broken": FAIL,
    }
    assert rows["slow"]["ours"] == "2.2" and rows["slow"]["error"] == "0.2"
    assert "3 rows, 2 failed" in done.stdout
    marked = (tmp_path / "out" / "verify.md").read_text(encoding="utf-8").splitlines()
    assert len(marked) == 5 and all(line.count("|") == 8 for line in marked)
