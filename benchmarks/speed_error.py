"""Speed against error: what each choice costs and how far its numbers are off, beside the plain script.

Table 1, neo-Hookean, with its whole history unless said otherwise. Every run is a fresh process with warm forms; runs
are interleaved and repeated, medians count: of the wall time that each reports for itself (mesh, forms and solve, not
the start of Python) and of the processor time of all of it, which other programs disturb less. NGSolve takes part where
it is installed (`make second-code` installs it). Errors are of end values, of J1, J2, J3 on q - q0, against a reference
on a mesh of a quarter of the size whose own error is estimated from a coarser one: of the nucleus's eight largest and
mean values, which the other programs report too, and of all scalars of the package.

    python benchmarks/speed_error.py [--repeat 3] [--only WORD ...] [--out results/speed-error]

Writes speed_error.csv, speed_error.md and speed_error.png. A run that fails is a row that says so.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import platform
import statistics
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import command

from cellmech.results import accuracy
from cellmech.results.records import to_csv, write_whole

HERE = Path(__file__).parent
REST = {"J1": 2.0, "J2": 2.0, "J3": 1.0}
SCALARS = [f"{q}_{kind}" for kind in ("max", "mean") for q in ("sigma_mises", "J1", "J2", "J3")]
# The end is static: the steps' tolerance bears on what is left of the way there only, which is below 1e-6.
FINE = (
    "mesh.thin_layers=2",
    "mesh.quadrature_degree=6",
    "contact.smoothing_um=1.25e-5",
    "contact.quadrature_degree=19",
)
REFERENCE, CHECK = (("mesh.size_um=0.6", "time.rtol=1e-2", *FINE), ("mesh.size_um=1.2", "time.rtol=1e-2", *FINE))
FULL_NEWTON = "import cellmech.solver.newton as s; s.KEEP_RATE = -1.0; "  # a new tangent at every iteration
SCENE = 'title = "Table 1, neo-Hookean"\n'


@dataclass(frozen=True)
class Contender:
    """One way to solve the scene.

    Args:
        family: what is varied.
        name: the variant.
        settings: `--set` of the package.
        ranks: MPI ranks.
        before: Python put before the package's run.
        script: another program in this folder and its words, instead of the package.
    """

    family: str
    name: str
    settings: tuple[str, ...] = ()
    ranks: int = 1
    before: str = ""
    script: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Family and variant in one."""
        return f"{self.family}, {self.name}"


END = ("time.history=false",)
UNIFORM, FIRST = '{"graded": false}', '{"graded": false, "degree": null, "start": "last"}'
NGSOLVE = (0.5, 0.25, 0.12) if importlib.util.find_spec("ngsolve") else ()
CONTENDERS = (
    Contender("cellmech", "default"),
    *(Contender("third order", f"{h} um", (f"mesh.size_um={h}",)) for h in (4.8, 4.2, 3.4, 1.7, 1.2)),
    *(Contender("second order", f"{h} um", ("mesh.order=2", f"mesh.size_um={h}")) for h in (2.4, 1.2, 0.6)),
    *(Contender("first order", f"{h} um", ("mesh.order=1", f"mesh.size_um={h}")) for h in (0.6, 0.3)),
    *(Contender("steps", f"rtol {r:g}", (f"time.rtol={r:g}",)) for r in (1e-1, 1e-2, 1e-4)),
    *(Contender("bulk quadrature", f"degree {d}", (f"mesh.quadrature_degree={d}",)) for d in (3, 6)),
    Contender("contact", "volume form", ('contact.form="volume"',)),
    Contender("contact", "quadrature 19", ("contact.quadrature_degree=19",)),
    Contender("tangent", "new at every iteration", before=FULL_NEWTON),
    Contender("ranks", "2 on one case", ranks=2),
    *(Contender("end state", f"{h} um", (*END, f"mesh.size_um={h}")) for h in (4.8, 2.4, 1.2)),
    *(Contender("plain", f"{h} um", script=("plain.py", f"{h}", "{}")) for h in (0.5, 0.3, 0.25, 0.15)),
    *(Contender("plain, uniform", f"{h} um", script=("plain.py", f"{h}", UNIFORM)) for h in (0.47, 0.19, 0.16)),
    *(Contender("plain, as written first", f"{h} um", script=("plain.py", f"{h}", FIRST)) for h in (0.95, 0.47)),
    *(Contender("NGSolve", f"{h} um", script=("ngsolve_history.py", f"{h}")) for h in NGSOLVE),
)


