"""What the printed maxima must obey whatever load they came from, and whether they and ours do.

At the place where J1 is largest, J3 is no more than its largest value. In plane strain, with J = √J3, every law's two
in-plane Cauchy stresses differ by at least c_s µ √(J1² − 4 J3)/J while J1 ≥ 2 (neo-Hookean and Mooney–Rivlin by just
that, Yeoh and Saint-Venant by more), and von Mises is at least √3/2 of their difference.
And everywhere J2 = J1² − 2 J3.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cellmech.figures import QUANTITIES, Row, Section, plain, signal, significant, verdict, yes
from studies.paper.numbers import ROWS
from studies.paper.ours import Ours, Slot
from studies.paper.places import TABLE_NAMES
from studies.paper.printed import Paper, PrintedRow, half_digit, in_print

Maxima = Mapping[str, float]
"""sigma [Pa], J1, J2, J3: the largest in the nucleus; NaN where not known."""


def least_mises(J1: float, J2: float, J3: float, c_s_mu: float) -> tuple[float, float]:
    """The least the largest von Mises stress can be, by J1 and by J2 [Pa]; NaN where they say nothing.

    Args:
        J1: largest tr C; J1² − 4 J3 at its place is at least that with the largest J3.
        J2: largest tr C²; J1² − 4 J3 at its place is J2 − 2 J3.
        J3: largest det C, or more.
        c_s_mu: solid fraction times shear modulus of the softest layer [Pa].
    """
    squares = J1**2 - 4 * J3, J2 - 2 * J3
    by_J1, by_J2 = (math.sqrt(3 * s / J3) / 2 * c_s_mu if s > 0 else math.nan for s in squares)
    return by_J1, by_J2


def least_saint_venant(J1: float, J3: float, young: float, poisson: float) -> float:
    """The least von Mises stress of a Saint-Venant solid in plane strain [Pa] at this J1, whatever det C up to J3.

    Args:
        J1: tr C.
        J3: upper bound of det C.
        young: Young's modulus times solid fraction [Pa].
        poisson: Poisson's ratio.
    """
    lmbda, mu = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    det = np.linspace(1e-3, 1.0, 1000) * min(J3, J1**2 / 4)
    root = np.sqrt(np.maximum(J1**2 - 4 * det, 0.0))
    stretches = np.array([(J1 + root) / 2, (J1 - root) / 2, np.ones_like(det)])  # squared, principal
    a, b, c = stretches * (lmbda * (J1 - 2) / 2 + mu * (stretches - 1)) / np.sqrt(det)
    return float(np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2).min())


def bounds(slot: Slot, values: Maxima) -> tuple[float, float, float]:
    """The least σ_Mises by J1, by J2, and by J1 with Saint-Venant's own law [Pa]; NaN where there is no bound."""
    if not values["J1"] >= 2:
        return math.nan, math.nan, math.nan
    layers, cell = slot.scene.layer, slot.scene.cell
    softest = min(layer.young_Pa * (1 - layer.fluid_fraction) for layer in (layers.lamina, layers.nucleoplasm))
    own = math.nan
    if cell.law == "saint-venant":
        own = least_saint_venant(values["J1"], values["J3"], softest, cell.poisson)
    by_J1, by_J2 = least_mises(values["J1"], values["J2"], values["J3"], softest / (2 * (1 + cell.poisson)))
    if cell.law in ("saint-venant", "yeoh") and not values["J2"] >= 4:
        by_J2 = math.nan  # J1² = J2 + 2 J3 may be below 4 there, and these laws soften below J1 = 2
    return by_J1, by_J2, own


@dataclass(frozen=True)
class Bounded:
    """A printed row and ours under the two rules.

    Args:
        row: as printed.
        slot: our case.
        printed: its maxima; J3 is the sweep's largest where the row has none.
        ours: our maxima.
    """

    row: PrintedRow
    slot: Slot
    printed: Maxima
    ours: Maxima

    @property
    def label(self) -> str:
        """The row for people."""
        what = f" ({ROWS[self.row.name]})" if self.row.name in ROWS else ""
        return f"{TABLE_NAMES[self.row.table]}: {self.slot.label}{what}"

    @property
    def remark(self) -> str:
        """Why ours is missing, and where J3 is from if the row does not print it."""
        source = "" if "J3" in self.row.values else "J3: the sweep's largest"
        return "; ".join(filter(None, [self.slot.reason, source]))

    def rounded(self, **up: int) -> Maxima:
        """The printed maxima, each half a printed digit up (1) or down (-1)."""
        return {q: value + up.get(q, 0) * half_digit(q, value) for q, value in self.printed.items()}

    @property
    def stress_possible(self) -> bool | None:
        """Whether the printed stress is as large as the strains demand; None where no bound applies."""
        return obeys_bounds(self.slot, self.rounded(sigma=1, J1=-1, J2=-1, J3=1))

    @property
    def J2_possible(self) -> bool | None:
        """Whether the printed J2 is as large as J1 and J3 demand; None where it is not printed."""
        return obeys_identity(self.rounded(J1=-1, J2=1, J3=1))


ROUND_OFF = 1e-9  # relative: a state that meets a rule with equality, such as S1, is within rounding of it


