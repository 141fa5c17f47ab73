"""The whole comparison of ours with the print: its tables, and what they say in a few sentences."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cellmech.figures import PAPER, Section, how_far, median_ratio, outside_bars, provenance, significant
from cellmech.results import to_csv
from studies.paper.bounds import Bounded, bound_section, bounded_rows, identity_section
from studies.paper.numbers import Number, all_numbers, implied_means, judged, mean_section, number_sections
from studies.paper.ours import Ours, read_ours
from studies.paper.places import TABLE_NAMES, Place, all_places, extremes, place_section
from studies.paper.printed import PAPER_NUMBERS, Paper, at, read_paper
from studies.paper.twins import share_section, twin_section, unsolved_section

HOW = (
    "q0 is the value where nothing is deformed: 0 for σ_Mises, 2, 2, 1 for J1, J2, J3, 50, 50, 25 % for their shares. "
    "“Of q − q0” is (ours − q0)/(printed − q0), the ratio that counts; the raw one of two numbers near 2 says nothing. "
    "Sign is that of ours − printed. “±” is how far ours may be off by mesh and time step; – where not measured."
)


@dataclass(frozen=True)
class Comparison:
    """All of it.

    Args:
        paper: the printed numbers.
        ours: the cases.
        numbers: each printed number beside ours.
        means: the nuclear means that the shares imply, beside ours.
        places: extremes and orders.
        rows: the printed rows under the rules no load can break.
    """

    paper: Paper
    ours: Ours
    numbers: Sequence[Number]
    means: Sequence[Number]
    places: Sequence[Place]
    rows: Sequence[Bounded]

    def number_sections(self) -> list[Section]:
        """Printed numbers and means."""
        return [*number_sections(self.numbers), mean_section(self.means)]

    def check_sections(self) -> list[Section]:
        """What the print says about itself."""
        shares = share_section(self.paper, self.ours)
        twins = twin_section(self.paper, self.ours)
        return [bound_section(self.rows), identity_section(self.rows), twins, shares]

    def sections(self) -> list[Section]:
        """Every table, in the order to read them."""
        places = [place_section(self.places), unsolved_section(self.paper, self.ours)]
        return [*self.number_sections(), *places, *self.check_sections()]

    def judged(self) -> list[Number]:
        """The numbers to count: no misprints, and of the shape index the nearest of three."""
        return judged(self.numbers)

    def median_ratio(self, quantity: str) -> float:
        """The middle one of a quantity's ratios of q − q0; NaN when there is none."""
        return median_ratio(n for n in (*self.numbers, *self.means) if n.quantity == quantity and not n.is_misprint)

    def extremes(self) -> tuple[int, int]:
        """How many extremes are where the paper has them, and of how many that can be judged."""
        return extremes(self.places)

    def impossible(self) -> tuple[int, int]:
        """How many printed rows no load can produce, by their stress or their J2, and of how many that were checked."""
        verdicts = [(row.stress_possible, row.J2_possible) for row in self.rows]
        return sum(False in both for both in verdicts), len(verdicts)

    def reading(self) -> list[str]:
        """What the tables say."""
        return [*self._of_numbers(), *self._of_places(), *self._of_the_print()]

    def _of_numbers(self) -> Iterable[str]:
        judged = self.judged()
        yield how_far(judged, sum(bool(number.slot.reason) for number in judged), "printed numbers")
        parts = {"sigma": "σ_Mises", "J1": "J1 − 2", "J2": "J2 − 2", "J3": "J3 − 1"}
        middle = (f"{name} × {significant(self.median_ratio(q), 2)}" for q, name in parts.items())
        yield f"Typical (median) ours/printed: {', '.join(middle)}."
        yield from outside_bars(judged, "printed numbers")

    def _of_places(self) -> Iterable[str]:
        good, known = self.extremes()
        yield f"Extremes (over laws, sweeps and S1–S3): {good} of {known} are where the paper has them."
        slot = self.ours.find("fig4", "", self.paper.not_converged)
        result = f"{slot.status} here" + (f" ({slot.reason})" if slot.status == "failed" else "")
        yield f"The paper's one case without convergence, {at(self.paper.not_converged)}: {result}."

    def _of_the_print(self) -> Iterable[str]:
        stress = [row.stress_possible for row in self.rows]
        silent = f"; for {stress.count(None)} they demand nothing" if None in stress else ""
        yield (
            f"The print against itself: in {stress.count(False)} of the {len(stress)} printed rows with σ_Mises and J1 "
            "σ_Mises is smaller than the printed J1, J2, J3 demand with the printed moduli: no load can give "
            f"both{silent}."
        )
        if strange := [row.label for row in self.rows if row.J2_possible is False]:
            yield f"J2 = J1² − 2 J3 cannot hold in {'; '.join(strange)}."
        a, b = self.paper.table("table3").get("S1"), self.paper.table("fig2").get("saint-venant")
        if a and b:
            x, y = (self.ours.at(row).value("nucleus.sigma_mises_max_Pa") for row in (a, b))
            yield (
                f"S1 at 24,000 s is Saint-Venant at 18,000 s, yet the print has σ_Mises {a.values['sigma']:g} and "
                f"{b.values['sigma']:g} Pa; ours are {significant(x, 4)} and {significant(y, 4)} Pa."
            )

    def provenance(self) -> list[str]:
        """Where our numbers come from, a line for each table."""
        studies = {TABLE_NAMES[table]: self.ours.study(table) for table in self.ours.slots}
        return [f"{name}: {provenance(study)}" for name, study in studies.items() if study.cases]

    def markdown(self) -> str:
        """The whole as Markdown."""
        faults = self.ours.unsolved()
        parts = [f"# The printed numbers of {PAPER}, and ours", "\n".join(f"- {line}" for line in self.reading()), HOW]
        if faults:
            parts += ["## Cases without a result", "\n".join(f"- {line}" for line in faults)]
        parts += [section.markdown() for section in self.sections()]
        return "\n\n".join([*parts, "## Provenance", "\n".join(f"- {line}" for line in self.provenance())]) + "\n"

    def csv(self) -> str:
        """Every table's lines with all digits, told apart by the column "section"."""
        return to_csv([record for section in self.sections() for record in section.records()], ("section",))


def compare(results: Path, paper: Path = PAPER_NUMBERS) -> Comparison:
    """Compare a folder of results with the print.

    Raises:
        InputError: when there is no result at all, or a file is missing or broken.
    """
    printed, ours = read_paper(paper), read_ours(results)
    numbers = all_numbers(printed, ours)
    return Comparison(
        printed, ours, numbers, implied_means(numbers), all_places(printed, ours, numbers), bounded_rows(printed, ours)
    )
