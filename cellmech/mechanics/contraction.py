"""Actin that contracts by an active strain: F = F_e F_a, with the solid's energy that of F_e.

In a part of the reference cell the solid's state of rest shortens to lambda_a = 1 - e along a0, or in every direction
of a tangent surface, and what it stores is the law's energy at F_e = F F_a^-1, per volume of that state:

    W(E, e) = k J_a W_law(E_e),  E_e = G^T E G + (G^T G - I)/2,  G = F_a^-1 = I + e/(1 - e) H,  J_a = det F_a,

H the structural tensor and k how many times stiffer than its layer that part is. S = dW/dE. Ellipticity is lost where
the law loses it: with N_e = G^T N the acoustic tensor of W is k J_a times that of W_law at F_e. The work of the
contraction is int dW/de de.

Sources: Nardinocchi & Teresi (2007), J. Elasticity 88, 27-39; Ambrosi & Pezzuto (2012), J. Elasticity 107, 199-212.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import ufl

from cellmech.mechanics.kinematics import Kinematics
from cellmech.mechanics.sector import Sector


@dataclass(frozen=True, eq=False)
class Contraction:
    """Actin that contracts by an active strain, in a part of the cell. A driver that acts through the material.

    Args:
        share: of its contraction that acts, as a function of the body's amplitude [-].
        contraction: e, how much shorter it becomes if nothing holds it, below 1 [-].
        sector: where.
        now: e of now, a number of forms on the body's mesh (`Domain.constant`) [-].
        kinematics: of the body; what cannot be stretched in it does not contract either.
        direction: of a0, one of `DIRECTIONS`.
        stiffness_factor: k, at all times, a number or one of forms [-].
        name: in results.
    """

    share: Callable[[float], float]
    contraction: float
    sector: Sector
    now: Any
    kinematics: Kinematics
    direction: str = "tangential"
    stiffness_factor: Any = 1.0
    name: str = "actin"
    reach_um: float = 0.0

    def at(self, amplitude: float) -> float:
        """e at an amplitude of the body [-]."""
        return self.contraction * self.share(amplitude)

    @property
    def _place(self) -> Any:
        return ufl.SpatialCoordinate(ufl.domain.extract_unique_domain(self.now))

    @property
    def _structure(self) -> Any:
        P = self.kinematics.stretched
        return P * self.sector.structure(self._place, self.direction, self.kinematics) * P

    @property
    def inverse(self) -> Any:
        """G = F_a^-1 [-], shape (3, 3)."""
        e = self.now * self.sector.inside(self._place)
        return ufl.Identity(3) + e / (1 - e) * self._structure

    def elastic(self, E: Any) -> Any:
        """E_e [-] at the strain E, shape (3, 3): no difference of nearly equal numbers."""
        G = self.inverse
        h = G - ufl.Identity(3)
        return G.T * E * G + h + h * h / 2

    @property
    def weight(self) -> Any:
        """k J_a [-]."""
        inside = self.sector.inside(self._place)
        return (1 + (self.stiffness_factor - 1) * inside) / ufl.det(self.inverse)

    def work(self, body: Any, u: Any, w: Any) -> ufl.Form | None:
        """See `Driver`: nothing besides what the material does."""
        return None

    def scale(self, body: Any, w: Any) -> ufl.Form:
        """See `Driver`: the stress that small strains of this size would leave in the undeformed body."""
        e = body.domain.constant(self.contraction) * self.sector.inside(self._place)
        pull = ufl.inner(2 * e * self._structure, body.kinematics.gradient(w))
        hold = (m for m in body.materials if self in m.contractions)
        return sum(
            body.over(self.stiffness_factor * m.solid_fraction * m.constants["mu"] * pull, m.names) for m in hold
        )
