"""A displacement of our choosing, made the solution by its body force; the stresses are written by hand."""

import numpy as np
import ufl
from dolfinx import fem
from laws_by_hand import plane_piola
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
    """First Piola-Kirchhoff stress in the plane, written by hand."""
    return plane_piola(law, F, moduli(law, YOUNG, poisson))


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
