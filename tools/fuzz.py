"""Hostile input: thousands of mutated files through `--check`, and hundreds of odd but valid scenes solved.

    python tools/fuzz.py [--checks 10000] [--programs 200] [--mpi 12] [--solves 300] [--seed 1] [--out results/fuzz]

`tests/hostile.py` makes the files and says how the command line must answer. Each file is alone in a folder of its own,
in which nothing else may change, and nothing above it; a worker process of limited memory answers for many files, so
that a crash or a hang costs one worker. What is wrong is kept in OUT/wrong/<number>, with the command that shows it.

Exit status: 0 nothing wrong; 1 something is.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
from hostile import Attempt, attempts, wrong  # noqa: E402
from odd_scenes import scenes, wrong_solve  # noqa: E402

MEMORY = 6 * 2**30  # bytes of address space of a worker: --check of the largest mesh allowed takes 4
CHECK_S, SOLVE_S, GRACE_S = 60.0, 60.0, 20.0
WORKER = [sys.executable, str(ROOT / "tools" / "fuzz_worker.py"), str(MEMORY)]
STUDY = [sys.executable, "-m", "cellmech.study"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
RANK = 'python=$0; "$python" -m cellmech.study "$@"; echo "status $?"'  # mpirun tells the first rank's only


class Worker:
    """A process that does one command line after the other."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[bytes] | None = None

    def ask(self, folder: Path, arguments: list[str], limit_s: float) -> dict[str, Any]:
        """The answer to a command line: status, out, err; of one that crashes or hangs, status None and why."""
        if self.process is None or self.process.poll() is not None:
            self.process = subprocess.Popen(WORKER, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=ENVIRONMENT)
        assert self.process.stdin and self.process.stdout
        self.process.stdin.write(json.dumps([str(folder), arguments]).encode() + b"\n")
        self.process.stdin.flush()
        if select.select([self.process.stdout], [], [], limit_s)[0]:
            line = self.process.stdout.readline()
            if line:
                return dict(json.loads(line))
            return {"status": None, "out": "", "err": f"the process ended with {self.process.wait()}"}
        self.process.send_signal(signal.SIGTERM)
        if select.select([self.process.stdout], [], [], GRACE_S)[0] and (line := self.process.stdout.readline()):
            return dict(json.loads(line)) | {"stopped": True}
        self.process.kill()
        self.process.wait()
        return {"status": None, "out": "", "err": f"no answer within {limit_s:g} s, and SIGTERM does not end it"}

    def close(self) -> None:
        """No more questions."""
        if self.process is not None and self.process.stdin:
            self.process.stdin.close()
            self.process.wait()


def program(command: list[str], folder: Path, limit_s: float = CHECK_S) -> dict[str, Any]:
    """The answer of a program of its own."""
    try:
        done = subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, timeout=limit_s)
    except subprocess.TimeoutExpired:
        return {"status": None, "out": "", "err": f"no answer within {limit_s:g} s"}
    out, err = (text.decode("utf-8", errors="surrogateescape") for text in (done.stdout, done.stderr))
    return {"status": done.returncode, "out": out, "err": err}


def under_mpi(arguments: list[str], folder: Path) -> dict[str, Any]:
    """The answer of two ranks: their common status, and what they say together."""
    answer = program(["mpirun", "-n", "2", "sh", "-c", RANK, sys.executable, *arguments], folder)
    if answer["status"] == 0:
        statuses = re.findall(r"^status (\d+)$", answer["out"], re.MULTILINE)
        answer["out"] = re.sub(r"^status \d+\n", "", answer["out"], flags=re.MULTILINE)
        answer["status"] = int(statuses[0]) if len(statuses) == 2 and statuses[0] == statuses[1] else f"{statuses}"
    return answer


