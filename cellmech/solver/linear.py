"""The linear solver of Newton's method: which one it is, how it is set up, and why it failed.

In the plane and for small bodies MUMPS factorises the tangent. Its time grows as unknowns^1.7 and its memory as
unknowns^1.3 in 3-D; there a large tangent is solved by GMRES with one multigrid cycle as preconditioner, to a residual
that Newton's method asks for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

from petsc4py import PETSc

from cellmech.causes import Cause, Reason
from cellmech.fem import fenicsx
from cellmech.mechanics.balance import Body
from cellmech.solver import room
from cellmech.solver.coarse import coarse_operator, interpolation
from cellmech.solver.det_f import order_of
from cellmech.solver.room import GIB

LARGE = 10_000  # unknowns of a body in space from which multigrid is faster
FORCING = 1e-2  # share of the right-hand side that a linear solve leaves: no digit that the Newton step does not need
SPARE = 0.3  # of the residual that ends Newton's method: what a linear solve leaves of it
FACTORISED = 40_000  # unknowns up to which factors stand in where multigrid finds no solution
EXACTLY = 1e-8  # such a share where a solution serves many steps
MOST_ITERATIONS, ENOUGH = 200, 60  # the second with the coarse level of an earlier tangent
SET_UP = 10.0  # iterations that a coarse level is worth: so many too many, and the next tangent has one of its own
# MUMPS's INFOG(1) where memory is refused, and where the workspace that was foreseen is too small.
REFUSED, OUTGROWN = frozenset((-5, -7, -13, -19)), frozenset((-8, -9, -17, -20))
# Of the multigrid solver; what PETSc.Options() holds under the same prefix goes before.
PREFIX = fenicsx.MULTIGRID
OPTIONS = {
    "ksp_type": "gmres",
    "ksp_gmres_restart": 50,
    "ksp_pc_side": "right",
    "pc_type": "mg",
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_ksp_max_it": 4,
    "mg_levels_ksp_chebyshev_esteig": "0,0.1,0,1.1",
    "mg_levels_pc_type": "pbjacobi",
    "mg_coarse_ksp_type": "preonly",
    "mg_coarse_pc_type": "cholesky",
    "mg_coarse_pc_factor_mat_solver_type": "mumps",
    "mg_coarse_mat_mumps_icntl_14": 60,
}


class Linear(Protocol):
    """A solver of the tangent, as a preconditioner of PETSc's that leaves nothing to a Krylov method outside."""

    @property
    def matrix_type(self) -> str | None:
        """What the tangent is stored as; None for PETSc's default."""

    @property
    def iterations(self) -> int:
        """How many it has made; 0 of factors."""

    def install(self, pc: PETSc.PC) -> None:
        """Make a preconditioner this solver."""

    def aim(self, share: float) -> None:
        """Leave what a Newton step may leave whose residual is to fall to this share [-] in the end."""

    def exactly(self, r: PETSc.Vec, z: PETSc.Vec) -> None:
        """Solve to `EXACTLY`, whatever is aimed at."""

    def close(self) -> None:
        """Free what PETSc holds."""

    def fault(self) -> Reason | None:
        """Why the last tangent could not be solved with; None if it could.

        Raises:
            MemoryError: on every rank, if there was no room.
        """


