"""Readings of the paper: sets of choices that change its inputs, tried on every row that it prints numbers of.

A reading is settings of a scene. The rows' own studies are solved with them, and scored by how far the numbers are from
the print. Where a reading leaves the fluid time to matter, whole histories are computed, also beyond the loss of
ellipticity, as the paper's program must have done.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cellmech import Scene
from cellmech.scene import put, read_scene
from studies.paper.misfit import LOST, log_ratio
from studies.paper.numbers import OUTLINES, Number, all_numbers, judged
from studies.paper.ours import STUDIES, Ours, Slot, read_ours
from studies.paper.places import MAXIMA, all_places, extremes
from studies.paper.printed import PLACES, TABLES, Paper, PrintedRow
from studies.paper.study_files import study_text

COARSE = {"mesh.order": 2, "mesh.size_um": 0.85, "mesh.grading": "uniform", "mesh.fade_rings": 0}
"""A mesh like the paper's: second order, 0.3 to 1 µm, which knows nothing of layers; maxima are at its nodes."""
FINE = {"mesh.order": 3, "mesh.size_um": 3.4, "mesh.grading": "fitted", "mesh.fade_rings": 2}
"""A mesh that resolves smeared layers: maxima of the neo-Hookean cell within 0.1 % of those on one twice as fine."""
FACTOR = 1 / 19.3  # of every modulus, by which the printed strains of most rows are met
LIMITS = {"5 %": math.log(1.05), "20 %": math.log(1.2), "a factor 2": math.log(2.0)}
ROUGH = {"time.rtol": 0.01, "time.history": True, "stability": "warn"}


@dataclass(frozen=True)
class Reading:
    """One set of choices.

    Args:
        name: of its folder.
        text: what is changed, for people.
        settings: of every scene, by dotted key.
    """

    name: str
    text: str
    settings: Mapping[str, Any] = field(default_factory=dict)

    def overrides(self) -> list[str]:
        """As the command line takes them."""
        return [f"{key}={_toml(value)}" for key, value in (ROUGH | dict(self.settings)).items()]


