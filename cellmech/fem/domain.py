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
from cellmech.mesh.geometry import DiscSpec, build_disc, interrupt_kept

T = TypeVar("T")


@dataclass(frozen=True)
class Domain:
    """A mesh with its named groups.

    Args:
        mesh: triangles, straight or of second order [µm].
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


def build_domain(spec: DiscSpec, comm: MPI.Comm) -> Domain:
    """Mesh a disc on rank 0 and distribute it (collective).

    Raises:
        MeshError: on every rank, if Gmsh failed or an element is inverted.
        OSError: on every rank, if the disk refuses the folder for temporary files.
    """
    with ExitStack() as stack:

        def model() -> Any:
            if (known := store.kept(spec)) is not None:
                stack.enter_context(store.without_gmsh())
                return known
            made = stack.enter_context(build_disc(spec))
            store.keep(spec, made)
            return made

        if comm.rank > 0:
            stack.enter_context(store.without_gmsh())
        return from_gmsh(_from_root(comm, model, send=False), comm)


def from_gmsh(model: Any, comm: MPI.Comm) -> Domain:
    """Distribute the Gmsh model of rank 0; the other ranks pass None (collective).

    Raises:
        MeshError: on every rank, if a group has no name or an element has a Jacobian that is not positive.
    """
    cells, facets = _from_root(comm, lambda: (_groups(model, 2), _groups(model, 1)))
    with interrupt_kept():
        mesh, cell_tags, facet_tags = fenicsx.model_to_mesh(model, comm)
    check_elements(mesh)
    quality = mesh_quality(mesh)
    for name, number in cells.items():
        own = cell_tags.indices[cell_tags.values == number] < mesh.topology.index_map(mesh.topology.dim).size_local
        quality[f"cells_{name}"] = comm.allreduce(float(own.sum()))
    return Domain(mesh, cell_tags, facet_tags, cells, facets, quality)


def check_elements(mesh: Any) -> None:
    """Make sure that the Jacobian determinant is positive all over every triangle (collective).

    Raises:
        MeshError: on every rank, with the number of bad elements and where the worst ones are.
    """
    points = fenicsx.cell_points(mesh)
    lowest = jacobian_coefficients(points).min(axis=1)
    bad = np.nonzero(~(lowest > 0.0))[0]
    places = points[bad][:, :3].mean(axis=1)
    found = mesh.comm.allgather([(float(d), *xy) for d, xy in zip(lowest[bad], places.tolist(), strict=True)])
    worst = sorted(element for rank in found for element in rank)
    if worst:
        elements = mesh.topology.index_map(mesh.topology.dim).size_global
        where = ", ".join(f"({x:.4g}, {y:.4g})" for _, x, y in worst[:5]) + (", ..." if len(worst) > 5 else "")
        raise MeshError(
            f"the Jacobian is not positive all over {len(worst)} of {elements} elements, "
            f"centred at {where} µm. A smaller size_um or thicker layers may help"
        )


def jacobian_coefficients(points: np.ndarray) -> np.ndarray:
    """Bernstein coefficients of the Jacobian determinant of triangles [µm²], shape (cells, 1 or 6).

    The determinant of a second-order triangle is quadratic: it lies between its least and its largest coefficient.

    Args:
        points: geometry nodes in DOLFINx's order, shape (cells, 3 or 6, 2) [µm].

    Source: Johnen, Remacle, Geuzaine, J. Comput. Phys. 233 (2013) 359-372.
    """
    if points.shape[1] == 3:
        return _determinant(points[:, 1:] - points[:, :1])[:, None]
    corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    values = [_determinant(_gradients(x, y) @ points) for x, y in (*corners, (0.5, 0.5), (0.0, 0.5), (0.5, 0.0))]
    edges = [2 * values[3 + k] - (values[i] + values[j]) / 2 for k, (i, j) in enumerate(((1, 2), (0, 2), (0, 1)))]
    return np.stack([*values[:3], *edges], axis=1)


def mesh_quality(mesh: Any) -> dict[str, float]:
    """Quality of a mesh (collective).

    Shape quality is twice the inscribed over the circumscribed radius of the corner triangle, 1 at best; aspect ratio
    its longest edge over its least height, 1.15 at best. Both are poor by design in structured thin layers. The scaled
    Jacobian is an element's lowest over its largest Jacobian (Bernstein bounds): 1 for straight edges.

    Returns:
        `cells`, `min_scaled_jacobian`, `min_shape_quality`, `mean_shape_quality`, `max_aspect_ratio`, `min_edge_um`
        and `max_edge_um` (between corners).
    """
    points = fenicsx.cell_points(mesh)
    jacobian = jacobian_coefficients(points)
    corners = points[:, :3]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    area = np.abs(_determinant(corners[:, 1:] - corners[:, :1])) / 2
    shape = 16 * area**2 / (edges.sum(axis=1) * edges.prod(axis=1))
    local = {
        "min_scaled_jacobian": jacobian.min(axis=1) / jacobian.max(axis=1),
        "min_shape_quality": shape,
        "max_aspect_ratio": edges.max(axis=1) ** 2 / (2 * area),
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


def _gradients(x: float, y: float) -> np.ndarray:
    """Derivatives of the second-order shape functions by the reference coordinates, shape (2, 6), DOLFINx's order."""
    z = 1 - x - y
    return np.array(
        [
            [1 - 4 * z, 4 * x - 1, 0.0, 4 * y, -4 * y, 4 * (z - x)],
            [1 - 4 * z, 0.0, 4 * y - 1, 4 * x, 4 * (z - y), -4 * x],
        ]
    )


def _determinant(matrices: np.ndarray) -> np.ndarray:
    return matrices[:, 0, 0] * matrices[:, 1, 1] - matrices[:, 0, 1] * matrices[:, 1, 0]


def _groups(model: Any, dim: int) -> dict[str, int]:
    """Numbers of the model's physical groups of one dimension, by name."""
    numbers = {}
    for _, number in model.getPhysicalGroups(dim):
        name = model.getPhysicalName(dim, number)
        if not name or name in numbers:
            raise MeshError(f"physical group {number} of dimension {dim} needs a name of its own; got {name!r}")
        numbers[name] = int(number)
        for entity in model.getEntitiesForPhysicalGroup(dim, number):
            kinds = list(model.mesh.getElements(dim, entity)[0])
            if kinds not in ([1], [8], [2], [9]):
                raise MeshError(
                    f"group {name!r} must hold triangles and their edges, of order 1 or 2; Gmsh kind {kinds}"
                )
    if dim == 2 and not numbers:
        raise MeshError("the Gmsh model has no physical group of surfaces")
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
