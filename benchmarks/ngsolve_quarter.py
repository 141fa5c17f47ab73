"""A layered quarter ball for NGSolve, made by hand: prisms from a triangulated sphere outwards, tetrahedra inwards."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import cos, pi, sin
from math import sqrt as root
from typing import Any

import numpy as np
from netgen.meshing import Element2D, Element3D, FaceDescriptor, MeshPoint, Pnt
from netgen.meshing import Mesh as NetgenMesh
from ngsolve import H1, CoefficientFunction, GridFunction, IfPos, Mesh, Norm, VectorH1, x, y, z
from ngsolve_cell import INSIDE_OUT

ON_AXIS = 1e-9  # µm


@dataclass(frozen=True)
class Rings:
    """How finely the ball in space is resolved: `order` of displacement and geometry, and numbers of elements.

    Args:
        contact: rings about the pole below that is touched, up to `contact_rad` of latitude.
        beside: rings from there on, each somewhat wider than the one before.
        around: along each of them, over the quarter.
        across: from the inside out, of the shells of each layer; the innermost one's innermost shell is the centre's.
        order: of displacement and geometry.
        contact_rad: where the contact's rings end.
    """

    contact: int
    beside: int
    around: int
    across: tuple[int, int, int, int]
    order: int
    contact_rad: float = 0.42


def latitudes(rings: Rings) -> list[float]:
    """Angles from the pole below [rad], from 0 to pi: even in the contact, then wider and wider."""
    first = rings.contact_rad / rings.contact
    rest = pi - rings.contact_rad
    low, high = 1.0, 2.0
    for _ in range(60):  # of first * (q + q^2 + ...) = rest
        q = (low + high) / 2
        low, high = (q, high) if first * sum(q**k for k in range(1, rings.beside + 1)) < rest else (low, q)
    widths = [first] * rings.contact + [first * low**k for k in range(1, rings.beside + 1)]
    return [0.0, *(np.cumsum(widths) * pi / sum(widths)).tolist()]


def sphere(rings: Rings) -> tuple[np.ndarray, list[tuple[int, int, int]]]:
    """A triangulated quarter of the unit sphere, x and z positive: points, and triangles seen from outside."""
    angles, n = latitudes(rings), rings.around
    points = [(0.0, -1.0, 0.0)]
    for a in angles[1:-1]:
        points += [(sin(a) * cos(k * pi / 2 / n), -cos(a), sin(a) * sin(k * pi / 2 / n)) for k in range(n + 1)]
    points.append((0.0, 1.0, 0.0))
    rows = [range(1 + i * (n + 1), 1 + (i + 1) * (n + 1)) for i in range(len(angles) - 2)]
    triangles = [(0, a, b) for a, b in pairwise(rows[0])] + [(len(points) - 1, b, a) for a, b in pairwise(rows[-1])]
    for i, (lower, upper) in enumerate(pairwise(rows)):
        for k in range(n):
            a, b, c, d = lower[k], lower[k + 1], upper[k + 1], upper[k]
            triangles += [(a, c, b), (a, d, c)] if (i + k) % 2 else [(a, d, b), (b, d, c)]
    return np.array(points), triangles


def shells(radii: dict[str, float], across: Sequence[int]) -> list[tuple[float, str]]:
    """Outer radius [µm] and layer of each shell of elements, from the inside out; the first is the centre's ball."""
    found, inner = [], 0.0
    for (name, outer), n in zip(radii.items(), across, strict=True):
        found += [(inner + (outer - inner) * (k + 1) / n, name) for k in range(n)]
        inner = outer
    return found


def quarter_ball(radii: dict[str, float], centre_y: float, rings: Rings) -> tuple[Mesh, GridFunction]:
    """The layered quarter ball, x and z positive, and what curves it and must stay alive.

    Sides are "x" and "z" (where this coordinate is 0), "outer", "lamina outline" and so on; materials are the layers.
    """
    points, triangles = sphere(rings)
    layers = shells(radii, rings.across)
    sides = ["x", "z", *(f"{name} outline" for name in INSIDE_OUT[:-1]), "outer"]
    raw = NetgenMesh(dim=3)
    for number, name in enumerate(sides, 1):
        raw.Add(FaceDescriptor(bc=number, domin=1, domout=0, surfnr=number))
        raw.SetBCName(number - 1, name)
    for number, name in enumerate(INSIDE_OUT, 1):
        raw.SetMaterial(number, name)
    centre = raw.Add(MeshPoint(Pnt(0.0, centre_y, 0.0)))
    nodes = [[raw.Add(MeshPoint(Pnt(*(r * p + (0.0, centre_y, 0.0))))) for p in points] for r, _ in layers]
    flat = {"x": points[:, 0] < 1e-12, "z": points[:, 2] < 1e-12}
    for shell, (r, name) in enumerate(layers):
        number, here = INSIDE_OUT.index(name) + 1, nodes[shell]
        below = nodes[shell - 1] if shell else None
        for t in triangles:
            outer = [here[i] for i in t]
            inner = [below[i] for i in t] if below else [centre]
            raw.Add(Element3D(number, [*inner, *outer]))
            if r == radii[name]:
                raw.Add(Element2D(sides.index("outer" if name == INSIDE_OUT[-1] else f"{name} outline") + 1, outer))
            for a, b in edges(t):
                for side in ("x", "z"):
                    if flat[side][a] and flat[side][b]:
                        face = [here[a], here[b], *([below[b], below[a]] if below else [centre])]
                        raw.Add(Element2D(sides.index(side) + 1, face))
    mesh = Mesh(raw)
    return mesh, curved(mesh, layers[0][0], centre_y, rings.order)


def edges(triangle: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Its three edges."""
    yield from zip(triangle, (*triangle[1:], triangle[0]), strict=True)


def curved(mesh: Mesh, core: float, centre_y: float, order: int) -> GridFunction:
    """What moves the points between vertices onto the spheres, but inside the core [µm], which stays as it is."""
    radius, share = (GridFunction(H1(mesh, order=1)) for _ in range(2))
    for vertex in mesh.vertices:
        X, Y, Z = vertex.point
        r = root(X**2 + (Y - centre_y) ** 2 + Z**2)
        radius.vec[vertex.nr] = r
        share.vec[vertex.nr] = float(r > core * (1 + 1e-9))
    place = CoefficientFunction((x, y - centre_y, z))
    lift = share * (radius / IfPos(radius - ON_AXIS, Norm(place), 1.0) - 1) * place
    shift = interpolated(displacements(mesh, order), lift)
    mesh.SetDeformation(shift)
    return shift


def displacements(mesh: Mesh, order: int) -> VectorH1:
    """With none across the mirror planes."""
    return VectorH1(mesh, order=order, dirichletx="x", dirichletz="z")


def interpolated(space: VectorH1, field: Any) -> GridFunction:
    """A field in a space, exactly 0 where that is held."""
    found = GridFunction(space)
    found.Set(field)
    found.vec.FV().NumPy()[~np.array(space.FreeDofs())] = 0.0
    return found
