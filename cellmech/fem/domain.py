"""From a Gmsh model to a distributed mesh with named groups and measures, its elements checked."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from cellmech.errors import CellmechError, MeshError
from cellmech.fem import fenicsx
from cellmech.mesh import store
from cellmech.mesh.ball import BallSpec
from cellmech.mesh.ball_mesh import build_ball
from cellmech.mesh.elements import jacobian_coefficients, shape_measures
from cellmech.mesh.geometry import DiscSpec, build_disc, interrupt_kept

T = TypeVar("T")
KINDS = {1: (1, 8), 2: (2, 9), 3: (4, 11)}  # Gmsh's numbers of elements of order 1 and 2, by dimension


@dataclass(frozen=True)
class Domain:
    """A mesh with its named groups.

    Args:
        mesh: triangles or tetrahedra, straight or of second order [µm].
        cell_tags: group numbers of cells.
        facet_tags: group numbers of facets.
        cells: number of each group of cells, by name.
        facets: number of each group of facets, by name.
        quality: of `mesh_quality`, and `cells_<name>`, the number of cells of each group.
    """

    mesh: Any
    cell_tags: Any
    facet_tags: Any
    cells: dict[str, int]
    facets: dict[str, int]
    quality: dict[str, float]

    @property
    def own_cells(self) -> np.ndarray:
        """Numbers of the cells that this rank owns, shape (n,)."""
        return np.arange(self.mesh.topology.index_map(self.mesh.topology.dim).size_local, dtype=np.int32)

    def own_of(self, names: Iterable[str]) -> tuple[np.ndarray, np.ndarray]:
        """Cells of the named groups that this rank owns, and the numbers of their groups, shape (n,) each."""
        tags = self.cell_tags
        mine = np.isin(tags.values, [self.cells[name] for name in names]) & (tags.indices < len(self.own_cells))
        return tags.indices[mine], tags.values[mine]

    def dx(self, degree: int, names: Iterable[str] | None = None) -> ufl.Measure:
        """Cells of the named groups, all cells by default, with this quadrature degree."""
        return self._measure("dx", self.cell_tags, self.cells, degree, names)

    def ds(self, degree: int, names: Iterable[str] | None = None) -> ufl.Measure:
        """Facets of the named groups on the boundary, the whole boundary by default."""
        return self._measure("ds", self.facet_tags, self.facets, degree, names)

    def dS(self, degree: int, names: Iterable[str] | None = None) -> ufl.Measure:
        """Facets of the named groups in the interior, all interior facets by default."""
        return self._measure("dS", self.facet_tags, self.facets, degree, names)

    def constant(self, value: Any) -> fem.Constant:
        """A number, or a vector of them, as a coefficient of forms: its value compiles nothing anew."""
        return fem.Constant(self.mesh, np.array(value, dtype=float) if np.ndim(value) else float(value))

    def _measure(
        self, kind: str, tags: Any, numbers: dict[str, int], degree: int, names: Iterable[str] | None
    ) -> ufl.Measure:
        measure = ufl.Measure(kind, domain=self.mesh, subdomain_data=tags, metadata={"quadrature_degree": degree})
        if names is None:
            return measure
        names = (names,) if isinstance(names, str) else tuple(names)
        missing = [name for name in names if name not in numbers]
        if missing:
            raise MeshError(f"the mesh has no group {missing[0]!r} for {kind}; it has {', '.join(numbers) or 'none'}")
        if kind == "dx" and set(names) == set(numbers):
            return measure  # every cell has a group: one kernel instead of one for each
        return measure(tuple(numbers[name] for name in names))


def whole(name: str) -> str:
    """The group that a numbered piece is part of: "cytosol" for "cytosol 2"; other names are their own."""
    return name.rstrip("0123456789 ")


def build_domain(spec: DiscSpec | BallSpec, comm: MPI.Comm) -> Domain:
    """Mesh a disc or a ball on rank 0 and distribute it (collective).

    Raises:
        MeshError: on every rank, if Gmsh failed or an element is inverted.
        OSError: on every rank, if the disk refuses the folder for temporary files.
    """
    with ExitStack() as stack:

        def model() -> Any:
            if (known := store.kept(spec)) is not None:
                stack.enter_context(store.without_gmsh())
                return known
            made = build_ball(spec) if isinstance(spec, BallSpec) else stack.enter_context(build_disc(spec))
            store.keep(spec, made)
            return made

        if comm.rank > 0:
            stack.enter_context(store.without_gmsh())
        return from_gmsh(_from_root(comm, model, send=False), comm, _mover(spec))


def _mover(spec: DiscSpec | BallSpec) -> Callable[[np.ndarray], np.ndarray] | None:
    """What moves a mesh's nodes to where they are in a cell that has other shapes, shape (n, d) [µm]."""
    shape, centre = spec.moves, np.array(spec.centre)
    return None if shape is None else lambda x: centre + shape.moved(x - centre)


