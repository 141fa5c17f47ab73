"""From a scene to a body, and from a body to numbers: set-up, layers, samples, observables, description.

It may import: mechanics, mesh, fem, solver, scene.
"""

from __future__ import annotations

from cellmech.doors import door

_HOMES = {
    "Additions": "additions",
    "Observer": "observables",
    "Setup": "setup",
    "mesh_plan": "layering",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
