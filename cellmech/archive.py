"""Results tied to their inputs: what can be served again, and the tables of a study, equal for equal inputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

from cellmech.records import flatten, to_csv, write_whole
from cellmech.scene_file import scene_hash
from cellmech.study_file import Case

SUMMARY, TIMINGS = "summary.csv", "timings.csv"
MACHINE = ("wall_s", "ranks", "memory_MB")  # differ between runs of equal inputs: kept out of summary.csv
COSTS = ("steps", "rejected_steps", "newton_iterations", "factorisations", "mesh_cells", "dofs")


class Keyed(Protocol):
    """Whatever has a text that stands for it in a hash, such as a MeshPlan."""

    def key(self) -> str:
        """The text."""


@lru_cache
def source_hash() -> str:
    """SHA-256 of the package's modules, as they are at the first call."""
    found = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        content = path.read_bytes()
        found.update(f"{path.name} {len(content)}\n".encode() + content)
    return found.hexdigest()


def input_key(case: Case, plan: Keyed) -> str:
    """SHA-256 of all that decides a result but for rounding: the scene, the mesh's layers, the program."""
    return hashlib.sha256("\n".join((scene_hash(case.scene), source_hash(), plan.key())).encode()).hexdigest()


def finished(folder: Path, key: str, note: Callable[[str], None] = lambda line: None) -> dict[str, Any] | None:
    """The content of the folder's result.json if it is a solution for these inputs, else None.

    Args:
        folder: of the case.
        key: its `input_key`.
        note: told, for the log, why a result that is there cannot be used.
    """
    try:
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as error:
        note(f"result.json of an earlier run cannot be read ({error}): solved anew")
        return None
    if not isinstance(result, dict) or "input_hash" not in result or "status" not in result:
        note("result.json of an earlier run is not one of this program's: solved anew")
    elif result["input_hash"] != key:
        note("result.json of an earlier run is of other inputs or another version of the program: solved anew")
    elif result["status"] != "solved":
        note(f"an earlier run failed ({result.get('reason')}): tried again")
    else:
        return result
    return None


def forget_tables(folder: Path) -> None:
    """Remove the tables of an earlier run, which would belie the results that are about to change."""
    for name in (SUMMARY, TIMINGS):
        (folder / name).unlink(missing_ok=True)


def write_tables(folder: Path, cases: Sequence[Case], results: Sequence[Mapping[str, Any]]) -> None:
    """Write summary.csv, equal for equal inputs, and timings.csv.

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
    write_whole(folder / SUMMARY, to_csv(summary, ("case", *swept, "status", "reason")))
    write_whole(folder / TIMINGS, to_csv(timings))
