"""Kinematics: what a displacement's gradient is in space, formed so that small strains keep their digits.

A geometry fixes the 3 x 3 gradient of a vector field; everything behind it is the same for all. Everything here is
symbolic (UFL). `F J C` are kinematic quantities only; the residual is `R`, the tangent `K`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import ufl

ON_AXIS_UM = 1e-9  # a point nearer to the axis is on it: rounding leaves so much of 0


class Kinematics(Protocol):
    """A geometry: what the fields of a mesh mean in space."""

    @property
    def words(self) -> str:
        """For people."""

    @property
    def force_unit(self) -> str:
        """Of resultants over the body, as messages write it."""

    @property
    def energy_unit(self) -> str:
        """Likewise, of moments and energies."""

    @property
    def content(self) -> str:
        """Key of a region's size, with its unit."""

    @property
    def components(self) -> int:
        """Of a displacement, and coordinates of the mesh."""

    @property
    def rest(self) -> tuple[float, float, float]:
        """The reported J1, J2, J3 of a body at rest [-]."""

    @property
    def stretched(self) -> Any:
        """Projector onto the directions in which a point may be stretched [-], shape (3, 3)."""

    @property
    def directions(self) -> int:
        """How many these are."""

    def gradient(self, v: Any) -> Any:
        """Gradient in space of a vector field on the mesh, shape (3, 3)."""

    def vector(self, v: Any) -> Any:
        """A vector on the mesh as one in space, shape (3,)."""

    def weight(self, x: Any) -> Any:
        """Factor of an integral over the mesh, or its boundary, at the place x; symbols or arrays."""

    def ball(self, radius: float) -> float:
        """Size of a whole round body [µm^2 or µm^3]."""

    def hertz_um(self, force: float, radius: float, modulus: float) -> float:
        """Half-width of the contact of a round body on a rigid flat [µm], modulus E/(1 - nu^2) [Pa] (Hertz)."""

    def adhering_um(self, work: float, radius: float, modulus: float) -> float:
        """The same without load, by adhesion [Pa µm] alone (Johnson, Kendall & Roberts 1971; in the plane Barquins)."""


@dataclass(frozen=True)
class PlaneStrain:
    """Plane strain: nothing moves along z and nothing depends on it, F33 = 1. Totals are per µm of z.

    The reported J1, J2, J3 are tr C, tr C^2, det C of the plane's C (eqs 14-16), 2, 2, 1 at rest.
    """

    words: ClassVar[str] = "plane strain, finite strain"
    force_unit: ClassVar[str] = "Pa um"
    energy_unit: ClassVar[str] = "Pa um2"
    content: ClassVar[str] = "area_um2"
    components: ClassVar[int] = 2
    rest: ClassVar[tuple[float, float, float]] = (2.0, 2.0, 1.0)
    directions: ClassVar[int] = 2

    @property
    def stretched(self) -> Any:
        """See `Kinematics`."""
        return ufl.as_matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])

    def gradient(self, v: Any) -> Any:
        """See `Kinematics`."""
        h = ufl.grad(v)
        return ufl.as_matrix([[h[0, 0], h[0, 1], 0.0], [h[1, 0], h[1, 1], 0.0], [0.0, 0.0, 0.0]])

    def vector(self, v: Any) -> Any:
        """See `Kinematics`."""
        return ufl.as_vector([v[0], v[1], 0.0])

    def weight(self, x: Any) -> Any:
        """See `Kinematics`."""
        return 1

    def ball(self, radius: float) -> float:
        """See `Kinematics`."""
        return math.pi * radius**2

    def hertz_um(self, force: float, radius: float, modulus: float) -> float:
        """See `Kinematics`."""
        return 2.0 * math.sqrt(force * radius / (math.pi * modulus))

    def adhering_um(self, work: float, radius: float, modulus: float) -> float:
        """See `Kinematics`: a^3 = 32 w R^2/(pi E*)."""
        return float((32.0 * work * radius**2 / (math.pi * modulus)) ** (1 / 3))