class Direct:
    """MUMPS's factors; exact.

    Args:
        symmetric: whether the tangent is, which halves the factors.
    """

    matrix_type, iterations = None, 0

    def __init__(self, symmetric: bool = False) -> None:
        self._factors = "cholesky" if symmetric else "lu"

    def install(self, pc: PETSc.PC) -> None:
        """See `Linear`."""
        self.pc = pc
        pc.setType(self._factors)
        pc.setFactorSolverType("mumps")

    def aim(self, share: float) -> None:
        """See `Linear`."""

    def exactly(self, r: PETSc.Vec, z: PETSc.Vec) -> None:
        """See `Linear`."""
        self.pc.apply(r, z)

    def close(self) -> None:
        """See `Linear`."""

    def fault(self) -> Reason | None:
        """See `Linear`. A preconditioner of ours hides it from PETSc."""
        factor = self.pc.getFactorMatrix()
        code = factor.getMumpsInfog(1)
        if code >= 0:
            return None
        if code in REFUSED or (code in OUTGROWN and factor.getMumpsIcntl(23)):
            size = f"{factor.getSize()[0]} unknowns, ranks: {factor.getComm().size}, MUMPS error {code}"
            hint = "Fewer unknowns (a larger mesh.size_um), more ranks per case or more memory help"
            raise MemoryError(f"no room to factorise the tangent ({size}). {hint}")
        if code in OUTGROWN:
            return Cause.NEARLY_SINGULAR.reason(code=code)
        return Cause.SINGULAR.reason()


class Multigrid:
    """GMRES, preconditioned by one cycle between the displacement's space and that of `coarse.interpolation`.

    The coarse level of one tangent serves for the next ones until the iterations that this costs outweigh a new one.
    Where this finds no solution MUMPS's factors stand in, of a body that is not too large for them, until a `reset`.
    """

    def __init__(self, body: Body) -> None:
        self.matrix_type = None if body.pressure_space is not None else "baij"
        self._P, self._held = interpolation(body)
        self._share = FORCING
        self._ksp: Any = None
        self._coarse: Any = None
        self._lost, self._best, self.iterations = 0.0, math.inf, 0
        self._fault: Reason | None = None
        self._factors: Direct | None = None
        self._small = _unknowns(body) <= FACTORISED

    def install(self, pc: PETSc.PC) -> None:
        """See `Linear`."""
        self._pc = pc
        pc.setType("python")
        pc.setPythonContext(self)

    def aim(self, share: float) -> None:
        """See `Linear`."""
        self._share = max(FORCING, min(share * SPARE, SPARE))

    def exactly(self, r: PETSc.Vec, z: PETSc.Vec) -> None:
        """See `Linear`."""
        aim, self._share = self._share, EXACTLY
        self._pc.apply(r, z)
        self._share = aim

    def close(self) -> None:
        """See `Linear`."""
        self._P.destroy()
        self._held.destroy()

    def setUp(self, pc: PETSc.PC) -> None:
        """Take a new tangent: smoothers, or factors, are set up for it at once."""
        A, _ = pc.getOperators()
        if self._factors is not None:
            self._factors.pc.setOperators(A)
            self._factors.pc.setUp()
            return
        if self._coarse is None or self._lost > SET_UP:
            self._coarsen(A)
        if self._ksp is None:
            self._ksp = self._create(A)
        self._ksp.setOperators(A)
        self._ksp.setUp()

    def _coarsen(self, A: PETSc.Mat) -> None:
        if self._coarse is not None:
            self._coarse.destroy()
        self._coarse = coarse_operator(A, self._P, self._held)
        room.give_back()
        if self._ksp is not None:
            self._ksp.getPC().getMGCoarseSolve().setOperators(self._coarse)
        self._lost, self._best = 0.0, math.inf

    def _create(self, A: PETSc.Mat) -> PETSc.KSP:
        options = PETSc.Options()
        for key, value in OPTIONS.items():
            if not options.hasName(PREFIX + key):
                options[PREFIX + key] = value
        ksp = PETSc.KSP().create(A.getComm())
        ksp.setOptionsPrefix(PREFIX)
        ksp.setOperators(A)
        pc = ksp.getPC()
        pc.setType("mg")
        pc.setMGLevels(2)
        pc.setMGInterpolation(1, self._P)
        ksp.setFromOptions()
        pc.getMGCoarseSolve().setOperators(self._coarse)
        return ksp

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, z: PETSc.Vec) -> None:
        """Solve, with a coarse level of this tangent's own where the one at hand does not serve; NaN if none does."""
        if self._factors is None and not self._cycle(pc, r, z):
            if not self._small:
                z.set(math.nan)
                return
            self._factors = self._factorised(pc)
        if self._factors is not None:
            self._factors.pc.apply(r, z)

    def _cycle(self, pc: PETSc.PC, r: PETSc.Vec, z: PETSc.Vec) -> bool:
        """Solve by multigrid; whether that led to a solution."""
        known, self._fault = self._best < math.inf, None
        solved = self._solve(r, z, ENOUGH if known else MOST_ITERATIONS)
        if not solved and known:
            self._coarsen(pc.getOperators()[0])
            solved = self._solve(r, z, MOST_ITERATIONS)
        if not solved:
            left, made = self._ksp.getResidualNorm() / r.norm(), self._ksp.getIterationNumber()
            self._fault = Cause.NOT_SOLVED.reason(left=left, made=made)
        return solved

    def _factorised(self, pc: PETSc.PC) -> Direct:
        factors, inner = Direct(), PETSc.PC().create(pc.getComm())
        inner.setOptionsPrefix(pc.getOptionsPrefix())
        inner.setOperators(pc.getOperators()[0])
        factors.install(inner)
        inner.setFromOptions()
        inner.setUp()
        return factors

    def _solve(self, r: PETSc.Vec, z: PETSc.Vec, most: int) -> bool:
        """Whether the residual fell as far as asked; counts what iterations more than with a new set-up it took."""
        self._ksp.setTolerances(rtol=self._share, atol=0.0, max_it=most)
        self._ksp.solve(r, z)
        self.iterations += self._ksp.getIterationNumber()
        if self._ksp.getConvergedReason() <= 0:
            return False
        size, left = r.norm(), self._ksp.getResidualNorm()
        digits = max(math.log10(size / left), 0.5) if 0.0 < left < size else 1.0
        rate = self._ksp.getIterationNumber() / digits
        self._best = min(self._best, rate)
        self._lost += (rate - self._best) * digits
        return True

    def reset(self, pc: PETSc.PC) -> None:
        """Forget all that was set up."""
        for held in (self._ksp, self._coarse):
            if held is not None:
                held.destroy()
        self._ksp = self._coarse = None
        if self._factors is not None:
            self._factors.pc.destroy()
            self._factors = None
        room.give_back()

    def fault(self) -> Reason | None:
        """See `Linear`."""
        return self._fault if self._factors is None else self._factors.fault()


