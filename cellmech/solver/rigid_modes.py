"""The rigid motions that nothing resists, as constraints for the nonlinear solve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from petsc4py import PETSc

from cellmech.fem.boundary import boundary
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body
from cellmech.solver.linear import Linear
from cellmech.solver.state import free_translations

AXES = "xyz"


class RigidModes:
    """Rigid motions that nothing resists, taken out by constraints: mean rotations 0, mean horizontal displacements 0.

    Newton runs in the space of displacements orthogonal to the modes and on the residual projected onto it. The
    tangent is made regular by springs at some nodes, whose effect is removed exactly (Sherman-Morrison-Woodbury).

    Args:
        vectors: orthonormal PETSc vectors b_k; the constraint is b_k . u = 0.
        pins: owned dofs (process-local numbering) that get a spring, of all ranks no fewer than there are modes.
        names: of the modes, for messages.
    """

    def __init__(self, vectors: Sequence[PETSc.Vec], pins: Sequence[int], names: Sequence[str]) -> None:
        self.vectors, self.names = list(vectors), list(names)
        start, _ = vectors[0].getOwnershipRange()
        comm = vectors[0].getComm().tompi4py()
        self.pins = sorted(p for part in comm.allgather([start + int(p) for p in pins]) for p in part)
        self.reactions = [0.0] * len(self.vectors)

    def project(self, r: PETSc.Vec) -> None:
        """Remove the modes from a residual, in place; what was removed is kept as `reactions` [Pa µm]."""
        self.reactions = [b.dot(r) for b in self.vectors]
        for b, reaction in zip(self.vectors, self.reactions, strict=True):
            r.axpy(-reaction, b)


class BorderedLU:
    """Preconditioner that solves [K B; B^T 0] as exactly as one of K + springs at the pins does."""

    def __init__(self, modes: RigidModes, linear: Linear, prefix: str) -> None:
        self.modes, self.linear, self.prefix, self.stiffness = modes, linear, prefix, 0.0
        self.inner: Any = None
        self.columns: list[PETSc.Vec] = []
        self.solved: list[PETSc.Vec] = []

    def setUp(self, pc: PETSc.PC) -> None:
        """Factorise and solve for the border."""
        A, _ = pc.getOperators()
        if self.inner is None:
            self.inner = PETSc.PC().create(pc.getComm())
            self.inner.setOptionsPrefix(self.prefix)
            self.linear.install(self.inner)
        self.inner.setOperators(A)
        self.inner.setUp()
        self._forget()
        columns = list(self.modes.vectors)
        for pin in self.modes.pins:
            e = A.createVecRight()
            first, last = e.getOwnershipRange()
            if first <= pin < last:
                e.setValue(pin, 1.0)
            e.assemble()
            columns.append(e)
        self.columns = columns
        self.solved = [self._solve(c) for c in columns]
        n = len(self.modes.vectors)
        self.small = np.array([[c.dot(s) for s in self.solved] for c in columns])
        self.small[:, n:] *= -self.stiffness
        self.small[n:, n:] += np.eye(len(columns) - n)

    def _forget(self) -> None:
        """Free the vectors of the last factorisation; petsc4py keeps what is merely dropped."""
        for vector in (*self.columns[len(self.modes.vectors) :], *self.solved):
            vector.destroy()
        self.columns, self.solved = [], []

    def reset(self, pc: PETSc.PC) -> None:
        """Begin anew, with another ordering too."""
        self._forget()
        if self.inner is not None:
            self.inner.reset()
            self.inner.destroy()
            self.inner = None

    def _solve(self, rhs: PETSc.Vec) -> PETSc.Vec:
        z = rhs.duplicate()
        self.linear.exactly(rhs, z)
        return z

    def apply(self, pc: PETSc.PC, r: PETSc.Vec, z: PETSc.Vec) -> None:
        """Solve for the correction: z = K'^-1 (r - B mu + k sum e_i z_i) with B^T z = 0."""
        self.inner.apply(r, z)
        n = len(self.modes.vectors)
        unknown = np.linalg.solve(self.small, np.array([c.dot(z) for c in self.columns]))
        for k, (value, solved) in enumerate(zip(unknown, self.solved, strict=True)):
            z.axpy(-value if k < n else self.stiffness * value, solved)


def rigid_modes(body: Body, centre: tuple[float, ...], sideways: bool) -> RigidModes:
    """Mean rotations about the centre, and mean horizontal displacements if `sideways`: all are set to zero.

    In the plane these are one rotation and u_x, in space three and two, less those that planes of symmetry hold.

    Args:
        body: the problem; no Dirichlet condition holds a component but on a plane of symmetry.
        centre: of the body at rest [µm].
        sideways: take out the translations, too.
    """
    mesh, w = body.domain.mesh, ufl.TestFunction(body.space)
    X, dx = ufl.SpatialCoordinate(mesh), body.domain.dx(body.bulk_degree)
    c = fem.Constant(mesh, np.array(centre, dtype=float))
    free, motions = free_translations(body), {}
    for axis, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
        if max(a, b) < len(free) and free[a] and free[b]:
            name = "rotation" if len(free) == 2 else f"rotation about {AXES[axis]}"
            motions[name] = ((X[a] - c[a]) * w[b] - (X[b] - c[b]) * w[a]) * dx
    for k in (0, 2):
        if sideways and k < len(free) and free[k]:
            motions[f"translation along {AXES[k]}"] = w[k] * dx
    vectors: list[PETSc.Vec] = []
    for form in motions.values():
        b = petsc.assemble_vector(compile_form(form, mesh.comm))
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        for earlier in vectors:
            b.axpy(-earlier.dot(b), earlier)
        b.normalize()
        vectors.append(b)
    return RigidModes(vectors, _pins(body, free), list(motions))


def _pins(body: Body, free: np.ndarray) -> list[int]:
    """Owned horizontal dofs of the lowest and the highest point of the outline: they regularise the tangent.

    In space a point at its side is held along z, too, against the rotation about the vertical.
    """
    components, comm = len(free), body.domain.mesh.comm
    nodes = np.unique(boundary(body.domain, body.space, "outer").dofs)
    nodes = nodes[nodes < body.space.dofmap.index_map.size_local]
    X = body.space.tabulate_dof_coordinates()[nodes]
    held = [(sign, 1, k) for sign in (-1.0, 1.0) for k in (0, 2) if k < components and free[k]]
    held += [(1.0, 0, 2)] if components == 3 and free[0] and free[2] else []
    pins = []
    for sign, axis, component in held:
        k = int(np.argmax(sign * X[:, axis])) if len(X) else -1
        best = [sign * X[k, axis] if k >= 0 else -np.inf, -comm.rank]
        if max(comm.allgather(best)) == best and k >= 0:
            pins.append(components * int(nodes[k]) + component)
    return pins
