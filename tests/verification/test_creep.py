"""BDF2 and its error control on a homogeneous, nonlinear Kelvin-Voigt creep problem with a reference solved by SciPy.

A unit square of neo-Hookean solid and fluid under a dead traction T on its right side, the other sides free to slide:
F = diag(a, b) with c_s P_s + c_f P_f = diag(T, 0), two ordinary differential equations for a and b.
"""

from functools import lru_cache

import numpy as np
import pytest
from problems import block, displacement_space, hold, march, moduli, wet
from scipy.integrate import solve_ivp

from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.solver.schedule import Schedule
from cellmech.solver.simulation import Simulation

YOUNG, POISSON, TRACTION, END = 10.0, 0.3, 4.0, 3.0
SHARE, LMBDA_F, MU_F = 0.5, 6.0, 3.0


def creep_rates(t, stretches):
    """(da/dt, db/dt) from c_s S_s + c_f S_f = diag(T/a, 0); S_s and S_f by hand (eqs 18, 23)."""
    a, b = stretches
    constants = moduli("neo-hookean", YOUNG, POISSON)
    lmbda, mu = constants["lmbda"], constants["mu"]
    J = a * b
    C_inv = np.array([1 / a**2, 1 / b**2])
    S_solid = mu * (1 - C_inv) + lmbda * np.log(J) * C_inv
    wanted = np.array([TRACTION / a, 0.0]) - (1 - SHARE) * S_solid
    # S_f,i = J C_inv_i (lambda_f sum_j d_j + 2 mu_f d_i) with d = (a'/a, b'/b)
    viscosity = J * C_inv[:, None] * (LMBDA_F * np.ones((2, 2)) + 2 * MU_F * np.eye(2))
    return np.linalg.solve(SHARE * viscosity, wanted) * stretches


@lru_cache
def reference():
    """The displacement of the corner (1, 1) as a function of time."""
    solved = solve_ivp(creep_rates, (0.0, END), [1.0, 1.0], method="Radau", rtol=1e-11, atol=1e-13, dense_output=True)
    assert solved.success
    return lambda t: solved.sol(t) - 1.0


def creeping_block():
    domain = block(bottom="outer")
    space = displacement_space(domain)
    material = wet("neo-hookean", YOUNG, POISSON, fluid_fraction=SHARE, fluid_lambda=LMBDA_F, fluid_mu=MU_F)
    bcs = (hold(space, domain, "left", 0), hold(space, domain, "outer", 1))
    mixture = material_fields(domain, {"solid": material})
    return Body(domain, mixture, space, bcs, tractions={"right": (TRACTION, 0.0)})


def corner(state):
    X = state.u.function_space.tabulate_dof_coordinates()[:, :2]
    return state.u.x.array.reshape(-1, 2)[np.argmin(np.linalg.norm(X - 1.0, axis=1))]


def test_reference_creeps_far_enough_to_be_nonlinear():
    end = reference()(END)
    assert end[0] > 0.4 and end[1] < -0.1
    assert np.linalg.norm(creep_rates(END, end + 1)) < 0.1 * np.linalg.norm(creep_rates(0.0, [1.0, 1.0]))


@pytest.mark.parametrize("ratio", [1.0, 2.0], ids=["constant", "alternating"])
def test_bdf2_converges_with_order_2(ratio, ladder):
    """Error at t = 1, where the creep is still fast, for steps of h, h, … and of 2h/3, 4h/3, 2h/3, …"""
    body, errors = creeping_block(), []
    for n in (20, 40, 80):
        pair = np.array([1.0, ratio]) / (1.0 + ratio) * 2 / n
        state = march(body, TRACTION, np.tile(pair, n // 2))
        errors.append(np.linalg.norm(corner(state) - reference()(1.0)))
    name = "constant" if ratio == 1.0 else "alternating"
    ladder.order(f"BDF2, nonlinear creep, {name} steps: u at t = 1 s", errors, 2.0, 0.05)


@lru_cache
def controlled(rtol):
    """Achieved relative error of a run, its steps, and the totals."""
    run = Simulation(creeping_block(), Schedule(END, rtol=rtol), TRACTION)
    worst, steps = [0.0], []

    def on_step(step):
        worst.append(np.linalg.norm(corner(run.state) - reference()(step.t_s)))
        steps.append(step)

    run.run(on_step)
    largest = max(np.linalg.norm(reference()(t)) for t in np.linspace(0.0, END, 200))
    return max(worst) / largest, steps, run.totals


TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


def test_error_control_makes_the_error_fall_with_the_tolerance(ladder):
    """Monotonically, and as rtol^0.6 or faster; local-error control of a second-order method gives 2/3."""
    errors = np.array([controlled(rtol)[0] for rtol in TOLERANCES])
    assert np.all(np.diff(errors) < 0)
    slope = np.polyfit(np.log(TOLERANCES), np.log(errors), 1)[0]
    ladder.between("error control, creep: error like rtol^q, q", ours=slope, low=0.6, high=1.0)


def test_error_control_at_the_default_tolerance_achieves_what_was_asked_for(ladder):
    achieved, _, _ = controlled(Schedule(END).rtol)
    case = "error control, creep: achieved over requested at the default rtol"
    ladder.between(case, ours=achieved / Schedule(END).rtol, low=0.05, high=5.0)


def test_error_control_ends_exactly_at_the_end_with_growing_steps():
    _, steps, totals = controlled(1e-4)
    sizes = np.array([s.dt_s for s in steps])
    assert steps[-1].t_s == END
    assert sizes.sum() == pytest.approx(END, rel=1e-12)
    assert totals.steps == len(steps)
    assert sizes.max() > 5 * sizes[0]  # creep slows down
    assert all(s.error_estimate <= 1e-4 for s in steps)
