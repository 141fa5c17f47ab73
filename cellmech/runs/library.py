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
from pathlib import Path
from typing import Any

import cellmech.fem.started  # noqa: F401 before all that it starts

# isort: split

from mpi4py import MPI

from cellmech.cell.additions import Additions
from cellmech.cell.layering import mesh_plan
from cellmech.errors import InputError, SolveError
from cellmech.fem import fenicsx
from cellmech.names import spelt
from cellmech.results import result as files
from cellmech.results.archive import alone_in, finished, forget, input_key, signed, source_hash
from cellmech.results.records import CHECKPOINT, LOG, RESULT, CaseFolder
from cellmech.runs.case import Progress, solve_case
from cellmech.runs.messages import agreed, together
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene
from cellmech.scene.scene import Scene
from cellmech.scene.toml_file import read_toml


class Result(files.Result):
    """One case's files, and pictures of them."""

    def plot(self, quantity: str = "sigma_mises_Pa", magnify: float = 1.0, axes: Any = None) -> Any:
        """A matplotlib figure of a field on the deformed cell, `figures.field_picture.draw_field`.

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
        _solve(asked, path, additions or Additions(), comm, fresh, progress)
        comm.barrier()  # what rank 0 writes is there
        result = replace(together(comm, lambda: load(path)), scene=asked)  # what is there may have another title
        if check and result.failure:
            raise SolveError(result.failure if own else f"{result.failure} (see {path / LOG})")
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


def _solve(
    scene: Scene, path: Path, additions: Additions, comm: MPI.Comm, fresh: bool, progress: Callable[[Progress], None]
) -> None:
    """Solve into a folder unless it holds the result; no key can tell what additions do, so they are solved anew."""
    case = Case(path.name, scene, {})
    plan = mesh_plan(case.scene)
    key = "" if additions else input_key(case, plan)
    with ExitStack() as stack:

        def enter() -> bool:
            """Whether the result is there, once nobody else is at work."""
            stack.enter_context(alone_in(path))
            if fresh or additions:
                forget(path)
            return bool(key) and finished(path, key) is not None

        if agreed(comm, enter):
            return
        folder = CaseFolder(path, comm, key)
        try:
            folder.agree()
            with fenicsx.own_options():
                record = solve_case(case, folder, comm, plan, progress, additions)
            folder.finish(signed(record, case.name, source_hash(), key))
        finally:
            folder.close()
