"""The solution of a body: Newton, rigid motions, BDF2 and its steps, the energy balance, ellipticity.

It may import: mechanics, mesh, fem. It knows no scene, no file and no command line.
"""

from __future__ import annotations

from cellmech.doors import door

_HOMES = {
    "Ellipticity": "ellipticity",
    "Schedule": "schedule",
    "Simulation": "simulation",
    "Solver": "newton",
    "State": "state",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
