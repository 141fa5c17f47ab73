"""A part of the reference cell between radii and angles, and the directions in which its fibres lie."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import ufl

from cellmech.mechanics.contact import smooth_step
from cellmech.mechanics.kinematics import Kinematics

DIRECTIONS = ("tangential", "meridional", "radial", "x", "vertical")
AT_CENTRE_UM = 1e-9  # a point nearer to the centre has no radial direction


@dataclass(frozen=True)
class Sector:
    """A part of the reference cell between two radii and two angles, fading in and out smoothly.

    Args:
        centre: of the cell [µm].
        radii_um: inner and outer radius [µm]; None for no bound.
        angles_deg: from the top, 0, to the bottom, 180.
        fade_um: half-width of the fade along the radius [µm].
        around_um: of the fade at the angles, along the arc [µm].
        names: groups of cells that hold it; None for all.
        aspect: height over width of the ellipses about the centre, all alike, along which its fibres lie [-].
    """

    centre: tuple[float, ...]
    radii_um: tuple[float | None, float | None] = (None, None)
    angles_deg: tuple[float, float] = (0.0, 180.0)
    fade_um: float = 0.1
    around_um: float = 0.1
    names: tuple[str, ...] | None = None
    aspect: float = 1.0

    def radial(self, X: Any) -> tuple[Any, Any]:
        """Distance from the centre [µm] and the unit vector from there, shape of X."""
        from_centre = ufl.as_vector([X[k] - c for k, c in enumerate(self.centre)])
        r = ufl.sqrt(ufl.dot(from_centre, from_centre) + AT_CENTRE_UM**2)
        return r, from_centre / r

    def normal(self, X: Any) -> Any:
        """The unit normal of the circle or ellipse through X, shape of X."""
        if self.aspect == 1.0:
            return self.radial(X)[1]
        gradient = [(X[k] - c) / (self.aspect**2 if k == 1 else 1.0) for k, c in enumerate(self.centre)]
        n = ufl.as_vector(gradient)
        return n / ufl.sqrt(ufl.dot(n, n) + AT_CENTRE_UM**2)

    def inside(self, X: Any) -> Any:
        """1 inside, 0 outside, and C2 between."""
        r, direction = self.radial(X)
        value: Any = 1.0
        inner, outer = self.radii_um
        if inner:
            value *= smooth_step(r - inner, self.fade_um)
        if outer is not None:
            value *= smooth_step(outer - r, self.fade_um)
        angle = ufl.acos(direction[1])
        first, last = (math.radians(degrees) for degrees in self.angles_deg)
        if self.angles_deg[0] > 0.0:
            value *= smooth_step(r * (angle - first), self.around_um)
        if self.angles_deg[1] < 180.0:
            value *= smooth_step(r * (last - angle), self.around_um)
        return value

    def holds(self, name: str) -> bool:
        """Whether it may reach into a group of cells."""
        return self.names is None or name in self.names

    def structure(self, X: Any, direction: str, kinematics: Kinematics) -> Any:
        """The structural tensor, a0 x a0 or the tangent projector [-], shape (3, 3)."""
        radial = kinematics.vector(self.normal(X))
        up = ufl.as_vector([0.0, 1.0, 0.0])
        if direction == "tangential":
            return ufl.Identity(3) - ufl.outer(radial, radial)
        if direction == "meridional":
            across = up - ufl.dot(up, radial) * radial
            along = across / ufl.sqrt(ufl.dot(across, across) + AT_CENTRE_UM**2)
        else:
            along = {"radial": radial, "x": ufl.as_vector([1.0, 0.0, 0.0]), "vertical": up}[direction]
        return ufl.outer(along, along)
