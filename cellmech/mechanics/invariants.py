"""Invariants of C measured from rest, so that energies built from them keep their digits at small strain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ufl

SERIES_LIMIT = 0.01  # |t| below which `excess` uses its series; above it the plain form keeps 11 digits (stresses 13)
SERIES_TERMS = 8  # t**2 … t**9: the first term left out is below 1e-16 of the first kept one


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

    def excess(self, t):
        """t - ln(1 + t) [-], of second order in t."""
        return excess(t, 0.0)


@dataclass(frozen=True)
class GivenInvariants(Invariants):
    """The same as functions of tr E, tr E^2 and det E themselves, to be differentiated by them."""

    first: Any
    squares: Any
    determinant: Any

    @property
    def trace(self):
        """See `Invariants`."""
        return self.first

    @property
    def square(self):
        """See `Invariants`."""
        return self.squares

    @property
    def third(self):
        """See `Invariants`."""
        return self.determinant


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


def reported_strains(E: ufl.core.expr.Expr) -> tuple[Any, Any, Any]:
    """J1, J2, J3 [-] of the geometry less their values at rest, tr C - tr I and so on, from E, shape (3, 3).

    In plane strain, where E33 = 0, these are the differences of the plane's tr C, tr C^2, det C too. Errors and ratios
    are taken on them.
    """
    C = Invariants(E)
    return C.I1_gap, 4 * C.trace + 4 * C.square, C.I3_gap
