"""How well numbers tell what is fitted to them: hand calculations, no solving."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from cellmech.runs.fit import _Search
from cellmech.runs.trials import Scale, standard_errors


@pytest.mark.parametrize("scale", [Scale(10.0, 1000.0), Scale(-1.0, 3.0)], ids=["ratios", "differences"])
def test_scale_leads_from_bound_to_bound_and_back(scale):
    assert (scale.value(0.0), scale.value(1.0)) == pytest.approx((scale.least, scale.most), rel=1e-15)
    assert scale.share(scale.value(0.3)) == pytest.approx(0.3, rel=1e-12)
    difference = (scale.value(0.3 + 1e-6) - scale.value(0.3 - 1e-6)) / 2e-6
    assert scale.slope(0.3) == pytest.approx(difference, rel=1e-8)


def test_scale_counts_ratios_alike_where_bounds_are_positive():
    assert Scale(10.0, 1000.0).value(0.5) == pytest.approx(100.0, rel=1e-14)
    assert Scale(10.0, 1000.0).step == pytest.approx(0.02 / math.log(100.0), rel=1e-14)
    assert Scale(0.0, 1000.0).value(0.5) == 500.0


def test_standard_errors_are_those_of_a_straight_line():
    """y = a + b t by least squares: s^2 = SSR / (n - 2), var b = s^2 / sum (t - mean)^2."""
    t, scales = np.array([0.0, 1.0, 2.0, 4.0]), {"a": Scale(-10.0, 10.0), "b": Scale(-5.0, 5.0)}
    slopes, residuals = np.column_stack([20.0 + 0 * t, 10.0 * t]), np.array([0.1, -0.2, 0.1, 0.05])
    variance = residuals @ residuals / 2
    gauged, untold = standard_errors(scales, np.array([0.5, 0.5]), residuals, slopes, weighed=False)
    spread = np.sum((t - t.mean()) ** 2)
    assert untold == ()
    assert gauged["b"] == pytest.approx(math.sqrt(variance / spread), rel=1e-12)
    assert gauged["a"] == pytest.approx(math.sqrt(variance * (1 / 4 + t.mean() ** 2 / spread)), rel=1e-12)
    weighed, _ = standard_errors(scales, np.array([0.5, 0.5]), residuals, slopes, weighed=True)
    assert weighed["b"] == pytest.approx(math.sqrt(1 / spread), rel=1e-12)


def test_standard_errors_are_of_values_not_of_their_logarithms():
    scales, slopes = {"E": Scale(10.0, 1000.0)}, np.array([[math.log(100.0)]] * 2)  # residuals are ln E
    errors, _ = standard_errors(scales, np.array([0.5]), np.zeros(2), slopes, weighed=True)
    assert errors["E"] == pytest.approx(100.0 / math.sqrt(2), rel=1e-12)


def test_keys_that_only_their_sum_tells_have_no_error():
    scales = {"a": Scale(0.0, 1.0), "b": Scale(0.0, 1.0), "c": Scale(0.0, 1.0)}
    slopes = np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    errors, untold = standard_errors(scales, np.full(3, 0.5), np.zeros(3), slopes, weighed=True)
    assert untold == ("a", "b")
    assert math.isnan(errors["a"]) and math.isnan(errors["b"]) and errors["c"] == pytest.approx(1.0)


def test_as_many_numbers_as_keys_leave_no_scatter_to_tell_an_error():
    errors, untold = standard_errors({"a": Scale(0.0, 1.0)}, np.array([0.5]), np.zeros(1), np.eye(1), weighed=False)
    assert untold == () and math.isnan(errors["a"])


@pytest.mark.parametrize(("uncertainty", "residual"), [(math.nan, 0.5), (0.01, 2.0)], ids=["from rest", "uncertainty"])
def test_residual_is_in_uncertainties_or_in_distances_from_rest(uncertainty, residual):
    number = SimpleNamespace(case="s", key="nucleus.J1_max")
    one = SimpleNamespace(ours=2.06, theirs=2.04, rest=2.0, uncertainty=uncertainty, reference=number)
    assert _Search.residual(SimpleNamespace(reference="m.toml"), one) == pytest.approx(residual, rel=1e-9)