def other(script: Sequence[str]) -> dict[str, Any]:
    """Solve it by another program, in the shape of a result.json."""
    done, processor_s = command.timed([sys.executable, str(HERE / script[0]), *script[1:]])
    if done.returncode != 0:
        return {"status": "failed", "reason": done.stderr.strip().splitlines()[-1]}
    found = json.loads(done.stdout.splitlines()[-1])
    return (found if "status" in found else shaped(found)) | {"processor_s": processor_s}


def shaped(found: Mapping[str, Any]) -> dict[str, Any]:
    """What the plain script prints, in the shape of a result.json."""
    result = {"wall_s": found["wall_s"], "dofs": found["unknowns"]}
    if found["failed"]:
        return result | {"status": "failed", "reason": found["failed"]}
    nucleus = {f"{name}_Pa" if name.startswith("sigma") else name: found[name] for name in SCALARS}
    counts = {"newton_iterations": found["newton"], "factorisations": found["newton"]}
    return result | {"status": "solved", "nucleus": nucleus} | counts


def warmed(contender: Contender, out: Path) -> dict[str, Any]:
    """Something small, after which its forms are compiled."""
    if contender.script[:1] == ("plain.py",):
        return other(("plain.py", "2.0", json.dumps(json.loads(contender.script[2]) | {"end": 400.0})))
    small = (*contender.settings, "mesh.size_um=8", "time.rtol=0.3")
    return {} if contender.script else command.solved(out, SCENE, small, contender.ranks, contender.before)


def nucleus_error(result: Mapping[str, Any], reference: Mapping[str, Any]) -> float:
    """Largest error of the nucleus's eight numbers, in percent of q - q0."""
    errors = []
    for name in SCALARS:
        key, rest = f"{name}_Pa" if name.startswith("sigma") else name, REST.get(name[:2], 0.0)
        there = reference["nucleus"][key]
        errors.append(abs(result["nucleus"][key] - there) / abs(there - rest))
    return 100 * max(errors)


def beyond(result: Mapping[str, Any], reference: Mapping[str, Any]) -> int:
    """How many of the package's end values are beyond 1 %."""
    rows = accuracy.assess(reference, {"quadrature": result}, ["quadrature"])
    left_out = ("over_time", "gradient")
    return sum(
        not row.within
        for key, row in rows.items()
        if not any(part in key for part in left_out) and not key.startswith("energy")
    )


def row_of(contender: Contender, results: Sequence[Mapping[str, Any]], reference: Mapping[str, Any]) -> dict[str, Any]:
    """A line of the table."""
    first = results[0]
    row = {"family": contender.family, "variant": contender.name, "status": first["status"]}
    row |= {"unknowns": first.get("dofs"), "steps": first.get("steps")}
    row |= {"newton": first.get("newton_iterations"), "factorisations": first.get("factorisations")}
    for key in ("wall_s", "processor_s"):
        times = [result[key] for result in results if key in result]
        row[key] = round(statistics.median(times), 2) if times else None
    if first["status"] != "solved":
        return row | {"nucleus_error_percent": None, "beyond_1_percent": None, "reason": first.get("reason", "")}
    row["nucleus_error_percent"] = float(f"{nucleus_error(first, reference):.3g}")
    row["beyond_1_percent"] = None if contender.script else beyond(first, reference)
    return row | {"reason": ""}


