"""The boundary of a mesh as numpy arrays, whatever its dimension."""

from __future__ import annotations

from dolfinx import fem

from cellmech.fem.domain import Domain
from cellmech.fem.outline import Outline
from cellmech.fem.surface import Surface


def boundary(domain: Domain, space: fem.FunctionSpace, name: str) -> Outline | Surface:
    """The edges of a plane mesh, or the faces of one in space, of a facet group."""
    kind = Outline if domain.mesh.topology.dim == 2 else Surface
    return kind(domain, space, name)
