"""How the cost of a time step, and memory, grow with the number of unknowns.

The first steps of Table 1's history on ever finer meshes, each in a fresh process with warm forms: wall time over
accepted steps (all of it: mesh, solve, observables, output) and the largest resident memory. The exponent between
neighbours is the p of unknowns^p.

    python benchmarks/scaling.py [--sizes 5 0.8 0.27 0.145] [--ranks 1] [--out results/scaling]

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
SCENE = 'title = "Table 1, its first steps"\n'
SETTINGS = ("time.end_s=3000", "time.rtol=0.1")


def run(out: Path, size_um: float, ranks: int) -> dict[str, Any]:
    """Solve on one mesh; a row."""
    result = command.solved(out, SCENE, (*SETTINGS, f"mesh.size_um={size_um:g}"), ranks)
    if result["status"] != "solved":
        raise SystemExit(f"mesh.size_um = {size_um:g}: {result['reason']}")
    return {
        "size_um": size_um,
        "ranks": ranks,
        "unknowns": result["dofs"],
        "steps": result["steps"],
        "newton": result["newton_iterations"],
        "factorisations": result["factorisations"],
        "wall_s": round(result["wall_s"], 2),
        "memory_MB": round(result["memory_MB"]),
    }


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=float, nargs="+", default=[5.0, 0.8, 0.27, 0.145], help="mesh.size_um")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("results/scaling"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    run(arguments.out, COARSE, arguments.ranks)
    rows: list[dict[str, Any]] = []
    for size in arguments.sizes:
        row = run(arguments.out, size, arguments.ranks)
        row["s_a_step"] = round(row["wall_s"] / row["steps"], 4)
        row["exponent"] = ""
        if rows:
            growth = row["s_a_step"] / rows[-1]["s_a_step"]
            row["exponent"] = round(math.log(growth) / math.log(row["unknowns"] / rows[-1]["unknowns"]), 2)
        rows.append(row)
        print("  ".join(f"{key} {value}" for key, value in row.items()), flush=True)
    write_whole(arguments.out / "scaling.csv", to_csv(rows))
    lines = [list(rows[0]), ["---"] * len(rows[0]), *([str(value) for value in row.values()] for row in rows)]
    write_whole(arguments.out / "scaling.md", "".join(f"| {' | '.join(line)} |\n" for line in lines))


if __name__ == "__main__":
    main()
