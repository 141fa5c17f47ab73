"""The page: figures, comparison, audit, run statistics and provenance in one HTML file that needs nothing else."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from cellmech import InputError
from cellmech.figures import (
    TONES,
    Runs,
    Shown,
    Tile,
    duration,
    embed,
    environment,
    markdown_html,
    runs_of,
    significant,
    verdict,
)
from studies.paper.comparison import HOW, Comparison
from studies.paper.ours import Slot
from studies.paper.places import TABLE_NAMES
from studies.paper.views import bars, extremes, lanes, matrices, ticks

FIGURES = {  # stem -> what it is, what it must show
    "fig1": ("The cell at rest on its micropillar", "Four layers: membrane, cytosol, lamina, nucleoplasm."),
    "fig2": (
        "Four material laws: stress and strain in the nucleus over time",
        "Flat curves once the ramp is over at 10,000 s. The paper's values are marked where its text gives them.",
    ),
    "fig3": (
        "Four material laws: the cell at 18,000 s",
        "The cell at rest on the pillar, its weight carried by contact.",
    ),
    "fig4": (
        "Fluid fractions of lamina and nucleoplasm",
        "All 25 combinations. Print and ours: where each is largest; the paper found no solution at 0.9, 0.9, so the "
        "tables below look for ours among the other 24.",
    ),
    "fig5": (
        "The cell at the largest strains of the two sweeps",
        "a: fluid fractions 0.7 and 0.9. b: moduli 1000 and 10 Pa.",
    ),
    "fig6": ("Young's moduli of lamina and nucleoplasm", "All 25 combinations. Print and ours: where each is largest."),
    "fig7": (
        "S1, S2, S3 at 24,000 s",
        "A nucleus softened step by step. S1 must be the Saint-Venant cell of Figure 3: nothing moves after the ramp.",
    ),
}
AUDIT = ("audit.md", "calibration.md")
STUDIES = {"fig2": "four laws", "fig4": "fluid fractions", "fig6": "moduli", "table3": "S1, S2, S3 (Figure 7, Table 3)"}


@dataclass(frozen=True)
class Article:
    """A text with its parts, each with a title."""

    head: Markup
    parts: Sequence[tuple[str, Markup]]


def report_html(results: Path, comparison: Comparison) -> str:
    """The page.

    Args:
        results: the folder with the studies, and with the pictures in `figures`.
        comparison: of these results.

    Raises:
        InputError: for a picture or an audit that cannot be read.
    """
    pictures, runs = results / "figures", [*map(_runs, comparison.ours.slots.items())]
    chart, length = bars(comparison.rows)
    return (
        environment(Path(__file__).parent)
        .get_template("report.html.j2")
        .render(
            figures=[_shown(pictures, stem) for stem in FIGURES],
            further=_further(pictures, audit=False),
            tiles=tiles(comparison, runs),
            reading=comparison.reading(),
            faults=comparison.ours.unsolved(),
            lanes=lanes(comparison),
            ticks=ticks(),
            tables=TABLE_NAMES,
            matrices=matrices(comparison),
            extremes=extremes(comparison.places),
            verdict=verdict,
            tones=TONES,
            how=HOW,
            sections=comparison.sections(),
            bars=chart,
            bar_ticks=[(100 * pa / length, pa) for pa in range(0, int(length) + 1, max(1, round(length / 8)))],
            articles=_articles(pictures),
            audit_figures=_further(pictures, audit=True),
            runs=runs,
            total=_total(runs),
            provenance=comparison.provenance(),
        )
    )


def tiles(comparison: Comparison, runs: Sequence[Runs]) -> list[Tile]:
    """The numbers to remember."""
    total = _total(runs)
    slot = comparison.ours.find("fig4", "", comparison.paper.not_converged)
    (same, known), (bad, rows) = comparison.extremes(), comparison.impossible()
    return [
        Tile(f"{total.solved} of {total.cases}", "simulations solved", total.solved == total.cases),
        Tile(slot.status, "the one case the paper could not solve", slot.status == "solved"),
        Tile(f"{total.newton:,}", "Newton iterations"),
        Tile(duration(total.wall_s), "solving time, all cases added up"),
        Tile(f"× {significant(comparison.median_ratio('sigma'), 2)}", "typical stress, ours over printed"),
        Tile(f"× {significant(comparison.median_ratio('J1'), 2)}", "typical strain J1 − 2, ours over printed"),
        Tile(f"{same} of {known}", "largest and smallest values where the paper has them"),
        Tile(f"{bad} of {rows}", "printed rows that no load can produce with the printed moduli"),
    ]


def _runs(item: tuple[str, Sequence[Slot]]) -> Runs:
    table, slots = item
    return runs_of(STUDIES[table], len(slots), [slot.case for slot in slots if slot.case is not None])


def _total(runs: Sequence[Runs]) -> Runs:
    cases, solved, steps, newton = (
        sum(getattr(run, name) for run in runs) for name in ("cases", "solved", "steps", "newton")
    )
    return Runs("all", cases, solved, steps, newton, sum(run.wall_s for run in runs), "")


def _shown(folder: Path, stem: str) -> Shown:
    title, text = FIGURES[stem]
    return Shown(stem, f"Figure {stem.removeprefix('fig')}", title, text, embed(folder / f"{stem}.png"))


def _further(folder: Path, audit: bool) -> list[Shown]:
    """Pictures beside those of the paper: the audit's, or all others."""
    paths = sorted(path for path in folder.glob("*.png") if path.stem not in FIGURES and not path.name.startswith("."))
    of = [path for path in paths if path.stem.startswith("audit") is audit]
    return [Shown(path.stem, path.stem.replace("_", " ").replace("-", " "), "", "", embed(path)) for path in of]


def _articles(folder: Path) -> list[Article]:
    """The words and tables of the audit, then those of the fits, as far as they are there."""
    try:
        texts = [path.read_text(encoding="utf-8") for name in AUDIT if (path := folder / name).is_file()]
    except (OSError, ValueError) as error:
        raise InputError(str(folder), "audit", f"cannot be read ({error})") from None
    return [*map(_article, texts)]


def _article(text: str) -> Article:
    head, *parts = re.split(r"^## ", text, flags=re.MULTILINE)
    titled = (part.partition("\n") for part in parts)
    return Article(markdown_html(head), [(title, markdown_html(body)) for title, _, body in titled])
