"""The viscous stress of the fluid phase (eqs 21-23) [Pa]."""

from __future__ import annotations

import ufl


def fluid_stress(F, C_dot, lmbda_f, mu_f):
    """S_f = J lambda_f/2 tr(C^-1 C_dot) C^-1 + J mu_f C^-1 C_dot C^-1 [Pa] (eq. 23).

    The factor 1/2 is eq. 23's (eq. 22 lacks it). A rigid rotation gives C_dot = 0 and so no stress, also after
    discretisation, because the rate is taken of C itself.

    Args:
        F: deformation gradient [-], shape (3, 3).
        C_dot: rate of C [1/s], same shape.
        lmbda_f, mu_f: volumetric and shear viscosity [Pa s].
    """
    J = ufl.det(F)
    C_inv = ufl.inv(F.T * F)
    return J * lmbda_f / 2 * ufl.tr(C_inv * C_dot) * C_inv + J * mu_f * C_inv * C_dot * C_inv
