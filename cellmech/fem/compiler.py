"""The C compiler: always the same one with the same options, and one clear error where it fails.

setuptools and gcc read variables (CC, CFLAGS, LDFLAGS, CPATH, ...) and files in the user's folder; what an activated
environment sets there would change compiled code, or name a compiler that is not there. None of it gets through.
"""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import shutil
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

SYSTEM = ("/usr/bin", "/bin")  # where Debian's compiler and its tools are
KEPT = ("TMPDIR", "TEMP", "TMP")  # where there is room says nothing of what is compiled
OPTIONS = ("-O2", "-g0")
FAULT = re.compile(r"(?:CompileError|LinkError): (.*)", re.DOTALL)  # as cffi tells of them


def name() -> str:
    """The compiler's name, Python's own."""
    return shlex.split(str(sysconfig.get_config_var("CC") or "cc"))[0]


def search_path() -> str:
    """The folders that it is looked for in: the system's before those of activated environments."""
    return os.pathsep.join((*SYSTEM, os.environ.get("PATH", "")))


def options(tables: str) -> list[str]:
    """Its options. They are in the key of what is compiled, and so are a mark of tables and a compiler of another's.

    Args:
        tables: stands for numbers that become part of the code and depend on the machine.
    """
    found = shutil.which(name(), path=search_path())
    if found is None or os.path.dirname(found) in SYSTEM:
        return [*OPTIONS, f"-DTABLES=x{tables}", "-DCOMPILER=system"]
    path = Path(found).resolve()
    stat = path.stat()
    mark = hashlib.sha256(f"{path} {stat.st_size} {stat.st_mtime_ns}".encode()).hexdigest()[:16]
    return [*OPTIONS, f"-DTABLES=x{tables}", f"-DCOMPILER=x{mark}"]


@contextmanager
def clean_environment(home: Path) -> Iterator[None]:
    """Have nothing in the environment that changes what is compiled, nor a home with files that do."""
    before = dict(os.environ)
    clean = {key: before[key] for key in KEPT if key in before}
    try:
        _replace(clean | {"PATH": search_path(), "HOME": str(home), "LC_ALL": "C"})
        yield
    finally:
        _replace(before)


def _replace(variables: dict[str, str]) -> None:
    for key in os.environ.keys() - variables.keys():
        del os.environ[key]
    os.environ.update(variables)


def fault(error: BaseException) -> str:
    """A line on what the compiler or the linker could not do and what to do about it; "" for another error."""
    met = FAULT.search(str(error))
    if met is None:
        return ""
    text = " ".join(met.group(1).split()).rstrip(".")
    missing = shutil.which(name(), path=search_path()) is None
    what = f"{name()} is not installed" if missing else text
    return (
        f"{what}. Equations are compiled with it: apt-get install gcc libc6-dev python3-dev; the same command goes on"
    )
