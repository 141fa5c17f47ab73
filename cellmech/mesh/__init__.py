"""Meshes, by Gmsh alone: the disc, its thin layers, and a store of what was meshed before.

It may import: what every room may use.
"""

from __future__ import annotations

from cellmech.doors import door

_HOMES = {
    "DiscSpec": "disc",
    "Grading": "disc",
    "build_disc": "geometry",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
