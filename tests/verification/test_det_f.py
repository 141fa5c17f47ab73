"""No state with det F <= 0 is ever accepted, and a body that has no equilibrium left is stopped."""

import numpy as np
import pytest
import ufl
from manufactured import plane_gradient
from mpi4py import MPI
from problems import affine, block, displacement_space, hold, solid, wet

from cellmech.causes import Cause
from cellmech.errors import SolveError
from cellmech.fem import jit
from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import PointValues
from cellmech.fem.subdivision import lattice
from cellmech.mechanics.balance import Body
from cellmech.solver.det_f import REPORTED, DetFWatch, node_points, quadrature
from cellmech.solver.newton import Solver
from cellmech.solver.schedule import Schedule
from cellmech.solver.simulation import Simulation
from cellmech.solver.state import State
from cellmech.solver.time_steps import History

YOUNG = 10.0


def column(material, traction, amplitude=lambda t: 1.0, nx=2):
    """A unit square on rollers under a dead traction on its right side."""
    domain = block(nx=nx, ny=nx, bottom="outer")
    space = displacement_space(domain)
    bcs = (hold(space, domain, "left", 0), hold(space, domain, "outer", 1))
    return Body(
        domain,
        material_fields(domain, {"solid": material}),
        space,
        bcs,
        tractions={"right": (traction, 0.0)},
        amplitude=amplitude,
    )


def stretch(state):
    X = state.u.function_space.tabulate_dof_coordinates()[:, :2]
    return 1.0 + state.u.x.array.reshape(-1, 2)[np.argmax(X.sum(axis=1)), 0]


@pytest.mark.parametrize(
    ("H", "admissible"),
    [
        (np.array([[0.3, 0.9], [-0.4, -0.2]]), True),
        (np.array([[-1.001, 0.0], [0.0, 0.0]]), False),
        (np.array([[0.0, 1.01], [1.01, 0.0]]), False),
        (np.array([[-2.0, 0.0], [0.0, -2.0]]), True),  # half a turn
    ],
)
def test_watch_refuses_what_is_turned_inside_out(H, admissible):
    body = column(solid("saint-venant"), 1.0)
    state = State(body)
    state.u.x.array[:] = affine(body.space, H)
    watch = DetFWatch(body, state)
    assert watch.admissible() == admissible
    assert (watch.worst is None) == admissible


def test_watch_sees_an_inversion_at_a_corner_that_no_quadrature_point_feels():
    body = column(solid("saint-venant"), 1.0, nx=1)
    state = State(body)
    X = body.space.tabulate_dof_coordinates()[:, :2]
    middle = np.argmin(np.linalg.norm(X - [0.5, 0.0], axis=1))
    state.u.x.array[2 * middle] = 0.255  # an edge node past the quarter point folds the corner
    watch = DetFWatch(body, state)
    assert not watch.admissible()
    np.testing.assert_allclose(watch.worst[1:], [1.0, 0.0], atol=1e-12)
    state.u.x.array[2 * middle] = 0.245
    assert watch.admissible()


def test_watch_looks_wherever_det_f_is_reported():
    """Of third order: a fold that neither a node nor a quadrature point feels is seen at the points of the lattice."""
    domain = block(nx=1, bottom="outer")
    space = jit.displacement_space(domain.mesh, 3)
    body = Body(domain, material_fields(domain, {"solid": solid("neo-hookean")}), space, ())
    state = State(body)
    det_F = ufl.det(ufl.Identity(2) + ufl.grad(state.u))
    elsewhere = np.vstack([node_points(space), quadrature(domain.mesh, body.bulk_degree)[0]])
    reported, others = (PointValues(det_F, at, MPI.COMM_SELF) for at in (lattice(REPORTED[3])[0], elsewhere))
    watch, folded = DetFWatch(body, state), 0
    for seed in range(200):
        state.u.x.array[:] = 0.05 * np.random.default_rng(seed).standard_normal(len(state.u.x.array))
        if np.min(reported(domain.own_cells)) < 0.0 < np.min(others(domain.own_cells)):
            folded += 1
            assert not watch.admissible()
    assert folded > 3


