"""Names that people write: one name, however its accents are coded, is one name.

Keyboards and web pages give "é" as one character (NFC), some systems' files as two (NFD); they look alike, and file
systems mostly keep the bytes.
"""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Iterable
from pathlib import Path


def plain(name: str) -> str:
    """The name in the form that all of ours have (NFC)."""
    return unicodedata.normalize("NFC", name)


def folded(name: str) -> str:
    """The form shared by names that differ by upper and lower case or the coding of accents only."""
    return plain(unicodedata.normalize("NFD", name).casefold())


def spelt(path: str | os.PathLike[str]) -> str:
    """The path as the disk has it: a part that is not there stands for the only one there that is the same name."""
    text = os.fspath(path)
    if text.isascii() or os.path.lexists(text):
        return text
    found = Path(text[:1] if os.path.isabs(text) else "")
    for part in Path(text).parts[os.path.isabs(text) :]:
        found /= part if os.path.lexists(found / part) else _only(found, part)
    return str(found)


def path_there(text: str) -> Path:
    """The same for a command line."""
    return Path(spelt(text))


def _only(folder: Path, name: str) -> str:
    try:
        alike = [other for other in os.listdir(folder) if plain(other) == plain(name)]
    except (OSError, ValueError):  # no such folder, or no name at all: whoever opens it will say so
        return name
    return alike[0] if len(alike) == 1 else name


def coordinates(place: Iterable[float]) -> str:
    """A place in words, "x = 1.2, y = 3"."""
    return ", ".join(f"{axis} = {value:.3g}" for axis, value in zip("xyz", place, strict=False))
