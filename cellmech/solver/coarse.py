"""The coarse space of multigrid: first order, but in thin and stiff layers, which keep the order that they have.

Cells of first order cannot bend: where the lamina bends, a coarse space of first order is stiffer by about the squared
ratio of its elements' length to their height, and what it misses is left to the smoother. That takes hundreds of
iterations in a layer much stiffer than what is around it, and none in one as soft.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from cellmech.fem import fenicsx
from cellmech.fem.jit import displacement_space
from cellmech.mechanics.balance import Body

BENDS = 30.0  # stiffness over the softest, over the squared flatness of cells, from which a shell keeps its order
FACES = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))
EXACT = 1e-9  # what evaluation of shape functions leaves of 1 or 0


def interpolation(body: Body) -> tuple[PETSc.Mat, PETSc.Vec]:
    """From the coarse space to the displacement's, without what Dirichlet conditions hold (collective).

    A column of the coarse space is a displacement of a vertex, or of another node of a shell. Rows and columns of
    what is held are zero.

    Returns:
        Its matrix, and a coarse vector that is 1 where a displacement is held and 0 elsewhere.
    """
    space = body.space
    from_vertices = fenicsx.interpolation_matrix(displacement_space(body.domain.mesh, 1), space)
    P = _keeping(from_vertices, _nodes_of_shells(body))
    from_vertices.destroy()
    free, held = P.createVecLeft(), P.createVecRight()
    free.set(1.0)
    for bc in body.bcs:
        dofs, owned = bc.dof_indices()
        free.array[dofs[:owned]] = 0.0
    indptr, columns, _ = P.getValuesCSR()
    alone = (np.diff(indptr) == 1) & (free.array == 0.0)
    ones = columns[indptr[:-1][alone]]
    held.setValues(ones, np.ones(len(ones)))
    held.assemble()
    kept = held.duplicate()
    kept.set(1.0)
    kept.axpy(-1.0, held)
    P.diagonalScale(free, kept)
    for vector in (free, kept):
        vector.destroy()
    return P, held


def coarse_operator(A: PETSc.Mat, P: PETSc.Mat, held: PETSc.Vec) -> PETSc.Mat:
    """P^T A P with 1 on the diagonal of what is held (collective)."""
    blocked = "baij" in A.getType()
    plain = A.convert("mpiaij" if A.getComm().size > 1 else "seqaij", out=PETSc.Mat()) if blocked else A
    product = plain.ptap(P)
    if blocked:
        plain.destroy()
    coarse = product.duplicate(copy=True)  # a product keeps what it is made of, the largest matrix of all
    product.destroy()
    diagonal = coarse.getDiagonal()
    diagonal.axpy(1.0, held)
    coarse.setDiagonal(diagonal)
    diagonal.destroy()
    return coarse


def flatness(points: np.ndarray) -> np.ndarray:
    """Least height over longest edge of tetrahedra [-], 0.816 at best; shape (cells,).

    Args:
        points: corners, shape (cells, 4, 3).
    """
    edges = np.stack([np.linalg.norm(points[:, i] - points[:, j], axis=1) for i in range(4) for j in range(i)])
    a, b, c = (points[:, k] - points[:, 0] for k in (1, 2, 3))
    volume = np.abs(np.einsum("nk,nk->n", np.cross(a, b), c)) / 6
    corners = (points[:, list(face)] for face in FACES)
    area = [np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2 for p in corners]
    return 3 * volume / np.max(area, axis=0) / edges.max(axis=0)


def _nodes_of_shells(body: Body) -> np.ndarray:
    """Whether each node that this rank owns lies in a shell that bends, shape (nodes,). Collective."""
    mesh, dofmap = body.domain.mesh, body.space.dofmap
    flat = flatness(fenicsx.cell_points(mesh)[:, :4])
    here = PETSc.Vec().createMPI((dofmap.index_map.size_local, None), comm=mesh.comm)
    for name, times in body.shells.items():
        cells, _ = body.domain.own_of((name,))
        total, count = mesh.comm.allreduce(np.array([flat[cells].sum(), len(cells)]))
        if times > BENDS * (total / count) ** 2 and len(cells):
            nodes = np.unique([dofmap.cell_dofs(cell) for cell in cells]).astype(np.int32)
            here.setValues(dofmap.index_map.local_to_global(nodes).astype(PETSc.IntType), np.ones(len(nodes)))
    here.assemble()
    found = here.getArray() > 0
    here.destroy()
    return found


def _keeping(P: PETSc.Mat, keep: np.ndarray) -> PETSc.Mat:
    """The interpolation with further columns, one for each kept row that is no column's own (collective).

    Args:
        P: interpolation from the vertices.
        keep: nodes whose rows are kept, of this rank, shape (nodes,).
    """
    comm, (first, end) = P.getComm().tompi4py(), P.getOwnershipRangeColumn()
    indptr, columns, values = P.getValuesCSR()
    row = np.repeat(np.arange(len(indptr) - 1), np.diff(indptr))
    vertex = np.bincount(row, np.abs(values - 1.0) < EXACT, len(indptr) - 1) > 0
    new = np.nonzero(np.repeat(keep, 3) & ~vertex)[0]
    starts = np.array(comm.allgather(first))
    shifts = np.concatenate([[0], np.cumsum(comm.allgather(len(new)))])
    rank = np.searchsorted(starts, columns, side="right") - 1  # of equal starts the last one owns
    stays = ~np.isin(row, new) & (np.abs(values) > EXACT)
    rows = np.concatenate([row[stays], new])
    places = np.concatenate([(columns + shifts[rank])[stays], end + shifts[comm.rank] + np.arange(len(new))])
    entries = np.concatenate([values[stays], np.ones(len(new))])
    order = np.lexsort((places, rows))
    indptr = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=len(indptr) - 1))])
    sizes = (P.getLocalSize()[0], None), (end - first + len(new), None)
    csr = indptr.astype(PETSc.IntType), places[order].astype(PETSc.IntType), entries[order]
    made = PETSc.Mat().createAIJ(sizes, csr=csr, comm=P.getComm())
    made.assemble()
    return made