@dataclass(frozen=True)
class ThreeD:
    """A body in space. The reported J1, J2, J3 are tr C, tr C^2, det C, 3, 3, 1 at rest."""

    words: ClassVar[str] = "3-D, finite strain"
    force_unit: ClassVar[str] = "pN"
    energy_unit: ClassVar[str] = "aJ"
    content: ClassVar[str] = "volume_um3"
    components: ClassVar[int] = 3
    rest: ClassVar[tuple[float, float, float]] = (3.0, 3.0, 1.0)
    directions: ClassVar[int] = 3

    @property
    def stretched(self) -> Any:
        """See `Kinematics`."""
        return ufl.Identity(3)

    def gradient(self, v: Any) -> Any:
        """See `Kinematics`."""
        return ufl.grad(v)

    def vector(self, v: Any) -> Any:
        """See `Kinematics`."""
        return v

    def weight(self, x: Any) -> Any:
        """See `Kinematics`."""
        return 1

    def ball(self, radius: float) -> float:
        """See `Kinematics`."""
        return 4 / 3 * math.pi * radius**3

    def hertz_um(self, force: float, radius: float, modulus: float) -> float:
        """See `Kinematics`."""
        return float((0.75 * force * radius / modulus) ** (1 / 3))

    def adhering_um(self, work: float, radius: float, modulus: float) -> float:
        """See `Kinematics`: a^3 = 9 pi w R^2/(2 E*)."""
        return float((4.5 * math.pi * work * radius**2 / modulus) ** (1 / 3))


@dataclass(frozen=True)
class Axisymmetric(ThreeD):
    """The half plane x > 0 turned about x = 0: x is the radius r, nothing moves around, F33 = 1 + u_r/r.

    On the axis u_r/r is its limit, du_r/dr.
    """

    words: ClassVar[str] = "axisymmetric, finite strain: the half disc turned about x = 0"
    components: ClassVar[int] = 2

    def gradient(self, v: Any) -> Any:
        """See `Kinematics`."""
        h, r = ufl.grad(v), ufl.SpatialCoordinate(ufl.domain.extract_unique_domain(v))[0]
        off = ufl.gt(r, ON_AXIS_UM)
        inverse, limit = (ufl.conditional(off, *values) for values in ((1 / r, 0.0), (0.0, 1.0)))
        around = inverse * v[0] + limit * h[0, 0]  # no conditional of v: FFCx takes none of test functions
        return ufl.as_matrix([[h[0, 0], h[0, 1], 0.0], [h[1, 0], h[1, 1], 0.0], [0.0, 0.0, around]])

    def vector(self, v: Any) -> Any:
        """See `Kinematics`."""
        return ufl.as_vector([v[0], v[1], 0.0])

    def weight(self, x: Any) -> Any:
        """See `Kinematics`: 2 pi r [µm]."""
        return 2 * math.pi * x[0]


PLANE_STRAIN, AXISYMMETRIC, THREE_D = PlaneStrain(), Axisymmetric(), ThreeD()
GEOMETRIES: dict[str, Kinematics] = {"plane": PLANE_STRAIN, "axisymmetric": AXISYMMETRIC, "3d": THREE_D}


def deformation_gradient(u: Any, kinematics: Kinematics) -> Any:
    """F = I + grad u [-], shape (3, 3) (eq. 7)."""
    return ufl.Identity(3) + kinematics.gradient(u)


def green_lagrange(u: Any, kinematics: Kinematics) -> Any:
    """E = (C - I)/2 [-], shape (3, 3), from grad u: no difference of nearly equal numbers."""
    h = kinematics.gradient(u)
    return (h + h.T + h.T * h) / 2


def dilatation_rate(strain_rate: Any) -> Any:
    """dC/dt = 2 dE/dt [1/s] (eq. 22)."""
    return 2 * strain_rate
