"""The study files of the audit, as this package writes them."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

from studies.paper.audit import Audit
from studies.paper.choices import MOST_RUNS, Trial, pairs, singles
from studies.paper.study_files import study_text

ROWS = "\n".join(
    [
        "Rows of the print it is about, the first part of a case's name:",
        "    saint-venant, neo-hookean, mooney-rivlin, yeoh   Figure 2, every choice",
        "    fluid    Figure 4, largest strains: fluid fractions 0.7 (lamina) and 0.9 (nucleoplasm)",
        "    stiff    Figure 6, smallest J1 and J2: 1500 Pa (lamina) and 90 Pa (nucleoplasm)",
        "    S2, S3   Table 3. S1 is saint-venant: the state is static after the ramp.",
    ]
)


def singles_text() -> str:
    """audit.toml."""
    head = f"""The audit, one choice at a time: what the paper leaves open or prints ambiguously, each tried alone.
Written by "python -m studies.paper audit-study". About ten seconds a case: 10 minutes on two cores. End states only.

{ROWS}

What it must show
- How far each choice moves the numbers of its row: audit.md orders the questions by that, and audit-pairs.toml
  joins those that moved most.
- Failures that are findings: Saint-Venant has no equilibrium from load.factor 5 on (saint-venant-limit.toml), and
  over the edge of a single pillar a cell slides off (edge-of-one), as contact is frictionless."""
    return study_text("Audit: one open choice at a time", head, _cases(singles()))


def pairs_text(audit: Audit) -> str:
    """audit-pairs.toml, for the order that the runs of one choice at a time have shown."""
    order = audit.order()
    found, total = pairs(order), len(pairs(order)) + len(singles())
    names = textwrap.fill(f"Questions in the order of how far they move the numbers: {', '.join(order)}.", 117)
    head = f"""The audit, two choices at a time: those that moved the numbers most alone (results of audit.toml).
Written by "python -m studies.paper audit-pairs". About 15 minutes on two cores. End states only.

{names}
Here: the first with every other, and the next two with each other, by the options that stand for their questions;
{len(found)} runs, {total} with those of audit.toml ({MOST_RUNS} at most). Of the loads: 10 and 20; for Saint-Venant
2 and 5, as what one load turns inside out a larger one does too.

{ROWS}

What it must show
- Which choices together bring which printed numbers within 5 %; audit.md says so, and which none can."""
    return study_text("Audit: two open choices at a time", head, _cases(found))


def _cases(trials: Iterable[Trial]) -> dict[str, dict[str, object]]:
    return {one.name: one.settings for one in trials}
