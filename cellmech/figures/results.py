"""Results of a study as they lie on disk, for figures and tables: files are read, nothing is solved.

Of a case's folder: scene.toml, result.json, history.csv, and fields.pvd with the files it lists.
"""

from __future__ import annotations

import csv
import json
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cellmech.errors import InputError
from cellmech.figures.parameters import value_at
from cellmech.scene import Scene
from cellmech.scene_file import read_scene
from cellmech.sealed import SEAL, damage, is_whole
from cellmech.study_file import Study
from cellmech.toml_file import read_toml

AGAIN = "Solve the case again (python -m cellmech.study … --fresh)."


@dataclass(frozen=True)
class CaseResult:
    """One case's files.

    Args:
        name: of the case and its folder.
        folder: where the files are.
        scene: the resolved input.
        result: the content of result.json.
    """

    name: str
    folder: Path
    scene: Scene
    result: Mapping[str, Any]

    @property
    def failure(self) -> str:
        """Why the case stopped early, "" when it was solved."""
        if self.result.get("status") == "solved":
            return ""
        return str(self.result.get("reason") or "no reason given")

    def number(self, key: str) -> float:
        """A number of result.json by its dotted key; NaN where it is null or not there.

        Raises:
            InputError: when something else than a number stands there.
        """
        value: Any = self.result
        for part in key.split("."):
            value = value.get(part) if isinstance(value, Mapping) else None
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise InputError(str(self.folder / "result.json"), key, "must be a number", value, AGAIN)
        return float("nan") if value is None else float(value)

    def history(self, *columns: str) -> dict[str, np.ndarray]:
        """Columns of history.csv, one value per accepted step; NaN where a field is empty.

        Raises:
            InputError: for a file that is missing or broken, or has no such column.
        """
        path = self.folder / "history.csv"
        rows = list(csv.DictReader(_text(path).splitlines()))
        if not rows:
            raise InputError(str(path), "", "holds no accepted step", None, AGAIN)
        found = {}
        for column in columns:
            if column not in rows[0]:
                raise InputError(str(path), column, "there is no such column", None, AGAIN)
            try:
                found[column] = np.array([float(row[column] or "nan") for row in rows])
            except (TypeError, ValueError) as error:
                raise InputError(str(path), column, f"must hold numbers only ({error})", None, AGAIN) from None
        return found

    def last_fields(self) -> tuple[float, Path]:
        """Time [s] and file of the last field file that fields.pvd lists.

        Raises:
            InputError: for a fields.pvd that is missing or broken, or names a file that is not there.
        """
        path = self.folder / "fields.pvd"
        try:
            entries = [
                (float(e.attrib["timestep"]), e.attrib["file"]) for e in ET.fromstring(_text(path)).iter("DataSet")
            ]
            t_s, name = max(entries)
        except (ET.ParseError, KeyError, ValueError) as error:
            raise InputError(str(path), "", f"is no list of field files ({error})", None, AGAIN) from None
        if not (self.folder / name).is_file():
            raise InputError(str(path), name, "the file it names is not there", None, AGAIN)
        return t_s, self.folder / name


@dataclass(frozen=True)
class StudyResult:
    """The cases of a results folder that a figure is about.

    Args:
        folder: the study's results.
        cases: name -> case, for the cases that have a result, in the order asked for.
        missing: name -> what is missing, for the others.
        title: of the study.
        varied: name -> values of the keys that the study varies, for all cases in the order asked for.
    """

    folder: Path
    cases: Mapping[str, CaseResult]
    missing: Mapping[str, str] = field(default_factory=dict)
    title: str = ""
    varied: Mapping[str, Mapping[str, object]] = field(default_factory=dict)

    def holding(self, name: str) -> dict[str, CaseResult]:
        """The cases to draw: all that were solved, and of the failed ones those that came far enough to have the file.

        Raises:
            InputError: when none is left.
        """
        found = {key: case for key, case in self.cases.items() if not case.failure or (case.folder / name).is_file()}
        if not found:
            raise InputError(str(self.folder), "", f"no case came to {name}: {'; '.join(self.faults())}")
        return found

    def faults(self) -> list[str]:
        """One line for each case that is missing or failed."""
        lines = [f"{name}: {what}" for name, what in self.missing.items()]
        for name, case in self.cases.items():
            if case.failure:
                lines.append(f"{name}: failed at {case.number('t_s'):,.0f} s ({case.failure})")
        return lines

    def complaint(self, most: int = 10_000) -> str:
        """What is missing or failed, in one line of at most so many characters; "" when all is there."""
        text = f"not complete: {'; '.join(self.faults())}" if self.faults() else ""
        return text if len(text) <= most else f"{text[: most - 1]}…"


def read_planned(folder: Path, study: Study) -> StudyResult:
    """Read the results of a study's cases. One that was solved with other values of what the study varies is missing.

    Raises:
        InputError: when none of the cases has a result, or a file is broken.
    """
    keys = dict.fromkeys(key for case in study.cases for key in case.swept)
    varied = {case.name: {key: value_at(case.scene, key) for key in keys} for case in study.cases}
    found = read_study(folder, varied)
    cases, missing = dict(found.cases), dict(found.missing)
    for name, case in found.cases.items():
        other = [
            f"{key} = {value_at(case.scene, key)}" for key in keys if value_at(case.scene, key) != varied[name][key]
        ]
        if other:
            del cases[name]
            missing[name] = f"solved with other inputs ({', '.join(other)})"
    return StudyResult(folder, cases, missing, study.title, varied)


def read_study(folder: Path, names: Iterable[str]) -> StudyResult:
    """Read the named cases of a results folder.

    Raises:
        InputError: when none of them has a result, or a file is broken.
    """
    names, where = tuple(names), str(folder)
    if not folder.is_dir():
        hint = "Run the study first: make study, or python -m cellmech.study STUDY.toml --out DIR."
        raise InputError(where, "", "there is no such results folder", None, hint)
    cases, missing = {}, {}
    for name in names:
        if not (folder / name).is_dir():
            missing[name] = "not in this folder"
        elif not (folder / name / "result.json").is_file():
            missing[name] = "not finished (no result.json)"
        else:
            cases[name] = read_case(folder / name)
    if not cases:
        rule = f"must hold a result of at least one of the cases {', '.join(names)}"
        found = sorted(path.parent.name for path in folder.glob("*/result.json"))
        raise InputError(where, "", rule, ", ".join(found[:8]) or "no result", "Run the study first: make study.")
    return StudyResult(folder, cases, missing, varied={name: {} for name in names})


def read_case(folder: Path) -> CaseResult:
    """Read one case's scene and result.

    Raises:
        InputError: for a file that is missing or broken.
    """
    path = folder / "result.json"
    try:
        result = json.loads(_text(path))
    except ValueError as error:
        raise InputError(str(path), "", f"is no valid JSON: {error}", None, AGAIN) from None
    if not isinstance(result, dict):
        raise InputError(str(path), "", "must be a JSON object", None, AGAIN)
    if SEAL in result and not is_whole(result):
        raise InputError(str(path), "", "is damaged: its content is not what was written", None, AGAIN)
    there = {name: known for name, known in result.get("files", {}).items() if (folder / name).exists()}
    if fault := damage(folder, there):
        raise InputError(str(folder), "", fault, None, AGAIN)
    scene = str(folder / "scene.toml")
    return CaseResult(folder.name, folder, read_scene(read_toml(scene), scene), result)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(str(path), "", "there is no such file", None, AGAIN) from None
    except (OSError, ValueError) as error:
        raise InputError(str(path), "", f"cannot be read ({error})") from None
