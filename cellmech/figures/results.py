"""Results of a study as they lie on disk, for figures and tables: files are read, nothing is solved."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cellmech.errors import InputError
from cellmech.figures.parameters import value_at
from cellmech.names import spelt
from cellmech.results.result import Result, load
from cellmech.scene.studies import Study


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
    cases: Mapping[str, Result]
    missing: Mapping[str, str] = field(default_factory=dict)
    title: str = ""
    varied: Mapping[str, Mapping[str, object]] = field(default_factory=dict)

    def holding(self, name: str) -> dict[str, Result]:
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
                lines.append(f"{name}: failed at {case.get('t_s'):,.0f} s ({case.failure})")
        return lines

    def complaint(self, most: int = 10_000) -> str:
        """A line of at most so many characters on what is missing or failed; "" when all is there."""
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
    names, where, folder = tuple(names), str(folder), Path(spelt(folder))
    if not folder.is_dir():
        hint = "Run the study first: make study, or python -m cellmech.study STUDY.toml --out DIR."
        raise InputError(where, "", "there is no such results folder", None, hint)
    cases, missing = {}, {}
    for name in names:
        place = Path(spelt(folder / name))
        if not place.is_dir():
            missing[name] = "not in this folder"
        elif not (place / "result.json").is_file():
            missing[name] = "not finished (no result.json)"
        else:
            cases[name] = load(place)
    if not cases:
        rule = f"must hold a result of at least one of the cases {', '.join(names)}"
        found = sorted(path.parent.name for path in folder.glob("*/result.json"))
        raise InputError(where, "", rule, ", ".join(found[:8]) or "no result", "Run the study first: make study.")
    return StudyResult(folder, cases, missing, varied={name: {} for name in names})


def read_all(folder: Path) -> StudyResult:
    """Read every case of a results folder that has a result.

    Raises:
        InputError: when none has, or a file is broken.
    """
    found = sorted(path.parent.name for path in Path(spelt(folder)).glob("*/result.json"))
    study = read_study(folder, found or ["any case"])
    varied = differing(study.cases)
    names = sorted(study.cases, key=lambda name: [_rank(value) for value in varied[name].values()])
    titles = {case.scene.title for case in study.cases.values()}
    return StudyResult(
        study.folder,
        {name: study.cases[name] for name in names},
        study.missing,
        titles.pop() if len(titles) == 1 else "",
        {name: varied[name] for name in names},
    )


def differing(cases: Mapping[str, Result]) -> dict[str, dict[str, object]]:
    """Of each case the values of the keys, dotted, that are not the same in all of them, but for titles."""
    scenes = {name: dict(_settings(case.scene.model_dump(mode="json", by_alias=True))) for name, case in cases.items()}
    keys = dict.fromkeys(key for scene in scenes.values() for key in scene if key != "title")
    varied = [key for key in keys if len({repr(scene.get(key)) for scene in scenes.values()}) > 1]
    return {name: {key: scene.get(key) for key in varied} for name, scene in scenes.items()}


def _settings(table: Mapping[Any, Any], start: str = "") -> Iterator[tuple[str, object]]:
    """A scene's values by dotted key."""
    for name, value in table.items():
        of_tables = isinstance(value, list) and all(isinstance(part, Mapping) for part in value)
        if of_tables or isinstance(value, Mapping):
            yield from _settings(dict(enumerate(value)) if of_tables else value, f"{start}{name}.")
        else:
            yield f"{start}{name}", value


def _rank(value: object) -> tuple[bool, float, str]:
    """Numbers by size, before texts."""
    number = isinstance(value, int | float)
    return not number, float(value) if isinstance(value, int | float) else 0.0, str(value)
