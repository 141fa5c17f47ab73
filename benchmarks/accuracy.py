"""Why the defaults are what they are: error of every end value against cost, for meshes, smoothing and quadrature.

The scenes are the four laws of Figure 2 and S2, S3 of Table 3 (S1 is the Saint-Venant case), as end states: what the
time tolerance adds is in the accuracy study (`make accuracy`). The reference is a mesh of a third of the size, with an
eighth of the smoothing and higher quadrature, whose own error is a tenth of what is looked for.

    python benchmarks/accuracy.py [--scenes neo-hookean saint-venant] [--out results/defaults]

Solved references and candidates are kept in --out and not solved again. Writes defaults.csv, convergence.csv and
defaults.md.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from cellmech.cell.layering import MeshPlan
from cellmech.mesh.disc import UNIFORM, Grading
from cellmech.results import accuracy
from cellmech.results.archive import input_key
from cellmech.results.records import CaseFolder, to_csv, write_whole
from cellmech.runs.case import solve_case
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene

WET = {"nucleoplasm": {"fluid_fraction": 0.9}, "lamina": {"fluid_fraction": 0.7}}
SCENES: dict[str, dict[str, Any]] = {
    **{law: {"cell": {"law": law}} for law in ("saint-venant", "neo-hookean", "mooney-rivlin", "yeoh")},
    "S2": {"cell": {"law": "saint-venant"}, "layer": WET},
    "S3": {"cell": {"law": "saint-venant"}, "layer": {**WET, "lamina": {"fluid_fraction": 0.7, "young_Pa": 10}}},
}
REFERENCE = {
    "mesh": {"size_um": 0.8, "thin_layers": 2, "quadrature_degree": 6},
    "contact": {"smoothing_um": 1.25e-5, "quadrature_degree": 19},
}
SECOND = Grading(rim=0.37, deeper=0.35)  # the best for elements of second order
# name -> scene, grading
CANDIDATES: dict[str, tuple[dict[str, Any], Grading]] = {
    "default": ({}, Grading()),
    "size 1.7": ({"mesh": {"size_um": 1.7}}, Grading()),
    "size 3.4": ({"mesh": {"size_um": 3.4}}, Grading()),
    "two elements across thin layers": ({"mesh": {"thin_layers": 2}}, Grading()),
    "second order": ({"mesh": {"order": 2}}, Grading()),
    "second order, graded for it": ({"mesh": {"order": 2}}, SECOND),
    "second order, graded for it, as many unknowns": ({"mesh": {"order": 2, "size_um": 1.02}}, SECOND),
    "third order, graded for second": ({}, SECOND),
    "pressure as an unknown": ({"mesh": {"pressure": "mixed"}}, Grading()),
    "uniform, as many unknowns": ({"mesh": {"size_um": 0.6}}, UNIFORM),
    "uniform, four times as many": ({"mesh": {"size_um": 0.29}}, UNIFORM),
    "smoothing 0.005": ({"contact": {"smoothing_um": 0.005}}, Grading()),
    "smoothing 0.0005": ({"contact": {"smoothing_um": 0.0005}}, Grading()),
    "smoothing 1e-05": ({"contact": {"smoothing_um": 1e-5}}, Grading()),
    "bulk quadrature 3": ({"mesh": {"quadrature_degree": 3}}, Grading()),
    "bulk quadrature 6": ({"mesh": {"quadrature_degree": 6}}, Grading()),
    "contact quadrature 5": ({"contact": {"quadrature_degree": 5}}, Grading()),
    "contact quadrature 19": ({"contact": {"quadrature_degree": 19}}, Grading()),
}
SIZES = (4.8, 3.4, 2.4, 1.7, 1.2)
WATCHED = {  # what the convergence table shows: maxima on the lamina's surface, at the contact edge, inside; means
    "lamina σ, on its surface": "lamina.sigma_mises_max_Pa",
    "lamina J1, on its surface": "lamina.J1_max",
    "membrane J3, at the contact edge": "membrane.J3_max",
    "cytosol J1, beside the lamina": "cytosol.J1_max",
    "nucleoplasm J2, inside": "nucleoplasm.J2_max",
    "nucleoplasm σ, mean": "nucleoplasm.sigma_mises_mean_Pa",
    "nucleoplasm J1, mean": "nucleoplasm.J1_mean",
    "lamina σ, mean": "lamina.sigma_mises_mean_Pa",
    "penetration": "contact.max_depth_um",
}


def merged(*parts: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of a scene, the later ones filling up the earlier."""
    result: dict[str, Any] = {}
    for part in parts:
        for table, values in part.items():
            result[table] = {**result.get(table, {}), **values}
    return result