def listing(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of change of all that is in a folder."""
    return {
        os.path.join(base, name): (found.st_size, found.st_mtime_ns)
        for base, folders, files in os.walk(folder)
        for name in (*folders, *files)
        if (found := os.lstat(os.path.join(base, name)))
    }


class Campaign:
    """Attempts made, outcomes counted, what is wrong kept."""

    def __init__(self, out: Path) -> None:
        self.out, self.worker, self.base = out, Worker(), Path(tempfile.mkdtemp(prefix="cellmech-fuzz-"))
        self.counts: dict[str, Counter[str]] = {}
        self.wrong: list[dict[str, Any]] = []
        self.slowest: dict[str, tuple[float, tuple[str, ...]]] = {}
        shutil.rmtree(out / "wrong", ignore_errors=True)
        (out / "wrong").mkdir(parents=True)

    def close(self) -> None:
        """End the worker and remove the folders."""
        self.worker.close()
        shutil.rmtree(self.base)

    def count(self, table: str, what: str) -> None:
        """One more of these."""
        counts = self.counts.setdefault(table, Counter())
        counts[what] += 1
        if table in ("check", "solve") and counts.total() % (500 if table == "check" else 50) == 0:
            print(f"{table}: {counts.total()} done", flush=True)

    def time(self, table: str, seconds: float, attempt: Attempt) -> None:
        """Remember the slowest."""
        self.slowest[table] = max(self.slowest.get(table, (0.0, ())), (seconds, attempt.changes))

    def folder(self, attempt: Attempt) -> Path:
        """A fresh folder with the file and what an earlier run may have left, in one that must not change either."""
        folder = self.base / "above" / "here"
        shutil.rmtree(self.base / "above", ignore_errors=True)
        earlier = folder / "results" / Path(attempt.name).stem / "my"
        earlier.mkdir(parents=True)
        (earlier / "result.json").write_text("precious")
        (folder / os.fsencode(attempt.name).decode("utf-8", "surrogateescape")).write_bytes(attempt.content)
        return folder

    def check(self, attempt: Attempt, table: str, ask: Callable[[list[str], Path], dict[str, Any]]) -> None:
        """One file through `--check`."""
        try:
            folder = self.folder(attempt)
        except (OSError, ValueError):  # no file can have this name
            self.count(table, "not made")
            return
        before, begun = listing(folder.parent), time.monotonic()
        arguments = [attempt.name, "--check", *attempt.arguments]
        answer = ask(arguments, folder)
        self.time(table, time.monotonic() - begun, attempt)
        fault = "no end" if answer.get("stopped") else wrong(answer["status"], answer["out"], answer["err"], attempt)
        if not fault and listing(folder.parent) != before:
            fault = "a file was written, changed or removed"
        outcome = {0: "valid", 2: "refused"}.get(answer["status"], "?")
        self.count(table, fault or outcome)
        for change in set(attempt.changes):
            self.count("changes", f"{change}: {'wrong' if fault else outcome}")
        if not fault and outcome == "refused":
            self.count("rules", rule_of(answer["err"]))
        if fault:
            self.keep(fault, attempt, arguments, answer)

    def solve(self, attempt: Attempt) -> None:
        """One valid scene, solved."""
        folder, begun = self.folder(attempt), time.monotonic()
        before = listing(folder.parent)
        arguments = [attempt.name, "--out", "out", "--quiet"]
        answer = self.worker.ask(folder, arguments, SOLVE_S)
        self.time("solve", time.monotonic() - begun, attempt)
        fault, outcome = wrong_solve(answer, folder / "out" / "my")
        after = {path: found for path, found in listing(folder.parent).items() if not path.startswith(f"{folder}/out")}
        after[str(folder)] = before[str(folder)]  # it holds the new folder
        if not fault and after != before:
            fault = "a file outside the results was written, changed or removed"
        self.count("solve", fault or outcome)
        if fault:
            self.keep(fault, attempt, arguments, answer)

    def keep(self, fault: str, attempt: Attempt, arguments: list[str], answer: dict[str, Any]) -> None:
        """What shows a fault again."""
        place = self.out / "wrong" / f"{len(self.wrong) + 1:04}"
        place.mkdir()
        (place / "my.toml").write_bytes(attempt.content)
        kept = {"fault": fault, "arguments": arguments, "changes": attempt.changes, **answer}
        self.wrong.append(kept)
        (place / "answer.json").write_text(json.dumps(kept, indent=1))
        print(f"{place}: {fault}: {answer['err'][-300:]}", flush=True)

    def report(self) -> str:
        """Counts as Markdown; as JSON beside it."""
        lines = ["# Hostile input\n"]
        for table, counts in self.counts.items():
            seconds, changes = self.slowest.get(table, (0.0, ()))
            slowest = f" (slowest {seconds:.1f} s: {', '.join(changes)})" if seconds else ""
            lines += [f"\n## {table}: {counts.total()}{slowest}\n", "| outcome | files |", "|---|---|"]
            lines += [f"| {what} | {count} |" for what, count in counts.most_common()]
        text = "\n".join(lines) + "\n"
        (self.out / "fuzz.md").write_text(text, encoding="utf-8", errors="backslashreplace")
        content = {"counts": self.counts, "slowest_s": self.slowest, "wrong": self.wrong}
        (self.out / "fuzz.json").write_text(json.dumps(content, indent=1))
        return text


def rule_of(message: str) -> str:
    """The rule in a message, without what differs from file to file."""
    text = message.strip().removeprefix("cellmech: error: ").split("; got ")[0]
    rule = next((part for part in text.split(": ")[1:] if " " in part), text)
    return re.sub(r"[-+]?\d[\d.,e+-]*", "#", re.sub(r"'[^']*'|\([^)]*\)", "…", rule))[:70].replace("|", "/")


def many(number: int, start: int, strategy: Any, act: Callable[[Attempt], None]) -> None:
    """Draw so many attempts and make them."""
    if not number:
        return

    @seed(start)
    @settings(
        max_examples=number,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def go(attempt: Attempt) -> None:
        act(attempt)

    go()


def main() -> int:
    """The campaign; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, default in (("checks", 10_000), ("programs", 200), ("mpi", 12), ("solves", 300), ("seed", 1)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--out", type=Path, default=Path("results/fuzz"))
    options = parser.parse_args()
    campaign, start = Campaign(options.out.absolute()), options.seed
    worker = campaign.worker

    def in_worker(arguments: list[str], folder: Path) -> dict[str, Any]:
        return worker.ask(folder, arguments, CHECK_S)

    def alone(arguments: list[str], folder: Path) -> dict[str, Any]:
        return program([*STUDY, *arguments], folder)

    try:
        many(options.checks, start, attempts(), lambda one: campaign.check(one, "check", in_worker))
        many(options.programs, start + 1, attempts(), lambda one: campaign.check(one, "check, a program each", alone))
        many(options.mpi, start + 2, attempts(), lambda one: campaign.check(one, "check, on two ranks", under_mpi))
        many(options.solves, start + 3, scenes(), campaign.solve)
    finally:
        print(campaign.report())
        campaign.close()
    return int(bool(campaign.wrong))


if __name__ == "__main__":
    sys.exit(main())
