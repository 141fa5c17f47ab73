"""Convergence of P2 on curved triangles against a manufactured finite-strain displacement."""

from dataclasses import replace

import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import curved_ring, displacement_space, domain_of, moduli, prescribe, solid

from cellmech.forms import PointValues, compile_form
from cellmech.materials import mixtures
from cellmech.residual import Body, State
from cellmech.snes import Solver

YOUNG, POISSON = 10.0, 0.3


def manufactured(x):
    """A displacement whose gradient reaches some 0.4."""
    return ufl.as_vector(
        [0.15 * ufl.sin(1.5 * x[1]) + 0.1 * x[0] * x[1], 0.12 * ufl.cos(1.5 * x[0]) - 0.05 * x[1] ** 2]
    )


def piola(law, u):
    """First Piola-Kirchhoff stress written from the paper, not from the package (eqs 17, 18)."""
    constants = moduli(law, YOUNG, POISSON)
    lmbda, mu = constants["lmbda"], constants["mu"]
    F = ufl.Identity(2) + ufl.grad(u)
    if law == "saint-venant":
        E = (F.T * F - ufl.Identity(2)) / 2
        return F * (lmbda * ufl.tr(E) * ufl.Identity(2) + 2 * mu * E)
    F_inv_T = ufl.inv(F).T
    return mu * (F - F_inv_T) + lmbda * ufl.ln(ufl.det(F)) * F_inv_T


def ring(n):
    """n rows of curved triangles, alike for every n: structured, because the layers are thinner than the elements."""
    rows = curved_ring(1.05 / n, 1.0, [(f"row {k}", 1.0 + k / n) for k in range(1, n + 1)])
    return replace(rows, **{field: getattr(domain_of(rows.mesh), field) for field in ("cell_tags", "cells")})


def solve(law, n):
    """L2 error and H1-seminorm error."""
    domain = ring(n)
    space = displacement_space(domain)
    exact = manufactured(ufl.SpatialCoordinate(domain.mesh))
    boundary = fem.Function(space)
    X = space.tabulate_dof_coordinates()
    x, y = X[:, 0], X[:, 1]
    boundary.x.array[0::2] = 0.15 * np.sin(1.5 * y) + 0.1 * x * y
    boundary.x.array[1::2] = 0.12 * np.cos(1.5 * x) - 0.05 * y**2
    body = Body(
        domain,
        mixtures(domain, {"solid": solid(law, YOUNG, POISSON)}),
        space,
        (prescribe(space, domain, tuple(domain.facets), boundary),),
        body_force=-ufl.div(piola(law, exact)),
    )
    state = State(body)
    state.u.x.array[:] = boundary.x.array
    outcome = Solver(body, state, YOUNG, tolerance=1e-12).solve(1.0)
    assert outcome.converged, outcome.reason
    gap = state.u - exact
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
