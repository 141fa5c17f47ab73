"""The one door to what differs between DOLFINx 0.5 (Debian 12) and 0.9 (Debian 13)."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import cellmech.fem.started  # noqa: F401 before all that it starts

# isort: split

import basix
import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from petsc4py import PETSc
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction

from cellmech.fem import p2_bubble, shared_memory

MULTIGRID = "cellmech_multigrid_"  # PETSc's options of this prefix are meant for `cellmech.solver.linear`
OLD = tuple(int(part) for part in dolfinx.__version__.split(".")[:2]) < (0, 9)

CANDIDATES = 40  # cells whose midpoints are nearest to a place, one of which holds it

if MPI.COMM_WORLD.size == 1:  # whoever solves comes through here, but with several ranks perhaps not all at once
    shared_memory.release(MPI.COMM_WORLD)

# UFL orders factors that are constants by the text of their numbers, in which "9" comes after "10": whether a form is
# known or compiled anew would depend on how many constants there were before. From here on all have ten digits.
if OLD:
    ufl.Constant._globalcount = 10**9
else:
    ufl.Constant._counter = itertools.count(10**9)


if OLD:
    import ffcx.parameters as ffcx_options

    FILES = "_load_parameters"
else:
    import ffcx.options as ffcx_options

    FILES = "_load_options"


@contextmanager
def own_parameters() -> Iterator[None]:
    """Keep the JSON files of DOLFINx and FFCx, in the user's folder and where one is, out of what is compiled."""
    places = (ffcx_options, dolfinx.jit)
    loaders = [getattr(place, FILES) for place in places]
    try:
        for place in places:
            setattr(place, FILES, lambda: ({}, {}))
        yield
    finally:
        for place, loader in zip(places, loaders, strict=True):
            setattr(place, FILES, loader)


@contextmanager
def own_options() -> Iterator[None]:
    """Keep PETSc's options of others away while the block lasts; those that PETSc read when it started, it has read."""
    options = PETSc.Options()
    theirs = {key: value for key, value in options.getAll().items() if not key.startswith(MULTIGRID)}
    for key in theirs:
        options.delValue(key)
    try:
        yield
    finally:
        for key, value in theirs.items():
            options.setValue(key, value)


@lru_cache
def tables_mark() -> str:
    """A mark of the last digits of shape functions, which become part of compiled code.

    Basix has them from linear algebra whose rounding depends on the processor and on the number of threads.
    """
    element = basix.create_element(basix.ElementFamily.P, basix.CellType.triangle, 3, basix.LagrangeVariant.gll_warped)
    points, _ = basix.make_quadrature(basix.CellType.triangle, 9)
    values = np.ascontiguousarray(element.tabulate(1, np.asarray(points)))
    return hashlib.sha256(values.tobytes()).hexdigest()[:16]


def model_to_mesh(model: Any, comm: MPI.Comm, gdim: int = 2) -> tuple[Any, Any, Any]:
    """Distribute the Gmsh model of rank 0 (collective); returns mesh, cell tags, facet tags.

    Facets are shared by ghost cells, so that integrals over interior facets work on any number of ranks.
    """
    from dolfinx.io import gmshio  # imports gmsh

    if OLD:
        return gmshio.model_to_mesh(model, comm, 0, gdim)
    partitioner = dmesh.create_cell_partitioner(dmesh.GhostMode.shared_facet)
    return gmshio.model_to_mesh(model, comm, 0, gdim, partitioner)


def cell_points(mesh: Any) -> np.ndarray:
    """Coordinates of the geometry nodes of this rank's own cells, shape (cells, nodes, dimension)."""
    dofs, cells = mesh.geometry.dofmap, mesh.topology.index_map(mesh.topology.dim).size_local
    if OLD:
        dofs = dofs.array.reshape(dofs.num_nodes, -1)
    return mesh.geometry.x[dofs[:cells], : mesh.geometry.dim]


def displacement_space(mesh: Any, degree: int, jit: dict[str, Any], bubble: bool = False) -> Any:
    """Continuous Lagrange vectors, or P2 with a cubic bubble; 0.5 compiles the element with these options."""
    if OLD and bubble:
        from basix.ufl_wrapper import VectorElement

        return fem.FunctionSpace(mesh, VectorElement(_p2_bubble(), 2), jit_params=jit)
    if OLD:
        return fem.FunctionSpace(mesh, ufl.VectorElement("Lagrange", mesh.ufl_cell(), degree), jit_params=jit)
    if bubble:
        from basix.ufl import blocked_element

        return fem.functionspace(mesh, blocked_element(_p2_bubble(), shape=(2,)))
    return fem.functionspace(mesh, ("Lagrange", degree, (mesh.geometry.dim,)))


