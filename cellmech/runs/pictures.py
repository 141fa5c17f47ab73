"""The pictures that a run leaves: which are new or missing, drawn by a process of its own so that none can harm it."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cellmech.console import say
from cellmech.figures.pictures import FOLDER, is_drawn, picture_of, sheet_of
from cellmech.results.archive import Record
from cellmech.runs.command import Order

MOST = 12  # cases of a study that get a picture each
MOST_ON_SHEET = 64
START_S, EACH_S = 60.0, 20.0  # after which drawing is given up: to begin with, and for each cell to draw
NOTHING = "no state to draw"
ROOT = Path(__file__).resolve().parents[2]


def leave_pictures(order: Order, here: Mapping[str, Record], quiet: bool) -> None:
    """Draw what is new or missing of a study, and say where; a failure is one warning.

    Args:
        order: the study, and what was chosen of it.
        here: the results of all its cases that have one.
        quiet: whether to say nothing but that warning.
    """
    warning = f"cellmech: warning: {order.study.stem}: pictures are missing: "
    try:
        wanted = missing_pictures(order, here)
        if wanted is None:
            return
        drawn, fault = _draw(wanted)
        if drawn and not quiet:
            say(f"{_words(order, wanted, drawn)} in {order.out / FOLDER}{os.sep}")
        if fault:
            say(warning + fault, sys.stderr)
    except Exception as error:  # a run that has solved everything does not fail for its pictures
        say(f"{warning}{type(error).__name__}: {error}", sys.stderr)


def missing_pictures(order: Order, here: Mapping[str, Record]) -> dict[str, Any] | None:
    """What `draw_pictures` is to draw; None for nothing.

    Only cases that have fields can be drawn. The sheet waits for the study's last case; of one case there is none.
    """
    cases = order.study.cases
    marks = {
        case.name: _mark(here[case.name]["input_hash"], order.study.title)
        for case in cases
        if case.name in here and case.scene.output.pictures and (order.out / case.name / "fields.pvd").is_file()
    }
    own = {case.name: marks[case.name] for case in order.chosen if case.name in marks} if len(cases) <= MOST else {}
    own = {name: mark for name, mark in own.items() if not is_drawn(picture_of(order.out, name), mark)}
    sheet, mark = list(marks)[:MOST_ON_SHEET], _mark(*marks.values())
    if len(sheet) < 2 or len(here) < len(cases) or is_drawn(sheet_of(order.out), mark):
        sheet = []
    if not own and not sheet:
        return None
    lacking = {case.name: NOTHING for case in cases if case.name not in marks and case.scene.output.pictures}
    of_sheet = {"sheet": sheet, "mark": mark, "missing": lacking, "count": len(marks)} if sheet else {}
    return {"folder": str(order.out), "cases": own, "title": order.study.title, **of_sheet}


def _mark(*of: str) -> str:
    return hashlib.sha256("\n".join(of).encode()).hexdigest()


def _draw(wanted: dict[str, Any]) -> tuple[list[str], str]:
    """The paths of what was drawn, and why not all was; "" if all."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    limit = START_S + EACH_S * (len(wanted["cases"]) + len(wanted.get("sheet", ())))
    try:
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-m", "cellmech.figures.pictures"],  # whatever PYTHONWARNINGS says
            input=json.dumps(wanted),
            env=os.environ | {"PYTHONPATH": path},
            capture_output=True,
            text=True,
            encoding="utf-8",
            errors="replace",
            timeout=limit,
        )
    except subprocess.TimeoutExpired:
        return [], f"not drawn within {limit:.0f} s"
    last = (done.stderr.strip().splitlines() or [f"drawing ended with status {done.returncode}"])[-1]
    return done.stdout.splitlines(), last if done.returncode else ""


def _words(order: Order, wanted: Mapping[str, Any], drawn: list[str]) -> str:
    sheet = str(sheet_of(order.out)) in drawn
    count = len(drawn) - sheet
    words = [f"pictures of {count} cases" if count > 1 else "a picture"] * bool(count) + ["a sheet of all"] * sheet
    text = f"{order.study.stem}: {' and '.join(words)}"
    if len(order.study.cases) > MOST:
        text += f" (of more than {MOST} cases the sheet only; python -m cellmech.plots pictures draws each)"
    return text
