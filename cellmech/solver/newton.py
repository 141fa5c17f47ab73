"""The nonlinear solve: Newton with line search. The only SNES code."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

from cellmech.causes import Cause, Reason
from cellmech.fem import fenicsx
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body, equilibrium, load_work
from cellmech.names import coordinates
from cellmech.solver.det_f import DetFWatch
from cellmech.solver.linear import Direct, Multigrid, choose
from cellmech.solver.rigid_modes import BorderedLU, RigidModes
from cellmech.solver.saddle import Elimination, Saddle
from cellmech.solver.state import State

TOLERANCE = 1e-7  # share of the load that may be out of balance
ROUGH = 1e-3  # share of the load that may be out of balance in a state on the way to another
BALANCED = 3e-4  # share of the load's sum that round-off may keep out of balance, as a 2-norm, in a state that counts
DRIVEN = 1e-3  # times a driver's size count beside the weight: its forces are in balance among themselves, mostly
ROUNDING = 8 * float(np.finfo(float).eps)  # of a position: what its arithmetic may be off by
STALL_RATE = 0.5  # a residual that a new tangent reduces by less than this factor stays
CRUSHED = 1e-3  # det F at and below which a solution is none: no continuum, and its stresses lose all digits
MAX_ITERATIONS, LEAP_ITERATIONS = 30, 16
# Ways to try a solve: whether tangents are kept, and PETSc's line search. Full steps first: the residual's norm judges
# them badly, for a motion of what is soft (or a contact that sets in) shakes what is stiff before it settles.
ATTEMPTS = ((True, "basic"), (False, "bt"))
REFINEMENTS = 2  # of what round-off stops: the translation that it holds is taken out; contact is balanced by itself
KEEP_RATE = 0.25  # a factorisation is kept while each iteration brings the residual down at least by this factor
# One prefix for all solvers, which want the same: PETSc has room for 512 options, and a sweep for more cases than that.
PREFIX, OPTIONS = "cellmech_", {"snes_linesearch_max_it": 12, "mat_mumps_icntl_14": 60}


@dataclass(frozen=True)
class Outcome:
    """The result of a solve.

    Args:
        iterations: Newton iterations.
        factorisations: tangents assembled and factorised.
        residual: its 2-norm at the end [Pa µm or pN].
        reason: why it did not converge, in physical terms; None where it did.
        linear_iterations: of the linear solver, 0 of factors.
        rounded: share of the load's sum that round-off keeps out of balance [-]; 0 where the tolerance is met.
    """

    iterations: int
    factorisations: int
    residual: float
    reason: Reason | None = None
    linear_iterations: int = 0
    rounded: float = 0.0

    @property
    def converged(self) -> bool:
        """True if the residual met the tolerance."""
        return self.reason is None

    @property
    def drowned(self) -> bool:
        """True if round-off is why it did not: no other step or guess will help."""
        return self.reason is not None and self.reason.cause is Cause.ROUND_OFF


class Solver:
    """Finds u with R(u) = 0 for one body, time after time.

    Args:
        body: the problem.
        state: its displacements; `state.u` is the first guess and receives the solution.
        force_scale: a force of the problem [Pa µm or pN], used where there is no dead load.
        tolerance: the residual's 2-norm is brought below this share of the load's 2-norm at the time [-]; without a
            dead load, of the force scale. Where round-off forbids that, below `BALANCED` of it.
        modes: rigid motions to take out.
        balance: moves the displacement to where contact balances the load at an amplitude [-], if that is possible: a
            stiff body's tangent, rounded, knows little of a soft contact.
    """

    def __init__(
        self,
        body: Body,
        state: State,
        force_scale: float,
        tolerance: float = TOLERANCE,
        modes: RigidModes | None = None,
        balance: Callable[[float], None] | None = None,
    ) -> None:
        self.body, self.state, self.modes, self._balance = body, state, modes, balance
        self.comm: MPI.Comm = body.domain.mesh.comm
        self.amplitude = fem.Constant(body.domain.mesh, 0.0)
        self._shares = [fem.Constant(body.domain.mesh, 0.0) for _ in body.drivers]
        R, K = equilibrium(body, state.written(), self.amplitude, self._shares)
        self._R, self._K = compile_form(R, self.comm), compile_form(K, self.comm)
        self.choice = choose(body)
        self._linear = Multigrid(body) if self.choice.multigrid else Direct(body.symmetric)
        self._A, self._r = petsc.create_matrix(self._K, self._linear.matrix_type), petsc.create_vector(self._R)
        self._u = self._r.duplicate()
        self._saddle = None if state.pressure is None else Saddle(state.pressure, self._A)
        self._b = self._r if self._saddle is None else self._saddle.vector()
        self._x = self._b.duplicate()
        self._watch = DetFWatch(body, state)
        self.factorisations, self._keep, self._stale, self._norm = 0, False, False, np.inf
        self._thrifty, self._search, self._again = True, "", False
        self._extent = self.comm.allreduce(float(np.abs(body.domain.mesh.geometry.x).max(initial=0.0)), op=MPI.MAX)
        self._tolerance, self._force_scale, self._atol, self._sum = tolerance, force_scale, 0.0, 0.0
        w = ufl.TestFunction(body.space)
        self._dead = self._norms(load_work(body, w))
        self._drivers = [self._norms(driver.scale(body, w)) for driver in body.drivers]
        self._snes = self._create_snes()

    def _norms(self, work: ufl.Form) -> np.ndarray:
        """Its 2-norm and the sum of its sizes over the unknowns, at full strength [Pa µm or pN]."""
        load = petsc.assemble_vector(compile_form(work, self.comm))
        load.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        norms = np.array([load.norm(), load.norm(PETSc.NormType.NORM_1)])
        load.destroy()
        return norms

    def _put_on(self, amplitude: float) -> np.ndarray:
        """Set the forces that act at this amplitude; returns their 2-norm and their sum [Pa µm or pN]."""
        self.amplitude.value = dead = self.body.dead(amplitude)
        self.body.contract(amplitude)
        norms = abs(dead) * self._dead
        for constant, driver, size in zip(self._shares, self.body.drivers, self._drivers, strict=True):
            constant.value = share = driver.share(amplitude)
            norms = norms + DRIVEN * abs(share) * size
        return norms if self._dead[0] or self._drivers else np.full(2, self._force_scale)

    def _create_snes(self) -> PETSc.SNES:
        prefix, options = PREFIX, PETSc.Options()
        for key, value in OPTIONS.items():
            options[prefix + key] = value
        options["options_left"] = False  # PETSc 3.22 warns, when the process ends, of one that no solve came to use
        snes = PETSc.SNES().create(self.comm)
        snes.setOptionsPrefix(prefix)
        snes.setFunction(self._residual, self._b)
        snes.setJacobian(self._tangent, self._A if self._saddle is None else self._saddle.operator)
        snes.setConvergenceTest(self._verdict)
        ksp = snes.getKSP()
        ksp.setType("preonly")
        pc = ksp.getPC()
        if self._saddle is not None:
            inner = PETSc.PC().create(self.comm)
            inner.setOptionsPrefix(prefix)
            pc.setType("python")
            pc.setPythonContext(Elimination(self._saddle, inner))
            pc = inner
        if self.modes is None:
            self._linear.install(pc)
        else:
            self._bordered = BorderedLU(self.modes, self._linear, prefix)
            pc.setType("python")
            pc.setPythonContext(self._bordered)
        snes.setFromOptions()
        ksp.setFromOptions()
        return snes

    def _residual(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        self._set_unknowns(x)
        r = b if self._saddle is None else self._r
        with r.localForm() as local:
            local.set(0.0)
        if not self._watch.admissible(on_the_way=True):
            b.set(np.nan)
            return
        petsc.assemble_vector(r, self._R)
        r.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        petsc.set_bc(r, list(self.body.bcs), self._u, -1.0)
        if self.modes is not None:
            self.modes.project(r)
        if self._saddle is not None:
            self._saddle.join(r, b)

    def _tangent(self, snes: PETSc.SNES, x: PETSc.Vec, operator: PETSc.Mat, P: PETSc.Mat) -> None:
        """Assemble the tangent, or leave the last one, and with it its factorisation, while it still serves."""
        norm = snes.getFunctionNorm()
        self._linear.aim(self._atol / norm if norm else 1.0)
        serves = self._thrifty and (snes.getIterationNumber() == 0 or norm < KEEP_RATE * self._norm)
        self._norm = norm
        if serves and self._keep:
            self._stale = True
            return
        self._keep, self._stale = True, False
        A = self._A
        A.zeroEntries()
        petsc.assemble_matrix(A, self._K, list(self.body.bcs))
        A.assemble()
        if self._saddle is not None:
            self._saddle.condense(self.body.bcs)
        if self.modes is not None:
            diagonal = A.getDiagonal()
            self._bordered.stiffness = diagonal.norm(PETSc.NormType.NORM_INFINITY)
            diagonal.destroy()
            first, last = A.getOwnershipRange()
            for pin in self.modes.pins:
                if first <= pin < last:
                    A.setValue(pin, pin, self._bordered.stiffness, PETSc.InsertMode.ADD_VALUES)
            A.assemble()
        self.factorisations += 1

    def _verdict(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        """The reason to stop: the tolerance is met, or round-off keeps the residual from falling; or to go on."""
        residual, reason = norms[-1], PETSc.SNES.ConvergedReason
        if not np.isfinite(residual):
            return reason.DIVERGED_FNORM_NAN
        if residual <= self._atol:
            return reason.CONVERGED_FNORM_ABS
        stays = iteration > 0 and not self._stale and residual > STALL_RATE * self._norm
        met = self._again and iteration == 0 and residual <= BALANCED * self._sum
        if not (stays or met) or not residual <= self._round_off(snes.getSolution()):
            return reason.ITERATING
        return reason.CONVERGED_SNORM_RELATIVE if residual <= BALANCED * self._sum else reason.DIVERGED_DTOL

    def _round_off(self, x: PETSc.Vec) -> float:
        """The residual's 2-norm that rounding alone may leave at these unknowns [Pa µm]; measured. Collective.

        Every unknown is moved by some units of its last place, up or down, and the body as a whole by some of its
        positions' last place, which contact and inertia feel. NaN where that turns the material inside out, and where
        the iteration has run away: its rounding says nothing of a state near by.
        """
        part = self.state.now.part.x.array
        if self.comm.allreduce(float(np.abs(part).max(initial=0.0)), op=MPI.MAX) > self._extent:
            return math.nan
        moved, before, after = x.duplicate(), self._b.duplicate(), self._b.duplicate()
        signs = np.random.default_rng(0).choice((-1.0, 1.0), x.getLocalSize())
        moved.setArray(x.getArray(readonly=True) * (1.0 + ROUNDING * signs))
        offset = self.state.now.offset.value.copy()
        self._residual(self._snes, x, before)
        self.state.now.offset.value = offset + ROUNDING * (self._extent + np.abs(offset).max())
        self._residual(self._snes, moved, after)
        self.state.now.offset.value = offset
        self._set_unknowns(x)
        after.axpy(-1.0, before)
        noise = float(after.norm())
        for held in (moved, before, after):
            held.destroy()
        return noise

    def _use(self, search: str) -> None:
        """Set the line search."""
        if search != self._search:
            PETSc.Options()[PREFIX + "snes_linesearch_type"] = self._search = search
            self._snes.setFromOptions()

    def rebuild(self) -> None:
        """Use no earlier factorisation in the next solve."""
        self._keep = False

    def restart(self) -> None:
        """Forget all that was learnt, the ordering of the factorisation included: the next solve is like a first."""
        self._keep, self._norm = False, np.inf
        self._snes.getKSP().getPC().reset()

    def close(self) -> None:
        """Free what PETSc holds: its SNES and this object refer to each other, which no garbage collector sees."""
        self._snes.getKSP().getPC().reset()
        for held in (self._snes, self._A, self._r, self._u, self._b, self._x):
            held.destroy()
        self._linear.close()
        if self._saddle is not None:
            self._saddle.close()

    def _set_unknowns(self, x: PETSc.Vec) -> None:
        owned = x.getArray(readonly=True)
        n = self._u.getLocalSize()
        self._u.setArray(owned[:n])
        self.state.now.part.x.array[:n] = owned[:n]
        self.state.now.part.x.scatter_forward()
        self.state.now.join()
        if self.state.pressure is not None:
            self.state.pressure.values[:] = owned[n:]
            self.state.pressure.p.x.scatter_forward()

    def _unknowns(self) -> np.ndarray:
        """This rank's unknowns as the state has them, boundary data put in."""
        self.state.split()
        self._u.setArray(self.state.now.part.x.array[: self._u.getLocalSize()])
        petsc.set_bc(self._u, list(self.body.bcs))
        pressure = self.state.pressure
        return np.concatenate([self._u.getArray(), [] if pressure is None else pressure.values])

    def solve(self, amplitude: float, rough: bool = False, leap: bool = False) -> Outcome:
        """Solve at this load amplitude [-], from `state.u` as first guess; `state.u` is the solution afterwards.

        A rough solution only leads to the next one: its residual is below `ROUGH` of the load. A leap is given up soon.

        When the solve fails `state.u` is of no use: the caller restores it. A pressure is as before then.

        Raises:
            MemoryError: on every rank, if there is no room to factorise a tangent.
        """
        load, self._sum = self._put_on(amplitude)
        before, iterations, linear = self.factorisations, 0, self._linear.iterations
        self._atol = (ROUGH if rough else self._tolerance) * load
        most = LEAP_ITERATIONS if leap else MAX_ITERATIONS
        self._snes.setTolerances(rtol=0.0, atol=self._atol, stol=0.0, max_it=most)
        guess, centre = self._unknowns(), self.state.now.offset.value.copy()
        for self._thrifty, search in ATTEMPTS[:1] if leap else ATTEMPTS:
            self._use(search)
            self._watch.worst, self._stale, tangents = None, False, self.factorisations
            fault: Reason | None = None
            self.state.now.offset.value = centre
            self._x.setArray(guess)
            for self._again in (False, *[True] * REFINEMENTS):
                fenicsx.solve(self._snes, self._x)
                iterations += self._snes.getIterationNumber()
                reason, residual = self._snes.getConvergedReason(), float(self._snes.getFunctionNorm())
                self._set_unknowns(self._x)
                drowned = reason == PETSc.SNES.ConvergedReason.DIVERGED_DTOL
                rounded = reason == PETSc.SNES.ConvergedReason.CONVERGED_SNORM_RELATIVE
                if drowned:
                    self.state.recentre()
                elif not rounded or self._balance is None:
                    break
                if self._balance is not None:
                    self._balance(amplitude)
                self._x.setArray(self._unknowns())
                if not drowned:
                    break
            converged = reason > 0 and self._watch.admissible(CRUSHED)
            if converged or drowned:
                break
            unsolved = reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE
            if unsolved or self.factorisations > tangents:
                fault = self._linear.fault()
            if unsolved or fault is not None:
                self.restart()  # what a failed factorisation leaves behind cannot be used again
        if not converged:
            self.rebuild()
        if converged:
            self.state.update()
        elif self.state.pressure is not None:
            self.state.pressure.values[:] = guess[self._u.getLocalSize() :]
        return Outcome(
            iterations=iterations,
            factorisations=self.factorisations - before,
            residual=residual,
            reason=None if converged else fault or self._explain(reason, residual),
            linear_iterations=self._linear.iterations - linear,
            rounded=residual / self._sum if converged and rounded else 0.0,
        )

    def _drowning(self, residual: float) -> Reason:
        """The forces that round-off leaves, and the load that it would not hide."""
        remedy = ""
        if self._sum:
            times = residual / (BALANCED * self._sum)
            remedy = f": {times:.2g} times the load, or moduli and penalty so much smaller, could be resolved"
        unit = self.body.kinematics.force_unit
        return Cause.ROUND_OFF.reason(force=residual, load=self._sum, unit=unit, remedy=remedy)

    def _explain(self, reason: int, residual: float) -> Reason:
        names = {getattr(PETSc.SNES.ConvergedReason, n): n for n in dir(PETSc.SNES.ConvergedReason) if n[0] != "_"}
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE:
            return Cause.SINGULAR.reason()
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_DTOL:
            return self._drowning(residual)
        if self._watch.worst is not None:
            value, *place = self._watch.worst
            where = f"det F = {value:.2g} at reference {coordinates(place)} um"
            return (Cause.CRUSHED if value > 0 else Cause.INSIDE_OUT).reason(where=where)
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT:
            return Cause.NO_CONVERGENCE.reason(most=MAX_ITERATIONS)
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH:
            return Cause.NONE_NEARBY.reason()
        return Cause.UNSOLVED.reason(told=names.get(reason, reason))
