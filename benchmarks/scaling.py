"""How the cost of a step, or of a Newton iteration in 3-D, and memory grow with the number of unknowns.

In the plane the first steps of Table 1's history on ever finer meshes; in 3-D its end state on ever finer balls. Each
in a fresh process with warm forms: wall time (all of it: mesh, first guess, solve, observables, output) over accepted
steps or Newton iterations, and the largest resident memory of a rank. The exponent between neighbours is the p of
unknowns^p.

    python benchmarks/scaling.py [--geometry plane] [--sizes 5 0.8 0.27 0.145] [--ranks 1 …] [--out results/scaling]

Writes scaling.csv and scaling.md.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

import command

from cellmech.results.records import to_csv, write_whole

COARSE = 8.0  # compiles
SCENE = 'title = "Table 1"\n'
SETTINGS = {
    "plane": ("time.end_s=3000", "time.rtol=0.1"),
    "3d": ("cell.geometry=3d", "time.history=false"),
}
SIZES = {"plane": [5.0, 0.8, 0.27, 0.145], "3d": [5.6, 3.6, 2.7]}
A_PIECE = {"plane": "steps", "3d": "newton"}  # what the wall time is divided by


def run(out: Path, geometry: str, size_um: float, ranks: int) -> dict[str, Any]:
    """Solve on one mesh; a row."""
    result = command.solved(out, SCENE, (*SETTINGS[geometry], f"mesh.size_um={size_um:g}"), ranks)
    if result["status"] != "solved":
        raise SystemExit(f"mesh.size_um = {size_um:g}: {result['reason']}")
    return {
        "size_um": size_um,
        "ranks": ranks,
        "unknowns": result["dofs"],
        "steps": result["steps"],
        "newton": result["newton_iterations"],
        "factorisations": result["factorisations"],
        "linear": result["linear_iterations"],
        "wall_s": round(result["wall_s"], 2),
        "memory_MB": round(result["memory_MB"]),
    }


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--geometry", choices=SETTINGS, default="plane")
    parser.add_argument("--sizes", type=float, nargs="+", help="mesh.size_um")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1])
    parser.add_argument("--out", type=Path, default=Path("results/scaling"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    geometry, piece = arguments.geometry, A_PIECE[arguments.geometry]
    run(arguments.out, geometry, COARSE, arguments.ranks[0])
    rows: list[dict[str, Any]] = []
    for ranks in arguments.ranks:
        before: dict[str, Any] = {}
        for size in arguments.sizes or SIZES[geometry]:
            row = run(arguments.out, geometry, size, ranks)
            row["s_a_piece"] = round(row["wall_s"] / row[piece], 4)
            row["exponent"] = ""
            if before:
                growth = row["s_a_piece"] / before["s_a_piece"]
                row["exponent"] = round(math.log(growth) / math.log(row["unknowns"] / before["unknowns"]), 2)
            rows.append(row)
            before = row
            print("  ".join(f"{key} {value}" for key, value in row.items()), flush=True)
    write_whole(arguments.out / "scaling.csv", to_csv(rows))
    lines = [list(rows[0]), ["---"] * len(rows[0]), *([str(value) for value in row.values()] for row in rows)]
    write_whole(arguments.out / "scaling.md", "".join(f"| {' | '.join(line)} |\n" for line in lines))


if __name__ == "__main__":
    main()
