"""Kill a sweep at random moments, let it go on each time, and compare it with one that was left alone.

    .venv/bin/python benchmarks/kill_sweep.py studies/fig4.toml --kills 10 --set mesh.size_um=2 time.rtol=1e-2

The interrupted sweep begins with an empty compiler cache, and the first kill comes in the middle of a compilation.
Prints one line per kill; exit status 0 if summary.csv and every history.csv are byte for byte those of the other sweep.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path


def descendants(pid: int) -> list[int]:
    """The processes that a process has started, and those that these have, from /proc."""
    parents = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except OSError:
                continue  # it has just ended
    found = [pid]
    for parent in found:
        found += [child for child, its in parents.items() if its == parent]
    return found[1:]


def kill_all(process: subprocess.Popen[bytes]) -> None:
    """SIGKILL to a process and everything below it."""
    for pid in (*descendants(process.pid), process.pid):
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue
    process.wait()


class Sweep:
    """A study on two ranks, with its own results folder and compiler cache."""

    def __init__(self, arguments: list[str], out: Path, cache: Path | None) -> None:
        launcher = ["mpirun", "-n", "2", sys.executable, "-m", "cellmech.study"]
        self.command = [*launcher, *arguments, "--out", str(out), "--quiet", "--no-pictures"]
        self.environment: Mapping[str, str] = {**os.environ, **({"XDG_CACHE_HOME": str(cache)} if cache else {})}
        self.out, self.cache = out, cache

    def start(self) -> subprocess.Popen[bytes]:
        """Start it, or let it go on."""
        return subprocess.Popen(self.command, env=self.environment, stdin=subprocess.DEVNULL)

    def finish(self) -> float:
        """Let it go on to its end; how long that took [s]."""
        begun = time.monotonic()
        if self.start().wait() != 0:
            raise SystemExit(f"{self.out}: the sweep did not end well")
        return time.monotonic() - begun

    def compiling(self) -> bool:
        """Whether a compilation is under way."""
        sources = (self.cache / "cellmech").glob("libffcx_*.c") if self.cache else ()
        return any(not source.with_suffix(".c.cached").exists() for source in sources)

    def kill_when(self, moment: Callable[[], bool]) -> str:
        """Start it and kill it at that moment; what it had done by then."""
        process = self.start()
        while not moment() and process.poll() is None:
            time.sleep(0.005)
        ended, compiling = process.poll() is not None, self.compiling()
        kill_all(process)
        done, half = (len(list(self.out.glob(f"*/{name}"))) for name in ("result.json", "checkpoint.npz"))
        state = "had ended" if ended else "killed while compiling" if compiling else "killed"
        return f"{state}; {done} cases done, {half} with a checkpoint"


def differences(whole: Path, parts: Path) -> list[str]:
    """The tables in which two results folders differ."""
    names = sorted(
        path.relative_to(whole) for pattern in ("summary.csv", "*/history.csv") for path in whole.glob(pattern)
    )
    return [str(name) for name in names if (whole / name).read_bytes() != (parts / name).read_bytes()]


def main() -> int:
    """The command line; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study")
    parser.add_argument("--kills", type=int, default=10, metavar="N")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    arguments = [options.study, *(["--set", *options.set] if options.set else [])]
    place = Path(tempfile.mkdtemp(prefix="kill-sweep-"))
    chance = random.Random(options.seed)
    try:
        whole, parts = (
            Sweep(arguments, place / "whole" / "study", None),
            Sweep(arguments, place / "parts" / "study", place / "cache"),
        )
        alone = whole.finish()
        print(f"left alone: {alone:.1f} s", flush=True)
        print(f"kill 1, at the first compilation: {parts.kill_when(parts.compiling)}", flush=True)
        at_last = parts.kill_when(lambda: any(parts.out.glob("*/checkpoint.npz")))
        print(f"kill 2, at the first checkpoint, all compiled anew: {at_last}", flush=True)
        for k in range(3, options.kills + 1):
            delay = chance.uniform(1.0, 3.0 + 2 * alone / options.kills)
            due = time.monotonic() + delay
            print(
                f"kill {k}, after {delay:.1f} s: {parts.kill_when(lambda due=due: time.monotonic() > due)}", flush=True
            )
        print(f"let go on to the end: {parts.finish():.1f} s", flush=True)
        differ = differences(whole.out, parts.out)
        print(f"DIFFERENT: {', '.join(differ)}" if differ else "summary.csv and all histories are equal, byte for byte")
        return 1 if differ else 0
    finally:
        shutil.rmtree(place)


if __name__ == "__main__":
    sys.exit(main())
