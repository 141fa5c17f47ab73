"""Which of the paper's open choices bring which printed numbers near ours: the runs that try them, and their ratios.

Two studies are read, `audit` (one choice at a time) and `audit-pairs` (two). How far a number is off is measured by the
ratio of the differences from rest; the values are those of the static state at the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from cellmech import InputError
from cellmech.figures import QUANTITIES, StudyResult, read_planned
from cellmech.results import Result
from cellmech.scene import load_study
from studies.paper.bounds import Bounded, bounded, bounds
from studies.paper.choices import QUESTIONS, SUBJECTS, Subject, Trial, trial
from studies.paper.misfit import misfit
from studies.paper.ours import STUDIES, Slot
from studies.paper.printed import RESTS, Paper, PrintedRow

CLOSE = 0.05
SINGLES, PAIRS = "audit", "audit-pairs"
MAXIMA = {q.paper_key: f"nucleus.{q.key}_max{q.suffix}" for q in QUANTITIES}
KEYS = MAXIMA | {f"share_{q.key}": f"share_of_area_percent.{q.key}" for q in QUANTITIES if q.rest}


@dataclass(frozen=True)
class Tried:
    """A run of the audit and the printed row it is about.

    Args:
        trial: what was chosen.
        row: as printed.
        slot: its scene, and its result if there is one.
    """

    trial: Trial
    row: PrintedRow
    slot: Slot

    @property
    def failure(self) -> str:
        """Why there are no numbers; "" when there are."""
        return self.slot.case.failure if self.slot.case else self.slot.lack

    @property
    def printed(self) -> dict[str, float]:
        """Quantity -> printed value, of those that every run has."""
        return {quantity: value for quantity, value in self.row.values.items() if quantity in KEYS}

    @property
    def judged(self) -> list[str]:
        """The quantities whose print is not the value at rest."""
        return [quantity for quantity, value in self.printed.items() if abs(value - RESTS[quantity]) > 1e-9]

    def value(self, quantity: str) -> float:
        """Ours; NaN without a solution."""
        return self.slot.value(KEYS[quantity])

    @cached_property
    def ratios(self) -> dict[str, float]:
        """Quantity -> (ours - rest) / (printed - rest), of those to judge; NaN without a solution."""
        rests, printed = RESTS, self.printed
        return {q: (self.value(q) - rests[q]) / (printed[q] - rests[q]) for q in self.judged}

    def close(self) -> list[str]:
        """The quantities that are within 5 %."""
        return [quantity for quantity, ratio in self.ratios.items() if abs(ratio - 1) <= CLOSE]

    @property
    def misfit(self) -> float:
        """Root mean square of ln ratio over the printed maxima."""
        return misfit(ratio for quantity, ratio in self.ratios.items() if quantity in MAXIMA)

    @cached_property
    def obeys(self) -> bool | None:
        """Whether our stress is as large as our strains demand of every law; None where that says nothing."""
        values = {quantity: self.value(quantity) for quantity in MAXIMA}
        known = [bound for bound in bounds(self.slot, values)[:2] if math.isfinite(bound)]
        return values["sigma"] >= max(known) if known else None


@dataclass(frozen=True)
class Audit:
    """All runs of the audit.

    Args:
        paper: the printed numbers.
        tried: the runs, one choice at a time first.
        study: the runs with a result, for `figures.style.provenance`.
    """

    paper: Paper
    tried: Sequence[Tried]
    study: StudyResult

    def of(self, subject: Subject) -> list[Tried]:
        """The runs about a subject."""
        return [tried for tried in self.tried if tried.trial.subject == subject]

    def alone(self) -> list[Tried]:
        """The runs with one choice at most."""
        return [tried for tried in self.tried if len(tried.trial.chosen) <= 1]

    def as_printed(self, subject: Subject) -> Tried:
        """The run without any choice."""
        return next(tried for tried in self.of(subject) if not tried.trial.chosen)

    def best(self, subject: Subject) -> Tried:
        """The run with the smallest misfit."""
        return min(self.of(subject), key=lambda tried: tried.misfit)

    def solved(self) -> list[Tried]:
        """The runs with a solution."""
        return [tried for tried in self.tried if not tried.failure]

    def missing(self) -> list[str]:
        """The runs without any result, a line each."""
        return [f"{tried.slot.name}: {tried.failure}" for tried in self.tried if tried.slot.case is None]

    def bounded(self, subject: Subject) -> Bounded:
        """The printed row under the rules that no load can break."""
        base = self.as_printed(subject)
        return bounded(self.paper, base.row, base.slot)

    def most_moved(self, question: str) -> tuple[float, Tried, str] | None:
        """The largest |change of ln ratio| by a choice of this question alone, the run and the maximum that moved.

        Numbers that change sign have no such measure and are left out. None when nothing is known.
        """
        found = []
        for subject in SUBJECTS:
            base = self.as_printed(subject).ratios
            for tried in self.of(subject):
                if tuple(tried.trial.chosen) == (question,):
                    found += [
                        (abs(math.log(ratio / base[quantity])), tried, quantity)
                        for quantity, ratio in tried.ratios.items()
                        if quantity in MAXIMA and ratio > 0 and base[quantity] > 0
                    ]
        return max(found, key=lambda one: one[0], default=None)

    def movement(self, question: str) -> float:
        """The largest |change of ln ratio| of a printed maximum by a choice of this question alone."""
        most = self.most_moved(question)
        return most[0] if most else 0.0

    def order(self) -> list[str]:
        """The questions, the one that moved the numbers most first."""
        return sorted(QUESTIONS, key=lambda question: -self.movement(question))


def read_audit(results: Path, paper: Paper, studies: Path = STUDIES, pairs: bool = True) -> Audit:
    """Read the runs of the audit.

    Args:
        results: has a folder of each study.
        paper: the printed numbers.
        studies: the folder of the study files, which say what runs there should be.
        pairs: whether to read those too, if there are any.

    Raises:
        InputError: when the first study has no result, or a file is broken.
    """
    tried: list[Tried] = []
    cases: dict[str, Result] = {}
    for stem in (SINGLES, PAIRS):
        if stem == SINGLES or (pairs and (results / stem).is_dir()):
            found, known = _read(results / stem, studies / f"{stem}.toml", paper)
            tried += found
            cases |= known
    return Audit(paper, tried, StudyResult(results / SINGLES, cases))


def _read(folder: Path, path: Path, paper: Paper) -> tuple[list[Tried], dict[str, Result]]:
    plan = load_study(path)
    results = read_planned(folder, plan)
    found = []
    for case in plan.cases:
        try:
            one = trial(case.name)
        except ValueError as error:
            raise InputError(str(path), "case", "must be one of the audit's", str(error)) from None
        slot = Slot(case.name, case.scene, (), results.cases.get(case.name), results.missing.get(case.name, ""))
        found.append(Tried(one, paper.table(one.subject.table)[one.subject.row], slot))
    return found, dict(results.cases)
