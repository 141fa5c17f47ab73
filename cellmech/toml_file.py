"""TOML from anybody: read within bounds of length, depth and size, or refused with one clear error."""

from __future__ import annotations

import os
import stat
import tomllib
from collections.abc import Iterator
from typing import Any

from cellmech.errors import InputError, cut

MOST_BYTES = 1_000_000
MOST_BITS = 1024  # of a whole number; a double's largest
DEEPEST = 20  # levels of tables and lists; a scene has four


def read_toml(where: str) -> dict[str, Any]:
    """The content of a TOML file.

    Raises:
        InputError: for a file that is missing, unreadable, too large, no UTF-8 or no TOML.
    """
    try:
        if not stat.S_ISREG(os.stat(where).st_mode):
            kind = "folder" if os.path.isdir(where) else "device or pipe"
            raise InputError(where, "", f"must be a TOML file, and is a {kind}")
        with open(where, "rb") as stream:
            raw = stream.read(MOST_BYTES + 1)
    except FileNotFoundError:
        hint = "The study files that come with the program are in studies/."
        raise InputError(where, "", "there is no such file", None, hint) from None
    except (OSError, ValueError) as error:  # ValueError: a name with a null byte
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(where, "", f"cannot be read ({reason})") from None
    if len(raw) > MOST_BYTES:
        raise InputError(where, "", f"must be at most {MOST_BYTES:,} bytes long")
    try:
        data = tomllib.loads(raw.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(where, "", f"must be UTF-8 text, and is not (at line {line})") from None
    except ValueError as error:  # of tomllib, and of int() for thousands of digits
        raise InputError(where, "", f"is no valid TOML: {error}") from None
    except RecursionError:
        raise _too_deep(where) from None
    check_size(data, where)
    return data


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
    """Whether the nesting could overflow the stack of what walks the data."""
    level = [data]
    for _ in range(DEEPEST + 1):
        level = [
            inner
            for item in level
            if isinstance(item, dict | list)
            for inner in (item.values() if isinstance(item, dict) else item)
        ]
    return bool(level)
