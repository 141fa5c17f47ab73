"""The cases of a study: what each one sets, and what it is called."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from cellmech.errors import InputError
from cellmech.names import folded
from cellmech.scene.keys import brief, is_known, unknown

MOST_CASES = 100_000
LONGEST_NAME = 120  # bytes; file systems end at 255, and names of ours are added to it
FILE_ENDINGS = (".csv", ".json", ".log", ".toml", ".tmp", ".png", ".pdf", ".svg", ".vtu", ".pvd", ".lock")


@dataclass(frozen=True)
class Variant:
    """One case before it is read: its name, and the dotted keys it sets beyond the file's."""

    name: str
    settings: dict[str, Any]


def swept_variants(table: object, where: str) -> tuple[Variant, ...]:
    """The Cartesian product of the axes of `[sweep]`, the last axis running fastest.

    Raises:
        InputError: for no or an unknown key, an axis that is no list of plain values, too many cases.
    """
    if not isinstance(table, dict):
        raise InputError(where, "sweep", 'must be a table, such as [sweep] with "cell.law" = ["yeoh"]', brief(table))
    if not table:
        hint = 'Such as "cell.law" = ["yeoh", "neo-hookean"] below [sweep].'
        raise InputError(where, "sweep", "must name a key and its values", None, hint)
    axes = _flat_settings(table, f"{where}, [sweep]")
    for key, values in axes.items():
        _check_axis(key, values, f"{where}, [sweep]")
    count = math.prod(len(values) for values in axes.values())
    if count > MOST_CASES:
        raise InputError(where, "sweep", f"must give at most {MOST_CASES:,} cases", count, "Split the study.")
    settings = [dict(zip(axes, values, strict=True)) for values in product(*axes.values())]
    return tuple(map(Variant, _sweep_names(settings), settings))


def _check_axis(key: str, values: object, where: str) -> None:
    if not isinstance(values, list) or not values:
        raise InputError(where, key, "must be a list of values, not empty", brief(values), "Such as [1, 2].")
    for value in values:
        if not isinstance(value, bool | int | float | str):
            hint = "Lists and tables belong into [[case]]."
            raise InputError(where, key, "must list numbers, texts or booleans", brief(value), hint)


def named_variants(tables: object, where: str) -> tuple[Variant, ...]:
    """The `[[case]]` entries.

    Raises:
        InputError: for a case without a name, an unknown key, too many cases.
    """
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise InputError(where, "case", "must be an array of tables", brief(tables), "Write [[case]] for each case.")
    if len(tables) > MOST_CASES:
        raise InputError(where, "case", f"must be at most {MOST_CASES:,} cases", len(tables), "Split the study.")
    variants = []
    for index, table in enumerate(tables):
        name = table.get("name")
        if not isinstance(name, str):
            raise InputError(where, f"case.{index}.name", "must be a text that names the case", name, 'Such as "S1".')
        rest = {key: value for key, value in table.items() if key != "name"}
        variants.append(Variant(name, _flat_settings(rest, f"{where}, case {brief(name)!r}")))
    return tuple(variants)


def _flat_settings(table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Dotted key -> value of a table whose keys may be quoted dotted keys, tables, or both."""
    settings: dict[str, Any] = {}
    for key, value in _leaves(table):
        if not is_known(key):
            raise unknown(where, key, value)
        if key in settings:
            raise InputError(where, key, "must be set once", brief(value))
        settings[key] = value
    return settings


def _leaves(table: Mapping[str, Any], start: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, dict) and value:
            yield from _leaves(value, f"{start}{key}.")
        else:
            yield start + key, value


def _sweep_names(settings: Sequence[Mapping[str, Any]]) -> list[str]:
    """The value alone for one axis, "key=value,..." for several or when a bare value is no folder name."""
    keys = short_keys(settings[0])
    if len(keys) == 1:
        names = [value_text(value) for case in settings for value in case.values()]
        if not any(name_fault(name) for name in names):
            return names
    return [",".join(f"{keys[key]}={value_text(value)}" for key, value in case.items()) for case in settings]


def short_keys(keys: Iterable[str]) -> dict[str, str]:
    """Each dotted key's shortest ending that no other key shares and that does not begin with a pillar's index."""
    keys = list(keys)
    short = {}
    for key in keys:
        parts = key.split(".")
        endings = [".".join(parts[-n:]) for n in range(1, len(parts) + 1) if not parts[-n].isdigit()]
        others = [f".{other}" for other in keys if other != key]
        free = (ending for ending in endings if not any(other.endswith(f".{ending}") for other in others))
        short[key] = next(free, key)
    return short


def value_text(value: bool | int | float | str) -> str:
    """A value as it stands in a case's name: true, 10, 0.5, yeoh."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)


def name_fault(name: str) -> str:
    """Why a text cannot name a case's folder, "" when it can."""
    if not name.isprintable() or "/" in name or "\\" in name:
        return "must not contain slashes or characters that cannot be printed"
    if not name or name != name.strip() or name[0] in ".-~":
        return "must not be empty or begin with a dot, dash, tilde or space, nor end with a space"
    if len(name.encode()) > LONGEST_NAME:
        return f"must be at most {LONGEST_NAME} bytes long"
    if name.lower().endswith(FILE_ENDINGS):
        return "must not end like one of the files beside the cases"
    return ""


def check_names(names: Iterable[str], where: str) -> None:
    """Refuse names that cannot be folders side by side, also where case or the coding of accents counts for nothing.

    Raises:
        InputError: naming the first that cannot.
    """
    hint = "Cases of [[case]] have names of your own choice."
    seen: dict[str, str] = {}
    for name in names:
        if fault := name_fault(name):
            raise InputError(where, "case", f"a case's name {fault}", brief(name), hint)
        folder = folded(name)
        if folder in seen:
            rule = f"names of cases must differ by more than upper and lower case from {seen[folder]!r}"
            if name.casefold() != seen[folder].casefold():
                rule = f"names of cases must differ by more than how accents are coded from {seen[folder]!r}"
            raise InputError(where, "case", rule, name, hint)
        seen[folder] = name
