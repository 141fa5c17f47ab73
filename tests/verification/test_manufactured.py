"""Convergence of P2 on curved triangles against a manufactured finite-strain displacement."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from manufactured import manufactured, ring, solved

from cellmech.forms import PointValues, compile_form


def solve(law, n):
    """L2 error and H1-seminorm error."""
    body, state, _ = solved(law, n)
    domain = body.domain
    gap = state.u - manufactured(ufl.SpatialCoordinate(domain.mesh))
    measures = ufl.inner(gap, gap) * domain.dx(8), ufl.inner(ufl.grad(gap), ufl.grad(gap)) * domain.dx(8)
    return [np.sqrt(fem.assemble_scalar(compile_form(m, domain.mesh.comm))) for m in measures]


@pytest.mark.parametrize("law", ["saint-venant", "neo-hookean"])
def test_p2_on_curved_triangles_converges_with_order_3_in_l2_and_2_in_h1(law):
    errors = np.array([solve(law, n) for n in (2, 4, 8)])
    l2, h1 = np.log2(errors[:-1] / errors[1:]).T
    assert np.all(np.abs(l2 - 3.0) < 0.15)
    assert np.all(np.abs(h1 - 2.0) < 0.15)


def test_manufactured_displacement_is_a_finite_strain():
    domain = ring(4)
    H = ufl.grad(manufactured(ufl.SpatialCoordinate(domain.mesh)))
    norm = PointValues(ufl.sqrt(ufl.inner(H, H)), np.array([[0.2, 0.2]]), domain.mesh.comm)
    largest = norm(np.arange(domain.quality["cells"], dtype=np.int32)).max()
    assert 0.3 < largest < 0.6
