"""Speed against error: the package beside the plain script, same scene, same number of cells, same environment.

Both are run as fresh processes, alternately; medians of the wall times each reports for itself (mesh, forms and solve,
not the start of Python) and their ratio are printed, with every scalar's error against a fine reference solution.
Errors of J1, J2, J3 are taken on q - q0.

    python benchmarks/speed.py [--repeat 1] [--out results/benchmark]
"""

from __future__ import annotations

import argparse
import csv
import json
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
REST = {"J1": 2.0, "J2": 2.0, "J3": 1.0}
SCALARS = [f"{q}_{kind}" for kind in ("max", "mean") for q in ("sigma_mises", "J1", "J2", "J3")]
REFERENCE = ["mesh.size_um=0.8", "time.rtol=1e-2"]  # the end state is static: the mesh decides


def ours(out: Path, *settings: str) -> dict[str, Any]:
    """Run the package on Table 1, neo-Hookean, and return its numbers."""
    scene = out / "table1.toml"
    scene.write_text('title = "Table 1, neo-Hookean"\n')
    sets = [word for setting in settings for word in ("--set", setting)]
    command = [
        sys.executable,
        "-m",
        "cellmech.study",
        str(scene),
        "--out",
        str(out / "run"),
        "--fresh",
        "--quiet",
        *sets,
    ]
    subprocess.run(command, check=True)
    result = json.loads((out / "run" / "table1" / "result.json").read_text())
    nucleus = result["nucleus"]
    numbers = {name: nucleus[name + "_Pa" if name.startswith("sigma") else name] for name in SCALARS}
    return numbers | {
        key: result[key] for key in ("wall_s", "mesh_cells", "steps", "newton_iterations", "factorisations")
    }


def plain(size: float) -> dict[str, Any]:
    """Run the plain script with elements of this size [µm] and return its numbers."""
    command = [sys.executable, str(HERE / "plain.py"), str(size)]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return json.loads(text.splitlines()[-1])


def errors(numbers: dict[str, Any], reference: dict[str, Any]) -> dict[str, float]:
    """Relative errors in percent, of q - q0 for the strains."""
    rest = {name: REST.get(name.split("_")[0], 0.0) for name in SCALARS}
    return {n: 100 * ((numbers[n] - rest[n]) / (reference[n] - rest[n]) - 1) for n in SCALARS}


def main() -> None:
    """Run, compare, print, and write speed.csv."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument(
        "--plain-size",
        type=float,
        default=0.47,
        help="element size of the plain script [um]; 0.47 gives the default scene's number of cells",
    )
    parser.add_argument("--out", type=Path, default=Path("results/benchmark"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    reference = ours(arguments.out, *REFERENCE)
    ours(arguments.out), plain(arguments.plain_size)  # compile forms
    mine, theirs = [], []
    for _ in range(arguments.repeat):
        mine.append(ours(arguments.out))
        theirs.append(plain(arguments.plain_size))
    wall = [statistics.median(run["wall_s"] for run in runs) for runs in (mine, theirs)]
    rows = [
        {"code": "cellmech", "cells": mine[0]["mesh_cells"], "newton": mine[0]["newton_iterations"], "wall_s": wall[0]},
        {"code": "plain", "cells": theirs[0]["cells"], "newton": theirs[0]["newton"], "wall_s": wall[1]},
    ]
    for row, runs in zip(rows, (mine, theirs), strict=True):
        row |= {f"{name}_error_percent": round(e, 3) for name, e in errors(runs[0], reference).items()}
    with open(arguments.out / "speed.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    for row in rows:
        print(
            "  ".join(
                f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}" for key, value in row.items()
            )
        )
    print(f"reference: {reference['mesh_cells']} cells, {reference['wall_s']:.1f} s")
    print(f"plain / cellmech wall time: {wall[1] / wall[0]:.1f}")


if __name__ == "__main__":
    main()
