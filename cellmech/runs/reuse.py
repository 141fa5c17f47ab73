"""Cases that another study, or another case of the same one, has solved with equal inputs."""

from __future__ import annotations

import json
import os
import shutil
from contextlib import suppress
from glob import escape, glob
from pathlib import Path

from mpi4py import MPI

from cellmech.results.archive import Record, alone_in, finished, forget, is_final
from cellmech.results.records import CHECKPOINT, LOG, RESULT, CaseFolder
from cellmech.scene.case import Case
from cellmech.scene.files import scene_to_toml

FOREIGN = (OSError, ValueError, RecursionError, TypeError, KeyError, AttributeError)  # from any program's result.json
OWN = (RESULT, CHECKPOINT, LOG, "scene.toml")  # files that are not copied as they are


def solved_beside(out: Path) -> dict[str, list[Path]]:
    """Folders of cases in the results folders beside `out`, and in `out`, by the key of their final results."""
    parent = out.parent if out.name else out.absolute().parent
    found: dict[str, list[Path]] = {}
    for path in sorted(glob(os.path.join(escape(str(parent)), "*", "*", RESULT))):
        with suppress(*FOREIGN):
            result = json.loads(Path(path).read_text(encoding="utf-8"))
            if is_final(result):
                found.setdefault(result["input_hash"], []).append(Path(path).parent)
    return found


def take_over(source: Path, case: Case, folder: Path, key: str) -> Record | None:
    """Copy a finished case from another folder, under this case's name.

    Args:
        source: folder of the other case.
        case: this one; its scene has the other's content, maybe under another title.
        folder: of this case.
        key: `archive.input_key` of both.

    Returns:
        The content of result.json; None if the other case is not finished.

    Raises:
        OSError: a file cannot be read or written, or another process is at work in the folder.
    """
    result = finished(source, key)
    if result is None:
        return None
    with alone_in(folder):
        return _copied(result, source, case, folder, key)


def _copied(result: Record, source: Path, case: Case, folder: Path, key: str) -> Record | None:
    forget(folder)
    files = CaseFolder(folder, MPI.COMM_SELF, key)
    try:
        files.log(f"taken over from {source}, whose log was:")
        files.log((source / LOG).read_text(encoding="utf-8", errors="replace").rstrip("\n"))
        files.write_text("scene.toml", scene_to_toml(case.scene))
        for path in sorted(source.iterdir()):
            if path.name not in OWN and not path.name.startswith(".") and path.is_file():
                with files.replace_with(path.name) as copy:
                    shutil.copyfile(path, copy)
        if finished(source, key) != result:
            return None  # it is being solved anew: the files may not be of one run
        result |= {"case": case.name, "scene": case.scene.model_dump(mode="json", by_alias=True)}
        files.finish(result)
    finally:
        files.close()
    return result