def _p2_bubble() -> Any:
    """The package's only custom element: to the cache of 0.5 all such of equal degrees are one."""
    nodal = p2_bubble.nodes(), p2_bubble.evaluations(), 0
    start: tuple[Any, ...] = basix.CellType.triangle, [], p2_bubble.coefficients(), *nodal
    degrees = p2_bubble.COMPLETE, p2_bubble.HIGHEST
    if OLD:
        from basix.ufl_wrapper import BasixElement

        return BasixElement(basix.create_custom_element(*start, basix.MapType.identity, False, *degrees))
    from basix.ufl import custom_element

    return custom_element(*start, basix.MapType.identity, basix.SobolevSpace.H1, False, *degrees)


def interpolation_matrix(coarse: Any, fine: Any) -> PETSc.Mat:
    """Values at the nodes of one space of a function of another one on the same mesh (collective)."""
    if OLD:
        matrix = dolfinx.cpp.fem.petsc.interpolation_matrix(coarse._cpp_object, fine._cpp_object)
    else:
        from dolfinx.fem.petsc import interpolation_matrix as interpolated

        matrix = interpolated(coarse, fine)
    matrix.assemble()
    return matrix


def discontinuous_space(mesh: Any, degree: int, jit: dict[str, Any]) -> Any:
    """Functions of this degree on each cell; likewise."""
    return fem.FunctionSpace(mesh, ("DG", degree), jit_params=jit) if OLD else fem.functionspace(mesh, ("DG", degree))


def compiled_form(form: Any, jit: dict[str, Any]) -> Any:
    """A UFL form compiled with these options of the just-in-time compiler."""
    return fem.form(form, jit_params=jit) if OLD else fem.form(form, jit_options=jit)


def compiled_expression(expression: Any, points: np.ndarray, jit: dict[str, Any]) -> Any:
    """A UFL expression compiled for evaluation at reference points, shape (n, 2)."""
    if OLD:
        return fem.Expression(expression, points, jit_params=jit)
    # To FFCx 0.9 an expression is another one for each new number of a `ufl.variable`: differentiated, it needs none.
    plain = map_expr_dag(_WithoutVariables(), ufl.algorithms.expand_derivatives(expression))
    return fem.Expression(plain, points, jit_options=jit)


class _WithoutVariables(MultiFunction):
    """Puts what a `ufl.variable` stands for in its place."""

    expr = MultiFunction.reuse_if_untouched

    def variable(self, o: Any, operand: Any, label: Any) -> Any:
        """The operand."""
        return operand


def mesh_of(expression: Any) -> Any:
    """The mesh that a UFL expression lives on."""
    if OLD:
        return expression.ufl_domain().ufl_cargo()
    domain = ufl.domain.extract_unique_domain(expression)
    return dmesh.Mesh(domain.ufl_cargo(), domain)  # the cargo is the C++ mesh; evaluation asks for Python's


def evaluate(expression: Any, mesh: Any, cells: np.ndarray) -> np.ndarray:
    """Values of a compiled expression in the cells, shape (n_cells, n_points * value_size)."""
    return expression.eval(cells) if OLD else expression.eval(mesh, cells)


def interpolated(function: Any, space: Any) -> np.ndarray:
    """A function in another space on the same mesh, ghosts included, flat."""
    other = fem.Function(space)
    other.interpolate(function)
    other.x.scatter_forward()
    return other.x.array.copy()


def values_at(function: Any, places: np.ndarray) -> np.ndarray:
    """A function's values at places [µm], shape (n, 3), on a mesh of tetrahedra that this rank has alone.

    Outside the mesh those of the nearest cell are continued. Source of the cells: DOLFINx's own search gives up at flat
    elements, so of each place's nearest midpoints the cell counts whose corners hold it best.

    Returns:
        Shape (n, value size).
    """
    from scipy.spatial import cKDTree

    corners = cell_points(function.function_space.mesh)[:, :4]
    inverse = np.linalg.inv(np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2))
    tree, cells = cKDTree(corners.mean(axis=1)), np.zeros(len(places), dtype=np.int32)
    for some in np.array_split(np.arange(len(places)), len(places) // 5000 + 1):
        _, near = tree.query(places[some], min(CANDIDATES, len(corners)))
        local = np.einsum("pcij,pcj->pci", inverse[near], places[some, None] - corners[near, 0])
        worst = np.minimum(local.min(axis=-1), 1 - local.sum(axis=-1))
        cells[some] = np.take_along_axis(near, worst.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.asarray(function.eval(places, cells)).reshape(len(places), -1)


def solve(snes: PETSc.SNES, x: PETSc.Vec) -> None:
    """Solve; what a callback raises arrives as it is (petsc4py 3.22 makes it the cause of an error of its own)."""
    try:
        snes.solve(None, x)
    except PETSc.Error as error:
        raise error.__cause__ or error from None
