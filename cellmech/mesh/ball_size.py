"""How many elements a ball's mesh will have, without making it: element sizes, integrated over the ball."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from cellmech.mesh.ball import SYMMETRIC, BallSpec
from cellmech.mesh.ball_mesh import directions_of_a_quarter, grown, shells_of, size_expressions
from cellmech.mesh.sizes import sizes_at

TETRAHEDRA = 8.2  # in a cube of the element size, as Gmsh fills it; regular ones would be 6 sqrt(2)
TRIANGLES = 4 / math.sqrt(3)  # in a square of it
NODES = {1: 0.185, 2: 1.41, 3: 4.68}  # to a tetrahedron of a large mesh, by the order of the displacement
RADII, DIRECTIONS = 120, 600  # at which sizes are read


def expected_cells(spec: BallSpec) -> float:
    """Tetrahedra of a large mesh, to some 10 %; of one with few thousand, to some 30 %."""
    shells = shells_of(spec)
    radii, sizes = grown(shells), size_expressions(spec)
    directions = directions_of_a_quarter(DIRECTIONS)

    def over_sphere(radius: float, dimension: int) -> float:
        """Elements to a unit of thickness, or of the sphere's surface, if each is as long as its size in every way."""
        return float(np.mean(math.pi * radius**2 / sizes_at(sizes, spec.centre, *(radius * directions)) ** dimension))

    abscissae, weights = np.polynomial.legendre.leggauss(RADII)
    thick = 0.0
    for inner, outer in pairwise([0.0, *radii]):
        half = (outer - inner) / 2
        at = inner + half * (1 + abscissae)
        thick += half * sum(w * over_sphere(r, 3) for w, r in zip(weights, at, strict=True))
    prisms = sum((len(shell) - 1) * over_sphere(radius, 2) for shell, radius in zip(shells, radii, strict=True))
    quarters = 4 / 2 ** len(SYMMETRIC[spec.shape])
    return quarters * (TETRAHEDRA * thick + 3 * TRIANGLES * prisms)
