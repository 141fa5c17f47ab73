"""The one door to what differs between DOLFINx 0.5 (Debian 12) and 0.9 (Debian 13)."""

from __future__ import annotations

from typing import Any

import dolfinx
import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI

OLD = tuple(int(part) for part in dolfinx.__version__.split(".")[:2]) < (0, 9)


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
    """Coordinates of the geometry nodes of this rank's own cells, shape (cells, nodes, 2)."""
    dofs, cells = mesh.geometry.dofmap, mesh.topology.index_map(2).size_local
    if OLD:
        dofs = dofs.array.reshape(dofs.num_nodes, -1)
    return mesh.geometry.x[dofs[:cells], :2]
