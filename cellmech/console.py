"""Standard output and error, and whether a person looks at them. Nothing of ours is imported."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from typing import Any


def say(text: str, stream: Any = None) -> None:
    """Print a text; where that is no longer possible (`| head`, a terminal closed, a full disk), go on in silence."""
    stream = stream or sys.stdout
    try:
        print(text, file=stream, flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())  # what is left goes there, and Python ends in peace
    except ValueError:
        pass  # closed by the program that calls us


def bear_any_text() -> None:
    """Have standard output and error write what they cannot show as escapes: no name in a file may stop a program."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def on_terminal() -> bool:
    """True if a terminal shows our standard output; mpirun gives its ranks one of their own wherever it prints."""
    if sys.stdout is None or sys.stdout.closed or not sys.stdout.isatty() or os.environ.get("TERM") == "dumb":
        return False
    if not any(name in os.environ for name in ("OMPI_COMM_WORLD_RANK", "PMIX_RANK")):
        return True
    try:
        process, ours = os.getppid(), os.readlink("/proc/self/fd/1")
        while (theirs := os.readlink(f"/proc/{process}/fd/1")) == ours:  # a shell between mpirun and us
            process = int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])
    except OSError:
        return False
    return theirs.startswith(("/dev/pts/", "/dev/tty"))
