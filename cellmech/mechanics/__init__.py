"""The equations, symbolic (UFL): kinematics, laws, fluid, obstacles, contact, balance.

It may import: what every room may use (errors).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cellmech.doors import door

if TYPE_CHECKING:  # what type checkers see of the names below
    from cellmech.mechanics.contact import Contact
    from cellmech.mechanics.invariants import Invariants
    from cellmech.mechanics.kinematics import deformation_gradient, green_lagrange
    from cellmech.mechanics.materials import Material
    from cellmech.mechanics.obstacles import Flat, Obstacle, Pillar

_HOMES = {
    "Contact": "contact",
    "Flat": "obstacles",
    "Invariants": "invariants",
    "Material": "materials",
    "Obstacle": "obstacles",
    "Pillar": "obstacles",
    "deformation_gradient": "kinematics",
    "green_lagrange": "kinematics",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