def solved(out: Path, name: str, scene: Mapping[str, Any], grading: Grading) -> dict[str, Any]:
    """The result of an end state, from disk if it is there."""
    case = Case(name, read_scene(merged(scene, {"time": {"history": False}}), name))
    plan = MeshPlan((), grading)
    key = input_key(case, plan)
    path = out / "runs" / name / "result.json"
    if path.exists():
        result = json.loads(path.read_text())
        if result["input_hash"] == key:
            return result
    folder = CaseFolder(path.parent, MPI.COMM_SELF, key)
    begun = time.process_time()
    result = solve_case(case, folder, MPI.COMM_SELF, plan, lambda progress: None)
    result |= {"input_hash": key, "cpu_s": time.process_time() - begun}
    folder.finish(result)
    folder.close()
    print(f"  {name}: {result['status']}, {result['dofs']} unknowns, {result['cpu_s']:.1f} s", flush=True)
    return result


def errors(result: Mapping[str, Any], reference: Mapping[str, Any]) -> dict[str, accuracy.Assessed]:
    """The error of every end value against the reference."""
    return {
        key: row
        for key, row in accuracy.assess(reference, {"quadrature": result}, ["quadrature"]).items()
        if "over_time" not in key and "gradient" not in key and not key.startswith("energy")
    }


def compare(out: Path, scenes: Sequence[str]) -> list[dict[str, Any]]:
    """A row for each candidate: cost and the largest errors over the scenes."""
    rows = []
    for name, (settings, grading) in CANDIDATES.items():
        row: dict[str, Any] = {"candidate": name}
        largest, small, beyond, cost = (0.0, ""), (0.0, ""), 0, []
        for scene in scenes:
            reference = solved(out, f"{scene}, reference", merged(SCENES[scene], REFERENCE), Grading())
            result = solved(out, f"{scene}, {name}", merged(SCENES[scene], settings), grading)
            cost.append((result["dofs"], result["newton_iterations"], result["factorisations"], result["cpu_s"]))
            for key, found in errors(result, reference).items():
                if found.allowed == accuracy.SMALL_BUDGET:
                    small = max(small, (found.error or 0.0, f"{scene} {key}"))
                    continue
                share = found.share(found.error) or 0.0
                beyond += not found.within
                largest = max(largest, (share, f"{scene} {key}"))
        dofs, newton, factorisations, cpu = np.mean(cost, axis=0)
        row |= {"unknowns": round(dofs), "newton": round(newton, 1), "factorisations": round(factorisations, 1)}
        row |= {"cpu_s": round(cpu, 2), "largest_error_percent": round(100 * largest[0], 3), "where": largest[1]}
        row |= {"beyond_1_percent": beyond, "absolute_error_near_rest": small[0], "near_rest": small[1]}
        rows.append(row)
    return rows


def converge(out: Path, scenes: Sequence[str]) -> list[dict[str, Any]]:
    """A row for each watched number of each scene: its error in percent on ever finer meshes, and the fitted order."""
    rows = []
    for scene in scenes:
        reference = solved(out, f"{scene}, reference", merged(SCENES[scene], REFERENCE), Grading())
        found = []
        for size in SIZES:
            finer = {"mesh": {"size_um": size}, "contact": {"smoothing_um": REFERENCE["contact"]["smoothing_um"]}}
            result = solved(out, f"{scene}, mesh {size}", merged(SCENES[scene], finer), Grading())
            found.append(errors(result, reference))
        for label, key in WATCHED.items():
            shares = np.array([row[key].share(row[key].error) for row in found])
            order = np.polyfit(np.log(SIZES), np.log(np.maximum(shares, 1e-9)), 1)[0]
            columns = {f"{size} um": float(f"{100 * share:.3g}") for size, share in zip(SIZES, shares, strict=True)}
            rows.append({"scene": scene, "number": label, **columns, "order": round(float(order), 2)})
    return rows


def markdown(rows: Sequence[Mapping[str, Any]]) -> str:
    """A table."""
    head = list(rows[0])
    lines = [
        head,
        ["---"] * len(head),
        *([f"{row[key]:.3g}" if isinstance(row[key], float) else str(row[key]) for key in head] for row in rows),
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def main() -> None:
    """Solve what is missing, print and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", choices=list(SCENES), default=list(SCENES))
    parser.add_argument("--out", type=Path, default=Path("results/defaults"))
    arguments = parser.parse_args()
    candidates, convergence = compare(arguments.out, arguments.scenes), converge(arguments.out, arguments.scenes)
    write_whole(arguments.out / "defaults.csv", to_csv(candidates))
    write_whole(arguments.out / "convergence.csv", to_csv(convergence))
    text = (
        "Largest error of any end value over the scenes, in % of |q - q0|; a J within 1e-4 of rest is kept apart.\n\n"
        f"{markdown(candidates)}\n"
        "Error in % on ever finer meshes, with the reference's smoothing.\n\n"
        f"{markdown(convergence)}"
    )
    write_whole(arguments.out / "defaults.md", text)
    print(text)


if __name__ == "__main__":
    main()
