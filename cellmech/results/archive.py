"""Results tied to their inputs: what can be served again, and the tables of a study, equal for equal inputs."""

from __future__ import annotations

import csv
import errno
import fcntl
import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, Protocol, TypeAlias

from cellmech.causes import Cause, Reason
from cellmech.errors import CellmechError
from cellmech.results.accuracy import LENGTHS, REGIONS, TABLES
from cellmech.results.dictionary import dictionary
from cellmech.results.records import CHECKPOINT, LOG, RESULT, flatten, to_csv, write_whole
from cellmech.results.sealed import damage, is_whole
from cellmech.scene.case import Case
from cellmech.scene.files import scene_hash
from cellmech.sources import hash_behind

SOLVER = "cellmech.runs.case"  # solves a case: what it imports decides the numbers
SUMMARY, TIMINGS, COLUMNS, LOCK = "summary.csv", "timings.csv", "columns.csv", ".lock"
MACHINE = ("wall_s", "ranks", "memory_MB")  # differ between runs of equal inputs: kept out of summary.csv
COSTS = ("steps", "rejected_steps", "newton_iterations", "factorisations", "mesh_cells", "dofs")

OF_A_STATE = (*REGIONS, *TABLES, *LENGTHS, "nucleus_obstacle", "settled", "stability")
ALWAYS = ("scene", "t_s", *MACHINE, *COSTS, "versions", "model", *OF_A_STATE)  # keys of every result.json

Record: TypeAlias = dict[str, Any]


class Keyed(Protocol):
    """An object with a text that stands for it in a hash, such as a MeshPlan."""

    def key(self) -> str:
        """The text."""


def source_hash() -> str:
    """SHA-256 of the modules that a case's numbers depend on, as they are at the first call."""
    return hash_behind(SOLVER)


def input_key(case: Case, plan: Keyed) -> str:
    """SHA-256 of all that decides a result but for rounding: the scene, the mesh's layers, the program."""
    return hashlib.sha256("\n".join((scene_hash(case.scene), source_hash(), plan.key())).encode()).hexdigest()


def recorded(folder: Path, key: str, note: Callable[[str], None] = lambda line: None) -> Record | None:
    """The content of the folder's result.json if it is for these inputs, good or bad, else None.

    Args:
        folder: of the case.
        key: its `input_key`.
        note: told, for the log, why a result that is there cannot be used.
    """
    try:
        result = json.loads((folder / RESULT).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as error:
        note(f"{RESULT} of an earlier run cannot be read ({error}): solved anew")
        return None
    if not isinstance(result, dict) or not {"input_hash", "status", "reason"} <= result.keys():
        note(f"{RESULT} of an earlier run is not one of this program's: solved anew")
    elif result["input_hash"] != key:
        note(f"{RESULT} of an earlier run is of other inputs or another version of the program: solved anew")
    elif not is_whole(result):
        note(f"{RESULT} of an earlier run is damaged: its content is not what was written: solved anew")
    else:
        return result
    return None


def signed(record: Record, case: str, source: str, key: str) -> Record:
    """A result with what ties it to its case, its program and its inputs; a failed one has null for what it lacks."""
    hashes = {"source_hash": source, "input_hash": key}
    lacks = dict.fromkeys(ALWAYS) if record["status"] == "failed" else {}
    return {"schema": 1, "case": case, "status": "", "reason": "", "cause": "", **hashes, **lacks, **record, **hashes}


def is_final(result: Mapping[str, Any]) -> bool:
    """True if equal inputs must end alike: solved, or failed for a physical reason."""
    return result["status"] == "solved" or not Cause.named(result.get("cause")).passing


def refusal(error: OSError) -> Reason:
    """The reason of a failure that is the disk's."""
    place = f" ({error.filename})" if error.filename else ""
    return Cause.DISK.reason(told=f"{error.strerror or error}{place}")


def finished(folder: Path, key: str, note: Callable[[str], None] = lambda line: None) -> Record | None:
    """As `recorded`, if the result is final and the files beside it are sound; the note says what was not."""
    result = recorded(folder, key, note)
    if result is not None and not is_final(result):
        note(f"an earlier run failed ({result['reason']}): tried again")
        return None
    if result is not None and (fault := damage(folder, result.get("files", {}))):
        note(f"of an earlier run {fault}: solved anew")
        return None
    return result


def forget(folder: Path) -> None:
    """Remove what a case would be served from, or go on from."""
    for name in (RESULT, CHECKPOINT):
        (folder / name).unlink(missing_ok=True)


def merge_tables(
    folder: Path, cases: Sequence[Case], keys: Mapping[str, str], known: Mapping[str, Record]
) -> dict[str, Record]:
    """Write the tables of all cases that have a result, whichever process solved them; remove them if none has.

    Args:
        folder: of the study.
        cases: all of the study.
        keys: their `input_key` by name.
        known: results by name; for those of the others, result.json is read.

    Returns:
        By name what is in the tables, in the study's order.

    Raises:
        CellmechError: the tables cannot be written.
    """
    try:
        with _alone(folder):
            found = {case.name: known.get(case.name) or recorded(folder / case.name, keys[case.name]) for case in cases}
            results = {name: result for name, result in found.items() if result is not None}
            if results:
                write_tables(folder, [case for case in cases if case.name in results], list(results.values()))
            else:
                for name in (SUMMARY, TIMINGS, COLUMNS):
                    (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise CellmechError(f"{folder}: the summary cannot be written ({error.strerror})") from None
    return results


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Let one process at a time in, also of several machines."""
    with open(folder / LOCK, "a") as stream:
        with suppress(OSError):  # a file system without locks: what two at once may miss, the next run puts in
            fcntl.flock(stream, fcntl.LOCK_EX)
        yield


@contextmanager
def alone_in(folder: Path, wait: Callable[[], None] | None = None) -> Iterator[None]:
    """Keep other processes from a case's folder, which is made if need be.

    Args:
        folder: of the case; what is locked is its run.log. A lock ends with its process, however that ends.
        wait: called again and again while another process is there; without it that is an error.

    Raises:
        BlockingIOError: another process is at work in the folder.
        OSError: the disk refuses.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / LOG, "a") as stream:
        while not _locked(stream):
            if wait is None:
                raise BlockingIOError(errno.EAGAIN, "another process is at work there", str(folder))
            wait()
        yield


def _locked(stream: IO[str]) -> bool:
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        pass  # a file system without locks
    return True


def write_tables(folder: Path, cases: Sequence[Case], results: Sequence[Mapping[str, Any]]) -> None:
    """Write summary.csv, equal for equal inputs, columns.csv, which explains its columns, and timings.csv.

    Args:
        folder: of the study.
        cases: in the study's order.
        results: the content of their result.json, in the same order.
    """
    swept = dict.fromkeys(key for case in cases for key in case.swept)
    summary, timings = [], []
    for case, result in zip(cases, results, strict=True):
        scalars = {key: value for key, value in flatten(result).items() if key not in MACHINE}
        outcome = {"status": result["status"], "reason": result["reason"]}
        summary.append({"case": case.name, **case.swept, **outcome, **scalars})
        timings.append({"case": case.name} | {key: result.get(key) for key in (*MACHINE, *COSTS)})
    table = to_csv(summary, ("case", *swept, "status", "reason"))
    columns = next(csv.reader(table.splitlines()))
    write_whole(folder / SUMMARY, table)
    write_whole(folder / COLUMNS, to_csv(dictionary(columns, swept)))
    write_whole(folder / TIMINGS, to_csv(timings))
