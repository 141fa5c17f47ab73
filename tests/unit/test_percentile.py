"""The 99th percentile of stress over an area: by hand, and the same however the points are shared among ranks."""

from types import SimpleNamespace

import numpy as np
import pytest

from cellmech.cell.observables import ABOVE_P99
from cellmech.cell.samples import GREATEST, Region, exceeded_on


def percentile(mises, area, ranks=1):
    """Of points that are dealt out to ranks in turn, as the observer finds it; values [Pa], areas [µm^2]."""
    rows = []
    for rank in range(ranks):
        values = np.zeros((1, len(mises[rank::ranks]), GREATEST + 1))
        values[..., 0] = mises[rank::ranks]
        samples = SimpleNamespace(values=values, size=area[rank::ranks][None])
        points = np.arange(values.shape[1])
        rows.append(Region(samples, None, points, points).largest_mises(ABOVE_P99 * area.sum()))
    return exceeded_on(ABOVE_P99 * area.sum(), rows), sum(row.shape[1] for row in rows)


def test_percentile_of_equal_areas_is_the_99th_of_a_hundred():
    """Its bound lies exactly between two points there, where a sum's last digit must not decide."""
    for area in (1.0, 0.1, 1 / 3, 1e-7):
        assert percentile(np.random.default_rng(0).permutation(np.arange(1.0, 101.0)), np.full(100, area))[0] == 99.0


def test_percentile_is_of_the_area_and_not_of_the_points():
    mises = np.array([5.0, 100.0, 50.0, 7.0])
    assert percentile(mises, np.array([9.0, 0.05, 0.06, 0.89]))[0] == 50.0  # a quarter of the points is above
    assert percentile(mises, np.array([9.0, 0.005, 0.02, 90.975]))[0] == 7.0  # so is half, on 0.025 % of the area
    assert percentile(mises, np.array([9.0, 0.5, 0.02, 0.48]))[0] == 100.0


@pytest.mark.parametrize("ranks", [2, 3, 7])
def test_percentile_is_the_same_on_any_number_of_ranks_which_exchange_little(ranks):
    random = np.random.default_rng(ranks)
    mises, area = random.lognormal(size=5000), random.uniform(0.1, 10.0, 5000)
    serial, there = percentile(mises, area, ranks)[0], percentile(mises, area)[0]
    assert serial == there == min(v for v in mises if area[mises > v].sum() <= 0.01 * area.sum())
    assert percentile(mises, area, ranks)[1] < 0.02 * len(mises) * ranks
    assert percentile(mises[:3], area[:3], ranks)[0] == mises[:3].max()  # some ranks may have no point
