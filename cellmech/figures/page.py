"""A study's results as one HTML page that needs nothing else: cases, numbers, failures, pictures, comparison."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from cellmech.figures.comparison import Comparison
from cellmech.figures.embedded import Picture, embed
from cellmech.figures.results import StudyResult, differing
from cellmech.figures.section import NONE, TONES, Row, Section, signal
from cellmech.figures.style import QUANTITIES, provenance
from cellmech.results.result import Result

COLUMNS = {f"nucleus.{q.key}_max{q.suffix}": (f"σ_Mises [{q.unit}]" if q.unit else q.key, q.key) for q in QUANTITIES}
COLUMNS |= {"contact.max_depth_um": ("penetration [µm]", "")}
FORCES = {"contact.force_Pa_x_um": True, "contact.force_pN": False}  # and whether they are those of a plane
COLUMNS |= {key: (f"force [{'Pa µm' if plane else 'pN'}]", "") for key, plane in FORCES.items()}
PICTURES = (".png", ".gif")
MOST_VARIED = 6  # keys that set the cases apart and are shown


@dataclass(frozen=True)
class Shown:
    """A figure of a page; without a picture it is said to be missing."""

    stem: str
    name: str
    title: str
    text: str
    picture: Picture | None


@dataclass(frozen=True)
class Tile:
    """A number to remember."""

    value: str
    label: str
    good: bool | None = None


@dataclass(frozen=True)
class Runs:
    """The cost of some cases."""

    name: str
    cases: int
    solved: int
    steps: int
    newton: int
    wall_s: float
    cells: str


@dataclass(frozen=True)
class Failed:
    """A case without a solution: why, and what to do about it."""

    case: str
    reason: str
    advice: str


def report(study: StudyResult, comparison: Comparison | None = None) -> str:
    """The page of a study's results, whatever the study; nothing is solved.

    Args:
        study: its cases, `read_all`.
        comparison: of these results with reference numbers, to be shown too.

    Raises:
        InputError: for a picture that cannot be read.
    """
    places = study.folder, study.folder / "figures"
    runs = runs_of("all", len(study.cases), study.cases.values())
    return (
        environment()
        .get_template("report.html.j2")
        .render(
            title=study.folder.resolve().name,
            tiles=_tiles(runs),
            failed=[Failed(name, case.failure, case.cause.advice) for name, case in study.cases.items() if case.cause],
            doubts=[f"{name}: {text}" for name, case in study.cases.items() for text in _warnings(case)],
            numbers=number_section(study),
            shown=[_shown(path) for place in places for path in sorted(place.glob("[!.]*")) if path.suffix in PICTURES],
            comparison=comparison,
            tones=TONES,
            runs=[runs],
            provenance=[provenance(study)],
        )
    )


def environment(*folders: Path) -> Environment:
    """The templates of these folders and of this one, with `pretty` and `duration` as filters."""
    found = Environment(
        loader=FileSystemLoader([*folders, Path(__file__).parent]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters["pretty"] = pretty
    found.filters["duration"] = duration
    return found


def number_section(study: StudyResult) -> Section:
    """The cases with what sets them apart and their largest values at the end."""
    cases = study.cases.items()
    scenes = differing(study.cases)
    varied = list(next(iter(scenes.values()), {}))
    planes = {case.scene.cell.geometry == "plane" for case in study.cases.values()}
    columns = {key: of for key, of in COLUMNS.items() if key not in FORCES or FORCES[key] in planes}
    header = ("case", *varied[:MOST_VARIED], "status", *(label for label, _ in columns.values()))
    rows = []
    for name, case in cases:
        settings = scenes[name]
        values = {key: case.get(key) for key in columns}
        status = "failed" if case.failure else "solved"
        texts = [signal(values[key], case.rest(of), case.get(f"error.{key}")) for key, (_, of) in columns.items()]
        cells = (name, *(str(settings[key]) for key in varied[:MOST_VARIED]), status, *texts)
        rows.append(Row(cells, {"case": name, **settings, "status": status, **values}))
    more = f" {len(varied) - MOST_VARIED} more keys differ." if len(varied) > MOST_VARIED else ""
    return Section("cases", "Cases", f"Largest values in the nucleus at the end, and contact.{more}", header, rows)


def runs_of(name: str, planned: int, cases: Iterable[Result]) -> Runs:
    """The cost of cases; `planned` is the number that there should be."""
    there = list(cases)

    def total(key: str) -> float:
        return sum(value for case in there if math.isfinite(value := case.get(key)))

    cells = ", ".join(sorted({f"{case.get('mesh_cells'):,.0f}" for case in there}))
    solved = sum(not case.failure for case in there)
    return Runs(name, planned, solved, int(total("steps")), int(total("newton_iterations")), total("wall_s"), cells)


def _tiles(runs: Runs) -> list[Tile]:
    return [
        Tile(f"{runs.solved} of {runs.cases}", "cases solved", runs.solved == runs.cases),
        Tile(f"{runs.newton:,}", "Newton iterations"),
        Tile(duration(runs.wall_s), "solving time, all cases added up"),
    ]


def _warnings(case: Result) -> list[str]:
    return [str(text) for text in ((case.result.get("model") or {}).get("warnings") or {}).values()]


def _shown(path: Path) -> Shown:
    return Shown(path.stem, path.stem.replace("_", " ").replace("-", " "), "", "", embed(path))


def pretty(text: str) -> Markup:
    """Text with the indices of symbols set low (σ_Mises, c_f,l, E_np, J1, q0), and values kept in one line."""
    text = text.replace(" = ", "\u00a0=\u00a0").replace(" Pa", "\u00a0Pa")
    low = re.sub(r"\b([σcE])_([A-Za-z]+(?:,[a-z]+)?)", r"\1<sub>\2</sub>", str(escape(text)))
    return Markup(re.sub(r"\b([Jq])([0-3])(?![0-9A-Za-z_])", r"\1<sub>\2</sub>", low))


def duration(seconds: float) -> str:
    """A time for people."""
    if not math.isfinite(seconds):
        return NONE
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
