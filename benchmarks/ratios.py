"""Whether the package has become slower: its cost over the plain script's, beside the stored ratios.

Processor times of whole processes with warm forms, medians of interleaved runs, over those of the plain script
(`plain.py`, 0.25 µm, whose numbers of the nucleus are within 0.81 %) in the same minutes: a faster machine or a busy
one moves both. The package is measured with its defaults, which are within 0.042 % there, and with the mesh that is
about as good as the script's (4.2 µm, within 0.20 %). Iterations and factorisations stand beside them, since they do
not depend on the machine at all. The sweep is Figure 6's 25 cases, a whole command. Two ranks speed it up as much as
two cores are twice one: its efficiency is half that speed-up; over the one of plain scripts, two side by side against
one after the other, it is free of what shared caches and a shared physical core take.

    python benchmarks/ratios.py [--repeat 3] [--store]

Exit status 1 if a number is beyond its stored value by more than the tolerance. `--store` writes what was found as the
new stored values, into `ratios.toml` beside this file.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable
from pathlib import Path

import command
import tomli_w

HERE = Path(__file__).parent
STORED = HERE / "ratios.toml"
SCENE = 'title = "Table 1, neo-Hookean"\n'
END = "time.history=false"
SWEEP = HERE.parent / "studies" / "fig6.toml"
PLAIN = [sys.executable, str(HERE / "plain.py"), "0.25"]
PLAIN_COUNT = "plain script, newton iterations and factorisations"
EFFICIENCY, SPEED_UP = "sweep, efficiency of two ranks", "sweep, speed-up by two ranks over that of two plain scripts"
TOLERANCE = 0.2  # of a stored value; what quiet repetitions differ by is a third of it


def plain() -> tuple[float, int]:
    """Processor time of the plain script [s], and its iterations."""
    done, seconds = command.timed(PLAIN)
    if done.returncode != 0:
        raise SystemExit(f"the plain script failed: {done.stderr.strip()}")
    return seconds, json.loads(done.stdout.splitlines()[-1])["newton"]


def side_by_side() -> float:
    """How many plain scripts two at once do in the time of one alone: 2 if they do not disturb each other."""

    def wall(count: int) -> float:
        started = time.perf_counter()
        running = [subprocess.Popen(PLAIN, stdout=subprocess.DEVNULL, env=command.ONE_THREAD) for _ in range(count)]
        if any([process.wait() for process in running]):
            raise SystemExit("the plain script failed")
        return time.perf_counter() - started

    return 2 * wall(1) / wall(2)


def package(out: Path, *settings: str) -> dict[str, float]:
    """Processor time, iterations and factorisations of the package on Table 1."""
    result = command.solved(out, SCENE, settings)
    if result["status"] != "solved":
        raise SystemExit(f"cellmech {' '.join(settings)}: {result['reason']}")
    return {key: result[key] for key in ("processor_s", "newton_iterations", "factorisations")}


def sweep(out: Path, ranks: int) -> tuple[float, float]:
    """Processor time and wall time of Figure 6's cases [s]."""
    words = [
        sys.executable,
        "-m",
        "cellmech.study",
        str(SWEEP),
        "--out",
        str(out),
        "--fresh",
        "--quiet",
        "--no-pictures",
    ]
    started = time.perf_counter()
    done, seconds = command.timed(["mpirun", "-n", str(ranks), *words])
    if done.returncode != 0:
        raise SystemExit(f"{SWEEP.name} on {ranks} ranks: {done.stderr.strip()}")
    return seconds, time.perf_counter() - started


def measured(out: Path, repeat: int) -> dict[str, float]:
    """Medians over interleaved repetitions; the first one compiles and does not count."""
    runs: dict[str, Callable[[], dict[str, float]]] = {
        "start and one coarse state": lambda: package(out, END, "mesh.size_um=8"),
        "end state": lambda: package(out, END),
        "whole history": lambda: package(out),
        "whole history at the script's error": lambda: package(out, "mesh.size_um=4.2"),
    }
    found: dict[str, list[float]] = {}
    for turn in range(repeat + 1):
        base, newton = plain()
        now: dict[str, float] = {PLAIN_COUNT: newton}
        for name, run in runs.items():
            numbers = run()
            now[f"{name}, over the plain script"] = numbers.pop("processor_s") / base
            now |= {f"{name}, {key.replace('_', ' ')}": value for key, value in numbers.items()}
        (alone, wall), (_, shared) = sweep(out / "sweep", 1), sweep(out / "sweep", 2)
        now |= {"sweep of 25, over the plain script": alone / base, EFFICIENCY: wall / shared / 2}
        now[SPEED_UP] = wall / shared / side_by_side()
        if turn:
            for name, value in now.items():
                found.setdefault(name, []).append(value)
    return {name: round(statistics.median(values), 3) for name, values in found.items()}


def judged(now: dict[str, float], stored: dict[str, float]) -> tuple[str, bool]:
    """The table as Markdown, and whether anything has become worse by more than the tolerance."""
    lines = ["| | now | stored | now / stored | |", "|---|---:|---:|---:|---|"]
    worse = False
    for name, value in now.items():
        if name not in stored:
            raise SystemExit(f"{STORED.name} lacks {name!r}: run with --store")
        ratio = value / stored[name]
        loss = 1 / ratio if name in (EFFICIENCY, SPEED_UP) else ratio
        verdict = "slower" if loss > 1 + TOLERANCE else "faster" if loss < 1 / (1 + TOLERANCE) else ""
        worse |= verdict == "slower"
        lines.append(f"| {name} | {value:g} | {stored[name]:g} | {ratio:.2f} | {verdict} |")
    return "\n".join(lines), worse


def main() -> int:
    """Run, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--store", action="store_true", help="write what is found as the new stored values")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        now = measured(Path(folder), arguments.repeat)
    if arguments.store:
        STORED.write_text("# Written by ratios.py --store; what each means is said there.\n" + tomli_w.dumps(now))
    text, worse = judged(now, tomllib.loads(STORED.read_text()))
    print(text)
    return int(worse)


if __name__ == "__main__":
    sys.exit(main())
