"""Build the container image and check that what the README says of it holds: `make container-check`.

    python tools/container_check.py [--tests none|quick|all] [--work DIR]

Runs what the image runs by itself; then, as a user id that has no name, Figure 2 on two ranks and a figure, both into a
folder of the caller's; compares every number with a run outside; runs the tests inside, as root. Exit status 1 if
anything does not hold.
"""

from __future__ import annotations

import argparse
import csv
import math
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from engines import IMAGE, ROOT, Engine, engine_at_hand
from PIL import Image

UID, GID = 43210, 54321  # in no /etc/passwd
# The same Gmsh script becomes another mesh on another Debian, of equally many triangles: a few numbers differ like
# those of two such meshes, most, integrals above all, far less. What describes the mesh itself is not compared.
TOLERANCE, TOLERANCE_OF_HALF, OF_THE_MESH = 1e-3, 1e-8, "mesh_quality."
FIGURE_2 = "mpirun -n 2 python -m cellmech.study studies/fig2.toml --out /results/fig2"
# Runs the steps as the foreign user; says how many forms had to be compiled, and what is left in shared memory.
AS_ANYBODY = f"""
set -e
forms() {{ ls "$XDG_CACHE_HOME/cellmech" | grep -c '\\.so$'; }}
before=$(forms)
{FIGURE_2}
echo "compiled: $(($(forms) - before))"
python -m cellmech.study --list >/dev/null
python -m cellmech.study --out /results/alone --only yeoh --set mesh.size_um=6 time.rtol=1e-2
python -m cellmech.plots fig3 --results /results/fig2 --out /results/figures
echo "left in shared memory: $(find /dev/shm -user "$(id -u)" | wc -l)"
"""
NOISE = re.compile("warn|unable|cannot|not a |failed", re.IGNORECASE)
TESTS = {"quick": ["-m", "not slow and not by_hand and not mpi"], "all": []}


class Checks:
    """What was checked, said as it is done."""

    def __init__(self) -> None:
        self.failed: list[str] = []

    def expect(self, holds: bool, claim: str, otherwise: str = "") -> None:
        """Note whether a claim holds; if not, `otherwise` says more."""
        print(
            f"{'holds' if holds else 'FAILS'}: {claim}" + (f"\n{otherwise}" if otherwise and not holds else ""),
            flush=True,
        )
        self.failed += [claim] * (not holds)

    @contextmanager
    def timed(self, what: str) -> Iterator[None]:
        """Say how long something took."""
        print(f"-- {what}", flush=True)
        start = time.monotonic()
        yield
        print(f"   {what}: {time.monotonic() - start:.0f} s", flush=True)


def check_default(checks: Checks, engine: Engine) -> None:
    """The image by itself, as root, nothing mounted."""
    with checks.timed(f"run {IMAGE}"):
        done = engine.run()
    solved = done.returncode == 0 and "fig2: 4 of 4 cases solved" in done.stdout
    checks.expect(solved, "the image by itself solves the main job", done.stdout)


def check_anybody(checks: Checks, engine: Engine, results: Path) -> None:
    """A user id without a name, two ranks, a folder of the caller's."""
    shutil.rmtree(results, ignore_errors=True)
    results.mkdir(parents=True)
    user, group = (UID, GID) if os.geteuid() == 0 else (os.getuid(), os.getgid())
    os.chown(results, user, group)
    with checks.timed(f"as user {user}:{group}: {FIGURE_2}"):
        done = engine.run("bash", "-c", AS_ANYBODY, results=results, user=f"{user}:{group}")
    checks.expect(done.returncode == 0, "any user id runs studies, with mpirun and without, and draws", done.stdout)
    checks.expect("compiled: 0" in done.stdout, "the forms of the main job are in the image", done.stdout)
    checks.expect("left in shared memory: 0" in done.stdout, "nothing is left in shared memory", done.stdout)
    noise = [line for line in done.stdout.splitlines() if NOISE.search(line)]
    checks.expect(not noise, "nobody warns of anything", "\n".join(noise))
    files = [path for path in results.rglob("*") if path.is_file()]
    foreign = [path for path in files if (path.stat().st_uid, path.stat().st_gid) != (user, group)]
    checks.expect(len(files) > 20 and not foreign, f"all {len(files)} files are the caller's", f"not: {foreign}")
    picture = results / "figures" / "fig3.png"
    colours = Image.open(picture).convert("RGB").getcolors(1 << 24) if picture.exists() else []
    checks.expect(len(colours or []) > 100, f"Figure 3, drawn without a display, has {len(colours or [])} colours")