@pytest.mark.parametrize("law", ["saint-venant", "neo-hookean"])
def test_solver_refuses_an_inverted_first_guess_and_says_where(law):
    """Saint-Venant has finite stresses there, and another equilibrium: nothing but the watch stops it."""
    body = column(solid(law, YOUNG, 0.0), -0.1)
    state = State(body)
    state.u.x.array[:] = affine(body.space, [[-2.0, 0.0], [0.0, 0.0]])
    outcome = Solver(body, state, 0.1).solve(1.0)
    assert not outcome.converged
    assert outcome.reason.cause is Cause.INSIDE_OUT and "det F = -1" in outcome.reason.text


@pytest.mark.parametrize("law", ["saint-venant", "neo-hookean"])
def test_predictor_that_inverts_elements_is_refused_and_the_step_cut(law, monkeypatch):
    body = column(wet(law, YOUNG, 0.3, fluid_lambda=5.0, fluid_mu=2.0), -1.0)
    undisturbed = Simulation(body, Schedule(2.0), 1.0)
    undisturbed.run(lambda step: None)

    plain, calls, lines, times = History.predict, [], [], []
    inverted = affine(body.space, [[-1.5, 0.0], [0.0, 0.0]])

    def predict(self, step):
        calls.append(step)
        return inverted.copy() if len(calls) in (8, 9) else plain(self, step)

    monkeypatch.setattr(History, "predict", predict)
    run = Simulation(body, Schedule(2.0), 1.0, log=lines.append)
    run.run(lambda step: times.append(step.t_s))
    assert run.totals.failed_solves == 2
    assert calls[8] == pytest.approx(calls[7] / 4) and calls[9] == pytest.approx(calls[7] / 16)
    assert all("inside out" in line and "step cut" in line for line in lines) and len(lines) == 2
    assert times[-1] == 2.0
    assert np.all(np.diff(times) > 0)
    assert stretch(run.state) == pytest.approx(stretch(undisturbed.state), abs=5e-4)


def test_saint_venant_under_growing_compression_stops_at_its_limit_point(ladder):
    """nu = 0 and a dead load: P = E/2 a (a^2 - 1) has its minimum -E/(3 sqrt 3) at the stretch a = 1/sqrt 3."""
    limit = YOUNG / (3 * np.sqrt(3))
    body = column(solid("saint-venant", YOUNG, 0.0), -2 * limit, amplitude=lambda t: t)
    steps = []
    run = Simulation(body, Schedule(1.0, ramp_end_s=1.0), limit)
    with pytest.raises(SolveError, match="no equilibrium beyond") as stop:
        run.run(steps.append)
    reached = float(str(stop.value).split("load amplitude ")[1].split(":")[0])
    case = "Saint-Venant compression, ν = 0: largest load borne"
    assert 0.5 - 2e-3 < reached <= 0.5 + 1e-9
    ladder(case, ours=-2 * limit * reached, reference=-limit, rel=4e-3, unit="Pa")
    assert steps[-1].amplitude <= 0.5
    assert np.all(np.isfinite(run.u))
    a = stretch(run.state)
    ladder("Saint-Venant compression, ν = 0: stretch there", ours=a, reference=1 / np.sqrt(3), abs=0.03)
    assert YOUNG / 2 * a * (a**2 - 1) == pytest.approx(-2 * limit * reached, rel=1e-6)
    det_f = PointValues(ufl.det(plane_gradient(run.state.u)), np.array([[0.2, 0.2]]), body.domain.mesh.comm)
    assert det_f(np.arange(8, dtype=np.int32)).min() > 0.5


def test_neo_hookean_goes_through_the_load_that_stops_saint_venant():
    limit = YOUNG / (3 * np.sqrt(3))
    body = column(solid("neo-hookean", YOUNG, 0.0), -2 * limit, amplitude=lambda t: t)
    run = Simulation(body, Schedule(1.0, ramp_end_s=1.0), limit)
    run.run(lambda step: None)
    a, mu = stretch(run.state), YOUNG / 2
    assert mu * (a - 1 / a) == pytest.approx(-2 * limit, rel=1e-8)
