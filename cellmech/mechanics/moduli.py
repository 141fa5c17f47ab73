"""Elastic constants. Light: what scenes load."""

from __future__ import annotations


def lame(young: float, poisson: float, printed: bool = False) -> tuple[float, float]:
    """lambda and mu [Pa] from E [Pa] and nu [-] (eq. 17).

    Args:
        young: Young's modulus [Pa].
        poisson: Poisson's ratio [-].
        printed: take lambda = E nu/(1 - 2 nu), as eq. 17 prints it, instead of E nu/((1 + nu)(1 - 2 nu)).
    """
    factor = 1.0 if printed else 1.0 + poisson
    return young * poisson / (factor * (1 - 2 * poisson)), young / (2 * (1 + poisson))
