"""The boundary of a mesh as numpy arrays, whatever its dimension."""

from __future__ import annotations

from dolfinx import fem

from cellmech.fem.domain import Domain
from cellmech.fem.outline import Outline
from cellmech.fem.surface import Surface


def boundary(domain: Domain, space: fem.FunctionSpace, name: str, mirrored: tuple[int, ...] = ()) -> Outline | Surface:
    """The edges of a plane mesh, or the faces of one in space, of a facet group.

    Args:
        domain: the mesh.
        space: displacement space.
        name: of the facet group.
        mirrored: in space, coordinates whose plane through the origin mirrors the body.
    """
    if domain.mesh.topology.dim == 2:
        return Outline(domain, space, name)
    return Surface(domain, space, name, mirrored)
