"""A thousand random scenes over all scales, solved and checked against statics: no state is wrong in silence.

    python tools/campaign.py [--count 1000] [--seed 1] [--only INDEX …] [--jobs 2] [--limit 60] [--out results/campaign]

Scene INDEX depends on it and the seed alone (`campaign_scenes`). Every saved state, every accepted step and every
failure is judged by what the scene says, not by the solver (`campaign_checks`, `campaign_verdicts`). Some scenes are
solved twice: scaled, killed and gone on with, on two ranks, as an end state alone; the two must agree.

OUT/campaign.csv has a row for each scene, OUT/faults.md the counts and what is wrong, OUT/faults/<INDEX>.toml the
scenes that show it, each with the files of its case.

Exit status: 0 nothing wrong; 1 something is.
"""

from __future__ import annotations

import argparse
import copy
import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tools")]
from campaign_checks import Fault, differences, judge  # noqa: E402
from campaign_scenes import Data, Draw, draw  # noqa: E402
from campaign_verdicts import rounding, strain, verdict  # noqa: E402
from fuzz import ENVIRONMENT, STUDY, Worker  # noqa: E402
from hostile import dumped  # noqa: E402

from cellmech.scene_file import read_scene  # noqa: E402

SCENES_A_WORKER = 40  # after which it is replaced: modules that it has loaded stay in its memory
TWIN, RANKS, END_STATE = 1e-6, 1e-5, 1e-3  # by how much two runs of one scene may differ
AT_REST = 30.0  # relaxation times after which a history has come to its end state
BALANCED, SILENT, WRONG_STATE = "solved-and-balanced", "SILENT ERROR", "failed, last state WRONG"
GOOD = (BALANCED, "verdict supported", "round-off named")


@dataclass
class Row:
    """A line of campaign.csv: what was asked, what came of it."""

    index: int
    outcome: str
    faults: str
    status: str
    reason: str
    seconds: float
    steps: int | None
    newton: int | None
    t_s: float | None
    extra: str
    tags: str
    shape: str
    law: str
    history: bool
    inertia: bool
    form: str
    radius_um: float
    load_factor: float
    least_young_Pa: float
    most_young_Pa: float
    pillars: int
    flat: bool
    end_s: float
    half_ramp_s: float
    strain: float
    rounding: float


