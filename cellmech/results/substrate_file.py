"""What a cell stands on as triangles for ParaView: `substrate.vtu`, which `fields.pvd` lists beside each time."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cellmech.mechanics import obstacles
from cellmech.results.records import SUBSTRATE, CaseFolder
from cellmech.results.vtu import packed, write_vtu
from cellmech.scene.placement import placement
from cellmech.scene.scene import Scene
from cellmech.scene.substrate import Upright, standing

FARTHEST = 3.0  # radii from the cell's axis to where flat and ridges end
THICK = 0.25  # radii of the flat in a section
UP, AROUND, UP_IN_A_SECTION = 16, 48, 60  # pieces from a pillar's foot to its top, and around it


def write_substrate(folder: CaseFolder, scene: Scene) -> None:
    """Write the obstacles of a scene file, where there are any. On one rank.

    Cell data obstacle: 0 for the flat, then the pillars with their images. Obstacles of one's own are not in it.
    """
    parts = substrate_triangles(scene)
    if not parts:
        return
    corners = np.concatenate(list(parts.values()))
    numbers = np.concatenate([np.full(len(part), number, dtype=np.int32) for number, part in parts.items()])
    # A displacement of 0: the filter that shows the deformed cell leaves it where it is.
    piece, blocks = packed(corners, {"displacement_um": np.zeros_like(corners)}, {"obstacle": numbers})
    with folder.replace_with(SUBSTRATE) as path:
        write_vtu(path, [piece], blocks)


def substrate_triangles(scene: Scene) -> dict[int, np.ndarray]:
    """Flat, 0, and pillars, from 1 on, as triangles [µm], shape (n, 3, 3): surfaces in 3-D, else sections."""
    x, _, *z = placement(scene).centre
    rim = FARTHEST * scene.radius_um
    found = {}
    if scene.flat is not None:
        sides = np.array([x - rim, x + rim])
        if z:
            found[0] = _sheet(_line(sides[::-1], np.full(2, scene.flat.y_um), z[0] - rim), 2 * rim)
        else:
            tops = [_line(sides, np.full(2, scene.flat.y_um - down)) for down in (0.0, THICK * scene.radius_um)]
            found[0] = _between(*tops)
    for number, one in enumerate(standing(scene), 1):
        found[number] = _surface(one.arch, z[0], rim) if z else _section(one.arch)
    return found


def _line(x: np.ndarray, y: np.ndarray, z: float = 0.0) -> np.ndarray:
    return np.column_stack([x, y, np.full(len(x), z)])


def _arch(pillar: Upright, z_um: float, up: int = UP) -> np.ndarray:
    """Its upper outline in the plane z, from the right to the left [µm], shape (2 up + 1, 3)."""
    x, y = np.array(pillar.outline(4 * up + 1, z_um))[: 2 * up + 1].T
    return _line(x, y, z_um)


def _section(pillar: Upright) -> np.ndarray:
    line = _arch(pillar, 0.0, UP_IN_A_SECTION)[::-1]
    return _between(line, line * np.array([1, 0, 1]) + np.array([0, pillar.y_um, 0]))


def _surface(pillar: Upright, z_um: float, rim: float) -> np.ndarray:
    """The surface of a ridge as far as a rim from z, or of a pillar that ends on all sides."""
    if isinstance(pillar, obstacles.Pillar):
        return _sheet(_arch(pillar, 0.0) + np.array([0, 0, z_um - rim]), 2 * rim)
    # its sections at all heights are the foot's, shrunk as the arch says
    foot = np.array(pillar.foot.outline(AROUND + 1))
    middle = np.array([pillar.x_um, 0.0, pillar.z_um])
    rings = []
    for x, y, _ in _arch(pillar, pillar.z_um)[: UP + 1]:
        across = (x - pillar.x_um) / pillar.half_width_um * foot
        rings.append(middle + np.column_stack([across[:, 0], np.full(AROUND + 1, y), across[:, 1]]))
    return np.concatenate([_between(upper, lower) for lower, upper in pairwise(rings)])


def _sheet(line: np.ndarray, deep: float) -> np.ndarray:
    """Between a line and itself so far along z."""
    return _between(line, line + np.array([0, 0, deep]))


def _between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Triangles between two lines of as many points, shape (2 (n - 1), 3, 3)."""
    corners = [[one[:-1], other[:-1], one[1:]], [one[1:], other[:-1], other[1:]]]
    return np.concatenate([np.stack(triangle, axis=1) for triangle in corners])
