"""The package's own modules: which of them a number depends on, what stands for them, and where what is made is kept.

A module depends on what it imports, at its head or in a function, and on the packages that hold it. What is imported
for annotations alone (`if TYPE_CHECKING`) changes no number. The text is read, nothing is imported for it.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from cellmech import surroundings

PACKAGE = Path(__file__).parent
OF_ANNOTATIONS = re.compile(r"^if TYPE_CHECKING:.*\n(?:[ \t]+.*\n|\n)*", re.MULTILINE)
IMPORTED = re.compile(r"^[ \t]*(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+([\w., \t]+))", re.MULTILINE)


def modules_behind(name: str, package: Path = PACKAGE) -> dict[str, Path]:
    """The package's modules that a module of it depends on, itself among them, by dotted name, sorted.

    Args:
        name: dotted, as it is imported.
        package: folder of the package.
    """
    found: dict[str, Path] = {}
    waiting, seen = [name], set()
    while waiting:
        for part in _with_packages(waiting.pop()):
            if part in seen:
                continue
            seen.add(part)
            if (path := _path(part, package)) is not None:
                found[part] = path
                waiting += _imports(path.read_text(encoding="utf-8"), package.name)
    return dict(sorted(found.items()))


@lru_cache
def hash_behind(name: str) -> str:
    """SHA-256 of the modules that a module depends on, as they are at the first call."""
    found = hashlib.sha256()
    for part, path in modules_behind(name).items():
        content = path.read_bytes()
        found.update(f"{part} {len(content)}\n".encode() + content)
    return found.hexdigest()


def _with_packages(name: str) -> list[str]:
    parts = name.split(".")
    return [".".join(parts[: k + 1]) for k in range(len(parts))]


def _path(name: str, package: Path) -> Path | None:
    """The file of a module; None where there is none, as for a function that is imported from one."""
    place = package.parent.joinpath(*name.split("."))
    for path in (place.with_suffix(".py"), place / "__init__.py"):
        if path.is_file():
            return path
    return None


def _imports(text: str, package: str) -> Iterator[str]:
    """The dotted names that a module's text imports from the package, or from something in it."""
    for origin, names, plain in IMPORTED.findall(OF_ANNOTATIONS.sub("", text)):
        found = [word.split()[0] for word in plain.split(",") if word.strip()]
        if origin:
            bare = re.sub(r"#.*", "", names).strip("()")
            found = [f"{origin}.{word.split()[0]}" for word in bare.replace("\n", " ").split(",") if word.strip()]
        yield from (one for one in found if one.split(".")[0] == package)


def cache_directory() -> Path:
    """The folder of compiled forms: $XDG_CACHE_HOME/cellmech, or ~/.cache/cellmech.

    Raises:
        OSError: nothing says where.
    """
    if place := os.environ.get("XDG_CACHE_HOME"):
        return Path(place) / "cellmech"
    home = surroundings.home()
    if home is None:
        raise OSError(errno.ENOENT, "there is no home folder", "~/.cache/cellmech")
    return home / ".cache" / "cellmech"
