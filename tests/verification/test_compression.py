"""Plane-strain compression of Mooney-Rivlin and Yeoh: the incompressible closed form is their limit nu -> 1/2."""

import numpy as np
import pytest
import ufl
from dolfinx.fem import petsc
from problems import affine, block, displacement_space, hold, moduli, solid

from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body, internal_work
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

YOUNG, SECTION = 10.0, 2.0
LAWS = [("mooney-rivlin", 2.5), ("yeoh", 2.5), ("yeoh", 0.25)]


def incompressible(law, beta_over_mu, w):
    """The force [Pa µm] at a relative height change w, positive in tension (verification.md)."""
    constants = moduli(law, YOUNG, 0.5 - 1e-12, beta_over_mu=beta_over_mu)
    mu, beta = constants["mu"], constants["beta"]
    alpha = mu / 2 - beta
    c20, c30 = (-0.5 * alpha / 2, 0.1 * alpha / 3) if law == "yeoh" else (0.0, 0.0)
    shape = w * (2 + w) / (1 + w)
    bracket = alpha + beta + 2 * c20 * shape**2 + 3 * c30 * shape**4
    return 2 * SECTION * w * (2 + w) * (1 + (1 + w) ** 2) / (1 + w) ** 3 * bracket


def force(law, beta_over_mu, poisson, w):
    """The force on the top [Pa µm] of a block on rollers whose sides are free."""
    domain = block(SECTION, 1.0, 2, 1)
    space = displacement_space(domain)
    bcs = (hold(space, domain, "left", 0), hold(space, domain, "bottom", 1), hold(space, domain, "top", 1, w))
    material = solid(law, YOUNG, poisson, beta_over_mu=beta_over_mu)
    body = Body(domain, material_fields(domain, {"solid": material}), space, bcs)
    state = State(body)
    state.u.x.array[:] = affine(space, [[-w / (1 + w), 0.0], [0.0, w]])
    outcome = Solver(body, state, YOUNG, tolerance=1e-13).solve(1.0)
    assert outcome.converged, outcome.reason
    nodal = petsc.assemble_vector(compile_form(internal_work(body, state, ufl.TestFunction(space)), domain.mesh.comm))
    top = np.isclose(space.tabulate_dof_coordinates()[:, 1], 1.0)
    return nodal.getArray().reshape(-1, 2)[top, 1].sum()


@pytest.mark.parametrize(("law", "beta_over_mu"), LAWS)
@pytest.mark.parametrize("w", [-0.25, 0.15])
def test_force_goes_to_the_incompressible_one_linearly_in_1_less_2_nu(law, beta_over_mu, w, ladder):
    gaps = 3e-3 * 0.25 ** np.arange(4)
    limit = incompressible(law, beta_over_mu, w)
    forces = np.array([force(law, beta_over_mu, (1 - gap) / 2, w) for gap in gaps])
    case = f"incompressible limit, {law}, β/µ = {beta_over_mu:g}, height {w:+.0%}"
    extrapolated = (4 * forces[-1] - forces[-2]) / 3
    ladder(f"{case}: force extrapolated to ν = 1/2", ours=extrapolated, reference=limit, rel=1e-5, unit="Pa µm")
    ladder.order(f"{case}: error in 1 - 2ν", np.abs(forces / limit - 1), 1.0, 0.05, gaps)
