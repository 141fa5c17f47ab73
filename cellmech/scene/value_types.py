"""The types of a scene's keys: each checks one value and states its own rule in words.

They stand in `Annotated[...]` beside the Python type, where pydantic picks them up. A broken rule raises a
`PydanticCustomError` whose context holds `rule` and `hint`; `scene_file` turns that into an `InputError`.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from cellmech.scene.toml_file import COMMA_NUMBER, pointed

TINIEST = 1e-30  # in any unit: quotients of inputs stay inside a double's range


def broken(rule: str, hint: str = "", **context: object) -> PydanticCustomError:
    """The error of a value that breaks `rule`, to be raised inside a pydantic validator."""
    return PydanticCustomError("rule", "{rule}", {"rule": rule, "hint": hint, **context})


def _schema(check: Callable[[Any], Any]) -> CoreSchema:
    return core_schema.no_info_plain_validator_function(check)


@dataclass(frozen=True)
class Number:
    """A finite real number within bounds; an integer will do, a boolean or a string will not.

    Args:
        unit: unit as printed in the rule, "" for none.
        above: exclusive lower bound [unit].
        least: inclusive lower bound [unit].
        most: inclusive upper bound [unit].
        note: the reason of a bound, printed in parentheses.
    """

    unit: str = ""
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    note: str = ""

    @property
    def rule(self) -> str:
        """The rule in words, with its unit and range."""
        bounds = [f"> {self.above:g}"] * math.isfinite(self.above) + [f">= {self.least:g}"] * math.isfinite(self.least)
        bounds += [f"<= {self.most:g}"] * math.isfinite(self.most)
        words = ["must be a finite number", " and ".join(bounds), self.unit, f"({self.note})" if self.note else ""]
        return " ".join(word for word in words if word)

    def check(self, value: object) -> float:
        """`value` as a float [unit] if it keeps the rule; -0.0 becomes 0.0, so that equal scenes hash equal."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise broken(self.rule, _number_hint(value))
        try:
            number = float(value) + 0.0
        except OverflowError:  # an integer beyond the range of a double
            raise broken(self.rule) from None
        if not (math.isfinite(number) and self.above < number and self.least <= number <= self.most):
            raise broken(self.rule)
        if 0.0 < abs(number) < TINIEST:
            raise broken(f"{self.rule}, and not nearer to 0 than {TINIEST:g}")
        return number

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Hook of pydantic."""
        return _schema(self.check)


def _number_hint(value: object) -> str:
    if not isinstance(value, str):
        return ""
    if re.fullmatch(COMMA_NUMBER, value):
        return f"Write it with a decimal point: {pointed(value)}."
    try:
        number = float(value)
    except ValueError:
        return ""
    return f"Write {number!r}, without quotes." if math.isfinite(number) else ""


@dataclass(frozen=True)
class Constants:
    """A table of named numbers; which names there are, and their bounds, is the laws' to say (`rules`)."""

    def check(self, value: object) -> dict[str, float]:
        """`value` if it is such a table."""
        if not isinstance(value, dict):
            raise broken("must be a table of numbers")
        return {str(key): Number().check(number) for key, number in value.items()}

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Hook of pydantic."""
        return _schema(self.check)


@dataclass(frozen=True)
class Pair:
    """Two numbers, each of which keeps the rule of one.

    Args:
        number: that rule.
        what: they are.
        example: of them.
    """

    number: Number
    what: str = "along x and along z"
    example: str = "[0.0, 0.0]"

    def check(self, value: object) -> tuple[float, float]:
        """`value` if it is a list of two such numbers."""
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise broken(f"must be a list of two numbers, {self.what} ({self.number.unit})", f"Such as {self.example}.")
        return self.number.check(value[0]), self.number.check(value[1])

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Hook of pydantic."""
        return _schema(self.check)


@dataclass(frozen=True)
class Whole:
    """A whole number within inclusive bounds, or one of some words.

    Args:
        least, most: the bounds.
        words: strings that will do as well.
    """

    least: int
    most: int
    words: tuple[str, ...] = ()

    def check(self, value: object) -> int | str:
        """`value` if it keeps the rule."""
        if isinstance(value, str) and value in self.words:
            return value
        if isinstance(value, bool) or not isinstance(value, int) or not self.least <= value <= self.most:
            few = self.most - self.least < 2
            allowed = f"{self.least} or {self.most}" if few else f"a whole number from {self.least} to {self.most}"
            others = "".join(f' or "{word}"' for word in self.words)
            raise broken(f"must be {self.least}" if self.least == self.most else f"must be {allowed}{others}")
        return value

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Hook of pydantic."""
        return _schema(self.check)


@dataclass(frozen=True)
class Choice:
    """One of the strings of the `Literal` it annotates."""

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Hook of pydantic."""
        options: tuple[str, ...] = get_args(source)

        def check(value: object) -> str:
            if isinstance(value, str) and value in options:
                return value
            close = difflib.get_close_matches(str(value).lower().replace("_", "-"), options, 1)
            raise broken(f"must be one of {', '.join(options)}", f"Did you mean {close[0]!r}?" if close else "")

        return _schema(check)


@dataclass(frozen=True)
class Flag:
    """A boolean, or one of some words: 0, 1 and "yes" are refused rather than guessed at.

    Args:
        words: strings that will do as well.
    """

    words: tuple[str, ...] = ()

    def check(self, value: object) -> bool | str:
        """`value` if it is a boolean or one of the words."""
        if isinstance(value, bool) or (isinstance(value, str) and value in self.words):
            return value
        rule = ", ".join(["must be true", *(["false"] if self.words else [])])
        others = " or ".join([f'"{word}"' for word in self.words] or ["false"])
        raise broken(f"{rule} or {others}", "true and false are written small and without quotes.")

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Hook of pydantic."""
        return _schema(self.check)


@dataclass(frozen=True)
class Line:
    """One line of printable text, at most `most` characters."""

    most: int = 200

    def check(self, value: object) -> str:
        """`value` if it keeps the rule."""
        if not isinstance(value, str) or len(value) > self.most or not value.isprintable():
            raise broken(f"must be one line of text in quotes, at most {self.most} characters")
        return value

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Hook of pydantic."""
        return _schema(self.check)
