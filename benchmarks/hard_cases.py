"""Hard cases: what was solved, what stopped and why, and how the plain script fares on the same scenes.

Reads the results of studies/hard-cases.toml, compares each verdict with the one it must have, runs plain.py on the
scenes that it can do (a half cell without inertia), and writes hard-cases.csv and hard-cases.md beside the results.
Exit status 1 when a verdict is not the expected one.

    python benchmarks/hard_cases.py [--results results/hard-cases] [--no-plain]
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
SOLVED = "solved"
# Cases that must stop, and what their reason must say; all others must be solved.
STOPS = {
    "02 collapse": r"(ellipticity is lost at|no equilibrium beyond) .*load amplitude (?P<amplitude>[\d.]+): ",
    # its stress at rest pulls the cell together, off the pillar, before there is a load to hold it
    "08 yeoh as printed with history": r"no equilibrium beyond ",
    "08 yeoh x 200": r"(ellipticity is lost at|no equilibrium beyond .*unbounded below)",
    "13 full on an edge": r"slides: no equilibrium",
}
SPREAD = 0.05  # of the collapse loads of three meshes
UNBALANCED = 1e-6  # of the weight, between it and the contact force of a solved case
ENERGY = 0.1  # of the work of gravity, between in and out; 0.07 was met where 20 times the load is there at once
PLAIN_SIZE, PLAIN_STEP_S, PLAIN_LIMIT_S = 0.9, 500.0, 120.0  # as many cells as the study's; 20 steps a ramp
INSIDE_OUT = ("nucleoplasm", "lamina", "cytosol", "membrane")


def expected(name: str) -> str:
    """The pattern of the reason for which a case must stop, or "solved"."""
    return next((pattern for start, pattern in STOPS.items() if name.startswith(start)), SOLVED)


def fault(name: str, result: Mapping[str, Any]) -> str:
    """What is wrong with a result, "" if it is the expected one."""
    rule = expected(name)
    if rule != SOLVED:
        return "" if result["status"] == "failed" and re.search(rule, result["reason"]) else f"should stop: {rule}"
    if result["status"] != SOLVED:
        return "should be solved"
    contact, energy = result["contact"], result["energy"]
    if abs(contact["force_Pa_x_um"] - contact["weight_Pa_x_um"]) > UNBALANCED * abs(contact["weight_Pa_x_um"]):
        return "weight and contact force differ"
    if result["cell"]["det_F_min"] <= 0:
        return "det F <= 0"
    whole = result["scene"]["time"]["history"]
    if whole and abs(energy["balance_error"]) > ENERGY * abs(energy["gravity_work"]):
        return "energy balance"
    return ""


def collapse_fault(results: Mapping[str, Mapping[str, Any]]) -> str:
    """What is wrong with the collapse loads of the meshes, "" if they agree; prints them."""
    loads = {}
    for name, result in results.items():
        if not name.startswith("02 collapse") or result["scene"]["time"]["history"]:
            continue
        if found := re.search(STOPS["02 collapse"], result["reason"]):
            loads[name] = float(found["amplitude"]) * result["scene"]["load"]["factor"]
    if len(loads) < 3:
        return "fewer than three collapse loads"
    spread = (max(loads.values()) - min(loads.values())) / min(loads.values())
    print("collapse loads: " + ", ".join(f"{name.removeprefix('02 collapse ')}: {x:.4g}" for name, x in loads.items()))
    print(f"spread {100 * spread:.2g} %")
    return "" if spread <= SPREAD else f"collapse loads differ by {100 * spread:.2g} %"


def numbers_for_plain(scene: Mapping[str, Any]) -> dict[str, Any] | None:
    """The plain script's input for a scene, None for what it cannot do."""
    cell, layers, time, load = scene["cell"], scene["layer"], scene["time"], scene["load"]
    if cell["shape"] == "full" or cell["inertia"]:
        return None
    ramp_s, pillar = 2 * load["half_ramp_s"], scene["pillar"][0]
    viscosities = (cell["fluid_lambda_Pa_s"], cell["fluid_mu_Pa_s"]) if time["history"] else (0.0, 0.0)
    return {
        "law": cell["law"],
        "radii": [layers[name]["outer_radius_um"] for name in INSIDE_OUT],
        "young": [layers[name]["young_Pa"] for name in INSIDE_OUT],
        "fluid": [layers[name]["fluid_fraction"] for name in INSIDE_OUT],
        "poisson": cell["poisson"],
        "beta_over_mu": cell["beta_over_mu"],
        "i1_rest": 0.0 if cell["yeoh_reference"] == "printed" else 3.0,
        "lambda_f": viscosities[0],
        "mu_f": viscosities[1],
        "load": load["factor"],
        "half_ramp": load["half_ramp_s"],
        "penalty": scene["contact"]["penalty_Pa_per_um"],
        "smoothing": scene["contact"]["smoothing_um"],
        "pillar": [pillar["half_width_um"], pillar["height_um"], pillar["exponent"]],
        "gap": cell["gap_um"],
        "end": time["end_s"] if time["history"] else max(ramp_s, PLAIN_STEP_S),
        "dt": PLAIN_STEP_S,
    }


