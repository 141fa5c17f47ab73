"""The equations, symbolic (UFL): kinematics, laws, fluid, obstacles, contact, balance.

It may import: what every room may use (errors).
"""

from __future__ import annotations

from cellmech.doors import door

_HOMES = {
    "Contact": "contact",
    "Flat": "obstacles",
    "Invariants": "invariants",
    "Material": "materials",
    "Obstacle": "obstacles",
    "Pillar": "obstacles",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
