"""The package's own command line, run as a user would: a fresh process, one scene, its result.json."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

STUDY = "import runpy; runpy.run_module('cellmech.study', run_name='__main__', alter_sys=True)"
ONE_THREAD = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def solved(out: Path, scene: str, settings: Sequence[str] = (), ranks: int = 1, before: str = "") -> dict[str, Any]:
    """Solve a scene into a folder and return its result.json, or a status and reason where there is none.

    "processor_s" is added: of all its processes, from the start of Python to its end.

    Args:
        out: folder; the scene is written there and solved into `run`.
        scene: TOML.
        settings: as after `--set`.
        ranks: MPI ranks on the case.
        before: Python to execute before the package runs.
    """
    out.mkdir(parents=True, exist_ok=True)
    path, file = out / "run" / "scene" / "result.json", out / "scene.toml"
    file.write_text(scene)
    path.unlink(missing_ok=True)
    sets = [word for setting in settings for word in ("--set", setting)]
    where = ["--out", str(out / "run"), "--fresh", "--quiet", "--no-pictures", "--ranks-per-case", str(ranks)]
    command = [sys.executable, "-c", before + STUDY, str(file), *where, *sets]
    if ranks > 1:
        command = ["mpirun", "-n", str(ranks), *command]
    done, processor_s = timed(command)
    if not path.exists():
        return {"status": "failed", "reason": (done.stderr.strip().splitlines() or ["no result"])[-1]}
    return json.loads(path.read_text()) | {"processor_s": processor_s}


def timed(words: Sequence[str]) -> tuple[Any, float]:
    """Run a command to its end; what subprocess.run returns, and the processor time [s] it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(words, capture_output=True, text=True, env=ONE_THREAD)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