def from_gmsh(model: Any, comm: MPI.Comm, move: Callable[[np.ndarray], np.ndarray] | None = None) -> Domain:
    """Distribute the Gmsh model of rank 0; the other ranks pass None (collective).

    Args:
        model: of Gmsh.
        comm: the ranks.
        move: gives the nodes' places from those in the model [µm], shape (n, d).

    Raises:
        MeshError: on every rank, if a group has no name or an element has a Jacobian that is not positive.
    """
    dim = _from_root(comm, lambda: 3 if model.getPhysicalGroups(3) else 2)
    cells, facets = _from_root(comm, lambda: (_groups(model, dim, dim), _groups(model, dim - 1, dim)))
    with interrupt_kept():
        mesh, cell_tags, facet_tags = fenicsx.model_to_mesh(model, comm, dim)
    if move is not None:
        mesh.geometry.x[:, :dim] = move(mesh.geometry.x[:, :dim])
    check_elements(mesh)
    quality = mesh_quality(mesh)
    for name, number in cells.items():
        own = cell_tags.indices[cell_tags.values == number] < mesh.topology.index_map(mesh.topology.dim).size_local
        quality[f"cells_{name}"] = comm.allreduce(float(own.sum()))
    return Domain(mesh, cell_tags, facet_tags, cells, facets, quality)


def check_elements(mesh: Any) -> None:
    """Make sure that the Jacobian determinant is positive all over every element (collective).

    Raises:
        MeshError: on every rank, with the number of bad elements and where the worst ones are.
    """
    points = fenicsx.cell_points(mesh)
    lowest = jacobian_coefficients(points).min(axis=1)
    bad = np.nonzero(~(lowest > 0.0))[0]
    places = points[bad][:, : points.shape[2] + 1].mean(axis=1)
    found = mesh.comm.allgather([(float(d), *at) for d, at in zip(lowest[bad], places.tolist(), strict=True)])
    worst = sorted(element for rank in found for element in rank)
    if worst:
        elements = mesh.topology.index_map(mesh.topology.dim).size_global
        where = ", ".join("(" + ", ".join(f"{x:.4g}" for x in at) + ")" for _, *at in worst[:5])
        where += ", ..." if len(worst) > 5 else ""
        raise MeshError(
            f"the Jacobian is not positive all over {len(worst)} of {elements} elements, "
            f"centred at {where} µm. A smaller size_um or thicker layers may help"
        )


def mesh_quality(mesh: Any) -> dict[str, float]:
    """Quality of a mesh (collective).

    Shape quality and aspect ratio are those of `shape_measures`, both poor by design in structured thin layers. The
    scaled Jacobian is an element's lowest over its largest Jacobian (Bernstein bounds): 1 for straight edges.

    Returns:
        `cells`, `min_scaled_jacobian`, `min_shape_quality`, `mean_shape_quality`, `max_aspect_ratio`, `min_edge_um`
        and `max_edge_um` (between corners).
    """
    points = fenicsx.cell_points(mesh)
    jacobian = jacobian_coefficients(points)
    shape, aspect, edges = shape_measures(points[:, : points.shape[2] + 1])
    local = {
        "min_scaled_jacobian": jacobian.min(axis=1) / jacobian.max(axis=1),
        "min_shape_quality": shape,
        "max_aspect_ratio": aspect,
        "min_edge_um": edges.min(axis=1),
        "max_edge_um": edges.max(axis=1),
    }
    comm, cells = mesh.comm, mesh.topology.index_map(mesh.topology.dim).size_global
    quality = {"cells": float(cells), "mean_shape_quality": comm.allreduce(float(shape.sum())) / cells}
    for name, values in local.items():
        if name.startswith("min"):
            quality[name] = comm.allreduce(float(values.min(initial=np.inf)), op=MPI.MIN)
        else:
            quality[name] = comm.allreduce(float(values.max(initial=-np.inf)), op=MPI.MAX)
    return quality


def _groups(model: Any, dim: int, of_cells: int) -> dict[str, int]:
    """Numbers of the model's physical groups of one dimension, by name; cells have the dimension `of_cells`."""
    numbers = {}
    for _, number in model.getPhysicalGroups(dim):
        name = model.getPhysicalName(dim, number)
        if not name or name in numbers:
            raise MeshError(f"physical group {number} of dimension {dim} needs a name of its own; got {name!r}")
        numbers[name] = int(number)
        for entity in model.getEntitiesForPhysicalGroup(dim, number):
            kinds = list(model.mesh.getElements(dim, entity)[0])
            if kinds not in ([kind] for kind in KINDS[dim]):
                what = "triangles and their edges" if of_cells == 2 else "tetrahedra and their faces"
                raise MeshError(f"group {name!r} must hold {what}, of order 1 or 2; Gmsh kind {kinds}")
    if dim == of_cells and not numbers:
        raise MeshError("the Gmsh model has no physical group of surfaces or volumes")
    return numbers


def _from_root(comm: MPI.Comm, make: Callable[[], T], send: bool = True) -> T:
    """Rank 0's result of `make`, or its error, on every rank; with send = False the others get None."""
    made: Any = None
    error: Exception | None = None
    if comm.rank == 0:
        try:
            made = make()
        except (CellmechError, OSError) as caught:
            error = caught
        except Exception as caught:  # must not leave the other ranks waiting, nor pass for a fault of the mesh
            error = RuntimeError(f"{type(caught).__name__}: {caught}")
            error.__cause__ = caught
    error = comm.bcast(error)
    if error is not None:
        raise error
    return comm.bcast(made) if send else made
