"""Which pictures a run leaves: what is new or missing, and never at the cost of the run."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest
from plot_files import write_named

from cellmech.figures import pictures as drawn
from cellmech.runs import pictures
from cellmech.runs.command import Order
from cellmech.runs.pictures import leave_pictures, missing_pictures
from cellmech.scene.studies import load_study

NAMES = ("one", "two", "three")
HERE = {name: {"input_hash": f"of {name}"} for name in NAMES}


def order_of(folder: Path, more: str = "", chosen: tuple[str, ...] = NAMES) -> Order:
    """A study of three cases and its results, with fields."""
    cases = "".join(f'[[case]]\nname = "{name}"\n"load.factor" = {k}\n' for k, name in enumerate(NAMES, 1))
    (folder / "my.toml").write_text(f'title = "Mine"\n{more}\n{cases}')
    study = load_study(folder / "my.toml")
    if not (folder / "my").exists():
        write_named(folder / "my", study)
    return Order(study, folder / "my", tuple(case for case in study.cases if case.name in chosen))


def wanted(order: Order, here: dict[str, Any] = HERE) -> tuple[list[str], int]:
    """Names of cases, and how many stand on the sheet."""
    found = missing_pictures(order, here)
    return ([], 0) if found is None else (list(found["cases"]), len(found.get("sheet", ())))


def test_each_case_gets_a_picture_and_the_study_a_sheet_and_the_log_says_where(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    order = order_of(tmp_path)
    leave_pictures(order, HERE, quiet=False)
    out, err = capsys.readouterr()
    assert (out, err) == (f"my: pictures of 3 cases and a sheet of all in {tmp_path}/my/figures/\n", "")
    files = sorted(path.name for path in (tmp_path / "my" / "figures").iterdir())
    assert files == ["shape-one.png", "shape-three.png", "shape-two.png", "sheet.png"]
    leave_pictures(order, HERE, quiet=False)
    assert capsys.readouterr() == ("", "")  # all is there


def test_only_what_is_new_or_missing_is_drawn(tmp_path: Path) -> None:
    order = order_of(tmp_path)
    assert wanted(order) == (list(NAMES), 3)
    for path, mark in marks(order).items():
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"PNG " + mark.encode())
    assert wanted(order) == ([], 0)
    (order.out / "figures" / "shape-two.png").unlink()
    assert wanted(order) == (["two"], 0)
    assert wanted(order, HERE | {"one": {"input_hash": "other"}}) == (["one", "two"], 3)


def marks(order: Order) -> dict[Path, str]:
    found = missing_pictures(order, HERE)
    assert found is not None
    own = {drawn.picture_of(order.out, name): mark for name, mark in found["cases"].items()}
    return own | {drawn.sheet_of(order.out): found["mark"]}


def test_the_sheet_waits_for_the_last_case_and_pictures_are_of_what_was_chosen(tmp_path: Path) -> None:
    order = order_of(tmp_path, chosen=("two",))
    assert wanted(order) == (["two"], 3)
    assert wanted(order, {name: HERE[name] for name in ("one", "two")}) == (["two"], 0)


def test_a_case_without_fields_is_skipped(tmp_path: Path) -> None:
    order = order_of(tmp_path)
    for name in ("one", "three"):
        (order.out / name / "fields.pvd").unlink()
    assert wanted(order) == (["two"], 0)  # and one is no sheet


def test_the_sheet_says_which_cases_it_lacks(tmp_path: Path) -> None:
    order = order_of(tmp_path)
    (order.out / "one" / "fields.pvd").unlink()
    found = missing_pictures(order, HERE)
    assert found is not None
    assert (found["sheet"], found["missing"]) == (["two", "three"], {"one": "no state to draw"})


def test_output_pictures_false_leaves_none(tmp_path: Path) -> None:
    assert wanted(order_of(tmp_path, "[output]\npictures = false")) == ([], 0)


def test_of_many_cases_there_is_the_sheet_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "MOST", 2)
    monkeypatch.setattr(pictures, "MOST_ON_SHEET", 2)
    assert wanted(order_of(tmp_path)) == ([], 2)


def test_a_broken_field_file_is_one_warning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    order = order_of(tmp_path)
    (order.out / "one" / "fields_0000.vtu").write_text("<VTKFile/>")
    leave_pictures(order, HERE, quiet=False)
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("cellmech: warning: my: pictures are missing: ")
    assert err.count("\n") == 1 and "fields_0000.vtu" in err


@pytest.mark.parametrize(("ends", "told"), [("exit 3", "status 3"), ("kill -11 $$", "status -11"), (None, "Error")])
def test_drawing_that_dies_is_one_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], ends: str | None, told: str
) -> None:
    program = tmp_path / "python"
    if ends is not None:
        program.write_text(f"#!/bin/sh\n{ends}\n")
        program.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(program))
    leave_pictures(order_of(tmp_path), HERE, quiet=True)
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and told in err