def markdown(rows: Sequence[Mapping[str, Any]]) -> str:
    """The table, with wall times over the default's too."""
    base = next((row for row in rows if (row["family"], row["variant"]) == ("cellmech", "default")), {})
    counts = ["family", "variant", "unknowns", "steps", "newton", "factorisations"]
    times = ["wall_s", "processor_s"]
    head = [*counts, *times, *(f"{key} over default" for key in times), "nucleus, % off", "numbers beyond 1 %"]
    lines = [head, ["---"] * len(head)]
    for row in rows:
        ratios = [f"{row[key] / base[key]:.2f}" if base and row[key] else "" for key in times]
        error = row["nucleus_error_percent"] if row["status"] == "solved" else f"failed: {row['reason'][:60]}"
        shown = [*(row[key] for key in counts + times), *ratios, error, row["beyond_1_percent"]]
        lines.append(["" if value is None else str(value) for value in shown])
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def draw(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Error against wall time and against factorisations, a curve a family of meshes."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), sharey=True, layout="constrained")
    families, shades = list(dict.fromkeys(row["family"] for row in rows)), plt.get_cmap("tab20")
    marks = {family: (shades(k % 20), "*sD^vPXph<oH"[k % 12]) for k, family in enumerate(families)}
    for ax, key, name in zip(axes, ("wall_s", "factorisations"), ("wall time [s]", "factorisations"), strict=True):
        for family, (colour, mark) in marks.items():
            own = [row for row in rows if row["family"] == family and row["status"] == "solved"]
            points = sorted((row[key], row["nucleus_error_percent"]) for row in own)
            if points:
                line = "-" if own[0]["variant"].endswith(" um") else ""
                size = 13 if family == families[0] else 6
                ax.plot(*zip(*points, strict=True), ls=line, color=colour, marker=mark, ms=size, lw=1, label=family)
        ax.axhline(1.0, color="0.6", lw=0.8, ls="--")
        ax.set(xscale="log", yscale="log", xlabel=name)
    axes[0].set_ylabel("largest error of the nucleus's numbers [%]")
    axes[1].legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.savefig(path, dpi=150)


def main() -> int:
    """Run, compare, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", nargs="+", default=[""], help="contenders whose label holds one of these words")
    parser.add_argument("--out", type=Path, default=Path("results/speed-error"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    chosen = [c for c in CONTENDERS if any(word in c.label for word in arguments.only)]
    reference, check = (command.solved(arguments.out, SCENE, settings) for settings in (REFERENCE, CHECK))
    machine = f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores; " + ", ".join(
        f"{key} {value}" for key, value in reference["versions"].items()
    )
    known = f"reference: {reference['dofs']} unknowns; one of {check['dofs']} differs by "
    known += (
        f"{nucleus_error(check, reference):.2g} % in the nucleus, {beyond(check, reference)} numbers by more than 1 %"
    )
    print(f"{machine}\n{known}", flush=True)
    found: dict[str, list[dict[str, Any]]] = {contender.label: [] for contender in chosen}
    for turn in range(arguments.repeat + 1):  # the first one compiles
        for contender in chosen:
            if turn == 0:
                result = warmed(contender, arguments.out)
            elif contender.script:
                result = other(contender.script)
            else:
                result = command.solved(arguments.out, SCENE, contender.settings, contender.ranks, contender.before)
            if turn:
                found[contender.label].append(result)
                print(f"  {contender.label}: {result['status']}, {result.get('wall_s', 0):.1f} s", flush=True)
    rows = [row_of(contender, found[contender.label], reference) for contender in chosen]
    write_whole(arguments.out / "speed_error.csv", to_csv(rows))
    text = f"{machine}\n\n{known}\n\n{markdown(rows)}"
    write_whole(arguments.out / "speed_error.md", text)
    draw(arguments.out / "speed_error.png", rows)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