class Campaign:
    """Scenes solved by workers, judged, counted.

    Args:
        out: folder of what is reported.
        seed: of the scenes.
        limit_s: time for one solve.
    """

    def __init__(self, out: Path, seed: int, limit_s: float) -> None:
        self.out, self.seed, self.limit_s, self.rows = out, seed, limit_s, dict[int, Row]()
        self.base, self.lock, self.local = Path(tempfile.mkdtemp(prefix="cellmech-campaign-")), threading.Lock(), threading.local()
        self.workers: list[Worker] = []
        shutil.rmtree(out / "faults", ignore_errors=True)
        (out / "faults").mkdir(parents=True)

    def close(self) -> None:
        """End the workers and remove the folders."""
        for worker in self.workers:
            worker.close()
        shutil.rmtree(self.base, ignore_errors=True)

    def _worker(self) -> Worker:
        """This thread's, a new one now and then."""
        done = getattr(self.local, "done", 0)
        if done % SCENES_A_WORKER == 0:
            if done:
                self.local.worker.close()
            self.local.worker = Worker()
            with self.lock:
                self.workers.append(self.local.worker)
        self.local.done = done + 1
        return self.local.worker

    def solve(self, folder: Path, data: Data) -> dict[str, Any]:
        """Solve a scene in a folder; the content of result.json, or a status that no result has, and why."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "my.toml").write_bytes(dumped(data))
        answer = self._worker().ask(folder, ["my.toml", "--out", "out", "--quiet"], self.limit_s)
        return self._outcome(folder, answer)

    def _outcome(self, folder: Path, answer: dict[str, Any]) -> dict[str, Any]:
        if answer.get("stopped") or "no answer within" in answer["err"]:
            return {"status": "timeout", "reason": f"no end within {self.limit_s:g} s"}
        path = folder / "out" / "my" / "result.json"
        if answer["status"] not in (0, 1) or not path.exists():
            return {"status": "crash", "reason": f"status {answer['status']}: {answer['err'][-300:]}"}
        return dict(json.loads(path.read_text(encoding="utf-8")))

    def one(self, number: int) -> None:
        """Draw, solve and judge a scene."""
        drawn, begun = draw(self.seed, number), time.monotonic()
        folder = self.base / f"{number:04}"
        result = self.solve(folder / "first", drawn.data)
        case, scene = folder / "first" / "out" / "my", drawn.scene
        faults = judge(scene, case) if result["status"] in ("solved", "failed") else []
        if result["status"] == "solved" and drawn.extra and not faults:
            faults += [Fault(drawn.extra, text) for text in self.again(drawn, folder, result)]
        row = self._row(drawn, result, faults, time.monotonic() - begun)
        with self.lock:
            self.rows[number] = row
            if row.outcome not in GOOD:
                self._keep(drawn, folder, row)
            print(f"{number:4} {row.outcome}: {row.faults or row.reason or '-'}"[:230], flush=True)
            if len(self.rows) % 20 == 0:
                self.write()
        shutil.rmtree(folder, ignore_errors=True)

    def _row(self, drawn: Draw, result: dict[str, Any], faults: list[Fault], seconds: float) -> Row:
        status, reason, scene = result["status"], result.get("reason", ""), drawn.scene
        if status == "solved":
            outcome = SILENT if faults else BALANCED
        elif status == "failed":
            outcome = WRONG_STATE if faults else verdict(scene, reason, result["t_s"])
        else:
            outcome = status
        moduli = [layer["young_Pa"] for layer in drawn.data["layer"].values()]
        return Row(
            index=drawn.number,
            outcome=outcome,
            faults="; ".join(f"{fault.check}: {fault.text}" for fault in faults[:4]),
            status=status,
            reason=reason,
            seconds=round(seconds, 1),
            steps=result.get("steps"),
            newton=result.get("newton_iterations"),
            t_s=result.get("t_s"),
            extra=drawn.extra,
            tags=", ".join(drawn.tags),
            shape=scene.cell.shape,
            law=scene.cell.law,
            history=bool(scene.time.history),
            inertia=scene.cell.inertia,
            form=scene.contact.form,
            radius_um=scene.radius_um,
            load_factor=scene.load.factor,
            least_young_Pa=min(moduli),
            most_young_Pa=max(moduli),
            pillars=len(scene.pillar),
            flat=scene.flat is not None,
            end_s=scene.time.end_s,
            half_ramp_s=scene.load.half_ramp_s,
            strain=strain(scene, scene.time.end_s),
            rounding=rounding(scene, scene.time.end_s),
        )

    def again(self, drawn: Draw, folder: Path, result: dict[str, Any]) -> list[str]:
        """What differs when a scene is solved a second time in another way."""
        if drawn.extra == "twin":
            return [text for name, twin in twins(drawn) for text in self._twin(folder, name, twin, result)]
        if drawn.extra == "end state":
            return self._end_state(drawn, folder, result)
        if drawn.extra == "killed":
            return self._killed(drawn, folder, result)
        return self._on_two_ranks(drawn, folder, result)

    def _twin(self, folder: Path, name: str, twin: tuple[Data, float, float], result: dict[str, Any]) -> list[str]:
        data, stress, length = twin
        other = self.solve(folder / name, data)
        if other["status"] != "solved":
            return [f"{name}: {other['status']}: {other['reason'][:120]}"]
        same_mesh = other["mesh_cells"] == result["mesh_cells"]
        tolerance = TWIN if same_mesh else 0.05
        return [f"{name}: {text}" for text in differences(result, other, tolerance, stress, length)]

    def _end_state(self, drawn: Draw, folder: Path, result: dict[str, Any]) -> list[str]:
        scene = drawn.scene
        at_rest = scene.time.end_s - scene.ramp_end_s > AT_REST * scene.relaxation_s
        if not scene.time.history or scene.cell.inertia or not at_rest:
            return []
        data = copy.deepcopy(drawn.data)
        data["time"]["history"] = False
        other = self.solve(folder / "end", data)
        if other["status"] != "solved":
            return [f"{other['status']}: {other['reason'][:150]}"]
        return list(differences(result, other, END_STATE))

    def _killed(self, drawn: Draw, folder: Path, result: dict[str, Any]) -> list[str]:
        """Killed as soon as there is a checkpoint, then gone on with: to the last digit."""
        place = folder / "killed"
        place.mkdir()
        (place / "my.toml").write_bytes(dumped(drawn.data))
        command = [*STUDY, "my.toml", "--out", "out", "--quiet"]
        process = subprocess.Popen(command, cwd=place, env=ENVIRONMENT, stderr=subprocess.DEVNULL)
        end = time.monotonic() + self.limit_s
        while process.poll() is None and time.monotonic() < end:
            if (place / "out" / "my" / "checkpoint.npz").exists():
                break
            time.sleep(0.01)
        process.kill()
        process.wait()
        other = self.solve(place, drawn.data)
        if other["status"] != "solved":
            return [f"{other['status']}: {other['reason'][:150]}"]
        return list(differences(result, other, 0.0))

    def _on_two_ranks(self, drawn: Draw, folder: Path, result: dict[str, Any]) -> list[str]:
        place = folder / "ranks"
        place.mkdir()
        (place / "my.toml").write_bytes(dumped(drawn.data))
        command = ["mpirun", "-n", "2", *STUDY, "my.toml", "--out", "out", "--quiet", "--ranks-per-case", "2"]
        try:
            done = subprocess.run(command, cwd=place, env=ENVIRONMENT, capture_output=True, timeout=2 * self.limit_s)
        except subprocess.TimeoutExpired:
            return ["no end"]
        err = done.stderr.decode(errors="replace")
        other = self._outcome(place, {"status": done.returncode, "err": err})
        if other["status"] != "solved":
            return [f"{other['status']}: {other['reason'][:150]}"]
        return list(differences(result, other, RANKS))

    def _keep(self, drawn: Draw, folder: Path, row: Row) -> None:
        """What shows a fault again."""
        place = self.out / "faults"
        (place / f"{drawn.number:04}.toml").write_bytes(dumped(drawn.data))
        shutil.rmtree(place / f"{drawn.number:04}", ignore_errors=True)
        if folder.exists():
            shutil.copytree(folder, place / f"{drawn.number:04}")

    def write(self) -> str:
        """campaign.csv and faults.md; the text of the latter."""
        rows = [self.rows[number] for number in sorted(self.rows)]
        with open(self.out / "campaign.csv", "w", encoding="utf-8", newline="") as stream:
            table = csv.DictWriter(stream, [field.name for field in fields(Row)], lineterminator="\n")
            table.writeheader()
            table.writerows(asdict(row) for row in rows)
        text = report(rows, self.seed)
        (self.out / "faults.md").write_text(text, encoding="utf-8")
        return text


def twins(drawn: Draw) -> list[tuple[str, tuple[Data, float, float]]]:
    """Scenes of equal strains: their tables, and by how much stresses and lengths are larger. Powers of two are exact."""
    if drawn.scene.cell.inertia:
        return []
    power = 2.0 ** (12 if drawn.number % 2 else -12)
    kind = ("stiffer", "larger", "slower")[drawn.number % 3]
    scale = {"stiffer": _stiffer, "larger": _larger, "slower": _slower}[kind]
    data = scale(copy.deepcopy(drawn.data), power if kind != "larger" else 2.0 ** (4 if power > 1 else -4))
    try:
        read_scene(copy.deepcopy(data), "twin")
    except Exception:  # beyond what a scene may say
        return []
    stress = power if kind == "stiffer" else 1.0
    length = 2.0 ** (4 if power > 1 else -4) if kind == "larger" else 1.0
    return [(kind, (data, stress, length))]


def _stiffer(data: Data, k: float) -> Data:
    for layer in data["layer"].values():
        layer["young_Pa"] *= k
    data["contact"]["penalty_Pa_per_um"] *= k
    data["load"]["factor"] *= k
    for key, default in (("fluid_lambda_Pa_s", 1000.0), ("fluid_mu_Pa_s", 5e-3)):
        data["cell"][key] = data["cell"].get(key, default) * k
    return data


def _larger(data: Data, k: float) -> Data:
    for layer in data["layer"].values():
        layer["outer_radius_um"] *= k
    for pillar in data["pillar"]:
        for key in ("x_um", "y_um", "half_width_um", "height_um"):
            pillar[key] *= k
    if data["flat"]:
        data["flat"]["y_um"] *= k
    for table, keys in {
        "cell": ("gap_um", "centre_x_um"),
        "contact": ("smoothing_um", "volume_width_um"),
        "mesh": ("size_um",),
    }.items():
        data[table] |= {key: data[table][key] * k for key in keys if key in data[table]}
    data["contact"]["penalty_Pa_per_um"] /= k
    data["load"]["factor"] /= k
    return data


def _slower(data: Data, k: float) -> Data:
    data["time"]["end_s"] *= k
    data["load"]["half_ramp_s"] *= k
    if "output" in data:
        data["output"]["times_s"] = [t * k for t in data["output"]["times_s"]]
    for key, default in (("fluid_lambda_Pa_s", 1000.0), ("fluid_mu_Pa_s", 5e-3)):
        data["cell"][key] = data["cell"].get(key, default) * k
    return data


def report(rows: list[Row], seed: int) -> str:
    """Counts, verdicts by kind, and what is wrong, as Markdown."""
    lines = [f"# Campaign: {len(rows)} scenes, seed {seed}\n", "| outcome | scenes |", "|---|---|"]
    lines += [f"| {name} | {count} |" for name, count in Counter(row.outcome for row in rows).most_common()]
    lines += ["\n| verdict | outcome | scenes |", "|---|---|---|"]
    kinds = Counter((_kind(row.reason), row.outcome) for row in rows if row.status != "solved")
    lines += [f"| {kind} | {outcome} | {count} |" for (kind, outcome), count in kinds.most_common()]
    lines += ["\n## What is wrong\n"]
    for row in rows:
        if row.outcome not in GOOD:
            told = row.faults or row.reason
            lines.append(f"- `{row.index:04}.toml` {row.outcome}: {told} [{row.seconds:g} s; {row.shape}, {row.tags}]")
    return "\n".join(lines) + "\n"


def _kind(reason: str) -> str:
    """The kind of a verdict: what is said before and after the colon, without numbers."""
    parts = reason.split(": ")
    if reason.startswith("no equilibrium beyond") and len(parts) > 1:
        return parts[1].split("(")[0].split(";")[0].strip()[:60].replace("30 ", "").replace("16 ", "")
    return reason.split(" at t =")[0].split(";")[0].split("(")[0][:60].strip()


def main() -> int:
    """The campaign; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000, help="number of scenes")
    parser.add_argument("--seed", type=int, default=1, help="of the scenes")
    parser.add_argument("--only", type=int, nargs="+", metavar="INDEX", help="these scenes only")
    parser.add_argument("--jobs", type=int, default=2, help="scenes solved at a time")
    parser.add_argument("--limit", type=float, default=60.0, help="time for one scene [s]")
    parser.add_argument("--out", type=Path, default=Path("results/campaign"))
    options = parser.parse_args()
    campaign = Campaign(options.out.absolute(), options.seed, options.limit)
    try:
        with ThreadPoolExecutor(options.jobs) as pool:
            list(pool.map(campaign.one, options.only or range(options.count)))
    finally:
        print(campaign.write())
        campaign.close()
    return int(any(row.outcome not in GOOD for row in campaign.rows.values()))


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    sys.exit(main())
