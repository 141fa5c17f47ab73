"""DOLFINx as the equations need it: the door to its versions, compilation, domains, outlines, coefficients.

It may import: mechanics, mesh.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cellmech.doors import door

if TYPE_CHECKING:  # what type checkers see of the names below
    from cellmech.fem.coefficients import material_fields
    from cellmech.fem.domain import Domain, build_domain
    from cellmech.fem.jit import PointValues
    from cellmech.fem.outline import Outline
    from cellmech.fem.shared_memory import release
    from cellmech.fem.started import MPI
    from cellmech.fem.subdivision import lattice

_HOMES = {
    "Domain": "domain",
    "MPI": "started",
    "Outline": "outline",
    "PointValues": "jit",
    "build_domain": "domain",
    "lattice": "subdivision",
    "material_fields": "coefficients",
    "release": "shared_memory",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
