"""Files of a case: written whole or not at all, numbers to the last digit."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cellmech.results.sealed import file_hashes, plain, sealed

if TYPE_CHECKING:
    from mpi4py import MPI

Scalar = float | int | None

FLUSH_EVERY_S = 3.0
PARTIAL = ".partial-"  # begins the name of a file that is being written
RESULT, HISTORY, LOG, CHECKPOINT = "result.json", "history.csv", "run.log", "checkpoint.npz"
OUTLINE, SUBSTRATE = "outline.csv", "substrate.vtu"
DATA = (HISTORY, "fields.*", "fields_*", SUBSTRATE, OUTLINE)  # files that result.json vouches for
FROM_AN_EARLIER_RUN = (RESULT, CHECKPOINT, *DATA, f"{PARTIAL}*")
WORDS = (
    "nucleus_obstacle",
    *(f"stability.{kind}{name}" for kind in ("", "in_space.") for name in ("layer", "normal", "motion")),
)
NO_SCALARS = ("schema", "scene", "rest", "versions", "model", "accuracy")  # of result.json: where a result comes from


def write_whole(path: Path, text: str, durable: bool = True) -> None:
    """Write a text file; whoever looks finds the old content or the new one, never a part.

    Args:
        path: the file.
        text: its content.
        durable: whether to wait for the disk, so that this also holds after a crash of the machine.

    Raises:
        OSError: the old file is as it was.
    """
    partial = path.with_name(f"{PARTIAL}{os.getpid()}-{path.name}")
    try:
        partial.write_text(text, encoding="utf-8", newline="")
        _move(partial, path, durable)
    finally:
        partial.unlink(missing_ok=True)


def _move(partial: Path, path: Path, durable: bool) -> None:
    if durable:
        with open(partial, "rb+") as stream:
            os.fsync(stream.fileno())
    os.replace(partial, path)


def flatten(result: Mapping[str, Any]) -> dict[str, Scalar]:
    """The scalars of (a part of) result.json by dotted key; a place `..._at_um` gives `.x`, `.y` and, in 3-D, `.z`.

    Texts and lists have no place in a table and are left out, and so is what `NO_SCALARS` names.
    """
    return dict(_scalars({key: value for key, value in result.items() if key not in NO_SCALARS}, ""))


def _scalars(table: Mapping[str, Any], start: str) -> Iterator[tuple[str, Scalar]]:
    for name, value in table.items():
        key = f"{start}{name}"
        if key in WORDS:
            continue  # null where there is nothing to name
        if type(value) is float:  # most are: asking what else they might be takes long
            yield key, value
        elif isinstance(value, Mapping):
            yield from _scalars(value, f"{key}.")
        elif name.endswith("at_um"):
            place = (None, None) if value is None else value
            yield from _scalars(dict(zip("xyz", place, strict=False)), f"{key}.")
        elif value is None or isinstance(value, Integral):
            yield key, None if value is None else int(value)
        elif isinstance(value, Real):
            yield key, float(value)


def to_csv(rows: Sequence[Mapping[str, Any]], first: Sequence[str] = ()) -> str:
    """A table with a header; floats by repr, so that they read back to the last digit, None as an empty cell.

    Columns are those of all rows: `first`, then in order of appearance. A region that exists in some rows only is one
    null in the others: that column is left out beside those of its members.
    """
    names = dict.fromkeys([*first, *(name for row in rows for name in row)])
    tables = {name[:i] for name in names for i, sign in enumerate(name) if sign == "."}
    null = {name for name in tables & names.keys() if all(row.get(name) is None for row in rows)}
    columns = [name for name in names if name not in null]
    stream = io.StringIO()
    table = csv.writer(stream, lineterminator="\n")
    table.writerow(columns)
    table.writerows([_cell(row.get(name)) for name in columns] for row in rows)
    return stream.getvalue()


def _cell(value: Any) -> str:
    if type(value) is str:
        return value
    if isinstance(value, float):
        return repr(float(value))  # NumPy's own repr names the type
    if isinstance(value, bool | list | dict):
        return json.dumps(value)
    return "" if value is None else str(value)


class CaseFolder:
    """The files of one case. What an earlier run left is removed, unless it left a checkpoint, which decides later.

    What the disk refuses is kept, and raised by the next `agree` on every rank alike: one that stopped alone would
    leave the others waiting for it. Until then no file is replaced.

    Args:
        path: the folder, made if need be.
        comm: the ranks that share the case; the first writes, the calls of the others check and do nothing.
        key: ties what is in the folder to its inputs, `archive.input_key`.
    """

    def __init__(self, path: Path, comm: MPI.Comm, key: str = "") -> None:
        self.path, self.comm, self.lead, self.key = path, comm, comm.rank == 0, key
        self._rows: list[dict[str, str]] = []
        self._unsaved, self._next_flush = False, -math.inf
        self._log: io.TextIOBase | None = None
        self._fault: OSError | None = None
        if self.lead:
            with self._tried():
                path.mkdir(parents=True, exist_ok=True)
                goes_on = (path / CHECKPOINT).exists()
                self._log = open(path / LOG, "a" if goes_on else "w", buffering=1, encoding="utf-8")
                if not goes_on:
                    self.begin_afresh()

    @contextmanager
    def _tried(self) -> Iterator[None]:
        """Keep what the disk refuses for `agree`."""
        try:
            yield
        except OSError as error:
            self._fault = self._fault or error

    def agree(self) -> None:
        """Meet what the disk has refused since the last time. Collective.

        Raises:
            OSError: the first of it, on every rank.
        """
        fault, self._fault = self.comm.bcast(self._fault), None
        if fault is not None:
            raise fault

    @property
    def rows(self) -> int:
        """Number of rows of history.csv."""
        return len(self._rows)

    def begin_afresh(self, why: str = "") -> None:
        """Remove what an earlier run left; `why` is for the log."""
        if self.lead:
            if why:
                self.log(why)
            self._rows = []
            with self._tried():
                for old in _files(self.path, FROM_AN_EARLIER_RUN):
                    old.unlink(missing_ok=True)

    def history_hash(self) -> str:
        """SHA-256 of the rows of history.csv; empty cells do not count, as a later row may bring a new column."""
        filled = [sorted((name, cell) for name, cell in row.items() if cell) for row in self._rows]
        return hashlib.sha256(json.dumps(filled).encode()).hexdigest()

    def resume(self, rows: int, history_hash: str) -> None:
        """Go on after the first so many rows of the history.csv that an earlier run left; for the lead.

        Raises:
            ValueError: there are not so many, or they are others.
        """
        with open(self.path / HISTORY, encoding="utf-8", newline="") as stream:
            try:
                found = list(csv.DictReader(stream))[:rows]
            except csv.Error as error:
                raise ValueError(f"{HISTORY} is damaged: {error}") from None
        if len(found) < rows or any(None in row or None in row.values() for row in found):
            raise ValueError(f"{HISTORY} has not the {rows} whole rows that the checkpoint counts on")
        self._rows = found
        if self.history_hash() != history_hash:
            raise ValueError(f"{HISTORY} is damaged: its rows are not those that the checkpoint counts on")

    def finish(self, result: Mapping[str, Any]) -> None:
        """Write result.json, after which no checkpoint is needed. Collective; raises as `agree`."""
        self.flush(force=True)
        if self.lead and self._fault is None:
            with self._tried():
                files = file_hashes(_files(self.path, DATA))
                write_whole(self.path / RESULT, sealed({**result, "files": files}))
                (self.path / CHECKPOINT).unlink(missing_ok=True)
        self.agree()

    def log(self, line: str) -> None:
        """Add a line to run.log; it is on disk at once."""
        if self._log is not None:
            with self._tried():
                self._log.write(f"{line}\n")

    def add_row(self, row: Mapping[str, Scalar]) -> None:
        """Add a row to history.csv, which follows on disk within a few seconds or at the next `flush`.

        Raises:
            ValueError: for NaN or infinity, on every rank.
        """
        cells = {key: _cell(value) for key, value in plain(row).items()}
        if self.lead:
            self._rows.append(cells)
            self._unsaved = True
            self.flush()

    def flush(self, force: bool = False) -> None:
        """Write history.csv if that is due, or now and to the disk."""
        if self._unsaved and (force or time.monotonic() >= self._next_flush):
            with self._tried():
                self._write_history(durable=force)

    def _write_history(self, durable: bool) -> None:
        write_whole(self.path / HISTORY, to_csv(self._rows), durable)
        self._unsaved, self._next_flush = False, time.monotonic() + FLUSH_EVERY_S

    def write_text(self, name: str, text: str) -> None:
        """Write a file of the folder, whole or not at all."""
        if self.lead and self._fault is None:
            with self._tried():
                write_whole(self.path / name, text)

    @contextmanager
    def replace_with(self, name: str) -> Iterator[Path]:
        """The path to write a file of the folder to; it gets its name if the block ends well, else it is removed."""
        partial = self.path / f"{PARTIAL}{name}"
        with self._tried():
            try:
                yield partial
                if self.lead and self._fault is None:
                    _move(partial, self.path / name, durable=True)
            finally:
                if self.lead:
                    partial.unlink(missing_ok=True)

    def close(self) -> None:
        """Flush and close, quickly: after a signal mpirun leaves a second. run.log takes no lines afterwards."""
        with self._tried():
            if self._unsaved:
                self._write_history(durable=False)
        with self._tried():
            if self._log is not None:
                self._log.close()
        self._log = None


def _files(folder: Path, patterns: Iterable[str]) -> list[Path]:
    """The files, not folders, of these names."""
    return sorted(path for pattern in patterns for path in folder.glob(pattern) if path.is_file())
