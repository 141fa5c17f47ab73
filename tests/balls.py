"""Balls of curved tetrahedra with a nucleus in them, for what measures surfaces."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import gmsh
import numpy as np
from mpi4py import MPI

from cellmech.fem import fenicsx
from cellmech.fem.domain import Domain

MIRRORED = {"full": (), "half": (0,), "quarter": (0, 2)}


def ball(shape: str = "quarter", size: float = 2.0, radius: float = 5.0, inner: float = 0.0) -> Domain:
    """A ball about the origin, or its part x > 0 (half), x, z > 0 (quarter), on every rank a piece of it.

    Groups of facets are "outer", of an inner ball too "nucleus_outline", and "cut", which lies in the mirror planes.
    """
    comm = MPI.COMM_WORLD
    if comm.rank == 0:
        gmsh.initialize()
        gmsh.option.setNumber("General.Verbosity", 0)
        _build(shape, size, radius, inner)
    mesh, cells, facets = fenicsx.model_to_mesh(gmsh.model if comm.rank == 0 else None, comm, 3)
    if comm.rank == 0:
        gmsh.finalize()
    return Domain(mesh, cells, facets, {"solid": 1}, {"outer": 2, "nucleus_outline": 3, "cut": 4}, {})


def _build(shape: str, size: float, radius: float, inner: float) -> None:
    occ = gmsh.model.occ
    balls = [(3, occ.addSphere(0, 0, 0, r)) for r in (radius, inner) if r]
    if inner:
        balls = occ.fragment(balls[:1], balls[1:])[0]
    corner = {"full": (-2, -2), "half": (0, -2), "quarter": (0, 0)}[shape]
    box = occ.addBox(corner[0] * radius, -2 * radius, corner[1] * radius, *(4 * radius,) * 3)
    solids = occ.intersect(balls, [(3, box)])[0]
    occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in solids], 1)
    groups: dict[int, list[int]] = {2: [], 3: [], 4: []}
    for _, tag in gmsh.model.getEntities(2):
        low, high = np.reshape(gmsh.model.getParametrizationBounds(2, tag), (2, 2))
        points = gmsh.model.getValue(2, tag, np.linspace(low, high, 5)[1:-1].ravel())
        r = np.linalg.norm(np.reshape(points, (-1, 3)), axis=1)
        kind = 2 if np.allclose(r, radius) else 3 if inner and np.allclose(r, inner) else 4
        groups[kind].append(tag)
    for number, tags in groups.items():
        if tags:
            gmsh.model.addPhysicalGroup(2, tags, number)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)


def shell(size: float, inner: float, layers: Sequence[tuple[str, float]]) -> Domain:
    """An octant of a hollow ball in curved tetrahedra; layers from the inside out, with their outer radii.

    Groups of facets are "inner", "outer" and "x", "y", "z", where this coordinate is 0.
    """
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 0)
    occ, bounds = gmsh.model.occ, [inner, *(radius for _, radius in layers)]
    hollow = []
    for low, high in pairwise(bounds):
        whole, hole = ((3, occ.addSphere(0, 0, 0, radius)) for radius in (high, low))
        hollow += occ.cut([whole], [hole])[0]
    octant = occ.intersect(hollow, [(3, occ.addBox(0, 0, 0, *(2 * bounds[-1],) * 3))])[0]
    solids = occ.fragment(octant[:1], octant[1:])[0] if len(octant) > 1 else octant
    occ.synchronize()
    outwards = sorted((np.linalg.norm(occ.getCenterOfMass(3, tag)), tag) for _, tag in solids)
    for number, (_, tag) in enumerate(outwards, 1):
        gmsh.model.addPhysicalGroup(3, [tag], number)
    facets = {"inner": 1, "outer": 2, "x": 3, "y": 4, "z": 5}
    groups: dict[int, list[int]] = {number: [] for number in facets.values()}
    for _, tag in gmsh.model.getEntities(2):
        low, high = np.reshape(gmsh.model.getParametrizationBounds(2, tag), (2, 2))
        middle = np.array(gmsh.model.getValue(2, tag, (low + high) / 2))
        flat = np.flatnonzero(np.abs(middle) < 1e-9)
        radius = np.linalg.norm(middle)
        kind = 3 + int(flat[0]) if len(flat) else 1 if np.isclose(radius, inner) else 2
        if len(flat) or np.isclose(radius, (inner, bounds[-1])).any():
            groups[kind].append(tag)
    for number, tags in groups.items():
        gmsh.model.addPhysicalGroup(2, tags, number)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    mesh, cells, tags = fenicsx.model_to_mesh(gmsh.model, MPI.COMM_SELF, 3)
    gmsh.finalize()
    return Domain(mesh, cells, tags, {name: k for k, (name, _) in enumerate(layers, 1)}, facets, {})


def affine(space: Any, H: Any, offset: Any = (0.0, 0.0, 0.0)) -> Any:
    """The displacement u = H X + offset as a function of the space."""
    from dolfinx import fem

    u = fem.Function(space)
    X = space.tabulate_dof_coordinates()
    u.x.array[:] = (X @ np.asarray(H, dtype=float).T + np.asarray(offset)).ravel()
    return u
