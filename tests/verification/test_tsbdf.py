"""PETSc's own BDF2 on the package's residual: two integrators that share the forms and no line of time stepping.

PETSc solves R(t, u, du/dt) = 0 with dE/dt = sym(F^T grad du/dt), the package differentiates E itself; starting steps,
predictors, error estimates and step control are different too.
"""

from dataclasses import dataclass
from functools import lru_cache

import dolfinx.fem.petsc as petsc
import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc
from problems import block, displacement_space, hold, march, wet
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from cellmech.contact import Contact, Pillar
from cellmech.forms import compile_form
from cellmech.kinematics import deformation_gradient
from cellmech.materials import mixtures
from cellmech.residual import Body, State, equilibrium
from cellmech.run import Run, Schedule
from cellmech.scene_file import read_scene
from cellmech.setup import Setup


class RateState(State):
    """A state whose velocity is an unknown of its own, as PETSc's implicit form wants it."""

    def __init__(self, body: Body) -> None:
        super().__init__(body)
        self.v = fem.Function(body.space)

    def velocity(self):
        return self.v

    def strain_rate(self):
        return ufl.sym(deformation_gradient(self.u).T * ufl.grad(self.v))


@dataclass(frozen=True)
class History:
    """Accepted times [s], displacements [µm] of shape (times, dofs), and what they took."""

    t: np.ndarray
    u: np.ndarray
    steps: int
    rejected: int
    newton: int

    def at(self, times):
        return CubicSpline(self.t, self.u)(times)

    def difference(self, other):
        """Largest difference of a displacement component at the other's times, relative to the largest one [-]."""
        return np.max(np.abs(self.at(other.t) - other.u)) / np.max(np.abs(other.u))


def pushed_in(body, force_scale, amplitude):
    """The rigid translation that balances this load [µm], flat: without strain, and a first guess in contact."""
    run = Run(body, Schedule(1.0), force_scale)
    weight = -amplitude * run.ledger.load_resultant()[1]

    def imbalance(depth):
        run.u[:] = np.tile([0.0, -depth], len(run.u) // 2)
        return run.ledger.contact_force()[1] - weight

    imbalance(brentq(imbalance, 0.0, 0.1, xtol=1e-12))
    run.close()
    return run.u.copy()


def petsc_bdf2(body, force_scale, end, step, atol=None):
    """PETSc's history: fixed steps [s], or from this first one with local errors below atol [µm], largest component."""
    state, comm = RateState(body), body.domain.mesh.comm
    amplitude, shift = (fem.Constant(body.domain.mesh, 0.0) for _ in range(2))
    R, K = equilibrium(body, state, amplitude)
    K += shift * ufl.derivative(R, state.v, ufl.TrialFunction(body.space))
    R, K = compile_form(R, comm), compile_form(K, comm)
    b, A, bcs = petsc.create_vector(R), petsc.create_matrix(K), list(body.bcs)

    def set_state(t, u, v):
        amplitude.value = body.amplitude(t)
        state.u.x.array[:], state.v.x.array[:] = u.getArray(readonly=True), v.getArray(readonly=True)

    def residual(ts, t, u, v, r):
        set_state(t, u, v)
        r.set(0.0)
        petsc.assemble_vector(r, R)
        petsc.set_bc(r, bcs, u, -1.0)

    def tangent(ts, t, u, v, a, J, P):
        set_state(t, u, v)
        shift.value = a
        P.zeroEntries()
        petsc.assemble_matrix(P, K, bcs)
        P.assemble()

    prefix, options = "tsbdf_", PETSc.Options()
    for key, value in {"ts_bdf_order": 2, "ts_adapt_type": "basic" if atol else "none", "ts_adapt_wnormtype": "infinity"}.items():
        options[prefix + key] = value
    ts = PETSc.TS().create(comm)
    ts.setOptionsPrefix(prefix)
    ts.setType("bdf")
    ts.setIFunction(residual, b)
    ts.setIJacobian(tangent, A)
    ts.setTime(0.0)
    ts.setTimeStep(step)
    ts.setMaxTime(end)
    ts.setMaxSteps(100_000)
    ts.setExactFinalTime(PETSc.TS.ExactFinalTime.MATCHSTEP)
    if atol:
        ts.setTolerances(rtol=0.0, atol=atol)
    snes = ts.getSNES()
    snes.setTolerances(rtol=0.0, atol=1e-10 * force_scale, stol=0.0, max_it=30)
    snes.getKSP().setType("preonly")
    snes.getKSP().getPC().setType("lu")
    snes.getKSP().getPC().setFactorSolverType("mumps")
    ts.setFromOptions()
    times, values = [], []
    ts.setMonitor(lambda ts, k, t, u: (times.append(t), values.append(u.array.copy())))
    x = b.duplicate()
    x.array[:] = pushed_in(body, force_scale, body.amplitude(step / 2))  # PETSc begins with half a step
    ts.solve(x)
    assert ts.getConvergedReason() > 0, ts.getConvergedReason()
    history = History(np.array(times), np.array(values), ts.getStepNumber(), ts.getStepRejections(), ts.getSNESIterations())
    for held in (ts, A, b, x):
        held.destroy()
    return history