def obeys_bounds(slot: Slot, values: Maxima) -> bool | None:
    """Whether the stress is as large as the strains demand; None where that cannot be said."""
    known = [bound for bound in bounds(slot, values) if math.isfinite(bound)]
    return values["sigma"] >= (1 - ROUND_OFF) * max(known) if known and math.isfinite(values["sigma"]) else None


def least_J2(values: Maxima) -> float:
    """What J2 is at least, at the place of the largest J1."""
    return values["J1"] ** 2 - 2 * values["J3"]


def obeys_identity(values: Maxima) -> bool | None:
    """Whether the largest J2 is as large as that; None where that cannot be said."""
    least = least_J2(values)
    return values["J2"] >= (1 - ROUND_OFF) * least if math.isfinite(least) and math.isfinite(values["J2"]) else None


def bounded_rows(paper: Paper, ours: Ours) -> list[Bounded]:
    """Every printed row that has a stress and J1."""
    return [bounded(paper, row, ours.at(row)) for row in paper.rows if {"sigma", "J1"} <= row.values.keys()]


def bounded(paper: Paper, row: PrintedRow, slot: Slot) -> Bounded:
    """A printed row and the case it is about."""
    printed = {"J2": math.nan, "J3": paper.largest(row.table, "J3"), **row.values}
    tail = "_max_over_time" if row.table == "fig2" else "_max"
    here = {q.paper_key: slot.value(f"nucleus.{q.key}{tail}{q.suffix}") for q in QUANTITIES}
    return Bounded(row, slot, {name: printed[name] for name in here}, here)


def bound_section(rows: Sequence[Bounded]) -> Section:
    """The printed stresses beside the least their strains allow."""
    text = (
        "In plane strain σ_Mises ≥ (√3/2) c_s µ √(J1² − 4 J3)/√J3 at every point, for each of the four laws (J1 ≥ 2). "
        "With the maxima this bounds the largest stress by J1; by J2, as J1² − 4 J3 = J2 − 2 J3; and more sharply by "
        "J1 with Saint-Venant's own law. c_s µ is that of the softer layer of the nucleus, as printed. No load can "
        "produce a row whose stress is below its bound. Possible: half a digit granted to each printed number."
    )
    header = ("row", "printed σ [Pa]", "by J1", "by J2", "Saint-Venant's", "possible", "our σ", "our bound", "obeyed")
    title = "The least stress that the printed strains allow"
    return Section("bound", title, text, (*header, "remark"), [*map(_bound, rows)])


def _bound(b: Bounded) -> Row:
    printed, mine = bounds(b.slot, b.printed), bounds(b.slot, b.ours)
    obeyed = obeys_bounds(b.slot, b.ours)
    our_bound = max((bound for bound in mine if math.isfinite(bound)), default=math.nan)
    sigma, ours = b.printed["sigma"], b.ours["sigma"]
    head = (b.label, in_print("sigma", sigma), *map(significant, printed), yes(b.stress_possible))
    cells = (*head, significant(ours), significant(our_bound), yes(obeyed), b.remark)
    record: dict[str, Any] = {"table": b.row.table, "row": b.row.name, "case": b.slot.name, "quantity": "sigma"}
    record |= {"printed": sigma, "bound_J1": printed[0], "bound_J2": printed[1], "bound_saint_venant": printed[2]}
    record |= {"possible": plain(b.stress_possible), "ours": ours, "our_bound": our_bound, "obeyed": plain(obeyed)}
    return Row(cells, record | {"remark": b.remark}, verdict(b.stress_possible))


def identity_section(rows: Sequence[Bounded]) -> Section:
    """The printed J2 beside the least that J1 and J3 allow."""
    text = (
        "Everywhere J2 = J1² − 2 J3. So the largest J2 is at least J1² − 2 J3 of the largest J1 and J3; and where it "
        "is, J3 is at most (J1² − J2)/2, which says how much area the print leaves at that place (1: all of it)."
    )
    header = ("row", "printed J2", "at least", "possible", "J3 there at most", "our J2", "at least", "obeyed", "remark")
    known = [row for row in rows if math.isfinite(row.printed["J2"])]
    return Section("identity", "J2 against J1 and J3", text, header, [*map(_identity, known)])


def _identity(b: Bounded) -> Row:
    J2, least, ours, our_least = b.printed["J2"], least_J2(b.printed), b.ours["J2"], least_J2(b.ours)
    obeyed, J3 = obeys_identity(b.ours), (b.printed["J1"] ** 2 - J2) / 2
    head = (b.label, in_print("J2", J2), f"{least:.2f}", yes(b.J2_possible), f"{J3:.2f}")
    cells = (*head, signal(ours, 2), signal(our_least, 2), yes(obeyed), b.remark)
    record: dict[str, Any] = {"table": b.row.table, "row": b.row.name, "case": b.slot.name, "quantity": "J2"}
    record |= {"printed": J2, "least_J2": least, "possible": plain(b.J2_possible), "most_J3_at_largest_J2": J3}
    record |= {"ours": ours, "our_least_J2": our_least, "obeyed": plain(obeyed), "remark": b.remark}
    return Row(cells, record, verdict(b.J2_possible))
