"""Mutants: does a named test turn red when the program is made wrong on purpose?

`tests/mutants.toml` lists small mistakes, each with the test that must see it. They are made one at a time in a copy of
the tree; the test, which has passed on the sound copy, must then fail. A mutant that survives is a hole in the tests.

    python tools/mutants.py [--only NAME ...] [--jobs 2]

Exit status: 0 every mutant killed; 1 one survives, ends otherwise than by a failed test, or does not apply; 2 the list
is wrong or a named test fails on the sound program.
"""

from __future__ import annotations

import argparse
import ast
import os
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

ROOT = Path(__file__).resolve().parents[1]
LIST = ROOT / "tests" / "mutants.toml"
KEYS = ("name", "breaks", "file", "old", "new", "test")
TESTS_FAILED = 1  # pytest's status; 2 to 5 say that no test was run
PATIENCE = 20, 120.0  # a mutant may take so many times as long as the sound program, and so many seconds more


@dataclass(frozen=True)
class Mutant:
    """One mistake.

    Args:
        name: for the table and for `--only`.
        breaks: what is wrong then, in words.
        file: path from the root.
        old, new: text of that file, which occurs in it once, and what it becomes.
        test: pytest node id of the test that must fail.
    """

    name: str
    breaks: str
    file: str
    old: str
    new: str
    test: str

    @contextmanager
    def applied(self, root: Path) -> Iterator[None]:
        """The tree at `root` has the mistake for a while."""
        path = root / self.file
        sound = path.read_text()
        path.write_text(sound.replace(self.old, self.new))
        try:
            yield
        finally:
            path.write_text(sound)


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant."""

    mutant: Mutant
    word: str
    seconds: float
    said: str = ""

    @property
    def good(self) -> bool:
        """Whether the named test has seen the mistake."""
        return self.word == "killed"


def read(path: Path = LIST) -> list[Mutant]:
    """The mutants of a list."""
    return [Mutant(**{key: entry[key] for key in KEYS}) for entry in tomllib.loads(path.read_text())["mutant"]]


def faults(mutants: Sequence[Mutant], root: Path = ROOT) -> list[str]:
    """Why mutants cannot be tried: a text that is not there once, a test that does not exist. Nothing is run."""
    found = [
        f"{m.name}: this name comes twice" for k, m in enumerate(mutants) if m.name in {n.name for n in mutants[:k]}
    ]
    for m in mutants:
        path = root / m.file
        count = path.read_text().count(m.old) if path.is_file() else 0
        if count != 1:
            found.append(f"{m.name}: the old text occurs {count} times in {m.file}, not once")
        if m.old == m.new:
            found.append(f"{m.name}: changes nothing")
        file, _, test = m.test.partition("::")
        if not test or test.partition("[")[0].rpartition("::")[2] not in _tests_of(root / file):
            found.append(f"{m.name}: there is no test {m.test}")
    return found


def _tests_of(path: Path) -> set[str]:
    if not path.is_file():
        return set()
    return {node.name for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)}


class Copy:
    """A copy of the tree, tracked files only, with the environment that tests in it run in.

    Args:
        path: folder to make.
        cache: stands in for the user's cache of compiled forms, which mutants would litter.
    """

    running: subprocess.Popen[str] | None

    def __init__(self, path: Path, cache: Path) -> None:
        self.path, self.running = path, None
        listed = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=ROOT, check=True, capture_output=True, text=True,
        ).stdout  # fmt: skip
        for name in filter(None, listed.split("\0")):
            if (ROOT / name).is_file():
                (path / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, path / name)
        # No byte code: it would outlive a change that leaves a file's size and second alone.
        self.environment = os.environ | {
            "PYTHONPATH": str(path),
            "PYTHONDONTWRITEBYTECODE": "1",
            "XDG_CACHE_HOME": str(cache),
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        where = self._run([sys.executable, "-c", "import cellmech; print(cellmech.__file__)"], 60).stdout.strip()
        if Path(where) != path / "cellmech" / "__init__.py":
            raise SystemExit(f"the copy in {path} would test the package at {where}")

    def _run(self, command: Sequence[str], seconds: float | None) -> subprocess.CompletedProcess[str]:
        options: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        with subprocess.Popen(
            command, cwd=self.path, env=self.environment, start_new_session=True, **options
        ) as self.running:
            try:
                out, err = self.running.communicate(timeout=seconds)
            except BaseException:
                self.stop()
                raise
        return subprocess.CompletedProcess(command, self.running.returncode, out, err)

    def stop(self) -> None:
        """End what runs here, with all that it has started."""
        if self.running is not None and self.running.poll() is None:
            os.killpg(self.running.pid, signal.SIGKILL)

    def pytest(self, test: str, seconds: float | None = None) -> subprocess.CompletedProcess[str]:
        """Run a test of the copy, up to the first failure.

        Raises:
            subprocess.TimeoutExpired: it takes longer than that [s].
        """
        options = ["-x", "-q", "--no-header", "--tb=short", "-p", "no:cacheprovider"]
        return self._run([sys.executable, "-m", "pytest", *options, test], seconds)


def try_out(mutant: Mutant, copy: Copy, sound_s: float) -> Verdict:
    """Make the mistake, run the test, undo the mistake."""
    started = time.perf_counter()
    with mutant.applied(copy.path):
        try:
            done = copy.pytest(mutant.test, PATIENCE[0] * sound_s + PATIENCE[1])
        except subprocess.TimeoutExpired:
            return Verdict(mutant, "NO END", time.perf_counter() - started)
    word = word_of(done.returncode, done.stdout)
    said = next((line[1:].strip() for line in done.stdout.splitlines() if line.startswith("E ")), "")
    return Verdict(mutant, word, time.perf_counter() - started, said)


def word_of(status: int, out: str) -> str:
    """What pytest's status and output say of a mutant. Without pytest, Python's status is 1, too."""
    if status == TESTS_FAILED and " failed" in out:
        return "killed"
    return "SURVIVES" if status == 0 else f"NO TEST RUN (status {status})"


def own_cache(path: Path) -> Path:
    """A cache folder that begins with the user's compiled forms, as links."""
    users = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "cellmech"
    (path / "cellmech").mkdir(parents=True)
    for file in users.glob("libffcx_*") if users.is_dir() else ():
        try:
            os.link(file, path / "cellmech" / file.name)
        except OSError:  # another file system
            shutil.copy2(file, path / "cellmech")
    return path


