"""Newton's method for displacement and pressure at once, with the pressure eliminated in each element.

With R(u, p) the residual and c(u, p) = b(u) - M p the gap of the volume equation (`solver.element_pressure`), a step
solves

    [K  B^T] [du]   [R]
    [B  -M ] [dp] = [c]      by      (K + B^T D B) du = R + B^T D c,   dp = D (B du - c),   D = M^-1.

The unknowns of the linear system are those of a displacement method. Newton is not the same: p, and so the stress at
which K is taken, follows the volume change as linearised. Where p is made the function of u that it is in equilibrium,
lambda times the error of that linearisation drives the iteration away as soon as lambda >> mu.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from petsc4py import PETSc

from cellmech.solver.element_pressure import ElementPressure


class Saddle:
    """The block system; PETSc sees its matrix as `operator`.

    Block vectors hold the displacement's own unknowns [µm], then the pressure's [Pa]; of a residual the second part is
    scaled to a force [Pa µm], so that one norm serves for both.

    Args:
        pressure: of the state.
        K: matrix of the displacement's tangent; `condense` makes it K + B^T D B.
    """

    def __init__(self, pressure: ElementPressure, K: PETSc.Mat) -> None:
        self.pressure, self.K, self.n_u = pressure, K, K.getLocalSize()[0]
        n = self.n_u + len(pressure.scale)
        self.operator = PETSc.Mat().createPython(((n, None), (n, None)), context=self, comm=K.getComm())
        self.operator.setUp()
        self._product: PETSc.Mat | None = None
        self.u, self.v = K.createVecs()
        self.p, self.q = pressure.M.createVecs()

    def vector(self) -> PETSc.Vec:
        """A block vector."""
        return self.operator.createVecRight()

    def join(self, residual: PETSc.Vec, b: PETSc.Vec) -> None:
        """Put the residual [Pa µm] and the present gap into a block vector."""
        b.setArray(np.concatenate([residual.getArray(), self.pressure.scale * self.pressure.gap()]))

    def condense(self, bcs: Sequence[Any]) -> None:
        """Add B^T D B to the assembled tangent at the present displacement. Collective."""
        self.pressure.linearise(bcs)
        self._product = self.pressure.D.ptap(self.pressure.B, result=self._product)
        self.K.axpy(1.0, self._product, structure=PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self.operator.assemble()  # tells PETSc that it has changed

    def mult(self, operator: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = [K B^T; B -M] x, with (K + B^T D B) u + B^T (p - D B u) for the K u + B^T p that is no longer at hand."""
        given, B, D, M = x.getArray(readonly=True), self.pressure.B, self.pressure.D, self.pressure.M
        u, p = given[: self.n_u], given[self.n_u :]
        self.u.setArray(u)
        B.mult(self.u, self.q)
        D.mult(self.q, self.p)
        self.p.setArray(p - self.p.getArray())
        self.K.mult(self.u, self.v)
        B.multTransposeAdd(self.p, self.v, self.v)
        volume = self.q.getArray().copy()
        self.p.setArray(p)
        M.mult(self.p, self.q)
        y.setArray(np.concatenate([self.v.getArray(), self.pressure.scale * (volume - self.q.getArray())]))

    def close(self) -> None:
        """Free what PETSc holds."""
        for held in (self.operator, self._product, self.u, self.v, self.p, self.q):
            if held is not None:
                held.destroy()


class Elimination:
    """Preconditioner that solves the block system exactly, given one that does so for K + B^T D B.

    Args:
        system: the block system.
        inner: for K + B^T D B.
    """

    def __init__(self, system: Saddle, inner: PETSc.PC) -> None:
        self.system, self.inner = system, inner

    def setUp(self, pc: PETSc.PC) -> None:
        """Factorise K + B^T D B."""
        self.inner.setOperators(self.system.K)
        self.inner.setUp()

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, z: PETSc.Vec) -> None:
        """Solve for the correction."""
        system, given = self.system, r.getArray(readonly=True)
        B, D, scale = system.pressure.B, system.pressure.D, system.pressure.scale
        gap = np.divide(given[system.n_u :], scale, out=np.zeros(len(scale)), where=scale > 0)
        system.q.setArray(gap)
        D.mult(system.q, system.p)
        system.u.setArray(given[: system.n_u])
        B.multTransposeAdd(system.p, system.u, system.u)
        self.inner.apply(system.u, system.v)
        B.mult(system.v, system.q)
        system.q.setArray(system.q.getArray() - gap)
        D.mult(system.q, system.p)
        z.setArray(np.concatenate([system.v.getArray(), system.p.getArray()]))

    def reset(self, pc: PETSc.PC) -> None:
        """Begin anew, with another ordering too."""
        self.inner.reset()
