"""What each optional part of the model costs and changes where it does nothing.

For each part one scene in which it does nothing, solved twice: with the part in the equations and without it. A part
that the program leaves out by itself is forced into the equations for the first of the two. Compared are all scalars
that have an error (`cellmech.results.accuracy`), of J1, J2, J3 the difference from rest; where only end values are
asked for, energies of the way there and maxima over time are not.

A scalar's error is that of the run without the part, from two finer meshes and a tighter tolerance of the steps. At
least 1e-9 of its size, the Newton tolerance, is taken, and 1e-6 where it is smaller than 1e-4. Times are medians of
fresh processes that take turns; processor time stands beside wall time, because other work may share the machine.

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
import tomllib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cellmech.results.accuracy import Assessed, assess, bears_on, numbers, refinements
from cellmech.results.sealed import plain
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene, scene_to_toml
from cellmech.scene.keys import put
from cellmech.scene.scene import Scene

NEWTON, SMALL, ABSOLUTE = 1e-9, 1e-4, 1e-6
ERRORS_OF = ("mesh", "time")
OF_THE_WAY_THERE = ("energy.", "_over_time")
COARSE = {"mesh.size_um": 8.0, "time.rtol": 0.1}  # compiles the same forms in little time

LAYERS = ("membrane", "cytosol", "lamina", "nucleoplasm")
DRY = {f"layer.{name}.fluid_fraction": 0.0 for name in LAYERS}
INVISCID = {"cell.fluid_lambda_Pa_s": 0.0, "cell.fluid_mu_Pa_s": 0.0}
FAR_PILLAR = {"pillar": [{}, {"x_um": 25.0}]}


@dataclass(frozen=True)
class Variant:
    """One of a pair of runs.

    Args:
        scene: what differs from Table 1, by dotted key, as JSON.
        forced: "obstacles" or "fluid", kept though the program would leave them out; "membrane" or "lamina", meshed as
            one with its neighbour; "" for none of these.
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
    end_only: bool = False


def _variant(scene: dict[str, Any], forced: str = "") -> Variant:
    return Variant(json.dumps(scene), forced)


def _merged(name: str, where: str, scene: dict[str, Any]) -> Part:
    """A layer like its neighbour, meshed apart as the program does, and then as one with it."""
    return Part(name, where, "nothing: it does not pay", _variant(scene), _variant(scene, name))


def _kept(name: str, where: str, scene: dict[str, Any], forced: str) -> Part:
    """A part that the program leaves out by itself."""
    return Part(name, where, "program", _variant(scene, forced), _variant(scene))


def _asked(
    name: str, where: str, by: str, with_it: dict[str, Any], without: dict[str, Any], end_only: bool = False
) -> Part:
    """A part that the scene says yes or no to."""
    return Part(name, where, by, _variant(with_it), _variant(without), end_only)


PARTS = (
    _kept("fluid phase", "c_f = 0 in every layer", DRY, "fluid"),
    _kept("fluid phase", "viscosities 0", INVISCID, "fluid"),
    _asked("fluid phase", "end values of Table 1", "scene", {}, INVISCID, end_only=True),
    _merged("membrane", "the cytosol's material", {"layer.membrane.young_Pa": 10.0}),
    _merged("lamina", "the nucleoplasm's material", {"layer.lamina.young_Pa": 10.0}),
    _kept("flat", "9.5 um below the cell", {}, "obstacles"),
    _kept("second pillar", "at x = 25 um, out of reach", FAR_PILLAR, "obstacles"),
    _asked("inertia", "Table 1", "scene; hint", {"cell.inertia": True}, {}),
    _asked("left half", "mirror-symmetric scene", "scene; hint", {"cell.shape": "full"}, {}),
    _asked("history", "end values of Table 1", "scene; hint", {}, {"time.history": False}, end_only=True),
)


# In a process of its own


def solve(scene: Scene, forced: str) -> dict[str, Any]:
    """Solve a scene; its result.json and the processor time it took [s]."""
    from mpi4py import MPI

    from cellmech.cell.layering import INSIDE_OUT, MeshPlan
    from cellmech.cell.setup import Setup
    from cellmech.mechanics.materials import Material
    from cellmech.results.records import CaseFolder
    from cellmech.runs import case as case_module

    class Everything(Setup):
        """A setup whose obstacles are all modelled from the start."""

        def _body(self) -> Any:
            body, others = super()._body()
            return dataclasses.replace(body, obstacles=(*body.obstacles, *others)), []

    case = Case("case", scene)
    pair = {"membrane": INSIDE_OUT[2:], "lamina": INSIDE_OUT[:2]}.get(forced)
    plan = case_module.mesh_plan(case.scene) if pair is None else MeshPlan((pair,))
    if forced == "obstacles":
        case_module.Setup = Everything  # type: ignore[misc]
    if forced == "fluid":
        Material.rate_dependent = property(lambda self: True)  # type: ignore[method-assign,assignment]
    with tempfile.TemporaryDirectory() as path:
        folder = CaseFolder(Path(path) / "case", MPI.COMM_SELF)
        started = time.process_time()
        result = case_module.solve_case(case, folder, MPI.COMM_SELF, plan, lambda progress: None)
        processor = time.process_time() - started
        folder.close()
    if result["status"] != "solved":
        raise SystemExit(result["reason"])
    return {"result": plain(result), "cpu_s": processor}


