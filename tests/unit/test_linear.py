"""The linear solver: multigrid solves what MUMPS solves, to the share asked for, and says when it does not."""

import dataclasses
import math

import numpy as np
import pytest
from dolfinx import fem
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc
from problems import block, displacement_space, solid
from slab import LEVELS, PUSH, slab

from cellmech.causes import Cause
from cellmech.fem import fenicsx
from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body, equilibrium
from cellmech.solver import coarse, linear, room
from cellmech.solver.coarse import flatness, interpolation
from cellmech.solver.linear import PREFIX, Choice, Multigrid, choose
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

ROWS, WIDE = len(LEVELS) - 1, 4


@pytest.fixture(scope="module")
def body():
    return slab(MPI.COMM_SELF)


class System:
    """A tangent away from rest, a right-hand side without what is held, and multigrid for it."""

    def __init__(self, body):
        state = State(body)
        X = body.space.tabulate_dof_coordinates()
        state.u.x.array[:] = (0.2 * X[:, 2:] ** 2 * [1.0, 0.3, 0.1]).ravel()
        _, K = equilibrium(body, state, fem.Constant(body.domain.mesh, 1.0))
        self.form = compile_form(K, MPI.COMM_SELF)
        self.A = petsc.create_matrix(self.form, "baij")
        petsc.assemble_matrix(self.A, self.form, list(body.bcs))
        self.A.assemble()
        self.r, self.z = self.A.createVecs()
        self.held = np.concatenate([bc.dof_indices()[0] for bc in body.bcs])
        values = np.random.default_rng(1).normal(size=self.r.getLocalSize())
        values[self.held] = 0.0
        self.r.setArray(values)
        self.multigrid, self.pc = Multigrid(body), PETSc.PC().create(MPI.COMM_SELF)
        self.pc.setOperators(self.A)
        self.multigrid.install(self.pc)

    def left(self):
        rest = self.r.duplicate()
        self.A.mult(self.z, rest)
        rest.axpy(-1.0, self.r)
        return rest.norm() / self.r.norm()

    @property
    def iterations(self):
        return self.multigrid._ksp.getIterationNumber()


def test_settled_body_is_the_same_with_either_solver(body, monkeypatch):
    found = []
    for large in (linear.LARGE, 0):
        monkeypatch.setattr(linear, "LARGE", large)
        state = State(body)
        solver = Solver(body, state, PUSH, tolerance=1e-10)
        assert solver.choice.multigrid == (large == 0)
        assert solver.solve(1.0).converged
        found.append(state.u.x.array.copy())
        solver.close()
    assert np.abs(found[0]).max() > 0.1
    np.testing.assert_allclose(found[1], found[0], rtol=0.0, atol=1e-8 * np.abs(found[0]).max())


@pytest.mark.parametrize(("share", "least", "most"), [(1e-9, 1e-4, 1e-2), (0.2, 1e-2, 0.06), (None, 1e-11, 1e-8)])
def test_linear_solve_leaves_the_share_that_is_asked_for_and_does_no_more(body, share, least, most):
    """Newton asks for one part in a hundred, or less where it is nearly there; a border is solved for to 1e-8."""
    system = System(body)
    if share is None:
        system.multigrid.exactly(system.r, system.z)
    else:
        system.multigrid.aim(share)
        system.pc.apply(system.r, system.z)
    assert least < system.left() <= 1.01 * most
    assert system.multigrid.fault() is None


def test_solve_that_stops_early_gives_no_number_and_says_so(body, monkeypatch):
    monkeypatch.setattr(linear, "FACTORISED", 0)
    system = System(body)
    monkeypatch.setattr(linear, "MOST_ITERATIONS", 2)
    system.multigrid.exactly(system.r, system.z)
    assert math.isnan(system.z.norm())
    assert "of the residual is left after 2 iterations" in str(system.multigrid.fault())


def test_factors_stand_in_for_cycles_that_stop_early_until_all_is_forgotten(body, monkeypatch):
    system = System(body)
    monkeypatch.setattr(linear, "MOST_ITERATIONS", 2)
    system.multigrid.exactly(system.r, system.z)
    made = system.multigrid.iterations
    assert system.left() < 1e-11 and made == 2 and system.multigrid.fault() is None
    system.A.scale(2.0)
    system.multigrid.setUp(system.pc)  # another tangent
    system.pc.apply(system.r, system.z)
    assert system.left() < 1e-11 and system.multigrid.iterations == made
    monkeypatch.undo()
    system.multigrid.reset(system.pc)
    system.multigrid.setUp(system.pc)
    system.multigrid.exactly(system.r, system.z)
    assert 1e-11 < system.left() < 1e-7 and system.multigrid.iterations > made


def test_newton_tells_of_a_linear_solver_that_stops_early(body, monkeypatch):
    monkeypatch.setattr(linear, "FACTORISED", 0)
    monkeypatch.setattr(linear, "LARGE", 0)
    monkeypatch.setattr(linear, "MOST_ITERATIONS", 1)
    monkeypatch.setattr(linear, "FORCING", 1e-6)
    outcome = Solver(body, State(body), PUSH).solve(1.0)
    assert not outcome.converged
    assert outcome.reason.cause is Cause.NOT_SOLVED


def test_what_is_held_is_left_out_of_the_coarse_space(body):
    P, held = interpolation(body)
    dofs = np.concatenate([bc.dof_indices()[0] for bc in body.bcs])
    assert np.abs(P[np.unique(dofs), :]).max() == 0.0
    columns = np.abs(P[:, :]).max(axis=0)
    np.testing.assert_array_equal(columns == 0.0, held.getArray() == 1.0)
    assert held.sum() == 3 * (WIDE + 1) ** 2
    system = System(body)
    system.r.setArray(np.random.default_rng(2).normal(size=system.r.getLocalSize()))
    system.multigrid.exactly(system.r, system.z)
    np.testing.assert_allclose(system.z.getArray()[system.held], system.r.getArray()[system.held], atol=1e-6)


