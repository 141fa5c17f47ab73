"""Numbers to compare with, measured or printed elsewhere, as a TOML file has them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cellmech.errors import InputError
from cellmech.figures.style import QUANTITIES
from cellmech.results.result import Result
from cellmech.scene.toml_file import read_toml

STATISTIC = r"_(max|min|mean|p99)(_over_time)?"
NUMBERS, TEXTS = ("value", "uncertainty", "rest"), ("note",)


@dataclass(frozen=True)
class Reference:
    """A number to compare with.

    Args:
        case: name of the case that it is about.
        key: of our number in result.json, dotted.
        value: the number, in the unit that the key names.
        uncertainty: how far it may be off, in the same unit; NaN where that is not said.
        rest: the value where nothing is deformed; NaN where that is not said.
        note: what else there is to say.
    """

    case: str
    key: str
    value: float
    uncertainty: float
    rest: float
    note: str = ""


@dataclass(frozen=True)
class References:
    """A file of numbers to compare with: what they are, where they come from, the numbers."""

    title: str
    source: str
    numbers: tuple[Reference, ...]

    def cases(self) -> list[str]:
        """The names of the cases, each once."""
        return list(dict.fromkeys(number.case for number in self.numbers))


def read_references(path: Path) -> References:
    """Read a file of reference numbers.

    Its table `case` has a table for each case, in which a dotted key of result.json is a number, or a table with
    `value` and, where known, `uncertainty`, `rest` and `note`.

    Raises:
        InputError: for a file that is not there or has another form.
    """
    where, data = str(path), read_toml(str(path))
    for key, value in data.items():
        if key not in ("title", "source", "case"):
            raise InputError(where, key, "must be one of title, source, case")
        if key != "case" and not isinstance(value, str):
            raise InputError(where, key, "must be a text", value)
    cases = data.get("case")
    if not isinstance(cases, Mapping) or not cases:
        raise InputError(where, "case", "must be a table with a table for each case", cases)
    numbers = tuple(number for name, of in cases.items() for number in _numbers(where, name, of))
    if not numbers:
        raise InputError(where, "case", "must hold a number")
    return References(data.get("title", path.stem), data.get("source", ""), numbers)


def _numbers(where: str, case: str, table: Any, start: str = "") -> Iterator[Reference]:
    """The numbers in a case's table, or in a part of it whose keys begin with `start`."""
    if not isinstance(table, Mapping):
        raise InputError(where, f"case.{case}", "must be a table of numbers", table)
    for name, value in table.items():
        key = f"{start}{name}"
        if isinstance(value, Mapping) and "value" not in value:
            yield from _numbers(where, case, value, f"{key}.")
        else:
            yield _number(where, case, key, value if isinstance(value, Mapping) else {"value": value})


def _number(where: str, case: str, key: str, table: Mapping[str, Any]) -> Reference:
    place = f"case.{case}.{key}"
    for name, value in table.items():
        if name not in (*NUMBERS, *TEXTS):
            raise InputError(where, f"{place}.{name}", f"must be one of {', '.join([*NUMBERS, *TEXTS])}")
        if name in TEXTS and not isinstance(value, str):
            raise InputError(where, f"{place}.{name}", "must be a text", value)
        if name in NUMBERS and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise InputError(where, f"{place}.{name}", "must be a number", value)
        if name in NUMBERS and not math.isfinite(value):
            raise InputError(where, f"{place}.{name}", "must be finite", value)
    uncertainty = float(table.get("uncertainty", math.nan))
    if uncertainty < 0:
        raise InputError(where, f"{place}.uncertainty", "must be >= 0", uncertainty)
    rest = float(table.get("rest", math.nan))
    return Reference(case, key, float(table["value"]), uncertainty, rest, table.get("note", ""))


def rest_of(key: str, case: Result | None = None) -> float:
    """The value where nothing is deformed of a number of a case's result.json: that of J1, J2, J3, or else 0.

    Without a case it is that of the plane.
    """
    name = key.rpartition(".")[2]
    quantity = next((q for q in QUANTITIES if re.fullmatch(f"{q.key}{STATISTIC}{q.suffix}", name)), None)
    if quantity is None:
        return 0.0
    return quantity.rest if case is None else case.rest(quantity.key)