def _toml(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _smeared(width_um: float) -> dict[str, Any]:
    return {"cell.layers": "smeared", "cell.smear_um": width_um}


def _fitted(softer: float, width_um: float) -> dict[str, Any]:
    """What a fit to all figures at once ends at."""
    return {"cell.young_factor": float(f"{1 / softer:.4g}"), "cell.smear_um": width_um}


def _readings() -> tuple[Reading, ...]:
    coarse = COARSE | _smeared(0.3)
    soft = coarse | {"cell.young_factor": FACTOR}
    slow = soft | {"cell.fluid_lambda_Pa_s": 1e4}
    plane = slow | {"cell.trace": "in-plane", "cell.beta_over_mu": 0.1}
    twice = plane | {"cell.solid_exponent": 2.0, "cell.young_factor": 0.1}
    power = coarse | {"cell.solid_exponent": 1 + math.log(1 / FACTOR, 2), "cell.fluid_lambda_Pa_s": 1e4}
    best = twice | {"cell.fluid_lambda_Pa_s": 6e3}
    printed_contact = {"contact.form": "volume-printed", "contact.volume_width_um": 0.3}
    variants: tuple[tuple[str, str, dict[str, Any]], ...] = (
        ("smeared-0.1", "smeared 0.1 µm", _smeared(0.1)),
        ("smeared-0.2", "smeared 0.2 µm", _smeared(0.2)),
        ("smeared-0.6", "smeared 0.6 µm", _smeared(0.6)),
        ("smeared-1", "smeared 1 µm", _smeared(1.0)),
        ("inside", "fades inside the interfaces", {"cell.fade": "inside"}),
        ("outside", "fades outside the interfaces", {"cell.fade": "outside"}),
        ("squared", "fades in squared distance", {"cell.fade": "squared"}),
        ("lambda-printed", "λ as printed", {"cell.lame_lambda": "printed"}),
        ("half-width-5", "pillar half-width 5 µm", {"pillar.0.half_width_um": 5.0}),
        ("volume-printed", "contact as printed, width 0.3 µm", printed_contact),
        ("resolved", "resolved mesh", FINE),
    )
    return (
        Reading("printed", "as printed, resolved mesh"),
        Reading("printed-smeared", "as printed, smeared 0.3 µm, the paper's coarse mesh", coarse),
        Reading("load", "the same, load × 19.3", coarse | {"load.factor": 1 / FACTOR}),
        Reading("soft", "moduli / 19.3, smeared 0.3 µm, coarse mesh", soft),
        Reading("soft-resolved", "the same, resolved mesh", soft | FINE),
        Reading("power", "c_s^5.3 for the factor, λ_f × 10", power),
        Reading("slow", "moduli / 19.3, λ_f × 10", slow),
        Reading("beta", "the same, β = 0.1 µ", slow | {"cell.beta_over_mu": 0.1}),
        Reading("in-plane", "the same, tr C of eqs 19 and 20 in the plane", plane),
        Reading("in-plane-printed", "the same, eq. 20 without its − 3", plane | {"cell.yeoh_reference": "printed"}),
        Reading(
            "in-plane-5",
            "moduli / 19.3, tr C in the plane, β = 0.1 µ, λ_f × 5",
            plane | {"cell.fluid_lambda_Pa_s": 5e3},
        ),
        Reading("in-plane-3", "the same, λ_f × 3", plane | {"cell.fluid_lambda_Pa_s": 3e3}),
        Reading(
            "twice-6",
            "moduli / 10, c_s twice, tr C in the plane, β = 0.1 µ, λ_f × 6",
            best,
        ),
        Reading("on-all", "moduli / 22.5, smeared 0.18 µm, else as in-plane", plane | _fitted(22.5, 0.18)),
        Reading("on-all-twice", "moduli / 12.1, smeared 0.27 µm, else the best reading", best | _fitted(12.1, 0.27)),
        Reading("twice-5", "the same, λ_f × 5", twice | {"cell.fluid_lambda_Pa_s": 5e3}),
        Reading("twice", "the same, λ_f × 3", twice | {"cell.fluid_lambda_Pa_s": 3e3}),
        *(Reading(f"best-{name}", f"the best reading, but {text}", best | change) for name, text, change in variants),
    )


READINGS = _readings()
EFFECTIVE = "twice-6"  # the one that fits best
RESOLVED = {"soft": "soft-resolved", EFFECTIVE: "best-resolved"}
"""Reading on the paper's mesh -> the same on one that resolves it."""


def named(name: str) -> Reading:
    """The reading of that name."""
    return next(one for one in READINGS if one.name == name)


@dataclass(frozen=True)
class Score:
    """How far a reading is from the print.

    Args:
        reading: which one.
        numbers: each printed number beside ours, misprints left out; of a shape index the nearest of three.
        places: how many extremes are where the paper has them, and of how many; None when runs are missing.
    """

    reading: Reading
    numbers: Sequence[Number]
    places: tuple[int, int] | None = None

    def of(self, tables: Iterable[str] = TABLES, shares: bool = False) -> list[Number]:
        """Those of some tables: maxima and shape indices, or shares."""
        return [n for n in self.numbers if n.table in tables and n.quantity.startswith("share_") == shares]

    def logs(self, tables: Iterable[str] = TABLES, shapes: bool = True) -> list[float]:
        """Of ours over printed, with or without shape indices; `LOST` where there is no number of ours."""
        found = [n.score for n in self.of(tables) if shapes or n.quantity != "SI"]
        return [LOST if math.isnan(ratio) else log_ratio(ratio) for ratio in found]

    def order_of_laws(self) -> int:
        """For how many of sigma, J1, J2, J3 the four laws come in the printed order."""
        same = 0
        for quantity in MAXIMA:
            rows = [n for n in self.of(("fig2",)) if n.quantity == quantity]
            same += sorted(rows, key=lambda n: n.theirs) == sorted(rows, key=_ours)
        return same

    def shares_within(self, percent: float) -> int:
        """How many printed shares are met within so many of their per cents."""
        return sum(abs(n.ours - n.theirs) <= percent + n.uncertainty for n in self.of(shares=True))


def _ours(number: Number) -> float:
    return -math.inf if math.isnan(number.ours) else number.ours


def misfits(logs: Sequence[float]) -> tuple[float, float]:
    """Root mean square and median of |ln ratio|."""
    return math.sqrt(statistics.fmean(log**2 for log in logs)), statistics.median(map(abs, logs))


def within(logs: Sequence[float]) -> list[int]:
    """How many ratios are within each of `LIMITS`."""
    return [sum(abs(log) <= limit for log in logs) for limit in LIMITS.values()]


def rows_of(paper: Paper) -> dict[str, list[str]]:
    """Table -> names of the study's cases that the paper prints numbers of."""
    from cellmech.scene import load_study

    studies = {table: load_study(STUDIES / f"{table}.toml").cases for table in TABLES}
    planned = Ours({table: tuple(Slot(c.name, c.scene, (), None) for c in cases) for table, cases in studies.items()})
    names = {table: [planned.at(row).name for row in paper.table(table).values()] for table in TABLES}
    return {table: list(dict.fromkeys(of)) for table, of in names.items()}


def solve(reading: Reading, paper: Paper, out: Path, tables: Sequence[str] = TABLES, everything: bool = False) -> None:
    """Solve what the paper prints numbers of, or all runs of these tables, into a folder a table. Collective.

    Raises:
        SystemExit: with the study's status, when it was stopped or refused.
    """
    from cellmech.runs import main

    for table, names in rows_of(paper).items():
        if table not in tables:
            continue
        chosen = [] if everything else [word for name in names for word in ("--only", name)]
        words = [
            str(STUDIES / f"{table}.toml"),
            "--out",
            str(out / reading.name / table),
            "--quiet",
            "--no-pictures",
            *chosen,
        ]
        status = main([*words, "--set", *reading.overrides()])
        if status not in (0, 1):  # that some cases have no solution is part of what a reading says
            raise SystemExit(status)


def score(reading: Reading, paper: Paper, out: Path) -> Score:
    """Compare what has been solved with the print.

    Raises:
        InputError: when there is no result.
    """
    ours = read_ours(out / reading.name)
    numbers = all_numbers(paper, ours)
    kept = [n for n in judged(numbers) if n.quantity != "SI" or n.note or _lost_outline(n)]
    whole = all(slot.case for of in ours.slots.values() for slot in of)
    return Score(reading, kept, extremes(all_places(paper, ours, numbers)) if whole else None)


def _lost_outline(number: Number) -> bool:
    """Whether a shape index, which stands there once for each outline, has no solution, and is the first of them."""
    return math.isnan(number.ours) and number.key == f"shape_index.{next(iter(OUTLINES))}"


def effective_study(reading: Reading, paper: Paper) -> str:
    """The study of a reading: its settings, and a case for each row that the paper prints numbers of."""
    head, cases = HEAD.format(text=reading.text, name=reading.name), effective_cases(paper)
    return study_text(
        "The paper's rows in the reading that fits them best", head, cases, ROUGH | dict(reading.settings)
    )


def effective_cases(paper: Paper) -> dict[str, dict[str, Any]]:
    """Name of each printed row -> what sets its scene apart from Table 1's; a row printed twice once."""
    found: dict[str, dict[str, Any]] = {}
    scenes: list[Scene] = []
    for row in paper.rows:
        settings = row_settings(row)
        data: dict[str, Any] = {}
        for key, value in settings.items():
            put(data, key, value, row.name)
        if (scene := read_scene(data, row.name)) not in scenes:
            scenes.append(scene)
            found[f"{row.table} {row.name}"] = settings
    return found


def row_settings(row: PrintedRow) -> dict[str, Any]:
    """What sets a printed row's scene apart from Table 1's, by dotted key."""
    settings: dict[str, Any] = {}
    if row.table in ("fig2", "table3"):
        settings["cell.law"] = row.name if row.table == "fig2" else "saint-venant"
    if row.table == "table3":
        settings["time.end_s"] = 24000.0
    return settings | {f"layer.{PLACES[key][0]}.{PLACES[key][1]}": value for key, value in row.place.items()}


HEAD = """The rows of the paper that have printed numbers; not with its inputs, but in the reading that comes nearest:
{text},
layers smeared over ± 0.3 µm on a coarse mesh of second order.
Written by "python -m studies.paper effective-study" from the reading "{name}". The inputs as printed are in fig2,
fig4, fig6 and fig7: this study stands beside them, not in their place.

What it must show
- docs/paper.md has its numbers beside the printed ones, and what speaks against it.
- Its largest values are those at the nodes of a coarse mesh, as the paper's may be. On a resolved one J3 is near rest.
- Saint-Venant's rows are beyond the loss of ellipticity, and marked so: they depend on the mesh.
"""
