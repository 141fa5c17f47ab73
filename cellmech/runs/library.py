"""Scenes solved from Python: what `import cellmech` offers, without a command line."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
import weakref
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import cellmech.fem.started  # noqa: F401 before all that it starts

# isort: split

from mpi4py import MPI

from cellmech.causes import Reason
from cellmech.cell.additions import Additions
from cellmech.cell.layering import mesh_plan
from cellmech.errors import InputError, SolveError
from cellmech.names import spelt
from cellmech.results import result as files
from cellmech.results.archive import input_key, source_hash
from cellmech.results.records import CHECKPOINT, LOG, RESULT
from cellmech.runs.case import Progress, solve_case
from cellmech.runs.job import Job, solve_job
from cellmech.runs.messages import agreed, together
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene
from cellmech.scene.scene import Scene
from cellmech.scene.toml_file import read_toml


class Result(files.Result):
    """One case's files, and pictures of them."""

    def plot(self, quantity: str = "sigma_mises_Pa", magnify: float = 1.0, axes: Any = None) -> Any:
        """A matplotlib figure of a field on the deformed cell, which a notebook shows by itself.

        Args:
            quantity: a scalar of the field file.
            magnify: displacements are drawn so many times as large.
            axes: where to draw; a figure of its own if None.

        Raises:
            InputError: for a field that is not there, or a broken file.
        """
        from cellmech.figures.field_picture import draw_field

        return draw_field(self, quantity, magnify, axes)


def load(folder: str | os.PathLike[str]) -> Result:
    """Read the folder of a case that was solved, or that failed on its way.

    Raises:
        InputError: for a file that is missing or broken.
    """
    return files.read(folder, Result)


def solve(
    scene: Scene | Mapping[str, Any] | str | os.PathLike[str],
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
        scene: the scene, its tables as a dict, or a scene file (a study with several cases is for
            `python -m cellmech.study`).
        folder: of its files, new, empty or of an earlier run; one that lives as long as the result if None, on several
            ranks as long as the process. What is solved there already, of the same scene by the same program and
            without additions, is read; a run in the middle goes on.
        additions: laws, obstacles and observables that a scene cannot say.
        comm: the ranks that share the case.
        check: whether a case that fails raises; else its result says why (`Result.failure`).
        fresh: solve anew whatever is there.
        progress: told of every accepted step, on every rank.

    Returns:
        The result, as `load` reads it, on every rank.

    Raises:
        InputError: for a scene, an addition or a folder that breaks a rule.
        SolveError: there is no solution, with the physical reason; what was computed is in the folder if one was given.
        OSError: the disk refuses.
    """
    asked = scene if isinstance(scene, Scene) else _read(scene)
    own = folder is None
    path = agreed(comm, lambda: Path(tempfile.mkdtemp(prefix="cellmech-")) / "case" if own else _usable(folder))
    try:
        added = additions or Additions()
        with ExitStack() as lock:
            solve_job(_job(asked, path, added, fresh), partial(solve_case, additions=added), comm, lock, progress)
        comm.barrier()  # what rank 0 writes is there
        result = replace(together(comm, lambda: load(path)), scene=asked)  # what is there may have another title
        if check and result.cause is not None:
            told = result.failure if own else f"{result.failure} (see {path / LOG})"
            raise SolveError(Reason(result.cause, told))
    except BaseException:
        if own and comm.rank == 0:
            shutil.rmtree(path.parent, ignore_errors=True)
        raise
    if own and comm.size > 1 and comm.rank == 0:
        atexit.register(shutil.rmtree, path.parent, True)
    elif own and comm.size == 1:
        weakref.finalize(result, shutil.rmtree, path.parent, True)
    return result


def _read(scene: object) -> Scene:
    if isinstance(scene, Mapping):
        return read_scene(dict(scene), "scene")
    if not isinstance(scene, str | os.PathLike):
        raise InputError("scene", "", "must be a Scene, a dict of its tables, or a scene file", scene)
    where = str(os.fspath(scene))
    data = read_toml(where)
    if several := next((key for key in ("sweep", "case") if key in data), None):
        hint = "python -m cellmech.study solves its cases."
        raise InputError(where, several, "must not stand in a scene", None, hint)
    data.pop("accuracy", None)
    return read_scene(data, where)


def _usable(folder: object) -> Path:
    """The folder, if nothing of somebody else's can be lost in it."""
    if not isinstance(folder, str | os.PathLike) or not os.fspath(folder):
        raise InputError("folder", "", "must name a folder", folder)
    path = Path(spelt(str(os.fspath(folder)))).absolute()
    if path.exists() and not path.is_dir():
        raise InputError("folder", "", "must be a folder", str(path))
    if path.is_dir() and any(path.iterdir()) and not any((path / name).exists() for name in (LOG, RESULT, CHECKPOINT)):
        rule = "must be new, empty or of an earlier run, since files in it would be overwritten"
        raise InputError("folder", "", rule, str(path))
    return path


def _job(scene: Scene, path: Path, additions: Additions, fresh: bool) -> Job:
    """The scene as a job. No key can tell what additions do, so what has some is solved anew."""
    case, plan = Case(path.name, scene, {}), mesh_plan(scene)
    key = "" if additions else input_key(case, plan)
    return Job(path.name, case, path, plan, key, source_hash(), fresh=fresh or bool(additions))
