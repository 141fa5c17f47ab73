"""The rules no load can break: against hand-computed numbers, and against the laws themselves."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from paper_files import as_printed, steady, write_results

from studies.paper.bounds import Bounded, bounds, least_mises, least_saint_venant, obeys_bounds, obeys_identity
from studies.paper.comparison import Comparison, compare

POISSON, YOUNG = 0.45, 10.0
LAMBDA, MU = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
BETA = 2.5 * MU
ALPHA = MU / 2 - BETA


def saint_venant(I1: float, I2: float, J: float) -> float:
    square = I1**2 - 2 * I2  # tr C²
    return LAMBDA / 2 * ((I1 - 3) / 2) ** 2 + MU / 4 * (square - 2 * I1 + 3)


def neo_hookean(I1: float, I2: float, J: float) -> float:
    return MU / 2 * (I1 - 3 - 2 * math.log(J)) + LAMBDA / 2 * math.log(J) ** 2


def mooney_rivlin(I1: float, I2: float, J: float) -> float:
    volume = (LAMBDA + 2 * MU / 3) / 2 * math.log(J) ** 2
    return ALPHA * (I1 - 3 * J ** (2 / 3)) + BETA * (I2 - 3 * J ** (4 / 3)) + volume


def yeoh(I1: float, I2: float, J: float) -> float:
    return mooney_rivlin(I1, I2, J) - 0.5 * ALPHA / 2 * (I1 - 3) ** 2 + 0.1 * ALPHA / 3 * (I1 - 3) ** 3


def mises(law: Callable[[float, float, float], float], a: float, b: float) -> float:
    """Of the Cauchy stress λ_i/J ∂W/∂λ_i in plane strain with in-plane stretches a, b, by central differences."""

    def energy(stretches: np.ndarray) -> float:
        x, y, z = stretches**2
        return law(x + y + z, x * y + y * z + z * x, float(np.prod(stretches)))

    at, step = np.array([a, b, 1.0]), 1e-5
    slopes = [(energy(at + step * e) - energy(at - step * e)) / (2 * step) for e in np.eye(3)]
    p, q, r = at * np.array(slopes) / (a * b)
    return math.sqrt(((p - q) ** 2 + (q - r) ** 2 + (r - p) ** 2) / 2)


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    return compare(write_results(tmp_path_factory.mktemp("results")))


def row(comparison: Comparison, table: str, name: str) -> Bounded:
    return next(b for b in comparison.rows if (b.row.table, b.row.name) == (table, name))


def test_bound_by_hand() -> None:
    # stretches² 3 and 1: J1 = 4, J2 = 10, J3 = 3, so √(J1² − 4 J3)/√J3 = 2/√3 and the bound is c_s µ
    assert least_mises(4.0, 10.0, 3.0, 5.0) == pytest.approx((5.0, 5.0))
    assert all(map(math.isnan, least_mises(2.0, 2.0, 1.0, 5.0)))


@pytest.mark.parametrize("law", [saint_venant, neo_hookean, mooney_rivlin, yeoh])
def test_every_law_obeys_the_bound_where_J1_is_at_least_two(law: Callable[[float, float, float], float]) -> None:
    random, smallest = np.random.default_rng(7), math.inf
    for a, b in random.uniform(0.5, 1.9, (400, 2)):
        if a * a + b * b >= 2:
            J1, J3 = a * a + b * b, (a * b) ** 2
            bound = math.sqrt(3 * (J1**2 - 4 * J3) / J3) / 2 * MU
            assert mises(law, a, b) >= bound * (1 - 1e-6) - 1e-6
            smallest = min(smallest, mises(law, a, b) / bound)
    assert smallest < 1.5  # the bound is not idle


def test_saint_venants_own_bound_is_its_stress_at_the_largest_J3() -> None:
    a, b = 1.3, 0.9
    J1, J3 = a * a + b * b, (a * b) ** 2
    assert least_saint_venant(J1, J3, YOUNG, POISSON) == pytest.approx(mises(saint_venant, a, b), rel=1e-6)
    for squared in np.linspace(1.30, 1.68, 9):  # the same J1 with a smaller J3
        other = mises(saint_venant, math.sqrt(J1 - squared), math.sqrt(squared))
        if (J1 - squared) * squared <= J3:
            assert other >= least_saint_venant(J1, J3, YOUNG, POISSON) * (1 - 1e-6)


def test_rows_of_the_print_have_the_known_bounds(comparison: Comparison) -> None:
    found = {
        law: bounds(b.slot, b.printed)
        for law in ("neo-hookean", "mooney-rivlin", "saint-venant", "yeoh")
        if (b := row(comparison, "fig2", law))
    }
    assert found["neo-hookean"][0] == pytest.approx(1.62, abs=0.005)
    assert found["mooney-rivlin"][0] == pytest.approx(2.10, abs=0.005)
    assert found["saint-venant"][2] == pytest.approx(1.58, abs=0.005)
    assert math.isnan(found["neo-hookean"][2])  # another law
    assert math.isnan(found["yeoh"][1])  # J2 = 3.72 < 4 leaves room for J1 < 2, where this law is softer


def test_the_fluid_fraction_lowers_the_bound(comparison: Comparison) -> None:
    b = row(comparison, "fig4", "max_strain")  # nucleoplasm 0.9, the softer layer by far
    by_hand = math.sqrt(3 * (4.08**2 - 4 * 1.31) / 1.31) / 2 * 0.1 * MU
    assert bounds(b.slot, b.printed)[0] == pytest.approx(by_hand)


def test_a_row_without_J3_takes_the_largest_of_its_sweep(comparison: Comparison) -> None:
    b = row(comparison, "fig6", "max_J1_J2")
    assert b.printed["J3"] == 1.16 and b.remark == "J3: the sweep's largest"
    assert row(comparison, "fig6", "min_J1_J2").stress_possible is None  # 2.11² < 4 · 1.16: says nothing


def test_printed_rows_break_the_rules_and_an_obedient_one_does_not(comparison: Comparison) -> None:
    assert comparison.impossible() == (9, 10)
    assert [b.row.name for b in comparison.rows if b.J2_possible is False] == ["S3"]  # 3.05² − 2 · 0.86 = 7.58 > 6.92
    rows = {b.row.name: b for b in comparison.rows}
    strong = Bounded(rows["S2"].row, rows["S2"].slot, {**rows["S2"].printed, "sigma": 3.6}, rows["S2"].ours)
    assert strong.stress_possible is True


def test_half_a_printed_digit_is_granted(comparison: Comparison) -> None:
    b = row(comparison, "fig2", "neo-hookean")
    loosest = max(x for x in bounds(b.slot, {**b.printed, "J1": 2.435, "J2": 4.265, "J3": 1.155}) if math.isfinite(x))
    below = math.floor(100 * (loosest - 0.005)) / 100  # the largest printed stress that falls short with half a digit
    for sigma, possible in ((below, False), (round(below + 0.01, 2), True)):
        edge = Bounded(b.row, b.slot, {**b.printed, "sigma": sigma}, b.ours)
        assert edge.stress_possible is possible


def test_our_numbers_are_held_to_the_same_rules(tmp_path: Path) -> None:
    comparison = compare(write_results(tmp_path, as_printed))  # as impossible as the print
    text = next(s for s in comparison.check_sections() if s.stem == "bound")
    assert [r.record["obeyed"] for r in text.rows if r.record["row"] == "neo-hookean"] == ["no"]


def test_rounding_breaks_no_rule(comparison: Comparison) -> None:
    """Where the largest J1, J2, J3 are one point's, J2 = J1² − 2 J3 but for its last digit."""
    b = row(comparison, "fig2", "neo-hookean")
    J1, J3 = 2.00468, 1.00445
    values = {"J1": J1, "J2": J1**2 - 2 * J3, "J3": J3}
    least = max(x for x in bounds(b.slot, values) if math.isfinite(x))
    for off, obeys in ((0.0, True), (1e-14, True), (1e-6, False)):
        assert obeys_identity({**values, "J2": values["J2"] * (1 - off)}) is obeys
        assert obeys_bounds(b.slot, {**values, "sigma": least * (1 - off)}) is obeys


