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
import csv
import shutil
import sys
import tempfile
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tools")]
from campaign_checks import Fault, history_is_balanced, judge, read_history  # noqa: E402
from campaign_runs import Record, Runner  # noqa: E402
from campaign_scenes import Draw, draw  # noqa: E402
from campaign_twins import changed_digits, differences, same_mesh, twin_of  # noqa: E402
from campaign_verdicts import rounding, strain, verdict  # noqa: E402
from hostile import dumped  # noqa: E402

from cellmech.causes import Cause  # noqa: E402

TWIN, RANKS, END_STATE = 1e-6, 1e-5, 1e-3  # by how much two runs of one scene may differ
OTHER_MESH = 0.05  # the same where Gmsh makes another mesh of the scaled geometry
ROUNDED = 0.05  # the same where the program says that round-off keeps forces out of balance: it then decides steps
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
    cause: str
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
        limit_s: processor time for one solve [s].
    """

    def __init__(self, out: Path, seed: int, limit_s: float) -> None:
        self.out, self.seed, self.runner, self.lock = out, seed, Runner(limit_s), threading.Lock()
        self.rows: dict[int, Row] = {}
        self.base = Path(tempfile.mkdtemp(prefix="cellmech-campaign-"))
        shutil.rmtree(out / "faults", ignore_errors=True)
        (out / "faults").mkdir(parents=True)

    def close(self) -> None:
        """End the workers and remove the folders."""
        self.runner.close()
        shutil.rmtree(self.base, ignore_errors=True)

    def one(self, number: int) -> None:
        """Draw, solve and judge a scene."""
        drawn, begun = draw(self.seed, number), time.monotonic()
        folder = self.base / f"{number:04}"
        result = self.runner.solve(folder / "first", drawn.data)
        case, scene = folder / "first" / "out" / "my", drawn.scene
        faults = judge(scene, case) if result["status"] in ("solved", "failed") else []
        if result["status"] == "timeout":
            faults = list(history_is_balanced(scene, read_history(case / "history.csv")))
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

    def _row(self, drawn: Draw, result: Record, faults: list[Fault], seconds: float) -> Row:
        status, reason, scene = result["status"], result.get("reason", ""), drawn.scene
        if status == "solved":
            outcome = SILENT if faults else BALANCED
        elif status == "failed":
            outcome = WRONG_STATE if faults else verdict(scene, Cause.named(result["cause"]))
        else:
            outcome = status
        moduli = [layer["young_Pa"] for layer in drawn.data["layer"].values()]
        return Row(
            index=drawn.number,
            outcome=outcome,
            faults="; ".join(f"{fault.check}: {fault.text}" for fault in faults[:4]),
            status=status,
            reason=reason,
            cause=result.get("cause", ""),
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

    def again(self, drawn: Draw, folder: Path, result: Record) -> list[str]:
        """What differs when a scene is solved a second time in another way."""
        place, data = folder / drawn.extra.replace(" ", "-"), drawn.data
        tolerance: float | None
        stress = length = 1.0
        if drawn.extra == "killed":
            other, tolerance = self.runner.killed(place, data), None
        elif drawn.extra == "ranks":
            other, tolerance = self.runner.on_two_ranks(place, data), RANKS
        elif drawn.extra == "end state":
            if not comes_to_rest(drawn):
                return []
            without = {**data, "time": {**data["time"], "history": False}}
            other, tolerance = self.runner.solve(place, without), END_STATE
        else:
            found = twin_of(drawn)
            if found is None:
                return []
            data, stress, length = found
            other = self.runner.solve(place, data)
            tolerance = TWIN if same_mesh(result, other) else OTHER_MESH
        if other["status"] != "solved":
            return [f"{other['status']}: {other['reason'][:150]}"]
        if tolerance is None:
            return list(changed_digits(result, other))
        if "round-off" in result["model"]["warnings"]:
            tolerance = max(tolerance, ROUNDED)
        return list(differences(result, other, tolerance, stress, length))

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


def comes_to_rest(drawn: Draw) -> bool:
    """Whether a scene's history ends in the state that its load alone leads to."""
    scene = drawn.scene
    rest = scene.time.end_s - scene.ramp_end_s
    return bool(scene.time.history) and not scene.cell.inertia and rest > AT_REST * scene.relaxation_s


def report(rows: list[Row], seed: int) -> str:
    """Counts, verdicts by kind, and what is wrong, as Markdown."""
    lines = [f"# Campaign: {len(rows)} scenes, seed {seed}\n", "| outcome | scenes |", "|---|---|"]
    lines += [f"| {name} | {count} |" for name, count in Counter(row.outcome for row in rows).most_common()]
    lines += ["\n| check that does not hold | scenes |", "|---|---|"]
    checks = Counter(name for row in rows for name in {part.split(": ")[0] for part in row.faults.split("; ") if part})
    lines += [f"| {name} | {count} |" for name, count in checks.most_common()]
    lines += ["\n| verdict | outcome | scenes |", "|---|---|---|"]
    kinds = Counter((row.cause, row.outcome) for row in rows if row.status != "solved")
    lines += [f"| {kind} | {outcome} | {count} |" for (kind, outcome), count in kinds.most_common()]
    lines += ["\n## What is wrong\n"]
    for row in rows:
        if row.outcome not in GOOD:
            told = row.faults or row.reason
            lines.append(f"- `{row.index:04}.toml` {row.outcome}: {told} [{row.seconds:g} s; {row.shape}, {row.tags}]")
    return "\n".join(lines) + "\n"


def main() -> int:
    """The campaign; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000, help="number of scenes")
    parser.add_argument("--seed", type=int, default=1, help="of the scenes")
    parser.add_argument("--only", type=int, nargs="+", metavar="INDEX", help="these scenes only")
    parser.add_argument("--jobs", type=int, default=2, help="scenes solved at a time")
    parser.add_argument("--limit", type=float, default=60.0, help="processor time for one solve [s]")
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
    sys.exit(main())
