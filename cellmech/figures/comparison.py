"""A study's numbers beside reference numbers, whoever measured or printed them."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cellmech.figures.reference import Reference, References, read_references, rest_of
from cellmech.figures.results import StudyResult, read_study
from cellmech.figures.section import NONE, Row, Section, signal, significant, tone_of
from cellmech.figures.style import provenance
from cellmech.results.records import to_csv

HOW = (
    "q0 is the value where nothing is deformed. “Of q − q0” is (ours − q0)/(theirs − q0), the ratio that counts; the "
    "raw one of two numbers near 2 says nothing. Sign is that of ours − theirs. “±” is how far ours may be off by mesh "
    "and time step; – where not measured."
)


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One of our numbers beside another's.

    Args:
        theirs: the number to compare with.
        uncertainty: how far it may be off; NaN where not known.
        rest: the value where nothing is deformed; NaN where not known.
        ours: our number; NaN where there is none.
        error: how far ours may be off; NaN where that was not measured.
    """

    theirs: float
    uncertainty: float
    rest: float
    ours: float
    error: float

    @property
    def outside(self) -> bool | None:
        """True if theirs lies outside our error bar, its own uncertainty granted; None where ours was not measured."""
        gap = abs(self.ours - self.theirs)
        granted = 0.0 if math.isnan(self.uncertainty) else self.uncertainty
        return None if math.isnan(gap) or math.isnan(self.error) else gap > self.error + granted

    @property
    def ratio(self) -> float:
        """Ours / theirs."""
        return self.ours / self.theirs if self.theirs else math.nan

    @property
    def ratio_from_rest(self) -> float:
        """The same of the differences from rest; NaN where theirs is the value at rest."""
        gap = self.theirs - self.rest
        return (self.ours - self.rest) / gap if abs(gap) > 1e-9 else math.nan

    @property
    def sign(self) -> str:
        """The sign of ours - theirs."""
        difference = self.ours - self.theirs
        return NONE if math.isnan(difference) else "+" if difference > 0 else "−" if difference < 0 else "0"

    @property
    def tone(self) -> str:
        """The distance of ours from theirs, by the differences from rest, one of `TONES`."""
        return tone_of(self.ratio_from_rest)

    def judgement(self) -> dict[str, Any]:
        """The two numbers and their ratios, for machines."""
        ratios = {"ratio": self.ratio, "ratio_from_rest": self.ratio_from_rest}
        sign = {"sign": self.sign.replace("−", "-").replace(NONE, ""), "how_far": self.tone}
        return {"rest": self.rest, "ours": self.ours, "error": self.error} | ratios | sign


def how_far(pairs: Sequence[Pair], lost: int, what: str) -> str:
    """A sentence that counts the numbers by their distance.

    Args:
        pairs: the numbers.
        lost: how many of them have no result of ours.
        what: the numbers are called.
    """
    tones = Counter(pair.tone for pair in pairs)
    return (
        f"{len(pairs)} {what}: on q − q0, {tones['close']} of ours are within 5 %, {tones['near']} more "
        f"within a factor 2, {tones['off']} within 10, {tones['far']} further off, {tones['other']} of the other "
        f"sign{f'; {lost} without a result here' if lost else ''}."
    )


def outside_bars(pairs: Iterable[Pair], what: str) -> list[str]:
    """A sentence on how many numbers lie outside our error bars; none where no error was measured."""
    bars = [pair.outside for pair in pairs if pair.outside is not None]
    return [f"Of {len(bars)} {what} whose error was measured, {sum(bars)} lie outside our error bars."] if bars else []


def median_ratio(pairs: Iterable[Pair]) -> float:
    """The middle one of the ratios of q − q0; NaN when there is none."""
    known = [ratio for pair in pairs if math.isfinite(ratio := pair.ratio_from_rest)]
    return statistics.median(known) if known else math.nan


@dataclass(frozen=True, kw_only=True)
class Compared(Pair):
    """A reference number beside ours.

    Args:
        reference: the number.
        lack: why there is none of ours; "" when there is one.
    """

    reference: Reference
    lack: str = ""

    def row(self) -> Row:
        """Its line in the table."""
        of = self.reference
        cells = (
            of.case,
            of.key,
            f"{of.value:g}",
            significant(of.uncertainty, 1),
            signal(self.ours, self.rest, self.error),
            significant(self.error, 1),
            significant(self.ratio),
            significant(self.ratio_from_rest, 2),
            self.sign,
            self.lack or of.note,
        )
        record = {"case": of.case, "key": of.key, "theirs": of.value, "uncertainty": of.uncertainty}
        return Row(cells, record | self.judgement() | {"remark": self.lack or of.note}, self.tone)


@dataclass(frozen=True)
class Comparison:
    """All numbers of a reference file beside a study's.

    Args:
        references: the file.
        study: the cases that it is about.
        compared: its numbers in their order.
    """

    references: References
    study: StudyResult
    compared: Sequence[Compared] = field(default_factory=tuple)

    def reading(self) -> list[str]:
        """The table in a few sentences."""
        lost = sum(bool(one.lack) for one in self.compared)
        typical = f"Typical (median) ours/theirs, of q − q0: × {significant(median_ratio(self.compared), 2)}."
        numbers = "reference numbers"
        return [how_far(self.compared, lost, numbers), typical, *outside_bars(self.compared, numbers)]

    def section(self) -> Section:
        """The numbers as a table."""
        header = ("case", "number", "theirs", "± of theirs", "ours", "±", "ours/theirs", "of q − q0", "sign", "remark")
        return Section("number", "Number by number", HOW, header, [one.row() for one in self.compared])

    def markdown(self) -> str:
        """The whole as Markdown."""
        section, source = self.section(), self.references.source
        lines = "\n".join(f"- {line}" for line in self.reading())
        parts = [f"# {self.references.title}, and ours", *([source] if source else []), lines]
        if faults := self.study.faults():
            parts += ["## Cases without a result", "\n".join(f"- {line}" for line in faults)]
        return "\n\n".join([*parts, section.markdown(), f"{provenance(self.study)}\n"])

    def csv(self) -> str:
        """The numbers with all digits."""
        return to_csv(self.section().records())


def compare(folder: str | Path, reference: str | Path) -> Comparison:
    """Compare a study's results with reference numbers; nothing is solved.

    Args:
        folder: of the study's results.
        reference: the TOML file with the numbers, see `read_references`.

    Raises:
        InputError: for a file that is missing or broken, a number that no result has, or when no case has a result.
    """
    references = read_references(Path(reference))
    study = read_study(Path(folder), references.cases())
    return Comparison(references, study, [_compared(one, study) for one in references.numbers])


def _compared(reference: Reference, study: StudyResult) -> Compared:
    case, ours, error = study.cases.get(reference.case), math.nan, math.nan
    if case is None:
        lack = study.missing[reference.case]
    elif case.failure:
        lack = f"failed at {case.get('t_s'):,.0f} s: {case.failure}"
    else:
        ours, error = case.number(reference.key), case.get(f"error.{reference.key}")
        lack = "null in our result" if math.isnan(ours) else ""
    return Compared(
        reference=reference,
        theirs=reference.value,
        uncertainty=reference.uncertainty,
        rest=rest_of(reference.key, case) if math.isnan(reference.rest) else reference.rest,
        ours=ours,
        error=error,
        lack=lack,
    )
