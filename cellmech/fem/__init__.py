"""What the equations need of DOLFINx: the door to its versions, compilation, domains, outlines, coefficients.

It may import: mechanics, mesh.
"""

from __future__ import annotations

from cellmech.doors import door

_HOMES = {
    "Domain": "domain",
    "Outline": "outline",
    "PointValues": "jit",
    "build_domain": "domain",
    "mixtures": "coefficients",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
