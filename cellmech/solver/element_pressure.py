"""The mixed form for nearly incompressible solids: a pressure of its own in each element, eliminated there.

Every law is W = W(lambda = 0) + lambda/2 g^2 with a volumetric measure g of its own (`energies.volumetric`). For
lambda >> mu a P2 displacement cannot make g vanish everywhere without freezing: it locks. The mixed form is the saddle
point of

    int c_s (W(lambda = 0) + p g - p^2/(2 lambda)) dV

over u and p, p linear in each element and free to jump between elements, and so between layers; u is P2 with a cubic
bubble, which makes the pair stable (Crouzeix and Raviart, RAIRO R-3 (1973) 33-75; Boffi, Brezzi and Fortin, Mixed
Finite Element Methods, 8.6). In each element M p = b(u), with b = int c_s g q dV and M = int c_s q r/lambda dV: in
equilibrium p is a function of u, which is all that has to be stored. `cellmech.solver.saddle` has Newton's method.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from petsc4py import PETSc

from cellmech.fem.domain import Domain
from cellmech.fem.jit import cellwise_space, compile_form
from cellmech.mechanics.balance import Body
from cellmech.mechanics.kinematics import green_lagrange
from cellmech.mechanics.materials import MaterialField


class ElementPressure:
    """p [Pa], positive in tension, and the equation M p = b(u) that ties it to the displacement in each element.

    Args:
        body: with a space of p, which is 0 where materials are not mixed.
        u: displacement [µm], made of the unknown.
        unknown: what Newton's method looks for [µm].
    """

    def __init__(self, body: Body, u: Any, unknown: fem.Function) -> None:
        domain, over = body.domain, body.over
        self.p = fem.Function(body.pressure_space)
        q, r = ufl.TestFunction(body.pressure_space), ufl.TrialFunction(body.pressure_space)
        self._comm, none = domain.mesh.comm, fem.Constant(domain.mesh, 0.0)
        E = green_lagrange(u, body.kinematics)
        dilatation, compliance = over(none * q), over(none * q * r)  # in every cell
        for m in body.materials:
            if m.mixed:
                dilatation += over(m.solid_fraction * m.volumetric(E) * q, m.names)
                compliance += over(m.solid_fraction / m.constants["lmbda"] * q * r, m.names)
        self._b = compile_form(dilatation, self._comm)
        self._dilatation = petsc.create_vector(self._b)
        self.M = petsc.assemble_matrix(compile_form(compliance, self._comm))
        self.M.assemble()
        self.D = _inverse_of_blocks(self.M)
        du = ufl.TrialFunction(unknown.function_space)
        self._gradient = compile_form(ufl.derivative(dilatation, unknown, du), self._comm)
        self.B = petsc.create_matrix(self._gradient)
        self.scale = self._scale(domain, body.materials, body.bulk_degree)

    def _scale(self, domain: Domain, materials: Sequence[MaterialField], degree: int) -> np.ndarray:
        """mu/h [Pa/µm] of each own unknown: brings the gap to what it means in force."""
        constant = cellwise_space(domain.mesh)
        one, none = ufl.TestFunction(constant), fem.Constant(domain.mesh, 0.0)
        stiffness = none * one * domain.dx(degree)
        for m in materials:
            if m.mixed:
                stiffness += m.constants["mu"] * one * domain.dx(degree, m.names)
        forms = (compile_form(form, self._comm) for form in (stiffness, one * domain.dx(degree)))
        vectors = [petsc.assemble_vector(form) for form in forms]
        shear, area = (vector.getArray().copy() for vector in vectors)
        for vector in vectors:
            vector.destroy()
        of_cell, scale = shear / area**1.5, np.zeros(self.M.getLocalSize()[0])
        for cell in domain.own_cells:
            scale[self.p.function_space.dofmap.cell_dofs(cell)] = of_cell[constant.dofmap.cell_dofs(cell)[0]]
        return scale

    @property
    def values(self) -> np.ndarray:
        """Own unknowns of p [Pa], to be read and set."""
        return self.p.x.array[: len(self.scale)]

    def update(self) -> None:
        """Make p the pressure at the present displacement, M^-1 b(u). Collective."""
        self._assemble()
        p = self.D.createVecLeft()
        self.D.mult(self._dilatation, p)
        self.values[:] = p.getArray()
        p.destroy()
        self.p.x.scatter_forward()

    def gap(self) -> np.ndarray:
        """b(u) - M p [µm^2 or µm^3], own unknowns: what is still to be met. Collective."""
        self._assemble()
        p, gap = self.M.createVecs()
        p.setArray(self.values)
        self.M.mult(p, gap)
        result = self._dilatation.getArray() - gap.getArray()
        p.destroy()
        gap.destroy()
        return result

    def _assemble(self) -> None:
        with self._dilatation.localForm() as local:
            local.set(0.0)
        petsc.assemble_vector(self._dilatation, self._b)

    def linearise(self, bcs: Sequence[Any]) -> None:
        """Bring B = db/du to the present displacement, without the columns of Dirichlet conditions. Collective."""
        self.B.zeroEntries()
        petsc.assemble_matrix(self.B, self._gradient, list(bcs))
        self.B.assemble()

    def close(self) -> None:
        """Free what PETSc holds."""
        for held in (self._dilatation, self.M, self.D, self.B):
            held.destroy()


def _inverse_of_blocks(M: PETSc.Mat) -> PETSc.Mat:
    """The inverse of a matrix that couples the unknowns of an element only; a block of zeros stays one.

    Such blocks are of elements without a mixed solid: the law does without p there, or there is fluid only.
    """
    indptr, columns, values = M.getValuesCSR()
    first, last = M.getOwnershipRange()
    n = len(columns) // max(last - first, 1)
    columns = columns.reshape(-1, n) if n else columns.reshape(0, 1)
    blocks = columns[columns[:, 0] == np.arange(first, last)] - first  # rows of each element, told by their first
    inverse = np.zeros((last - first, columns.shape[1]))
    dense = values.reshape(inverse.shape)[blocks]
    solid = np.abs(dense).max(axis=(1, 2), initial=0.0) > 0.0
    inverse[blocks[solid]] = np.linalg.inv(dense[solid])
    result = PETSc.Mat().createAIJ(M.getSizes(), csr=(indptr, columns.ravel(), inverse.ravel()), comm=M.getComm())
    result.assemble()
    return result
