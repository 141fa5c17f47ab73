"""The strain energies of the solid phase W(E) [Pa] and the stresses that follow from them (eqs 17-20).

A law is a function of the strain invariants and of named constants; its stress is S = dW/dE by symbolic
differentiation. To add a law: write the function, name it in `LAWS`, and say which measure of volume change lambda
goes with (`volumetric`), without which it has no mixed form. Small-strain moduli: mu = 2 (alpha + beta) for every law,
lambda as given (Yeoh: lambda + 4 alpha_Y1).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import ufl

from cellmech.mechanics.invariants import Invariants
from cellmech.mechanics.kinematics import Kinematics

BETA_OVER_MU = 1 / 0.4  # beta_MR = mu/0.4, printed below eq. 19

Law: TypeAlias = Callable[..., ufl.core.expr.Expr]


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


LN_J = VolumeMeasure(lambda C: C.ln_J, _swollen)
TRACE = VolumeMeasure(lambda C: C.trace, lambda E, d, kinematics: E + d / kinematics.directions * kinematics.stretched)
VOLUMETRIC: dict[Law, VolumeMeasure] = {}


def volumetric(measure: VolumeMeasure) -> Callable[[Law], Law]:
    """State that a law is W(lmbda) = W(lmbda = 0) + lmbda/2 g^2, which its mixed form is made of."""

    def stated(law: Law) -> Law:
        VOLUMETRIC[law] = measure
        return law

    return stated


@volumetric(TRACE)
def saint_venant(C: Invariants, *, lmbda, mu):
    """lambda/2 (tr E)^2 + mu tr E^2 [Pa] (eq. 17)."""
    return lmbda / 2 * C.trace**2 + mu * C.square


@volumetric(LN_J)
def neo_hookean(C: Invariants, *, lmbda, mu):
    """mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2 [Pa] (eq. 18)."""
    return mu / 2 * C.I1_less_ln_I3 + lmbda / 2 * C.ln_J**2


@volumetric(LN_J)
def mooney_rivlin(C: Invariants, *, lmbda, mu, beta):
    """alpha (I1 - 3 I3^(1/3)) + beta (I2 - 3 I3^(2/3)) + lambda_MR/2 (ln J)^2 [Pa] (eq. 19).

    alpha = mu/2 - beta and lambda_MR = lambda + 2 mu/3; alpha < 0 at the printed beta = mu/0.4.
    """
    return _mooney_rivlin(C, C.I2_less_root, lmbda, mu, beta)


def _mooney_rivlin(C: Invariants, second, lmbda, mu, beta):
    """Eq. 19 with `second` for I2 - 3 I3^(2/3) [Pa]."""
    alpha = mu / 2 - beta
    return alpha * C.I1_less_root + beta * second + (lmbda + 2 * mu / 3) / 2 * C.ln_J**2


@volumetric(LN_J)
def yeoh(C: Invariants, *, lmbda, mu, beta, i1_rest):
    """W_MR + alpha_Y1/2 (I1 - i1_rest)^2 + alpha_Y2/3 (I1 - i1_rest)^3 [Pa] (eq. 20).

    alpha_Y1 = -0.5 alpha, alpha_Y2 = 0.1 alpha. i1_rest = 3 is free of stress at rest; i1_rest = 0 is eq. 20 as
    printed, whose stress at rest is -1.2 alpha I.
    """
    return _yeoh(mooney_rivlin(C, lmbda=lmbda, mu=mu, beta=beta), C.I1_gap + (3 - i1_rest), mu, beta)


def _yeoh(W, i1, mu, beta):
    """Eq. 20 from eq. 19's energy W [Pa] and I1 less its reference."""
    alpha = mu / 2 - beta
    return W - 0.5 * alpha / 2 * i1**2 + 0.1 * alpha / 3 * i1**3


LAWS: dict[str, Law] = {
    "saint-venant": saint_venant,
    "neo-hookean": neo_hookean,
    "mooney-rivlin": mooney_rivlin,
    "yeoh": yeoh,
}


@volumetric(LN_J)
def mooney_rivlin_in_plane(C: Invariants, *, lmbda, mu, beta):
    """The same with the in-plane tr C in the stress of eq. 19 [Pa], whose stress at rest is -2 beta I.

    There tr C I - C = det C C^-1, so that I3 stands for I2 = I1 - 1 + I3.
    """
    return _mooney_rivlin(C, C.I3_gap - 3 * ((1 + C.I3_gap) ** (2 / 3) - 1), lmbda, mu, beta)


@volumetric(LN_J)
def yeoh_in_plane(C: Invariants, *, lmbda, mu, beta, i1_rest):
    """Likewise, and with the in-plane tr C = I1 - 1 in eq. 20, of which i1_rest is taken off all the same [Pa]."""
    return _yeoh(mooney_rivlin_in_plane(C, lmbda=lmbda, mu=mu, beta=beta), C.I1_gap + (2 - i1_rest), mu, beta)


IN_PLANE: dict[str, Law] = LAWS | {"mooney-rivlin": mooney_rivlin_in_plane, "yeoh": yeoh_in_plane}
"""What the laws become with the in-plane trace of C."""


def energy_and_stress(law: Law, E, /, **constants):
    """W [Pa] and S = dW/dE [Pa], the second Piola-Kirchhoff stress of the solid phase.

    Args:
        law: one of `LAWS`, or any function of (Invariants, **constants).
        E: 3-D Green-Lagrange strain, shape (3, 3).
        constants: the law's moduli [Pa], floats or UFL.
    """
    variable = ufl.variable(E)
    W = law(Invariants(variable), **constants)
    return W, ufl.diff(W, variable)


def mixed_energy_and_stress(law: Law, E, p, /, *, lmbda, **constants):
    """W(lmbda = 0) + p g - p^2/(2 lmbda) [Pa], whose maximum over p is W, and S = dW/dE at fixed p [Pa].

    Args:
        law: with a volumetric measure g, see `volumetric`.
        E: 3-D Green-Lagrange strain, shape (3, 3).
        p: pressure, positive in tension, lmbda g where it is exact [Pa].
        lmbda, constants: the law's moduli [Pa], floats or UFL.
    """
    variable = ufl.variable(E)
    C = Invariants(variable)
    W = law(C, lmbda=0.0, **constants) + p * VOLUMETRIC[law].of(C) - p**2 / (2 * lmbda)
    return W, ufl.diff(W, variable)
