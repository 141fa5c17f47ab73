"""Meshes of balls with curved tetrahedra: thick layers by Gmsh, thin ones as stacks of prisms on its surface meshes.

Gmsh meshes a quarter in which each stack of thin layers has shrunk to a sphere, and the thick layers inside have grown
in proportion. These shrink again, the sphere's triangles are extruded along the radii, and each prism becomes three
tetrahedra.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from cellmech.mesh.ball import SYMMETRIC, BallSpec
from cellmech.mesh.ball_layers import layered
from cellmech.mesh.geometry import gmsh_errors, gmsh_session
from cellmech.mesh.sizes import Zone, graded_sizes, sizes_at
from cellmech.mesh.store import KeptModel

THIN = 0.2  # of the outer radius: a layer below it is thin
AXES = "xyz"
DIRECTIONS = 1000  # in which sizes are compared with a layer's thickness


def build_ball(spec: BallSpec) -> KeptModel:
    """Mesh a ball; what is returned answers as a Gmsh model does.

    Cell groups are the layers; facet groups are "outer", "nucleus_outline" and, where the shape ends at these planes,
    "symmetry x" and "symmetry z". The mesh depends on the specification only. Nodes of planes of symmetry lie on them
    exactly. Second-order nodes of spheres and of thin layers lie on spheres about the centre.

    Raises:
        MeshError: Gmsh failed.
    """
    shells = shells_of(spec)
    radii = grown(shells)
    corners = layered(spec, shells, radii, *_thick(spec, radii))
    for axis in "zx":
        if axis not in SYMMETRIC[spec.shape]:
            corners.mirror(AXES.index(axis))
    for axis in SYMMETRIC[spec.shape]:
        corners.close(f"symmetry {axis}", AXES.index(axis))
    return corners.model(np.array(spec.centre), spec.order)


def size_expressions(spec: BallSpec) -> list[str]:
    """Gmsh MathEval expressions whose least is the element size [µm] in the quarter of a ball."""
    x, y, z = spec.centre
    bottom = (Zone((x, y - spec.interfaces[-1][1], z)),)
    return graded_sizes(spec, bottom if spec.zones is None else spec.zones)


def shells_of(spec: BallSpec) -> list[np.ndarray]:
    """Radii of nodes [µm] of what is extruded, from the inside out: a stack of thin layers or a mere interface each.

    What lies between two shells, and inside the first, is thick: its elements are as large as they are asked to be.
    """
    radii = sorted({radius for _, radius in spec.interfaces} | {spec.nucleus_radius_um})
    shells = [[radii[0]]]
    for inner, outer in pairwise(radii):
        across = _elements_across(spec, inner, outer)
        if across:
            shells[-1].extend(np.linspace(inner, outer, across + 1)[1:].tolist())
        else:
            shells.append([outer])
    return [np.array(shell) for shell in shells]


def grown(shells: list[np.ndarray]) -> list[float]:
    """Radii of the spheres that Gmsh meshes between [µm]: each stack of thin layers has shrunk to one."""
    radii = [float(shells[-1][0])]
    for shell, inside in pairwise(reversed(shells)):
        radii.insert(0, radii[0] * inside[-1] / shell[0])
    return radii


def directions_of_a_quarter(count: int) -> np.ndarray:
    """Unit vectors that are spread evenly over a quarter of a sphere, shape (3, count)."""
    height = (np.arange(count) + 0.5) / count * 2 - 1
    turn = np.arange(count) * (math.sqrt(5) - 1) / 2 % 1 * math.pi / 2
    flat = np.sqrt(1 - height**2)
    return np.array([flat * np.cos(turn), height, flat * np.sin(turn)])


def _elements_across(spec: BallSpec, inner: float, outer: float) -> int:
    """Elements across an extruded layer, 0 for one whose elements are small enough to need no structure."""
    middle = (inner + outer) / 2
    offsets = middle * directions_of_a_quarter(DIRECTIONS)
    offsets = np.hstack([offsets, [[0.0, 0.0], [-middle, middle], [0.0, 0.0]]])
    size = sizes_at(size_expressions(spec), spec.centre, *offsets)
    least = spec.thin_layers if outer - inner < THIN * spec.interfaces[-1][1] else 1
    if size.max() * least <= outer - inner:
        return 0
    return max(least, math.ceil((outer - inner) / (spec.grading.elongation * size.min())))


def _thick(spec: BallSpec, radii: list[float]) -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]:
    """Gmsh's mesh of the quarter between spheres: positions about the centre, triangles and tetrahedra of each."""
    with gmsh_session() as gmsh:
        spheres, volumes, planes = _geometry(gmsh.model.geo, spec.centre, radii)
        gmsh.model.geo.synchronize()
        _set_sizes(gmsh, size_expressions(spec))
        with gmsh_errors():
            gmsh.model.mesh.generate(3)
        tags, x, _ = gmsh.model.mesh.getNodes()
        place = np.zeros((int(tags.max()) + 1, 3))
        place[tags.astype(np.int64)] = x.reshape(-1, 3) - spec.centre

        def elements(kind: int, entities: list[int]) -> np.ndarray:
            found = [gmsh.model.mesh.getElementsByType(kind, entity)[1] for entity in entities]
            return np.concatenate(found).astype(np.int64).reshape(-1, kind if kind == 4 else 3)

        triangles = [elements(2, entities) for entities in spheres]
        tetrahedra = [elements(4, [entity]) for entity in volumes]
        for axis, entities in planes.items():
            place[np.unique(elements(2, entities)), AXES.index(axis)] = 0.0
    return place, triangles, tetrahedra


