"""The nonlinear solve: what converged means, what a failure says, rigid modes taken out."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from dolfinx import fem
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc
from problems import block, displacement_space, hold, layered_disc, solid

from cellmech.causes import Cause
from cellmech.cell.layering import MeshPlan
from cellmech.cell.setup import Setup
from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body, equilibrium
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.obstacles import Flat
from cellmech.scene.files import read_scene
from cellmech.solver import newton
from cellmech.solver.linear import Direct
from cellmech.solver.newton import MAX_ITERATIONS, Solver
from cellmech.solver.rigid_modes import rigid_modes
from cellmech.solver.schedule import Schedule
from cellmech.solver.simulation import Simulation
from cellmech.solver.state import State

PULL = 6.0


def pulled_block(traction=PULL, law="neo-hookean"):
    domain = block(nx=3, ny=3, bottom="outer")
    space = displacement_space(domain)
    bcs = (hold(space, domain, "left", 0), hold(space, domain, "outer", 1))
    body = Body(
        domain, material_fields(domain, {"solid": solid(law)}), space, bcs, tractions={"right": (traction, 0.0)}
    )
    return body, State(body)


def test_solution_is_in_equilibrium_to_the_tolerance_asked_for():
    """The residual, assembled apart from the solver, is zero but for the held dofs; these carry the traction."""
    body, state = pulled_block()
    outcome = Solver(body, state, PULL, tolerance=1e-11).solve(1.0)
    assert outcome.converged and outcome.reason is None
    assert 2 <= outcome.iterations <= MAX_ITERATIONS
    assert 1 <= outcome.factorisations <= outcome.iterations + 1
    assert outcome.residual <= 1e-11 * PULL
    R, _ = equilibrium(body, state, fem.Constant(body.domain.mesh, 1.0))
    forces = petsc.assemble_vector(compile_form(R, body.domain.mesh.comm)).getArray().copy()
    held = np.concatenate([bc.dof_indices()[0] for bc in body.bcs])
    assert np.linalg.norm(np.delete(forces, held)) <= 1e-11 * PULL
    assert forces[0::2].sum() == pytest.approx(-PULL, rel=1e-9)
    assert np.abs(state.u.x.array).max() > 0.2


def test_second_solve_starts_from_the_first_and_needs_nothing():
    body, state = pulled_block()
    solver = Solver(body, state, PULL)
    assert solver.solve(1.0).iterations > 0
    u = state.u.x.array.copy()
    assert solver.solve(1.0).iterations == 0
    np.testing.assert_array_equal(state.u.x.array, u)


def test_solution_does_not_depend_on_the_way_to_it():
    """In five load steps, with kept factorisations, or at once."""
    body, state = pulled_block()
    solver = Solver(body, state, PULL, tolerance=1e-12)
    for amplitude in (0.2, 0.4, 0.6, 0.8, 1.0):
        assert solver.solve(amplitude).converged
    stepped = state.u.x.array.copy()
    body, state = pulled_block()
    assert Solver(body, state, PULL, tolerance=1e-12).solve(1.0).converged
    np.testing.assert_allclose(state.u.x.array, stepped, rtol=0, atol=1e-10)


def test_failed_solve_says_that_the_load_has_no_equilibrium():
    """Twice the load that Saint-Venant can bear in compression."""
    body, state = pulled_block(-8.0, "saint-venant")
    outcome = Solver(body, state, 8.0).solve(1.0)
    assert not outcome.converged
    assert outcome.reason.cause in (Cause.NO_CONVERGENCE, Cause.NONE_NEARBY, Cause.INSIDE_OUT)


@pytest.mark.parametrize("allowed", [2, 3, 4, 5, 6, 7])
def test_solve_that_runs_out_of_iterations_ends(allowed, monkeypatch):
    """Whether the last tangent was a kept one or not, there is one more try at most, with a new one each time."""
    factorised = []
    body, state = pulled_block(2 * PULL)
    solver = Solver(body, state, PULL, tolerance=1e-13)
    plain = Solver.rebuild

    def rebuild(self):
        factorised.append(self.factorisations)
        assert len(factorised) <= 2, "goes round in circles"
        plain(self)

    monkeypatch.setattr(Solver, "rebuild", rebuild)
    monkeypatch.setattr(newton, "MAX_ITERATIONS", allowed)
    outcome = solver.solve(1.0)
    assert outcome.iterations <= 2 * allowed
    assert outcome.converged or outcome.reason.cause is Cause.NO_CONVERGENCE


def test_body_that_nothing_holds_is_refused():
    """Pushed off its balance without anything to resist: never a solution, whatever the factorisation makes of it."""
    body, state = pulled_block()
    outcome = Solver(dataclasses.replace(body, bcs=()), state, PULL).solve(1.0)
    assert not outcome.converged
    assert outcome.reason


NEARLY = {"cell": {"poisson": 0.499}, "mesh": {"size_um": 6.0, "pressure": "mixed", "order": 2}}


FACTORISED = pytest.mark.parametrize(
    "tables", [{}, {"cell": {"shape": "full"}}, NEARLY], ids=["plain", "rigid modes", "pressure"]
)


def run_of(tables):
    scene = read_scene({"mesh": {"size_um": 6.0}, "time": {"history": False}, **tables}, "test")
    return Setup(scene, MPI.COMM_SELF, MeshPlan()).create_run(lambda line: None)


@FACTORISED
def test_every_factorisation_has_the_options_of_the_solver(tables):
    run = run_of(tables)
    run.run(lambda step: None)
    run.solve(0.9)  # the end of a run gives the last factors up
    assert run.solver._linear.pc.getFactorMatrix().getMumpsIcntl(14) == newton.OPTIONS["mat_mumps_icntl_14"]
    run.close()


@FACTORISED
def test_tangent_that_finds_no_room_is_no_fault_of_the_body(tables):
    """MUMPS may take 1 MB; what stands between it and PETSc must not hide that."""
    run = run_of(tables)
    limit = f"{newton.PREFIX}mat_mumps_icntl_23"
    PETSc.Options()[limit] = 1
    try:
        with pytest.raises(MemoryError, match=rf"\({run.u.size} unknowns, ranks: 1, MUMPS error -\d+\)\. Fewer"):
            run.run(lambda step: None)
    finally:
        PETSc.Options().delValue(limit)
    run.close()


@pytest.mark.parametrize(("code", "limit", "cause"), [(-9, 0, Cause.NEARLY_SINGULAR), (-10, 0, Cause.SINGULAR)])
def test_tangent_that_cannot_be_factorised_is_told_from_a_lack_of_memory(code, limit, cause):
    factor = SimpleNamespace(getMumpsInfog=lambda number: code, getMumpsIcntl=lambda number: limit)
    solver = Direct()
    solver.pc = SimpleNamespace(getFactorMatrix=lambda: factor)
    assert solver.fault().cause is cause


# Rigid modes

FLAT, CONTACT = Flat(0.0), Contact("surface", 50.0, 0.005)
RADIUS, GRAVITY = 2.0, 0.5


def resting_disc(shape):
    """A disc, or its right half with a plane of symmetry, settled on a flat."""
    domain = layered_disc(
        shape=shape, centre=(0.0, RADIUS), interfaces=(("soft", RADIUS),), nucleus_radius_um=RADIUS / 2, size_um=0.5
    )
    space = displacement_space(domain)
    half = shape == "half"
    body = Body(
        domain,
        material_fields(domain, {"soft": solid(young=10.0)}),
        space,
        (hold(space, domain, "axis", 0),) if half else (),
        (0.0, -GRAVITY),
        contact=CONTACT,
        obstacles=(FLAT,),
        amplitude=lambda t: t,
    )
    modes = None if half else rigid_modes(body, (0.0, RADIUS), sideways=True)
    run = Simulation(body, Schedule(1.0, ramp_end_s=1.0), GRAVITY * np.pi * RADIUS**2, modes=modes)
    run.run(lambda step: None)
    return run


@pytest.fixture(scope="module")
def discs():
    return {shape: resting_disc(shape) for shape in ("half", "full")}


def test_full_disc_without_its_rigid_modes_equals_the_half_disc(discs):
    half, full = discs["half"], discs["full"]
    assert 2 * half.ledger.contact_force()[1] == pytest.approx(GRAVITY * np.pi * RADIUS**2, rel=2e-3)
    assert full.ledger.contact_force()[1] == pytest.approx(2 * half.ledger.contact_force()[1], rel=1e-8)
    assert full.ledger.stored() == pytest.approx(2 * half.ledger.stored(), rel=1e-7)
    depths = [run.outline.max_depth(run.state.u, [FLAT]) for run in (half, full)]
    assert depths[1] == pytest.approx(depths[0], rel=1e-7)
    assert np.abs(full.u).max() == pytest.approx(np.abs(half.u).max(), rel=1e-7)
    assert np.abs(half.u).max() > 0.1


def test_rigid_modes_are_zero_in_the_solution_and_carry_no_force(discs):
    run = discs["full"]
    body, modes = run.body, run.modes
    x = modes.vectors[0].duplicate()
    x.setArray(run.u)
    for vector in modes.vectors:
        assert vector.norm() == pytest.approx(1.0, rel=1e-12)
        assert abs(vector.dot(x)) < 1e-10
    assert abs(modes.vectors[0].dot(modes.vectors[1])) < 1e-12
    assert max(abs(r) for r in modes.reactions) < 1e-8 * GRAVITY * np.pi * RADIUS**2
    area = body.domain.dx(2)
    mean = fem.assemble_scalar(compile_form(run.state.u[0] * area, body.domain.mesh.comm))
    assert abs(mean) < 1e-10


def test_rigid_mode_vectors_span_the_rotation_and_the_translation(discs):
    """A turn and a step sideways are taken out; the step up, which the contact resists, is not."""
    run = discs["full"]
    space, modes = run.body.space, run.modes
    X = space.tabulate_dof_coordinates()[:, :2] - [0.0, RADIUS]
    x = modes.vectors[0].duplicate()
    work = {}
    for name, motion in (
        ("turn", np.column_stack([-X[:, 1], X[:, 0]])),
        ("sideways", np.tile([1.0, 0.0], (len(X), 1))),
        ("up", np.tile([0.0, 1.0], (len(X), 1))),
    ):
        x.setArray(motion.ravel())
        work[name] = [vector.dot(x) for vector in modes.vectors]
    assert abs(np.linalg.det([work["turn"], work["sideways"]])) > 1.0
    np.testing.assert_allclose(work["up"], 0.0, atol=1e-10)


def test_force_on_a_rigid_mode_is_taken_by_its_constraint_and_reported(discs):
    """A frictionless flat cannot hold a disc that is pushed sideways: the constraints do, and say with what force."""
    push, settled = 0.05 * GRAVITY, discs["full"]
    body = dataclasses.replace(settled.body, body_force=(push, -GRAVITY))
    state, modes = State(body), rigid_modes(body, (0.0, RADIUS), sideways=True)
    state.u.x.array[:] = settled.u
    outcome = Solver(body, state, GRAVITY * np.pi * RADIUS**2, modes=modes).solve(1.0)
    assert outcome.converged, outcome.reason
    x = modes.vectors[0].duplicate()
    x.setArray(np.tile([1.0, 0.0], len(settled.u) // 2))
    held = sum(reaction * vector.dot(x) for reaction, vector in zip(modes.reactions, modes.vectors, strict=True))
    assert held == pytest.approx(-push * np.pi * RADIUS**2, rel=5e-3)  # the mesh's area is not quite the disc's
    np.testing.assert_allclose(state.u.x.array, settled.u, rtol=0, atol=1e-9)  # a uniform push against a uniform hold
