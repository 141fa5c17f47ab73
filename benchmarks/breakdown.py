"""Where the time of one run goes, of the package and of the plain script.

Table 1, neo-Hookean, in this process with warm forms (everything is run twice, the second time counts). The parts are
exclusive of each other: MUMPS's by PETSc's own events, the others by timers around the functions that do them. "Rest"
is what no timer covers: start of Python and imports excluded, Python between the parts included.

    python benchmarks/breakdown.py [--out results/breakdown]

Writes breakdown.csv and breakdown.md.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PARTS = ("mesh", "forms", "residual", "Jacobian", "factorise", "solve", "det F", "observables", "output")
EVENTS = {"MatLUFactorSym": "factorise", "MatLUFactorNum": "factorise", "MatSolve": "solve"}
RUNS = ("plain", "plain, quadrature by UFL", "history", "end state")


class Stopwatch:
    """Exclusive times of nested parts [s]."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = dict.fromkeys(PARTS, 0.0)
        self._inner = [0.0]

    def wrap(self, owner: Any, name: str, part: str) -> None:
        """Time a function wherever it is looked up in `owner`."""
        inner: Callable[..., Any] = getattr(owner, name)

        def timed(*args: Any, **words: Any) -> Any:
            started = time.perf_counter()
            self._inner.append(0.0)
            try:
                return inner(*args, **words)
            finally:
                whole = time.perf_counter() - started
                self.spent[part] += whole - self._inner.pop()
                self._inner[-1] += whole

        setattr(owner, name, timed)


def watched() -> Stopwatch:
    """Timers around DOLFINx's assembly and compilation."""
    import dolfinx
    import dolfinx.fem.petsc

    watch = Stopwatch()
    watch.wrap(dolfinx.cpp.fem, "assemble_vector", "residual")
    watch.wrap(dolfinx.cpp.fem.petsc, "assemble_matrix", "Jacobian")
    watch.wrap(dolfinx.jit, "ffcx_jit", "forms")
    return watch


def plain(watch: Stopwatch, numbers: dict[str, Any]) -> Callable[[], dict[str, Any]]:
    """The plain script, ready to run."""
    import plain as script

    watch.wrap(script, "half_disc", "mesh")
    watch.wrap(script, "report", "observables")
    return lambda: script.solve(0.25, numbers)


def package(watch: Stopwatch, out: Path, *settings: str) -> Callable[[], dict[str, Any]]:
    """The package's command line, ready to run."""
    from cellmech.cell import setup
    from cellmech.cell.observables import Observer
    from cellmech.runs import case, study
    from cellmech.solver.det_f import DetFWatch

    watch.wrap(setup, "build_domain", "mesh")
    watch.wrap(Observer, "observe", "observables")
    watch.wrap(Observer, "__init__", "observables")
    watch.wrap(case, "write_fields", "output")
    watch.wrap(case.checkpoint, "save", "output")
    watch.wrap(DetFWatch, "admissible", "det F")
    out.mkdir(parents=True, exist_ok=True)
    (out / "scene.toml").write_text('title = "Table 1, neo-Hookean"\n')
    words = [str(out / "scene.toml"), "--out", str(out / "run"), "--fresh", "--quiet", "--no-pictures"]
    words += [word for setting in settings for word in ("--set", setting)]

    def solve() -> dict[str, Any]:
        if study.main(words) != 0:
            raise SystemExit("the run failed")
        return dict(json.loads((out / "run" / "scene" / "result.json").read_text()))

    return solve


def profiled(name: str, out: Path) -> dict[str, Any]:
    """One row: seconds by part of the second of two runs in this process."""
    from petsc4py import PETSc

    PETSc.Log.begin()
    watch = watched()
    if name.startswith("plain"):
        run = plain(watch, {"degree": None} if "UFL" in name else {})
    else:
        run = package(watch, out, *(["time.history=false"] if name == "end state" else []))
    run()
    before = {event: PETSc.Log.Event(event).getPerfInfo()["time"] for event in EVENTS}
    watch.spent = dict.fromkeys(PARTS, 0.0)
    started = time.perf_counter()
    result = run()
    whole = time.perf_counter() - started
    for event, part in EVENTS.items():
        watch.spent[part] += PETSc.Log.Event(event).getPerfInfo()["time"] - before[event]
    newton = result.get("newton_iterations", result.get("newton"))
    counts = {"unknowns": result.get("dofs", result.get("unknowns")), "iterations": newton}
    counts["factorisations"] = result.get("factorisations", newton)
    parts = {part: round(seconds, 3) for part, seconds in watch.spent.items()}
    rest = round(whole - sum(watch.spent.values()), 3)
    return {"run": name, **counts, **parts, "rest": rest, "whole": round(whole, 3)}


def main() -> int:
    """Profile each run in a process of its own; print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/breakdown"))
    parser.add_argument("--only", choices=RUNS, help="this run, in this process, as JSON")
    arguments = parser.parse_args()
    if arguments.only:
        print(json.dumps(profiled(arguments.only, arguments.out)))
        return 0
    from cellmech.results.records import to_csv, write_whole

    rows = []
    for name in RUNS:
        words = [sys.executable, __file__, "--only", name, "--out", str(arguments.out)]
        done = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True)
        rows.append(json.loads(done.stdout.splitlines()[-1]))
    lines = [["s", *RUNS], ["---"] + ["---:"] * len(RUNS)]
    lines += [[key, *(str(row[key]) for row in rows)] for key in rows[0] if key != "run"]
    text = "".join(f"| {' | '.join(line)} |\n" for line in lines)
    arguments.out.mkdir(parents=True, exist_ok=True)
    write_whole(arguments.out / "breakdown.csv", to_csv(rows))
    write_whole(arguments.out / "breakdown.md", text)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