def _geometry(
    geo: Any, centre: tuple[float, ...], radii: list[float]
) -> tuple[list[list[int]], list[int], dict[str, list[int]]]:
    """Surfaces of each sphere, the volume inside each, and surfaces on the planes of symmetry."""
    spheres: list[list[int]] = []
    volumes: list[int] = []
    planes: dict[str, list[int]] = {"x": [], "z": []}
    middle = geo.addPoint(*centre)
    low = high = middle
    inner: dict[str, list[int]] = {"x": [], "z": []}
    for radius in radii:
        ends = {"x": (radius, 0, 0), "z": (0, 0, radius), "low": (0, -radius, 0), "high": (0, radius, 0)}
        point = {key: geo.addPoint(*np.add(centre, offset)) for key, offset in ends.items()}
        arc = {
            (a, b): geo.addCircleArc(point[a], middle, point[b])
            for a, b in (("low", "x"), ("x", "high"), ("low", "z"), ("z", "high"), ("x", "z"))
        }
        loops = (
            [arc["low", "x"], arc["x", "z"], -arc["low", "z"]],
            [arc["x", "high"], -arc["z", "high"], -arc["x", "z"]],
        )
        octants = [geo.addSurfaceFilling([geo.addCurveLoop(loop)], sphereCenterTag=middle) for loop in loops]
        down, up = geo.addLine(low, point["low"]), geo.addLine(high, point["high"])
        walls = []
        for plane, side in (("z", "x"), ("x", "z")):
            outer = [arc["low", side], arc[side, "high"]]
            loop = [down, *outer, -up, *(-curve for curve in reversed(inner[side]))]
            walls.append(geo.addPlaneSurface([geo.addCurveLoop(loop)]))
            planes[plane].append(walls[-1])
            inner[side] = outer
        around = [*octants, *walls, *(spheres[-1] if spheres else [])]
        volumes.append(geo.addVolume([geo.addSurfaceLoop(around)]))
        spheres.append(octants)
        low, high = point["low"], point["high"]
    return spheres, volumes, planes


def _set_sizes(gmsh: Any, expressions: list[str]) -> None:
    field = gmsh.model.mesh.field
    fields = [field.add("MathEval") for _ in expressions]
    for number, expression in zip(fields, expressions, strict=True):
        field.setString(number, "F", expression)
    least = field.add("Min")
    field.setNumbers(least, "FieldsList", fields)
    field.setAsBackgroundMesh(least)
    for source in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.MeshSize{source}", 0)
    gmsh.option.setNumber("Mesh.Algorithm", 6)  # frontal Delaunay
