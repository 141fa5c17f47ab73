"""Study files: one TOML file, and the overrides of the command line, become named cases with a scene each."""

from __future__ import annotations

import copy
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cellmech.errors import InputError
from cellmech.names import plain
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene
from cellmech.scene.keys import brief, check_tables, put
from cellmech.scene.scene import Scene
from cellmech.scene.toml_file import check_size, parse, read_toml
from cellmech.scene.variants import Variant, check_names, name_fault, named_variants, swept_variants

OVERRIDE = "--set"
PARTS = ("mesh", "time", "quadrature", "smoothing")  # of the numerical error
MODELLING = "penalty"  # how far the penalty is from a rigid obstacle: an input of the model, not part of the error
ALL_PARTS = (*PARTS, MODELLING)


@dataclass(frozen=True)
class Study:
    """A study file as read.

    Args:
        title: for people.
        path: None for Table 1 without a file.
        stem: names the results folder.
        cases: at least one.
        accuracy: the parts of the error that `[accuracy]` asks for.
    """

    title: str
    path: Path | None
    stem: str
    cases: tuple[Case, ...]
    accuracy: tuple[str, ...] = ()


def load_study(path: str | os.PathLike[str] | None, overrides: Sequence[str] = ()) -> Study:
    """Read and validate a study: every case of it, before anything is solved.

    Args:
        path: the TOML file, None for Table 1 as it is.
        overrides: KEY=VALUE texts of `--set`, in order; VALUE is TOML, or else a bare text.

    Raises:
        InputError: one message that names the file (or `--set`), the key, the rule and the value.
    """
    where = "Table 1" if path is None else os.fspath(path)
    data = {} if path is None else read_toml(where)
    stem = "table1" if path is None else plain(Path(where).stem)
    if fault := name_fault(stem):
        rule = f"the file's name without its ending {fault}"
        raise InputError(where, "", rule, brief(stem), "The folder of its results is called after it.")
    sweep, named = data.pop("sweep", None), data.pop("case", None)
    if sweep is not None and named is not None:
        raise InputError(where, "case", "must not stand beside [sweep]", None, "Use one of them, or two files.")
    accuracy = _accuracy_parts(data.pop("accuracy", None), where)
    variants: tuple[Variant, ...] = ()
    if sweep is not None:
        variants = swept_variants(sweep, where)
    elif named:
        variants = named_variants(named, where)
    check_tables(data, where)
    sets = parse_overrides(overrides)
    _refuse_swept(sets, variants)
    source = _Source(where, data, sets)
    cases = tuple(source.case(variant) for variant in variants or [Variant(stem, {})])
    check_names((case.name for case in cases), where)  # last: a bad value says more than the name made of it
    cases = tuple(replace(case, name=plain(case.name)) for case in cases)
    return Study(cases[0].scene.title or stem, None if path is None else Path(where), stem, cases, accuracy)


def _accuracy_parts(table: object, where: str) -> tuple[str, ...]:
    """The parts that `[accuracy]` asks for, all of them if it does not say; none without the table."""
    if table is None:
        return ()
    if not isinstance(table, dict):
        hint = "Write [accuracy], with parts if not all are wanted."
        raise InputError(where, "accuracy", "must be a table", brief(table), hint)
    for key, value in table.items():
        if key != "parts":
            raise InputError(where, f"accuracy.{key}", "unknown key", brief(value), "Did you mean accuracy.parts?")
    parts = table.get("parts", list(ALL_PARTS))
    if not isinstance(parts, list) or not parts or any(part not in ALL_PARTS for part in parts):
        rule = f"must be a list of some of {', '.join(ALL_PARTS)}"
        raise InputError(where, "accuracy.parts", rule, brief(parts), 'Such as ["mesh", "time"].')
    return tuple(part for part in ALL_PARTS if part in parts)


def parse_overrides(texts: Iterable[str]) -> dict[str, Any]:
    """Dotted key -> value of the KEY=VALUE texts of `--set`; of a key set twice the last counts.

    Raises:
        InputError: for a text without "=", without a key or without a value.
    """
    sets: dict[str, Any] = {}
    for text in texts:
        key, equals, value = (part.strip() for part in plain(text).partition("="))
        if not equals or not key or not value:
            hint = "Such as --set load.factor=2 or --set cell.law=yeoh."
            raise InputError(OVERRIDE, "", "must be KEY=VALUE", brief(text), hint)
        key = key.replace('"', "").replace("'", "")
        sets.pop(key, None)
        sets[key] = _toml_value(value)
        check_size({key: sets[key]}, OVERRIDE)
    return sets


def _toml_value(text: str) -> Any:
    try:
        data = parse(f"value = {text}", OVERRIDE)
    except InputError:
        return text
    return data["value"] if len(data) == 1 else text


def _refuse_swept(sets: Iterable[str], variants: Iterable[Variant]) -> None:
    swept = dict.fromkeys(key for variant in variants for key in variant.settings)
    for key in sets:
        for other in swept:
            if key == other or key.startswith(f"{other}.") or other.startswith(f"{key}."):
                rule = f"must not override {other}, which the study varies from case to case"
                raise InputError(OVERRIDE, key, rule, None, "Choose cases with --only, or write a study of your own.")


class _Source:
    """A file's own content and the overrides, from which the cases are built."""

    def __init__(self, where: str, data: dict[str, Any], sets: dict[str, Any]) -> None:
        self.where, self.data, self.sets = where, data, sets

    def case(self, variant: Variant) -> Case:
        try:
            scene = self._scene(variant.settings, self.sets)
        except InputError as error:
            raise self._blamed(error, variant) from None
        return Case(variant.name, scene, dict(variant.settings))

    def _scene(self, settings: dict[str, Any], sets: dict[str, Any]) -> Scene:
        data = copy.deepcopy(self.data)
        for key, value in (settings | sets).items():
            put(data, key, copy.deepcopy(value), self.where)
        return read_scene(data, self.where)

    def _blamed(self, error: InputError, variant: Variant) -> InputError:
        """The same error at the place that causes it: the file, the case or `--set`.

        A rule may tie keys from several places together, so what counts is whether it breaks without the part.
        """
        where = self.where
        if self.sets and not self._also(error, variant.settings, {}):
            where = OVERRIDE
        if variant.settings and not self._also(error, {}, self.sets):
            where += f", case {brief(variant.name)!r}"
        return InputError(where, error.key, error.rule, error.got, error.hint)

    def _also(self, error: InputError, settings: dict[str, Any], sets: dict[str, Any]) -> bool:
        try:
            self._scene(settings, sets)
        except InputError as other:
            return (other.key, other.rule, repr(other.got)) == (error.key, error.rule, repr(error.got))
        return False