def check_numbers(checks: Checks, inside: Path, outside: Path) -> None:
    """Every number of Figure 2, inside and outside the container."""
    with checks.timed("compare numbers"):
        rows = [list(csv.DictReader(open(folder / "summary.csv"))) for folder in (inside, outside)]
        differences = sorted(_differences(*rows), reverse=True)
    worst, middle = differences[0][0], differences[len(differences) // 2][0]
    for difference, what in differences[:5]:
        print(f"   {difference:.1e} {what}")
    close = sum(d < 1e-5 for d, _ in differences)
    print(f"   {close} of {len(differences)} within 1e-5")
    claim = f"half agree with those outside to {middle:.1e} ({_digits(middle)} digits; {TOLERANCE_OF_HALF:g} allowed)"
    checks.expect(middle <= TOLERANCE_OF_HALF, claim)
    claim = f"all agree with those outside to {worst:.1e} ({_digits(worst)} digits; {TOLERANCE:g} allowed)"
    checks.expect(len(differences) > 800 and worst <= TOLERANCE, claim)


def _differences(ours: list[dict[str, str]], theirs: list[dict[str, str]]) -> Iterator[tuple[float, str]]:
    """Relative difference of every number of the summaries, 1 where a text differs; with its name and both."""
    for a, b in zip(ours, theirs, strict=True):
        for key in a.keys() | b.keys():
            if key.startswith(OF_THE_MESH):
                continue
            x, y = a.get(key, "missing"), b.get(key, "missing")
            try:
                p, q = float(x), float(y)
                difference = abs(p - q) / max(abs(p), abs(q)) if p != q else 0.0
            except ValueError:
                if x == y:
                    continue
                difference = 1.0
            yield difference, f"{a['case']}: {key}: {x} inside, {y} outside"


def _digits(difference: float) -> int:
    return math.floor(-math.log10(max(difference, 1e-16)))


def check_tests(checks: Checks, engine: Engine, arguments: list[str]) -> None:
    """The project's tests inside the image, which brings the program but not the tools to test it."""
    with checks.timed("tests inside"):
        done = engine.run("bash", "-c", 'tools/setup.sh && python -m pytest -q "$@"', "tests", *arguments)
    print("\n".join(done.stdout.splitlines()[-3:]))
    checks.expect(done.returncode == 0, "the tests pass inside", done.stdout)


def solve_outside(results: Path) -> None:
    """Figure 2 with this machine's own DOLFINx; what is solved is not solved again."""
    command = ["mpirun", "-n", "2", sys.executable, "-m", "cellmech.study", "studies/fig2.toml", "--out", results]
    subprocess.run(command, cwd=ROOT, check=True)


def main() -> int:
    """The command line; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=ROOT / "results" / "container", metavar="DIR")
    parser.add_argument("--tests", choices=("none", *TESTS), default="quick", help="which run inside; %(default)s")
    options = parser.parse_args()
    work, checks = options.work.resolve(), Checks()
    engine = engine_at_hand(work)
    print(f"container-check: with {engine.program}", flush=True)
    with checks.timed("build"):
        engine.build()
    print(f"   the image has {engine.size() / 1e9:.1f} GB")
    check_default(checks, engine)
    check_anybody(checks, engine, work / "inside")
    solve_outside(work / "outside" / "fig2")
    check_numbers(checks, work / "inside" / "fig2", work / "outside" / "fig2")
    if options.tests != "none":
        check_tests(checks, engine, TESTS[options.tests])
    print("\n".join(["container-check: FAILED", *checks.failed]) if checks.failed else "container-check: all holds")
    return int(bool(checks.failed))


if __name__ == "__main__":
    sys.exit(main())
