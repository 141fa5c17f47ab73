"""What each optional part of the model costs and changes where it does nothing.

For each part one scene in which it does nothing, solved twice: with the part in the equations and without it. Scenes in
which the program leaves a part out by itself are made to keep it (`FORCED`). Compared are all scalars of result.json at
the end, of J1, J2, J3 the difference from rest; where a run without history has no such number (energies of the way
there, maxima over time) it is not compared, and neither are the places and times of maxima.

A scalar's error is its difference from the same scene on half the element size with a tenth of the time tolerance, but
at least 1e-9 of its size (the Newton tolerance) and, where it is smaller than 1e-4, an absolute 1e-6. Times are medians
of fresh processes, which take turns; processor time beside wall time, because other work may share the machine.

    python benchmarks/needs.py [--size 1.0] [--repeat 3] [--only PART ...] [--out results/needs]
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

REST = {"J1": 2.0, "J2": 2.0, "J3": 1.0}
NEWTON, SMALL, ABSOLUTE = 1e-9, 1e-4, 1e-6
NO_NUMBERS_OF_THE_STATE = (
    "_at_um.", "_time_s", "balance_error", "kinetic", "settled", "t_s", "steps", "rejected_steps", "newton_iterations",
    "factorisations", "wall_s", "ranks", "mesh_cells", "mesh_quality", "dofs", "memory_MB", "lateral_force",
)  # fmt: skip
OF_THE_WAY_THERE = ("energy.", "_over_time")
FINER = {"time.rtol": 1e-4}
COARSE = {"mesh.size_um": 4.0, "time.rtol": 0.1}  # compiles the same forms in little time

LAYERS = ("membrane", "cytosol", "lamina", "nucleoplasm")
DRY = {f"layer.{name}.fluid_fraction": 0.0 for name in LAYERS}
INVISCID = {"cell.fluid_lambda_Pa_s": 0.0, "cell.fluid_mu_Pa_s": 0.0}
FAR_PILLAR = {"pillar": [{}, {"x_um": 25.0}]}


@dataclass(frozen=True)
class Variant:
    """One of a pair of runs.

    Args:
        scene: what differs from Table 1, by dotted key, as JSON.
        forced: the part that is kept though the program would leave it out, a key of `FORCED`; "" for none.
    """

    scene: str = "{}"
    forced: str = ""


@dataclass(frozen=True)
class Part:
    """An optional part of the model and a pair of runs in which it does nothing."""

    name: str
    where: str
    by: str
    with_it: Variant
    without: Variant


def _variant(forced: str = "", **tables: Any) -> Variant:
    return Variant(json.dumps(tables.get("scene", {})), forced)


def _kept(name: str, where: str, scene: dict[str, Any], forced: str) -> Part:
    """A part that the program leaves out by itself."""
    return Part(name, where, "program", _variant(forced, scene=scene), _variant(scene=scene))


def _asked(name: str, where: str, by: str, with_it: dict[str, Any], without: dict[str, Any]) -> Part:
    """A part that the scene says yes or no to."""
    return Part(name, where, by, _variant(scene=with_it), _variant(scene=without))


PARTS = (
    _kept("fluid phase", "c_f = 0 in every layer", DRY, "fluid"),
    _kept("fluid phase", "viscosities 0", INVISCID, "fluid"),
    _asked("fluid phase", "end values of Table 1", "scene", {}, INVISCID),
    _kept("membrane", "the cytosol's material", {"layer.membrane.young_Pa": 10.0}, "interfaces"),
    _kept("lamina", "the nucleoplasm's material", {"layer.lamina.young_Pa": 10.0}, "interfaces"),
    _kept("flat", "9.5 um below the cell", {}, "obstacles"),
    _kept("second pillar", "at x = 25 um, out of reach", FAR_PILLAR, "obstacles"),
    _asked("inertia", "Table 1", "scene; hint", {"cell.inertia": True}, {}),
    _asked("left half", "mirror-symmetric scene", "scene; hint", {"cell.shape": "full"}, {}),
    _asked("history", "end values of Table 1", "scene; hint", {}, {"time.history": False}),
)


# In a process of its own


def solve(variant: Variant, settings: dict[str, Any]) -> dict[str, Any]:
    """Solve one variant; its scalars, times and size."""
    from mpi4py import MPI

    from cellmech import case as case_module
    from cellmech.case import mesh_plan, solve_case
    from cellmech.records import CaseFolder, flatten
    from cellmech.scene_file import read_scene
    from cellmech.setup import MeshPlan, Setup
    from cellmech.study_file import Case

    class Everything(Setup):
        """A setup whose obstacles are all modelled from the start."""

        def _body(self) -> Any:
            body, others = super()._body()
            return dataclasses.replace(body, obstacles=(*body.obstacles, *others)), []

    case = Case("case", read_scene(_nested(json.loads(variant.scene) | settings), "needs"))
    plan = MeshPlan() if variant.forced == "interfaces" else mesh_plan([case])
    if variant.forced == "obstacles":
        case_module.Setup = Everything  # type: ignore[misc]
    if variant.forced == "fluid":
        from cellmech.materials import Material

        Material.rate_dependent = property(lambda self: True)  # type: ignore[method-assign,assignment]
    with tempfile.TemporaryDirectory() as path:
        folder = CaseFolder(Path(path) / "case", lead=True)
        started = time.process_time()
        result = solve_case(case, folder, MPI.COMM_SELF, plan, lambda progress: None)
        processor = time.process_time() - started
        folder.close()
    if result["status"] != "solved":
        raise SystemExit(result["reason"])
    values = {k: v for k, v in flatten(result).items() if not any(part in k for part in NO_NUMBERS_OF_THE_STATE)}
    return {"values": values, "cpu_s": processor} | {key: result[key] for key in ("wall_s", "dofs", "steps")}


def _nested(flat: dict[str, Any]) -> dict[str, Any]:
    tables: dict[str, Any] = {}
    for key, value in flat.items():
        *above, last = key.split(".")
        table = tables
        for name in above:
            table = table.setdefault(name, {})
        table[last] = value
    return tables


# In the first process


def run(variant: Variant, settings: dict[str, Any]) -> dict[str, Any]:
    """What `solve` says, from a fresh process."""
    order = json.dumps([variant.scene, variant.forced, settings])
    done = subprocess.run([sys.executable, __file__, "--solve", order], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{variant}: {done.stdout}{done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def at_rest(key: str) -> float:
    """Value at rest of a scalar [its unit]."""
    return REST.get(key.rsplit(".", 1)[-1].split("_")[0], 0.0) if not key.startswith("share") else 0.0


def compare(part: Part, runs: dict[Variant, dict[str, Any]], finer: dict[str, Any]) -> Iterable[dict[str, Any]]:
    """A row for each scalar that both runs have: both values, the relative change, the change over the error."""
    with_it, without = (runs[variant]["values"] for variant in (part.with_it, part.without))
    no_history = '"time.history": false' in part.without.scene
    stressless = part.without.scene == json.dumps(INVISCID) and not part.with_it.forced
    for key, value in without.items():
        other, best = with_it.get(key), finer["values"].get(key)
        if value is None or other is None or best is None:
            continue
        if (no_history or stressless) and any(word in key for word in OF_THE_WAY_THERE):
            continue
        size = abs(value - at_rest(key))
        least = ABSOLUTE if size < SMALL else NEWTON * size
        error = max(abs(value - best), least)
        change = abs(other - value)
        yield {
            "part": part.name,
            "where": part.where,
            "scalar": key,
            "with": other,
            "without": value,
            "relative_change": change / size if size >= SMALL else None,
            "absolute_change": change,
            "error": error,
            "change_over_error": change / error,
        }


def row_of(part: Part, rows: list[dict[str, Any]], times: dict[Variant, list[dict[str, Any]]]) -> dict[str, Any]:
    """A part's line of the table."""
    relative = max((row for row in rows if row["relative_change"] is not None), key=lambda row: row["relative_change"])
    worst = max(rows, key=lambda row: row["change_over_error"])
    row: dict[str, Any] = {
        "part": part.name,
        "does nothing": part.where,
        "left out by": part.by,
        "scalars": len(rows),
        "largest change": relative["relative_change"],
        "of": relative["scalar"],
        "change/error": worst["change_over_error"],
        "there": worst["scalar"],
    }
    for kind, unit in (("wall", "wall_s"), ("cpu", "cpu_s")):
        pair = [statistics.median(r[unit] for r in times[v]) for v in (part.with_it, part.without)]
        row |= {f"{kind} with [s]": pair[0], f"{kind} without [s]": pair[1], f"{kind} ratio": pair[0] / pair[1]}
    for size in ("dofs", "steps"):
        row[f"{size} with"], row[f"{size} without"] = (times[v][-1][size] for v in (part.with_it, part.without))
    return row


