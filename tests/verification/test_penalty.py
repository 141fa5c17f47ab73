"""What the penalty costs, apart from what the mesh costs.

A block on a flat under an uneven dead pressure on its top, its whole bottom in contact: the rigid flat is a bottom
held by u_y = 0, on the same mesh, and the penalty's modelling error is the distance from that. The mesh error at a
fixed penalty is that of the manufactured solution under contact (test_manufactured.py).
"""

from dataclasses import replace

import numpy as np
import ufl
from dolfinx import fem
from problems import block, displacement_space, hold, solid

from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.obstacles import Flat
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

YOUNG, LOAD = 20.0, 4.0


def penalised_and_rigid(n, stiffnesses):
    """L2 distance from the rigid flat [µm^2] at each penalty [Pa/µm], on n x n squares cut in two."""
    domain = block(nx=n, ny=n, bottom="outer")
    space, x = displacement_space(domain), ufl.SpatialCoordinate(domain.mesh)
    rigid = Body(
        domain,
        material_fields(domain, {"solid": solid("neo-hookean", YOUNG, 0.3)}),
        space,
        (hold(space, domain, "left", 0), hold(space, domain, "outer", 1)),
        tractions={"top": -LOAD * ufl.as_vector([0.0, 1 + ufl.cos(np.pi * x[0]) / 2])},
    )
    kappa, s = (fem.Constant(domain.mesh, 0.0) for _ in range(2))
    resting = replace(rigid, bcs=rigid.bcs[:1], contact=Contact("surface", kappa, s), obstacles=(Flat(0.0),))
    exact, state = State(rigid), State(resting)
    outcome = Solver(rigid, exact, LOAD, tolerance=1e-12).solve(1.0)
    assert outcome.converged, outcome.reason
    solver = Solver(resting, state, LOAD, tolerance=1e-12)
    gap = state.u - exact.u
    norm = compile_form(ufl.inner(gap, gap) * domain.dx(4), domain.mesh.comm)
    distances = []
    for value in stiffnesses:
        kappa.value, s.value = value, 0.1 * LOAD / value
        state.u.x.array[:] = exact.u.x.array
        state.u.x.array[1::2] -= LOAD / value
        outcome = solver.solve(1.0)
        assert outcome.converged, outcome.reason
        distances.append(np.sqrt(fem.assemble_scalar(norm)))
    return np.array(distances)


def test_modelling_error_of_the_penalty_goes_like_1_over_kappa_on_a_fixed_mesh(ladder):
    stiffnesses = 400.0 * 4.0 ** np.arange(4)
    found = penalised_and_rigid(8, stiffnesses)
    ladder.order("penalty: κ at fixed h, distance from the rigid flat", found, 1.0, 0.02, 1 / stiffnesses)


def test_modelling_error_of_the_penalty_stays_when_the_mesh_is_refined(ladder):
    """So no rate in h against the rigid flat is kept at a fixed penalty."""
    found = np.array([penalised_and_rigid(n, [400.0])[0] for n in (4, 8, 16)])
    case = "penalty: h at fixed κ, distance from the rigid flat on half the mesh size over that before"
    ladder.between(case, ours=found[1:] / found[:-1], low=0.99, high=1.01)
