"""Scenes solved from Python: what `import cellmech` offers, without a command line."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

from mpi4py import MPI

from cellmech.additions import Additions
from cellmech.archive import alone_in, finished, forget, input_key, signed, source_hash
from cellmech.case import Progress, mesh_plan, solve_case
from cellmech.errors import InputError, SolveError
from cellmech.records import CaseFolder
from cellmech.result import Result, load
from cellmech.scene import Scene
from cellmech.scene_file import read_scene
from cellmech.study_file import Case
from cellmech.toml_file import read_toml


def solve(
    scene: Scene | str | os.PathLike[str],
    folder: str | os.PathLike[str] | None = None,
    *,
    additions: Additions | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    check: bool = True,
    fresh: bool = False,
    progress: Callable[[Progress], None] = lambda progress: None,
) -> Result:
    """Solve one scene. Collective on comm.

    Args:
        scene: the scene, or a scene file (a study with several cases is for `python -m cellmech.study`).
        folder: of its files; a folder of its own that lives as long as the result if None. What is solved there
            already, of the same scene by the same program and without additions, is read; a run in the middle goes on.
        additions: laws, obstacles and observables that a scene cannot say.
        comm: the ranks that share the case.
        check: whether a case that fails raises; else its result says why (`Result.failure`).
        fresh: solve anew whatever is there.
        progress: told of every accepted step.

    Returns:
        The result, as `load` reads it, on every rank.

    Raises:
        InputError: for a scene file that breaks a rule.
        SolveError: there is no solution, with the physical reason; what was computed is in the folder if one was given.
        OSError: the disk refuses.
    """
    asked = scene if isinstance(scene, Scene) else _read(os.fspath(scene))
    kept = None if folder is None else Path(folder)
    mine = tempfile.mkdtemp(prefix="cellmech-") if kept is None and comm.rank == 0 else None
    path = Path(comm.bcast(mine)) / "case" if kept is None else kept
    try:
        _solve(asked, path, additions or Additions(), comm, fresh, progress)
        comm.barrier()
        result = load(path)
        if check and result.failure:
            raise SolveError(result.failure if kept is None else f"{result.failure} (see {kept / 'run.log'})")
    except BaseException:
        if mine is not None:
            shutil.rmtree(mine, ignore_errors=True)
        raise
    if mine is not None:
        weakref.finalize(result, shutil.rmtree, mine, True)
    return result


def _read(where: str) -> Scene:
    data = read_toml(where)
    if several := next((key for key in ("sweep", "case") if key in data), None):
        raise InputError(
            where, several, "must not stand in a scene", None, "python -m cellmech.study solves its cases."
        )
    data.pop("accuracy", None)
    return read_scene(data, where)


def _solve(
    scene: Scene, path: Path, additions: Additions, comm: MPI.Comm, fresh: bool, progress: Callable[[Progress], None]
) -> None:
    """Solve into a folder unless it holds the result; no key can tell what additions do, so they are solved anew."""
    case = Case(path.name, scene, {})
    plan = mesh_plan([case])
    key = "" if additions else input_key(case, plan)
    with alone_in(path) if comm.rank == 0 else nullcontext():  # the others wait for what comes next
        if comm.rank == 0 and (fresh or additions):
            forget(path)
        if comm.bcast(comm.rank == 0 and bool(key) and finished(path, key) is not None):
            return
        folder = CaseFolder(path, comm.rank == 0, key)
        try:
            record = solve_case(case, folder, comm, plan, progress, additions)
            folder.finish(signed(record, case.name, source_hash(), key))
        finally:
            folder.close()