def write(out: Path, table: list[dict[str, Any]], changes: list[dict[str, Any]], head: str) -> str:
    """needs.csv, changes.csv and needs.md; the Markdown table."""
    for name, rows in (("needs.csv", table), ("changes.csv", changes)):
        with open(out / name, "w", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)
    lines = ["| " + " | ".join(table[0]) + " |", "|" + "---|" * len(table[0])]
    for row in table:
        cells = [f"{value:.3g}" if isinstance(value, float) else str(value) for value in row.values()]
        lines.append("| " + " | ".join(cells) + " |")
    text = f"{head}\n\n" + "\n".join(lines) + "\n"
    (out / "needs.md").write_text(text)
    return text


def main() -> None:
    """Run all variants in turns, compare, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=float, default=1.0, help="mesh.size_um [um]")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", nargs="+", metavar="PART", help="these parts only, by name")
    parser.add_argument("--out", type=Path, default=Path("results/needs"))
    parser.add_argument("--solve", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.solve:
        scene, forced, settings = json.loads(arguments.solve)
        print(json.dumps(solve(Variant(scene, forced), settings)))
        return
    parts = [part for part in PARTS if not arguments.only or part.name in arguments.only]
    variants = list(dict.fromkeys(v for part in parts for v in (part.with_it, part.without)))
    arguments.out.mkdir(parents=True, exist_ok=True)
    for variant in variants:
        run(variant, COARSE)
    times: dict[Variant, list[dict[str, Any]]] = {variant: [] for variant in variants}
    for turn in range(arguments.repeat):
        for variant in variants:
            times[variant].append(run(variant, {"mesh.size_um": arguments.size}))
        print(f"turn {turn + 1} of {arguments.repeat} done", file=sys.stderr, flush=True)
    finer = {v: run(v, FINER | {"mesh.size_um": arguments.size / 2}) for v in dict.fromkeys(p.without for p in parts)}
    table, changes = [], []
    for part in parts:
        rows = list(compare(part, {v: runs[-1] for v, runs in times.items()}, finer[part.without]))
        table.append(row_of(part, rows, times))
        changes += rows
    head = f"Table 1, neo-Hookean, mesh.size_um = {arguments.size:g}, medians of {arguments.repeat}."
    print(write(arguments.out, table, changes, head))


if __name__ == "__main__":
    main()