def scene_of(variant: Variant, settings: dict[str, Any]) -> Scene:
    """Table 1 with what differs from it."""
    data: dict[str, Any] = {}
    for key, value in (json.loads(variant.scene) | settings).items():
        put(data, key, value, "needs")
    return read_scene(data, "needs")


# In the first process


def run(variant: Variant, settings: dict[str, Any], scene: str = "") -> dict[str, Any]:
    """What `solve` says, from a fresh process; of a complete scene (TOML) instead if one is given."""
    order = json.dumps([scene or scene_to_toml(scene_of(variant, settings)), variant.forced])
    done = subprocess.run([sys.executable, __file__, "--solve", order], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{variant}: {done.stdout}{done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def errors_of(variants: Sequence[Variant], size_um: float) -> dict[Variant, dict[str, Assessed]]:
    """The error of every scalar of each variant, from finer runs, two at a time."""
    orders: list[tuple[Variant, str, dict[str, Any], str]] = []
    parts = {}
    for v in variants:
        scene = scene_of(v, {"mesh.size_um": size_um})
        parts[v] = [part for part in ERRORS_OF if part in bears_on(scene)]
        orders.append((v, "", {"mesh.size_um": size_um}, ""))
        orders += [(v, finer.name, {}, scene_to_toml(finer.scene)) for finer in refinements(scene, parts[v])]
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda order: run(order[0], *order[2:])["result"], orders))
    named = {(v, name): result for (v, name, _, _), result in zip(orders, results, strict=True)}
    return {
        v: assess(named[v, ""], {name: r for (w, name), r in named.items() if w == v and name}, parts[v])
        for v in variants
    }


def compare(part: Part, with_it: dict[str, Any], errors: dict[str, Assessed]) -> Iterator[dict[str, Any]]:
    """A row for each scalar that both runs have: both values, the relative change, the change over the error."""
    values = numbers(with_it)
    for key, row in errors.items():
        if key not in values or (part.end_only and any(word in key for word in OF_THE_WAY_THERE)):
            continue
        size, change = abs(row.value - row.rest), abs(values[key] - row.value)
        error = max(row.error or 0.0, ABSOLUTE if size < SMALL else NEWTON * size)
        yield {
            "part": part.name,
            "where": part.where,
            "scalar": key,
            "with": values[key],
            "without": row.value,
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
    for kind, read in (("wall", lambda r: r["result"]["wall_s"]), ("cpu", lambda r: r["cpu_s"])):
        pair = [statistics.median(read(r) for r in times[v]) for v in (part.with_it, part.without)]
        row |= {f"{kind} with [s]": pair[0], f"{kind} without [s]": pair[1], f"{kind} ratio": pair[0] / pair[1]}
    for size in ("dofs", "steps"):
        pair = [times[v][-1]["result"][size] for v in (part.with_it, part.without)]
        row |= {f"{size} with": pair[0], f"{size} without": pair[1]}
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
    parser.add_argument("--size", type=float, default=4.0, help="mesh.size_um [um]")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", nargs="+", metavar="PART", help="these parts only, by name")
    parser.add_argument("--out", type=Path, default=Path("results/needs"))
    parser.add_argument("--solve", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.solve:
        scene, forced = json.loads(arguments.solve)
        print(json.dumps(solve(read_scene(tomllib.loads(scene), "needs"), forced)))
        return
    parts = [part for part in PARTS if not arguments.only or part.name in arguments.only]
    variants = list(dict.fromkeys(v for part in parts for v in (part.with_it, part.without)))
    arguments.out.mkdir(parents=True, exist_ok=True)
    for variant in variants:
        run(variant, COARSE)
    errors = errors_of(list(dict.fromkeys(part.without for part in parts)), arguments.size)
    times: dict[Variant, list[dict[str, Any]]] = {variant: [] for variant in variants}
    for turn in range(1, arguments.repeat + 1):
        for variant in variants:
            times[variant].append(run(variant, {"mesh.size_um": arguments.size}))
        changes = {p: list(compare(p, times[p.with_it][-1]["result"], errors[p.without])) for p in parts}
        table = [row_of(part, changes[part], times) for part in parts]
        head = f"Table 1, neo-Hookean, mesh.size_um = {arguments.size:g}, medians of {turn}."
        text = write(arguments.out, table, [row for rows in changes.values() for row in rows], head)
        print(f"turn {turn} of {arguments.repeat} done", file=sys.stderr, flush=True)
    print(text)


if __name__ == "__main__":
    main()
