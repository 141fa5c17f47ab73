"""How the campaign's scenes are run: by a worker, killed and gone on with, on two ranks."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import threading
import time
from pathlib import Path
from typing import Any

from campaign_scenes import Data
from fuzz import ENVIRONMENT, STUDY, Worker
from hostile import dumped

LOOK_S, PATIENCE = 0.5, 12.0  # between two looks at a worker's time [s]; how often its limit may pass on the clock
SCENES_A_WORKER = 40  # after which it is replaced: modules that it has loaded stay in its memory
Record = dict[str, Any]


class TimedWorker(Worker):
    """A worker whose limit is processor time, so that a busy machine changes no outcome."""

    def ask(self, folder: Path, arguments: list[str], limit_s: float) -> Record:
        """As `Worker.ask`; the clock may run `PATIENCE` times as long."""
        begun, ended, late = self._used(), threading.Event(), threading.Event()

        def watch() -> None:
            while not ended.wait(LOOK_S):
                if self._used() - begun > limit_s and self.process is not None:
                    late.set()
                    self.process.send_signal(signal.SIGTERM)
                    return

        watcher = threading.Thread(target=watch, daemon=True)
        watcher.start()
        try:
            answer = super().ask(folder, arguments, PATIENCE * limit_s)
        finally:
            ended.set()
            watcher.join()
        return answer | {"stopped": True} if late.is_set() else answer

    def _used(self) -> float:
        """Processor time of the process until now [s]."""
        try:
            assert self.process is not None
            numbers = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        except (AssertionError, OSError):
            return 0.0
        return (int(numbers[11]) + int(numbers[12])) / os.sysconf("SC_CLK_TCK")


class Runner:
    """Solves scenes in folders, each thread with a worker of its own.

    Args:
        limit_s: processor time for one solve [s].
    """

    def __init__(self, limit_s: float) -> None:
        self.limit_s, self.local, self.lock = limit_s, threading.local(), threading.Lock()
        self.workers: list[Worker] = []

    def close(self) -> None:
        """End the workers."""
        for worker in self.workers:
            worker.close()

    def _worker(self) -> Worker:
        """This thread's, a new one now and then."""
        done = getattr(self.local, "done", 0)
        if done % SCENES_A_WORKER == 0:
            if done:
                self.local.worker.close()
            self.local.worker = TimedWorker()
            with self.lock:
                self.workers.append(self.local.worker)
        self.local.done = done + 1
        return self.local.worker

    def solve(self, folder: Path, data: Data) -> Record:
        """Solve a scene in a folder; the content of result.json, or a status that no result has, and why."""
        self._write(folder, data)
        answer = self._worker().ask(folder, ["my.toml", "--out", "out", "--quiet", "--no-pictures"], self.limit_s)
        return self._outcome(folder, answer)

    def _outcome(self, folder: Path, answer: dict[str, Any]) -> Record:
        if answer.get("stopped") or "no answer within" in answer["err"]:
            return self._late()
        path = folder / "out" / "my" / "result.json"
        if answer["status"] not in (0, 1) or not path.exists():
            return {"status": "crash", "reason": f"status {answer['status']}: {answer['err'][-300:]}"}
        return dict(json.loads(path.read_text(encoding="utf-8")))

    def killed(self, folder: Path, data: Data) -> Record:
        """As `solve`, killed as soon as there is a checkpoint, then gone on with."""
        self._write(folder, data)
        command = [*STUDY, "my.toml", "--out", "out", "--quiet", "--no-pictures"]
        process = subprocess.Popen(command, cwd=folder, env=ENVIRONMENT, stderr=subprocess.DEVNULL)
        end = time.monotonic() + PATIENCE * self.limit_s
        while process.poll() is None and time.monotonic() < end:
            if (folder / "out" / "my" / "checkpoint.npz").exists():
                break
            time.sleep(0.01)
        process.kill()
        process.wait()
        return self.solve(folder, data)

    def on_two_ranks(self, folder: Path, data: Data) -> Record:
        """As `solve`, by two ranks that share the case."""
        self._write(folder, data)
        command = ["mpirun", "-n", "2", *STUDY, "my.toml", "--out", "out", "--quiet", "--ranks-per-case", "2"]
        limit_s = PATIENCE * self.limit_s
        try:
            done = subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, timeout=limit_s)
        except subprocess.TimeoutExpired:
            return self._late()
        err = done.stderr.decode(errors="replace")
        return self._outcome(folder, {"status": done.returncode, "err": err})

    def _late(self) -> Record:
        return {"status": "timeout", "reason": f"no end within {self.limit_s:g} s"}

    @staticmethod
    def _write(folder: Path, data: Data) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "my.toml").write_bytes(dumped(data))
