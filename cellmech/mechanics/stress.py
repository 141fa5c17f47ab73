"""Stress by differentiation of a law's energy, alone or with a pressure of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import ufl

from cellmech.mechanics.invariants import Invariants
from cellmech.mechanics.kinematics import Kinematics
from cellmech.mechanics.laws import Law, Volume, volume_of


@dataclass(frozen=True)
class VolumeMeasure:
    """A measure g of volume change [-].

    Args:
        of: g as a function of the invariants.
        changed: (E, d, kinematics) -> the strain that has g + d and else is as E is, equal in all stretched directions.
    """

    of: Callable[[Invariants], ufl.core.expr.Expr]
    changed: Callable[..., ufl.core.expr.Expr]


def _swollen(E, d, kinematics: Kinematics):
    """(e^(2 d/n) C - I)/2 with n stretched directions: ln J grows by d."""
    half = d / kinematics.directions
    growth = 2 * ufl.sinh(half) * ufl.exp(half)  # e^(2 d/n) - 1
    return E + growth * (E + kinematics.stretched / 2)


def _spread(E, d, kinematics: Kinematics):
    """E + d/n I with n stretched directions: tr E grows by d."""
    return E + d / kinematics.directions * kinematics.stretched


MEASURES = {
    Volume.LN_J: VolumeMeasure(lambda C: C.ln_J, _swollen),
    Volume.TRACE: VolumeMeasure(lambda C: C.trace, _spread),
}


def measure_of(law: Law) -> VolumeMeasure:
    """The measure that a law's lambda goes with.

    Raises:
        ValueError: the law states none.
    """
    if (stated := volume_of(law)) is None:
        raise ValueError(
            f"{law.__name__} states no volumetric measure (cellmech.mechanics.laws.volumetric): it cannot be mixed"
        )
    return MEASURES[stated]


def energy_and_stress(law: Law, E, /, **constants):
    """W [Pa] and S = dW/dE [Pa], the second Piola-Kirchhoff stress of the solid phase.

    Args:
        law: one of `cellmech.mechanics.laws.LAWS`, or any function of (Invariants, **constants).
        E: 3-D Green-Lagrange strain, shape (3, 3).
        constants: the law's moduli [Pa], floats or UFL.
    """
    variable = ufl.variable(E)
    W = law(Invariants(variable), **constants)
    return W, ufl.diff(W, variable)


def mixed_energy_and_stress(law: Law, E, p, /, *, lmbda, **constants):
    """W(lmbda = 0) + p g - p^2/(2 lmbda) [Pa], whose maximum over p is W, and S = dW/dE at fixed p [Pa].

    Args:
        law: with a volumetric measure g, see `measure_of`.
        E: 3-D Green-Lagrange strain, shape (3, 3).
        p: pressure, positive in tension, lmbda g where it is exact [Pa].
        lmbda, constants: the law's moduli [Pa], floats or UFL.
    """
    variable = ufl.variable(E)
    C = Invariants(variable)
    W = law(C, lmbda=0.0, **constants) + p * measure_of(law).of(C) - p**2 / (2 * lmbda)
    return W, ufl.diff(W, variable)