def test_node_that_is_held_alone_is_left_out_of_the_coarse_space(body):
    """In the middle of an edge whose ends are free, which move it else."""
    X = body.space.tabulate_dof_coordinates()
    x, y = WIDE * X[:, 0], WIDE * X[:, 1]
    between = np.isclose(np.abs(x - np.round(x)), 0.5) & np.isclose(y, np.round(y)) & np.isclose(X[:, 2], 1.0)
    node = int(np.flatnonzero(between)[0])
    alone = fem.dirichletbc(fem.Function(body.space), np.array([node], dtype=np.int32))
    P, held = interpolation(dataclasses.replace(body, shells={}, bcs=(alone,)))
    rows = np.abs(P[:, :]).max(axis=1).reshape(-1, 3)
    assert np.flatnonzero((rows == 0.0).all(axis=1)).tolist() == [node]
    assert held.sum() == 0


def test_coarse_space_keeps_the_order_of_shells_only(body):
    P, held = interpolation(body)
    vertices = (WIDE + 1) ** 2 * (ROWS + 1)
    nodes_of_the_layer = (2 * WIDE + 1) ** 2 * 3
    assert P.getSize()[1] == 3 * (vertices + nodes_of_the_layer - 2 * (WIDE + 1) ** 2)
    ones = P.createVecRight()
    ones.set(1.0)
    ones.axpy(-1.0, held)
    above = body.space.tabulate_dof_coordinates()[:, 2] > LEVELS[1] + 1e-9
    moved = (P * ones).getArray().reshape(-1, 3)[above]
    np.testing.assert_allclose(moved, 1.0, atol=1e-12)


def test_shell_keeps_its_order_by_its_stiffness_and_slenderness(body):
    """Its cells are flat, 0.05 by 0.35: a stiffness of 20 is enough, one of 0.5 is not."""
    kept, _ = interpolation(dataclasses.replace(body, shells={"stiff": 20.0}))
    assert kept.getSize() == interpolation(body)[0].getSize()
    P, _ = interpolation(dataclasses.replace(body, shells={"stiff": 0.5}))
    assert P.getSize()[1] == 3 * (WIDE + 1) ** 2 * (ROWS + 1)


def test_stiff_shell_needs_its_order_on_the_coarse_level(body, monkeypatch):
    needed = []
    for bends in (coarse.BENDS, np.inf):
        monkeypatch.setattr(coarse, "BENDS", bends)
        system = System(body)
        system.multigrid.exactly(system.r, system.z)
        needed.append(system.iterations)
    assert needed[0] <= 30
    assert needed[1] > 1.5 * needed[0]


def test_set_up_serves_for_further_tangents_until_it_costs_too_much(body, monkeypatch):
    system = System(body)
    made = []
    monkeypatch.setattr(system.multigrid, "_coarsen", lambda A, real=system.multigrid._coarsen: made.append(real(A)))
    system.multigrid.exactly(system.r, system.z)
    system.A.scale(2.0)
    system.multigrid.exactly(system.r, system.z)
    assert len(made) == 1
    assert system.left() <= 1.01e-8
    system.multigrid._lost = linear.SET_UP + 1
    system.A.scale(2.0)
    system.multigrid.exactly(system.r, system.z)
    assert len(made) == 2
    assert system.left() <= 1.01e-8


def test_options_of_its_prefix_reach_the_solver_and_others_do_not(body):
    options = PETSc.Options()
    mine, others = f"{PREFIX}mg_levels_ksp_max_it", ("mg_levels_ksp_max_it", "ksp_max_it", "ksp_type")
    before = options.getString(mine, "")
    options[mine] = 7
    for key in others:
        options[key] = "cg" if key == "ksp_type" else 3
    try:
        system = System(body)
        with fenicsx.own_options():
            system.pc.setUp()
        assert system.multigrid._ksp.getPC().getMGSmoother(1).getTolerances()[3] == 7
        assert system.multigrid._ksp.getType() == "gmres"
    finally:
        for key in (mine, *others):
            options.delValue(key)
        if before:
            options[mine] = before


def test_choice_goes_by_geometry_and_size(body, monkeypatch):
    assert not choose(body).multigrid
    assert "2187 unknowns" in choose(body).reason
    monkeypatch.setattr(linear, "LARGE", 2187)
    assert choose(body).multigrid
    domain = block(nx=2, ny=2)
    monkeypatch.setattr(linear, "LARGE", 0)
    plane = Body(domain, material_fields(domain, {"solid": solid()}), displacement_space(domain))
    assert choose(plane) == Choice(False)


def test_body_that_takes_more_memory_than_there_is_is_refused_with_the_size_that_fits(body, monkeypatch):
    unknowns = body.space.dofmap.index_map.size_global * 3
    needed = room.needed_bytes(unknowns, 2, False)
    monkeypatch.setattr(room, "available_bytes", lambda comm: needed / 8)
    told = rf"{unknowns:,} unknowns need about .* GiB.*mesh.size_um 2\.00 times as large"
    with pytest.raises(MemoryError, match=told):
        choose(body)
    monkeypatch.setattr(room, "available_bytes", lambda comm: needed * 1.01)
    choose(body)


def test_flatness_of_tetrahedra():
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    flat = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0], [0, 0, 0.5]], dtype=float)
    np.testing.assert_allclose(flatness(np.array([regular, flat])), [math.sqrt(2 / 3), 0.0977], rtol=5e-3)
