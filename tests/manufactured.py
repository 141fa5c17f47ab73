"""A ring of curved triangles whose body force makes a displacement of our choosing the solution."""

from dataclasses import replace

import numpy as np
import ufl
from dolfinx import fem
from problems import curved_ring, displacement_space, domain_of, moduli, prescribe, solid

from cellmech.materials import mixtures
from cellmech.residual import Body, State
from cellmech.snes import Solver

YOUNG, POISSON = 10.0, 0.3


def manufactured(x):
    """A displacement whose gradient reaches some 0.4."""
    return ufl.as_vector(
        [0.15 * ufl.sin(1.5 * x[1]) + 0.1 * x[0] * x[1], 0.12 * ufl.cos(1.5 * x[0]) - 0.05 * x[1] ** 2]
    )


def piola(law, u, constants):
    """First Piola-Kirchhoff stress written from the paper, not from the package (eqs 17, 18)."""
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


def solved(law, n):
    """The body, its solved state and the law's constants."""
    domain = ring(n)
    space = displacement_space(domain)
    constants = moduli(law, YOUNG, POISSON)
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
        body_force=-ufl.div(piola(law, exact, constants)),
    )
    state = State(body)
    state.u.x.array[:] = boundary.x.array
    outcome = Solver(body, state, YOUNG, tolerance=1e-12).solve(1.0)
    assert outcome.converged, outcome.reason
    return body, state, constants
