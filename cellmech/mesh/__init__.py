"""Meshes, by Gmsh alone: the disc, the ball, their thin layers, and a store of what was meshed before.

It may import: what every room may use.
"""

from __future__ import annotations

from cellmech.doors import door

_HOMES = {
    "BallSpec": "ball",
    "DiscSpec": "disc",
    "Grading": "disc",
    "Zone": "sizes",
    "build_ball": "ball_mesh",
    "build_disc": "geometry",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
