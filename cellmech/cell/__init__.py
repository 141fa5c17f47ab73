"""From a scene to a body, and from a body to numbers: set-up, layers, samples, observables, description.

It may import: mechanics, mesh, fem, solver, scene.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cellmech.doors import door

if TYPE_CHECKING:  # what type checkers see of the names below
    from cellmech.cell.additions import Additions
    from cellmech.cell.layering import mesh_plan
    from cellmech.cell.observables import Observer
    from cellmech.cell.setup import Setup

_HOMES = {
    "Additions": "additions",
    "Observer": "observables",
    "Setup": "setup",
    "mesh_plan": "layering",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
