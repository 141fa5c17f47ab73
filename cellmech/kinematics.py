"""Plane-strain kinematics, formed from the displacement gradient so that small strains keep their digits.

Everything here is symbolic (UFL). `F J C` are kinematic quantities only; the residual is `R`, the tangent `K`.
"""

from __future__ import annotations

from dataclasses import dataclass

import ufl

SERIES_LIMIT = 0.01  # |t| below which `excess` uses its series; above it the plain form keeps 11 digits (stresses 13)
SERIES_TERMS = 8  # t**2 … t**9: the first term left out is below 1e-16 of the first kept one


def deformation_gradient(u):
    """F = I + grad u [-], shape (2, 2) (eq. 7)."""
    return ufl.Identity(2) + ufl.grad(u)


def green_lagrange(u):
    """E = (C - I)/2 [-], shape (2, 2), from grad u: no difference of nearly equal numbers."""
    h = ufl.grad(u)
    return (h + h.T + h.T * h) / 2


def embed(a, a_zz=0.0):
    """The 3-D tensor diag(a, a_zz) of a plane one, shape (3, 3); F33 = 1 in plane strain, so E33 = 0."""
    zero = ufl.as_ufl(0.0)
    return ufl.as_matrix([[a[0, 0], a[0, 1], zero], [a[1, 0], a[1, 1], zero], [zero, zero, ufl.as_ufl(a_zz)]])


def plane(a):
    """The in-plane block of a 3-D tensor, shape (2, 2)."""
    return ufl.as_matrix([[a[0, 0], a[0, 1]], [a[1, 0], a[1, 1]]])


def dilatation_rate(strain_rate):
    """dC/dt = 2 dE/dt [1/s] (eq. 22)."""
    return 2 * strain_rate


@dataclass(frozen=True)
class Invariants:
    """Invariants of the 3-D C (eqs 14-16), each measured from rest, as functions of the 3-D strain E.

    Args:
        E: Green-Lagrange strain, shape (3, 3), usually a `ufl.variable` that energies are differentiated by.
    """

    E: ufl.core.expr.Expr

    @property
    def trace(self):
        """tr E [-]."""
        return ufl.tr(self.E)

    @property
    def square(self):
        """tr E^2 [-]."""
        return ufl.inner(self.E, self.E)

    @property
    def second(self):
        """Second principal invariant of E [-]."""
        return (self.trace**2 - self.square) / 2

    @property
    def third(self):
        """det E [-]; 0 in plane strain, kept for its derivative by E33."""
        return ufl.det(self.E)

    @property
    def I1_gap(self):
        """I1 - 3 [-]."""
        return 2 * self.trace

    @property
    def I2_gap(self):
        """I2 - 3 [-]."""
        return 4 * self.trace + 4 * self.second

    @property
    def I3_gap(self):
        """I3 - 1 = J^2 - 1 [-]."""
        return 2 * self.trace + 4 * self.second + 8 * self.third

    @property
    def ln_J(self):
        """ln J [-]."""
        t = self.I3_gap
        return (t - excess(t, 0.0)) / 2

    @property
    def I1_less_ln_I3(self):
        """I1 - 3 - ln I3 [-], of second order in E."""
        return excess(self.I3_gap, 0.0) - 4 * self.second - 8 * self.third

    @property
    def I1_less_root(self):
        """I1 - 3 I3^(1/3) [-], of second order in E."""
        return excess(self.I3_gap, 1 / 3) - 4 * self.second - 8 * self.third

    @property
    def I2_less_root(self):
        """I2 - 3 I3^(2/3) [-], of second order in E."""
        return 2 * excess(self.I3_gap, 2 / 3) - 4 * self.second - 16 * self.third


def excess(t, a: float):
    """t - ((1 + t)^a - 1)/a [-], with the limit t - ln(1 + t) at a = 0, to full precision at small t.

    The part of a power (or logarithm) of I3 = 1 + t that is of second order: energies built from it, and their
    derivatives, do not lose digits by cancellation at small strain.
    """
    coefficient, terms = 1.0, []
    for k in range(2, SERIES_TERMS + 2):
        coefficient *= (a - k + 1) / k  # binomial(a, k)/a
        terms.append(-coefficient)
    series = ufl.as_ufl(0.0)
    for c in reversed(terms):
        series = t * series + c
    plain = ufl.ln(1 + t) if a == 0.0 else ((1 + t) ** a - 1) / a
    return ufl.conditional(ufl.lt(abs(t), SERIES_LIMIT), t * t * series, t - plain)


def reported_strains(E):
    """In-plane J1 = tr C, J2 = tr C^2, J3 = det C [-] from the plane E, less their rest values 2, 2, 1.

    Returns the differences (J1 - 2, J2 - 2, J3 - 1), which is what errors and ratios are taken on.
    """
    trace, square = ufl.tr(E), ufl.inner(E, E)
    return 2 * trace, 4 * trace + 4 * square, 2 * trace + 2 * (trace**2 - square)
