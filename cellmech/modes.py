"""The rigid motions that nothing resists, as constraints for the nonlinear solve."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from petsc4py import PETSc

from cellmech.forms import compile_form
from cellmech.outline import Outline
from cellmech.residual import Body
from cellmech.snes import RigidModes


def rigid_modes(body: Body, centre: tuple[float, float], sideways: bool) -> RigidModes:
    """Mean rotation about the centre, and mean u_x if `sideways`: both are set to zero.

    Args:
        body: the problem; it must have no Dirichlet conditions.
        centre: of the body at rest [µm].
        sideways: take out the translation along x too.
    """
    mesh, w = body.domain.mesh, ufl.TestFunction(body.space)
    X, dx = ufl.SpatialCoordinate(mesh), body.domain.dx(body.bulk_degree)
    c = fem.Constant(mesh, np.array(centre, dtype=float))
    motions = {"rotation": ((X[0] - c[0]) * w[1] - (X[1] - c[1]) * w[0]) * dx}
    if sideways:
        motions["translation along x"] = w[0] * dx
    vectors: list[PETSc.Vec] = []
    for form in motions.values():
        b = petsc.assemble_vector(compile_form(form, mesh.comm))
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        for earlier in vectors:
            b.axpy(-earlier.dot(b), earlier)
        b.normalize()
        vectors.append(b)
    return RigidModes(vectors, _pins(body), list(motions))


def _pins(body: Body) -> list[int]:
    """Owned x-dofs of the lowest and the highest point of the outline: they regularise the tangent."""
    outline = Outline(body.domain, body.space, "outer")
    owned = body.space.dofmap.index_map.size_local
    y, dofs = outline.reference[..., 1].ravel(), outline.dofs.ravel()
    mine = dofs < owned
    y, dofs = y[mine], dofs[mine]
    comm = body.domain.mesh.comm
    pins = []
    for sign in (-1.0, 1.0):
        k = int(np.argmax(sign * y)) if len(y) else -1
        best = [sign * y[k] if k >= 0 else -np.inf, -comm.rank]
        if max(comm.allgather(best)) == best and k >= 0:
            pins.append(2 * int(dofs[k]))
    return pins
