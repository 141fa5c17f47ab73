"""Variable-step BDF2: coefficients, predictor, local error, step control."""

import numpy as np
import pytest

from cellmech.solver import bdf

STEPS = [(1.0, 1.0, 1.0), (0.3, 0.7, 0.2), (2.0, 1.0, 3.0), (1e-3, 5e-4, 1e-3)]


def ages(steps):
    return np.concatenate([[0.0], np.cumsum(steps)])


@pytest.mark.parametrize("steps", STEPS)
def test_bdf2_coefficients_differentiate_quadratics_exactly(steps):
    now = 1.7
    t = now - ages(steps[:2])
    a = bdf.coefficients(steps[:2])
    for values, slope in ((t**0, 0.0), (t, 1.0), (t**2, 2 * now)):
        assert np.dot(a, values) == pytest.approx(slope, rel=1e-9, abs=1e-9 / steps[0])
    cubic = np.dot(a, t**3) - 3 * now**2
    assert cubic == pytest.approx(-steps[0] * (steps[0] + steps[1]), rel=1e-3)  # -u'''/6 h (h + h_n): not third order


def test_bdf1_coefficients_differentiate_straight_lines_exactly():
    assert bdf.coefficients([0.5]) == (2.0, -2.0, 0.0)


def test_equal_steps_give_the_classical_bdf2():
    np.testing.assert_allclose(bdf.coefficients([0.1, 0.1]), [15.0, -20.0, 5.0], rtol=1e-14)


@pytest.mark.parametrize("steps", STEPS)
@pytest.mark.parametrize("known", [1, 2, 3])
def test_extrapolation_is_exact_on_polynomials_through_the_known_values(steps, known):
    now = 1.7
    t = now - ages(steps)[1 : known + 1]
    weights = bdf.extrapolation(steps[:known])
    for power in range(known):
        assert np.dot(weights, t**power) == pytest.approx(now**power, rel=1e-9)
    assert abs(np.dot(weights, t**known) - now**known) > 0.1 * np.prod(ages(steps)[1 : known + 1])


def test_error_factor_at_equal_steps_is_two_elevenths():
    assert bdf.error_factor([0.7, 0.7, 0.7]) == pytest.approx(2 / 11, rel=1e-14)


@pytest.mark.parametrize("steps", STEPS)
def test_error_factor_turns_predictor_difference_into_the_local_error(steps):
    """On u = t^3 with exact history and du/dt given, the error of the step over (solution - predictor)."""
    now = 0.9
    t = now - ages(steps)
    exact = t**3
    a0, a1, a2 = bdf.coefficients(steps[:2])
    solution = (3 * now**2 - a1 * exact[1] - a2 * exact[2]) / a0
    predicted = np.dot(bdf.extrapolation(steps), exact[1:])
    assert bdf.error_factor(steps) * (solution - predicted) == pytest.approx(solution - exact[0], rel=1e-5)


@pytest.mark.parametrize("known", [1, 2])
def test_error_factor_of_a_starting_step_does_not_underestimate(known):
    """Fewer than three steps: the comparison is with a lower order, so the estimate lies above the true local error."""
    h, steps = 0.1, [0.1] * known
    t = 1.0 - ages(steps)
    exact = np.exp(t)
    a = bdf.coefficients(steps[:2])
    solution = (np.exp(1.0) - np.dot(a[1 : known + 1], exact[1:])) / a[0]
    estimate = bdf.error_factor(steps) * abs(solution - np.dot(bdf.extrapolation(steps), exact[1:]))
    assert 0.5 * abs(solution - exact[0]) <= estimate <= 20 * abs(solution - exact[0])
    assert abs(solution - exact[0]) > 1e-2 * h ** (known + 1)


def test_controller_accepts_up_to_the_tolerance_and_aims_below_it():
    control = bdf.Controller(rtol=1e-3)
    assert control.accepts(1e-3) and not control.accepts(1.001e-3)
    assert control.factor(1e-3) == pytest.approx(0.9)
    assert control.factor(8e-3) == pytest.approx(0.45)  # third root: the local error of a second-order method
    assert control.factor(5e-4) == pytest.approx(0.9 * 2 ** (1 / 3), abs=1e-3)


def test_controller_limits_the_ratio_of_neighbouring_steps():
    control = bdf.Controller(rtol=1e-3)
    assert control.factor(0.0) == control.factor(1e-30) == control.grow
    assert control.factor(1e30) == control.shrink
    assert control.grow < 1 + np.sqrt(2)  # zero-stability of variable-step BDF2
    assert 0 < control.shrink < 1