@dataclass(frozen=True)
class Choice:
    """Which solver, and why.

    Args:
        multigrid: whether it is not MUMPS's factors.
        reason: for the log; "" in the plane, where there is no choice.
    """

    multigrid: bool
    reason: str = ""


def needed_bytes(body: Body) -> float:
    """Memory that a body in space takes at most, all ranks together [bytes]."""
    unknowns = _unknowns(body)
    return room.needed_bytes(unknowns, order_of(body.space), unknowns >= LARGE)


def _unknowns(body: Body) -> int:
    return int(body.space.dofmap.index_map.size_global * body.space.dofmap.index_map_bs)


def choose(body: Body) -> Choice:
    """The solver for a body by its geometry and size (collective).

    Raises:
        MemoryError: on every rank, if the body is one in space and memory will not suffice.
    """
    unknowns, mesh = _unknowns(body), body.domain.mesh
    if mesh.topology.dim < 3:
        return Choice(False)
    multigrid, needed = unknowns >= LARGE, needed_bytes(body)
    room.refuse_without(needed, unknowns, mesh.comm)
    name, rule = ("GMRES with multigrid", "not fewer") if multigrid else ("MUMPS", "fewer")
    text = f"linear solver: {name}, for {unknowns} unknowns are {rule} than {LARGE}; about {needed / GIB:.2g} GiB"
    return Choice(multigrid, text)
