"""PETSc's own BDF2 on the package's residual: two integrators that share the forms and no line of time stepping.

PETSc solves R(t, u, du/dt) = 0 with dE/dt = sym(F^T grad du/dt) where the package differentiates E itself; first step
and predictor are different too. The bodies are wet and come into contact under ramped gravity.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc
from problems import block, displacement_space, hold, march, wet
from scipy.optimize import brentq

from cellmech.cell.driving import ramp
from cellmech.cell.layering import MeshPlan
from cellmech.cell.setup import Setup
from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body, equilibrium
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.kinematics import deformation_gradient
from cellmech.mechanics.obstacles import Pillar
from cellmech.scene.files import read_scene
from cellmech.solver.schedule import Schedule
from cellmech.solver.simulation import Simulation
from cellmech.solver.state import State

CHECKS = 10  # times at which controlled steps are compared, evenly over the whole history


@dataclass(frozen=True)
class Problem:
    """A body, its weight [Pa µm], and a history: gravity rises until `ramp_end`."""

    body: Body
    weight: float
    ramp_end: float
    end: float
    steps: tuple[int, ...]  # numbers of equal steps at which the second order shows


@lru_cache
def wet_block():
    """A unit block on a round obstacle, in the end some 10 % flatter."""
    domain = block(nx=2, ny=2, bottom="outer")
    space = displacement_space(domain)
    material = wet(young=20.0, poisson=0.3, fluid_fraction=0.5, fluid_lambda=5.0, fluid_mu=2.0)
    body = Body(
        domain,
        material_fields(domain, {"solid": material}),
        space,
        (hold(space, domain, "left", 0),),
        (0.0, -3.0),
        contact=Contact(kappa=20.0, width=0.05),
        obstacles=(Pillar(0.0, -1.0, 1.5, 1.0, 2.0),),
        amplitude=ramp(1.0),
    )
    return Problem(body, 3.0, 2.0, 2.0, (40, 80, 160))


@lru_cache
def wet_cell():
    """Table 1 on a coarse mesh, its fluid 100 times as viscous: it takes 2,600 s to relax, a quarter of the ramp."""
    scene = read_scene({"mesh": {"size_um": 4.0, "thin_layers": 1}, "cell": {"fluid_lambda_Pa_s": 1e5}}, "test")
    setup = Setup(scene, MPI.COMM_SELF, MeshPlan())
    return Problem(setup.body, setup.force_scale, scene.ramp_end_s, 12000.0, (20, 40, 80))


PROBLEMS = pytest.mark.parametrize("make", [wet_block, wet_cell], ids=["block", "cell"])


@dataclass(frozen=True)
class History:
    """Times after the start [s], displacements then [µm] of shape (times, dofs), and what they took."""

    t: np.ndarray
    u: np.ndarray
    steps: int
    newton: int

    def difference(self, other, times):
        """Largest difference at times that both hold, of any component, relative to the largest displacement [-]."""
        mine, theirs = (h.u[[np.argmin(np.abs(h.t - t)) for t in times]] for h in (self, other))
        return np.max(np.abs(mine - theirs)) / np.max(np.abs(other.u))


def even(problem, n):
    return problem.end * np.arange(1, n + 1) / n


def pushed_in(problem, t):
    """The rigid translation that balances the load at this time [µm], flat.

    Free of strain, so it changes no history that starts from it; but at first touch the tangent is singular.
    """
    run = Simulation(problem.body, Schedule(problem.end), problem.weight)
    weight = -problem.body.amplitude(t) * run.ledger.load_resultant()[1]

    def imbalance(depth):
        run.u[:] = np.tile([0.0, -depth], len(run.u) // 2)
        return run.ledger.contact_force()[1] - weight

    imbalance(brentq(imbalance, 0.0, 0.1, xtol=1e-12))
    run.close()
    return run.u.copy()


class RateState(State):
    """A state whose velocity is an unknown of its own, as PETSc's implicit form has it."""

    def __init__(self, body):
        super().__init__(body)
        self.v = fem.Function(body.space)

    def velocity(self):
        return self.v

    def strain_rate(self):
        return ufl.sym(deformation_gradient(self.u, self.kinematics).T * self.kinematics.gradient(self.v))