def test_the_reading_counts_the_rows_as_the_page_does(comparison: Comparison) -> None:
    text = "\n".join(comparison.reading())
    assert (
        "in 9 of the 10 printed rows with σ_Mises and J1 σ_Mises is smaller" in text
        and "for 1 they demand nothing" in text
    )


def test_shares_fit_the_identity_of_means(comparison: Comparison) -> None:
    section = next(s for s in comparison.check_sections() if s.stem == "share")
    expected = {r.record["row"]: round(r.record["expected"]) for r in section.rows}
    assert expected == {"mooney-rivlin": 79, "max_strain": 162, "min_J1_J2": 52, "max_J1_J2": 68}
    assert len(section.rows) == 5 and {r.record["fits"] for r in section.rows} == {"yes"}


def test_a_state_printed_twice_must_be_the_same(comparison: Comparison) -> None:
    rows = next(s for s in comparison.check_sections() if s.stem == "twin").rows
    found = {(r.record["row"], r.record["quantity"]): r.record for r in rows}
    assert found["S1", "sigma"]["same"] == "no" and found["S1", "J3"]["same"] == "no"
    assert found["max_J1_J2", "sigma"]["same"] == "yes"  # 1.03 beside 1.032
    base = steady(1)["J1"], steady(0)["J1"]  # neo-Hookean of Figure 2, first case of Figure 6
    assert found["max_J1_J2", "J1"]["our_difference"] == pytest.approx(abs(base[0] - base[1]) / (base[0] - 2))
