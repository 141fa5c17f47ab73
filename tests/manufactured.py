"""A displacement of our choosing, made the solution by its body force; the stresses are written from the paper."""

import numpy as np
import ufl
from dolfinx import fem
from problems import displacement_space, moduli, prescribe

from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.solver import bdf
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

YOUNG, POISSON = 10.0, 0.3


def manufactured(x, y, sin, cos):
    """A displacement whose gradient reaches some 0.4."""
    return [0.15 * sin(1.5 * y) + 0.1 * x * y, 0.12 * cos(1.5 * x) - 0.05 * y**2]


def symbolic(mesh):
    return ufl.as_vector(manufactured(*ufl.SpatialCoordinate(mesh), ufl.sin, ufl.cos))


def nodal(space):
    X = space.tabulate_dof_coordinates()
    return np.stack(manufactured(X[:, 0], X[:, 1], np.sin, np.cos), axis=1).ravel()


def plane_gradient(u):
    """F = I + grad u in the plane, shape (2, 2), written without the program's own."""
    return ufl.Identity(2) + ufl.grad(u)


def solid_piola(law, F, poisson=POISSON):
    """First Piola-Kirchhoff stress in the plane (eqs 17-20); the 3-D invariants of C3 = diag(C, 1)."""
    constants = moduli(law, YOUNG, poisson)
    lmbda, mu = constants["lmbda"], constants["mu"]
    eye, C = ufl.Identity(2), F.T * F
    C_inv, ln_J = ufl.inv(C), ufl.ln(ufl.det(F))
    if law == "saint-venant":
        E = (C - eye) / 2
        return F * (lmbda * ufl.tr(E) * eye + 2 * mu * E)
    if law == "neo-hookean":
        return F * (mu * (eye - C_inv) + lmbda * ln_J * C_inv)
    beta, third = constants["beta"], 1 / 3
    alpha, I1, I3 = mu / 2 - beta, ufl.tr(C) + 1, ufl.det(C)
    S = 2 * alpha * (eye - I3**third * C_inv) + 2 * beta * (I1 * eye - C - 2 * I3 ** (2 * third) * C_inv)
    S += (lmbda + 2 * mu / 3) * ln_J * C_inv
    if law == "yeoh":
        S += 2 * (-alpha / 2 * (I1 - 3) + alpha / 10 * (I1 - 3) ** 2) * eye
    return F * S


def body_with(domain, material, P, free=(), order=2, **more):
    """The body that P keeps in balance, its displacement given on all sides but the free ones."""
    space = displacement_space(domain, order)
    boundary = fem.Function(space)
    boundary.x.array[:] = nodal(space)
    held = tuple(side for side in domain.facets if side not in free)
    return Body(
        domain,
        material_fields(domain, {"solid": material}),
        space,
        (prescribe(space, domain, held, boundary),),
        body_force=-ufl.div(P),
        **more,
    )


def solved(body, history=()):
    """The solved state of a body; `history` are shares of the displacement at the two times before."""
    state = State(body)
    state.u.x.array[:] = nodal(body.space)
    if history:
        state.ddt.set(bdf.coefficients([1.0, 1.0]))
        for function, share in zip((state.u_n, state.u_nn), history, strict=True):
            function.x.array[:] = share * nodal(body.space)
    outcome = Solver(body, state, YOUNG, tolerance=1e-12).solve(1.0)
    assert outcome.converged, outcome.reason
    return state
