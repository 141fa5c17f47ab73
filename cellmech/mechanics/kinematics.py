"""Plane-strain kinematics, formed from the displacement gradient so that small strains keep their digits.

Everything here is symbolic (UFL). `F J C` are kinematic quantities only; the residual is `R`, the tangent `K`.
"""

from __future__ import annotations

import ufl


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


def reported_strains(E):
    """In-plane J1 = tr C, J2 = tr C^2, J3 = det C [-] from the plane E, less their rest values 2, 2, 1.

    Returns the differences (J1 - 2, J2 - 2, J3 - 1), which is what errors and ratios are taken on.
    """
    trace, square = ufl.tr(E), ufl.inner(E, E)
    return 2 * trace, 4 * trace + 4 * square, 2 * trace + 2 * (trace**2 - square)
