"""TOML from anybody: read within bounds of length, depth and size, or refused with one clear error."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from collections.abc import Iterator
from typing import Any

from cellmech.errors import InputError, cut
from cellmech.names import spelt

MOST_BYTES = 1_000_000
MOST_BITS = 1024  # of a whole number; a double's largest
DEEPEST = 20  # levels of tables and lists; a scene has four
# A key of so many parts as no sentence has; the parser's memory goes with the square of their number.
LONG_KEY = re.compile(r"""(?<![\w-])(?>(?>[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){60}""")

COMMA_NUMBER = r"[-+]?\d[\d.]*,\d+"
DECIMAL_COMMA = re.compile(rf"""^[ \t]*([\w."' -]+=[ \t]*({COMMA_NUMBER}))[ \t]*(?:\#.*)?$""", re.MULTILINE)


def read_toml(where: str) -> dict[str, Any]:
    """The content of a TOML file.

    Raises:
        InputError: for a file that is missing, unreadable, too large, no UTF-8 or no TOML.
    """
    try:
        path = spelt(where)
        if not stat.S_ISREG(os.stat(path).st_mode):
            kind = "folder" if os.path.isdir(path) else "device or pipe"
            raise InputError(where, "", f"must be a TOML file, and is a {kind}")
        with open(path, "rb") as stream:
            raw = stream.read(MOST_BYTES + 1)
    except FileNotFoundError:
        hint = "The study files that come with the program are in studies/."
        raise InputError(where, "", "there is no such file", None, hint) from None
    except OSError as error:
        raise InputError(where, "", f"cannot be read ({error.strerror})") from None
    except ValueError:
        raise InputError(where, "", "cannot be read (null byte in its name)") from None
    if len(raw) > MOST_BYTES:
        raise InputError(where, "", f"must be at most {MOST_BYTES:,} bytes long")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(where, "", f"must be UTF-8 text, and is not (at line {line})") from None
    data = parse(text, where)
    check_size(data, where)
    return data


def parse(text: str, where: str) -> dict[str, Any]:
    """The data of a TOML text.

    Raises:
        InputError: for what is no TOML, or would take the parser too far.
    """
    if LONG_KEY.search(text):
        raise _too_deep(where)
    try:
        return tomllib.loads(text)
    except ValueError as error:  # of tomllib, and of int() for thousands of digits
        if comma := DECIMAL_COMMA.search(text):
            rule, number = f"is no valid TOML: {cut(comma[1])}", pointed(comma[2])
            raise InputError(where, "", rule, None, f"Write it with a decimal point: {number}.") from None
        raise InputError(where, "", f"is no valid TOML: {error}") from None
    except RecursionError:
        raise _too_deep(where) from None


def pointed(text: str) -> str:
    """A number written with a decimal comma, and perhaps points between thousands, as TOML has it."""
    return text.replace(".", "").replace(",", ".")


def check_size(data: object, where: str) -> None:
    """Refuse what later steps could not walk through or print.

    Raises:
        InputError: for deep nesting, or a whole number beyond any double, which Python may refuse to print.
    """
    if _is_deep(data):
        raise _too_deep(where)
    for key, value in _plain_values(data, ""):
        if isinstance(value, int) and value.bit_length() > MOST_BITS:
            rule = "must be a number within the range of a double"
            raise InputError(where, cut(key), rule, f"a whole number of {value.bit_length():,} bits")


def _plain_values(data: object, key: str) -> Iterator[tuple[str, object]]:
    if not isinstance(data, dict | list):
        yield key, data
        return
    for name, value in data.items() if isinstance(data, dict) else enumerate(data):
        yield from _plain_values(value, f"{key}.{name}" if key else str(name))


def _too_deep(where: str) -> InputError:
    return InputError(where, "", f"must not nest lists and tables more than {DEEPEST} deep")


def _is_deep(data: object) -> bool:
    """True if the nesting could overflow the stack of what walks the data."""
    level = [data]
    for _ in range(DEEPEST + 1):
        level = [
            inner
            for item in level
            if isinstance(item, dict | list)
            for inner in (item.values() if isinstance(item, dict) else item)
        ]
    return bool(level)