T = TypeVar("T")
R = TypeVar("R")


def shared(work: Callable[[T, Copy], R], items: Sequence[T], copies: Sequence[Copy]) -> Iterator[R]:
    """work(item, copy) for all items, in their order; as many at a time as there are copies."""
    free: queue.Queue[Copy] = queue.Queue()
    for copy in copies:
        free.put(copy)

    def one(item: T) -> R:
        copy = free.get()
        try:
            return work(item, copy)
        finally:
            free.put(copy)

    with ThreadPoolExecutor(len(copies)) as pool:
        try:
            yield from pool.map(one, items)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for copy in copies:
                copy.stop()
            raise


def time_of(test: str, copy: Copy) -> float:
    """Wall time of a test on the sound program [s].

    Raises:
        SystemExit: it fails there.
    """
    started = time.perf_counter()
    done = copy.pytest(test)
    if done.returncode:
        print(done.stdout, done.stderr, f"{test} does not pass on the sound program", sep="\n", file=sys.stderr)
        raise SystemExit(2)
    return time.perf_counter() - started


def report(verdicts: Iterable[Verdict], count: int) -> int:
    """Print each verdict as it comes, then the sum; the exit status."""
    good = 0
    for v in verdicts:
        good += v.good
        print(f"{v.word:9} {v.seconds:6.1f} s  {v.mutant.name}: {v.mutant.breaks}", flush=True)
        print(f"{'':19}{v.mutant.test}" + (f"\n{'':19}{v.said[:140]}" if v.said else ""), flush=True)
    print(f"{good} of {count} mutants killed")
    return 0 if good == count else 1


def main() -> int:
    """Try the mutants, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these mutants only")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="how many at a time")
    arguments = parser.parse_args()
    mutants = read()
    wrong = faults(mutants)
    wrong += [f"there is no mutant {name}" for name in arguments.only or () if name not in {m.name for m in mutants}]
    if wrong:
        print(*wrong, sep="\n", file=sys.stderr)
        return 2
    mutants = [m for m in mutants if not arguments.only or m.name in arguments.only]
    tests = sorted({m.test for m in mutants})
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends what it has started, leaves nothing behind
    with tempfile.TemporaryDirectory(prefix="cellmech-mutants-") as folder:
        cache = own_cache(Path(folder) / "cache")
        copies = [Copy(Path(folder) / f"copy-{k}", cache) for k in range(arguments.jobs)]
        print(f"{len(tests)} tests on the sound program", flush=True)
        times = dict(zip(tests, shared(time_of, tests, copies), strict=True))
        print(f"pass in {sum(times.values()):.0f} s; now {len(mutants)} mutants", flush=True)
        return report(shared(lambda m, copy: try_out(m, copy, times[m.test]), mutants, copies), len(mutants))


if __name__ == "__main__":
    sys.exit(main())