class ImplicitForm:
    """R(t, u, du/dt) and its tangent shift dR/d(du/dt) + dR/du as PETSc's TS calls them."""

    def __init__(self, body):
        self.body, self.state, mesh = body, RateState(body), body.domain.mesh
        self.amplitude, self.shift = (fem.Constant(mesh, 0.0) for _ in range(2))
        R, K = equilibrium(body, self.state, self.amplitude)
        K += self.shift * ufl.derivative(R, self.state.v, ufl.TrialFunction(body.space))
        self.R, self.K = compile_form(R, mesh.comm), compile_form(K, mesh.comm)

    def _set(self, t, u, v):
        self.amplitude.value = self.body.amplitude(t)
        self.state.u.x.array[:] = u.getArray(readonly=True)
        self.state.v.x.array[:] = v.getArray(readonly=True)

    def residual(self, ts, t, u, v, r):
        self._set(t, u, v)
        r.set(0.0)
        petsc.assemble_vector(r, self.R)
        petsc.set_bc(r, list(self.body.bcs), u, -1.0)

    def tangent(self, ts, t, u, v, shift, J, P):
        self._set(t, u, v)
        self.shift.value = shift
        P.zeroEntries()
        petsc.assemble_matrix(P, self.K, list(self.body.bcs))
        P.assemble()


@lru_cache
def theirs(make, n):
    """PETSc's TSBDF of order 2 with n equal steps."""
    problem, options = make(), PETSc.Options()
    form, step = ImplicitForm(problem.body), problem.end / n
    x, r, J = petsc.create_vector(form.R), petsc.create_vector(form.R), petsc.create_matrix(form.K)
    options["tsbdf_ts_bdf_order"], options["tsbdf_ts_adapt_type"] = 2, "none"
    ts = PETSc.TS().create(MPI.COMM_SELF)
    ts.setOptionsPrefix("tsbdf_")
    ts.setType("bdf")
    ts.setIFunction(form.residual, r)
    ts.setIJacobian(form.tangent, J)
    ts.setTimeStep(step)
    ts.setMaxTime(problem.end)
    ts.setMaxSteps(n + 1)
    ts.setExactFinalTime(PETSc.TS.ExactFinalTime.MATCHSTEP)
    ts.getSNES().setTolerances(rtol=0.0, atol=1e-10 * problem.weight, stol=0.0, max_it=30)
    ts.getSNES().getKSP().setType("preonly")
    ts.getSNES().getKSP().getPC().setType("lu")
    ts.getSNES().getKSP().getPC().setFactorSolverType("mumps")
    ts.setFromOptions()
    seen = []
    ts.setMonitor(lambda ts, k, t, u: seen.append((t, u.getArray(readonly=True).copy())))
    x.array[:] = pushed_in(problem, step / 2)  # it begins with half a step
    ts.solve(x)
    assert ts.getConvergedReason() == PETSc.TS.ConvergedReason.CONVERGED_TIME
    t, u = zip(*seen[1:], strict=True)
    history = History(np.array(t), np.array(u), ts.getStepNumber(), ts.getSNESIterations())
    for held in (ts, J, r, x):
        held.destroy()
    return history


def ours(make, n):
    """The package's BDF2 with n equal steps."""
    problem, u = make(), []
    state = State(problem.body)
    state.u.x.array[:] = pushed_in(problem, problem.end / n)

    def on_step(t):
        u.append(state.u.x.array.copy())

    march(problem.body, problem.weight, np.full(n, problem.end / n), on_step, state, tolerance=1e-9)
    return History(even(problem, n), np.array(u), n, 0)


@lru_cache
def controlled(make, rtol):
    """The package's run with error control, from first touch."""
    problem, t, u = make(), [], []
    landings = (*even(problem, CHECKS), problem.ramp_end)
    run = Simulation(problem.body, Schedule(problem.end, landings, rtol, problem.ramp_end), problem.weight)

    def on_step(step):
        t.append(step.t_s)
        u.append(run.u.copy())

    run.run(on_step)
    run.close()
    return History(np.array(t), np.array(u), run.totals.steps, run.totals.newton_iterations)


@PROBLEMS
def test_both_integrators_approach_each_other_at_second_order(make, ladder):
    numbers = make().steps
    differences = [ours(make, n).difference(theirs(make, n), even(make(), n)) for n in numbers]
    ladder.order(
        f"BDF2 and PETSc's, {make.__name__.replace('_', ' ')}: difference of u in the step", differences, 2.0, 0.1
    )


@PROBLEMS
def test_controlled_steps_follow_the_other_integrator_within_the_tolerance(make, ladder):
    problem, n = make(), make().steps[-1]
    times, rtol = even(problem, CHECKS), Schedule(problem.end).rtol
    reference = theirs(make, 2 * n)
    left = theirs(make, n).difference(reference, times) / 3  # the reference's own error: it is of second order
    loose, default = (controlled(make, r).difference(reference, times) for r in (10 * rtol, rtol))
    assert 10 * left < default < 0.5 * loose < 0.5 * 10 * rtol
    case = f"default time steps, {make.__name__.replace('_', ' ')}: difference of u from PETSc's, over rtol"
    ladder.between(case, ours=default / rtol, low=0.01, high=1.0)