def plain(scene: Mapping[str, Any]) -> dict[str, Any]:
    """How the plain script fares: verdict, Newton iterations, wall time [s]."""
    numbers = numbers_for_plain(scene)
    if numbers is None:
        return {"plain": "–", "plain_newton": "–", "plain_wall_s": "–"}
    size = max(PLAIN_SIZE, 0.25 * scene["mesh"]["size_um"])
    command = [sys.executable, str(HERE / "plain.py"), f"{size:g}", json.dumps(numbers)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PLAIN_LIMIT_S)
        found = json.loads(done.stdout.splitlines()[-1])
    except subprocess.TimeoutExpired:
        return {"plain": f"not done in {PLAIN_LIMIT_S:g} s", "plain_newton": "–", "plain_wall_s": PLAIN_LIMIT_S}
    except (IndexError, ValueError):
        return {"plain": f"crashed (status {done.returncode})", "plain_newton": "–", "plain_wall_s": "–"}
    verdict = found["failed"] or SOLVED
    return {"plain": verdict, "plain_newton": found["newton"], "plain_wall_s": round(found["wall_s"], 1)}


def row(name: str, result: Mapping[str, Any]) -> dict[str, Any]:
    """One line of the table."""
    energy, cell = result.get("energy") or {}, result.get("cell") or {}
    work = energy.get("gravity_work")
    return {
        "case": name,
        "verdict": result["status"],
        "as_expected": fault(name, result) or "yes",
        "steps": result["steps"],
        "cuts": result["rejected_steps"],
        "newton": result["newton_iterations"],
        "factorisations": result["factorisations"],
        "det_F_min": f"{cell['det_F_min']:.3g}" if cell else "–",
        "energy_balance": f"{energy['balance_error'] / work:.1e}" if work else "–",
        "wall_s": round(result["wall_s"], 1),
    }


def markdown(rows: Sequence[Mapping[str, Any]]) -> str:
    """The table and the reasons of what stopped."""
    keys = [key for key in rows[0] if key != "reason"]
    lines = ["| " + " | ".join(keys) + " |", "|" + " --- |" * len(keys)]
    lines += ["| " + " | ".join(str(r[key]) for key in keys) + " |" for r in rows]
    lines += ["", *(f"- {r['case']}: {r['reason']}" for r in rows if r["reason"])]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Read, judge, compare, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", type=Path, default=Path("results/hard-cases"))
    parser.add_argument("--no-plain", action="store_true", help="leave the plain script out")
    arguments = parser.parse_args()
    files = sorted(arguments.results.glob("*/result.json"))
    if not files:
        print(f"no results in {arguments.results}", file=sys.stderr)
        return 2
    results = {file.parent.name: json.loads(file.read_text(encoding="utf-8")) for file in files}
    rows = [row(name, result) for name, result in results.items()]
    if not arguments.no_plain:
        with ThreadPoolExecutor(2) as pool:
            for mine, theirs in zip(rows, pool.map(plain, [r["scene"] for r in results.values()]), strict=True):
                mine |= theirs
    for r, result in zip(rows, results.values(), strict=True):
        r["reason"] = result["reason"]
    with open(arguments.results / "hard-cases.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    text = markdown(rows)
    (arguments.results / "hard-cases.md").write_text(text, encoding="utf-8")
    print(text)
    wrong = [f"{r['case']}: {r['as_expected']}" for r in rows if r["as_expected"] != "yes"]
    if fault_of_loads := collapse_fault(results):
        wrong.append(fault_of_loads)
    print("\n".join(["NOT AS EXPECTED", *wrong]) if wrong else f"all {len(rows)} verdicts are as expected")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
