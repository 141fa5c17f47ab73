"""Which von Mises stress the paper may mean: the choices themselves, and their table."""

import math

import numpy as np
import pytest
import ufl

from studies.paper import stresses
from studies.paper.printed import read_paper
from studies.paper.readings import EFFECTIVE, named


@pytest.mark.parametrize(
    ("diagonal", "shear", "zz", "expected"),
    [
        ((3.0, 0.0), 0.0, 0.0, 3.0),
        ((0.0, 0.0), 2.0, 0.0, math.sqrt(12.0)),
        ((5.0, 5.0), 0.0, 5.0, 0.0),
        ((4.0, 1.0), 1.5, 0.0, math.sqrt(16.0 - 4.0 + 1.0 + 3 * 2.25)),
    ],
)
def test_mises_takes_the_zz_it_is_given(diagonal, shear, zz, expected):
    sigma = ufl.as_tensor([[diagonal[0], shear, 0.0], [shear, diagonal[1], 0.0], [0.0, 0.0, 99.0]])
    assert float(stresses._mises(sigma, zz)) == pytest.approx(expected, abs=1e-14)


def test_table_counts_a_row_without_a_solution_as_lost():
    names = [f"{choice}_{region}" for choice in stresses.CHOICES for region in stresses.REGIONS]
    found = [dict.fromkeys(names, 1.03), dict.fromkeys(names, math.nan)]
    section = stresses._section(named(EFFECTIVE), [1.0, 1.0], found)
    assert len(section.rows) == len(names)
    record = section.rows[0].record
    assert record["5 %"] == record["a factor 2"] == 1 and record["rms"] == pytest.approx(
        math.log(1000) / math.sqrt(2), rel=1e-3
    )


def test_choices_of_a_solved_row_are_ordered_as_mechanics_orders_them():
    """The reported one is the first; the solid carries nearly all of it at rest, and the nucleoplasm is a part."""
    paper = read_paper()
    row = next(row for row in paper.rows if row.name == "neo-hookean")
    quick = named(EFFECTIVE)
    found = stresses.stresses(quick, row)
    for choice in stresses.CHOICES:
        assert 0 < found[f"{choice}_nucleoplasm"] <= found[f"{choice}_nucleus"]
    assert found["solid_nucleus"] == pytest.approx(found["mixture_nucleus"], rel=1e-2)
    assert found["poisson_nucleus"] == pytest.approx(found["mixture_nucleus"], rel=0.05)
    assert found["in_plane_nucleus"] > 1.2 * found["mixture_nucleus"]
    assert np.isfinite(list(found.values())).all()
