"""The package's own command line, run as a user would: a fresh process, one scene, its result.json."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

STUDY = "import runpy; runpy.run_module('cellmech.study', run_name='__main__', alter_sys=True)"


def solved(out: Path, scene: str, settings: Sequence[str] = (), ranks: int = 1, before: str = "") -> dict[str, Any]:
    """Solve a scene into a folder and return its result.json, or a status and reason where there is none.

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
    where = ["--out", str(out / "run"), "--fresh", "--quiet", "--ranks-per-case", str(ranks)]
    command = [sys.executable, "-c", before + STUDY, str(file), *where, *sets]
    if ranks > 1:
        command = ["mpirun", "-n", str(ranks), *command]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if not path.exists():
        return {"status": "failed", "reason": (done.stderr.strip().splitlines() or ["no result"])[-1]}
    return dict(json.loads(path.read_text()))
