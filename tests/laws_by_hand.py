"""The laws written out by hand from their sources: what the package makes of its own energies is judged by these.

Each function gives W, dW/dI1, dW/dI2 and I3 dW/dI3 [Pa] from I1, I2, I3 of the 3-D C, in plain arithmetic with `log`
and `exp` of a module, so that floats, complex numbers, mpmath and UFL are served alike. Constants are the law's own.
"""

from types import SimpleNamespace

import numpy as np
import ufl

UFL = SimpleNamespace(log=ufl.ln, exp=ufl.exp)


def saint_venant(I1, I2, I3, m, *, lmbda, mu):
    """Eq. 17 with tr E = (I1 - 3)/2 and tr E^2 = (I1^2 - 2 I2 - 2 I1 + 3)/4."""
    trace = (I1 - 3) / 2
    W = lmbda * trace**2 / 2 + mu * (I1**2 - 2 * I2 - 2 * I1 + 3) / 4
    return W, lmbda * trace / 2 + mu * (I1 - 1) / 2, -mu / 2, 0


def neo_hookean(I1, I2, I3, m, *, lmbda, mu):
    """Eq. 18."""
    ln_J = m.log(I3) / 2
    return mu * (I1 - 3 - 2 * ln_J) / 2 + lmbda * ln_J**2 / 2, mu / 2, 0, (lmbda * ln_J - mu) / 2


def mooney_rivlin(I1, I2, I3, m, *, lmbda, mu, beta):
    """Eq. 19."""
    alpha, lmbda, ln_J = mu / 2 - beta, lmbda + 2 * mu / 3, m.log(I3) / 2
    root, square = m.exp(2 * ln_J / 3), m.exp(4 * ln_J / 3)  # I3^(1/3), I3^(2/3)
    W = alpha * (I1 - 3 * root) + beta * (I2 - 3 * square) + lmbda * ln_J**2 / 2
    return W, alpha, beta, -alpha * root - 2 * beta * square + lmbda * ln_J / 2


def yeoh(I1, I2, I3, m, *, lmbda, mu, beta, i1_rest):
    """Eq. 20."""
    W, by_I1, by_I2, by_I3 = mooney_rivlin(I1, I2, I3, m, lmbda=lmbda, mu=mu, beta=beta)
    i1, alpha = I1 - i1_rest, mu / 2 - beta
    y1, y2 = -alpha / 2, alpha / 10
    return W + y1 * i1**2 / 2 + y2 * i1**3 / 3, by_I1 + y1 * i1 + y2 * i1**2, by_I2, by_I3


def gent(I1, I2, I3, m, *, lmbda, mu, i1_limit):
    """Gent (1996) in t = I1 - 3 - ln I3, the part of I1 - 3 that is no change of volume at small strain."""
    ln_J = m.log(I3) / 2
    left = 1 - (I1 - 3 - 2 * ln_J) / i1_limit
    W = -mu * i1_limit * m.log(left) / 2 + lmbda * ln_J**2 / 2
    return W, mu / left / 2, 0, (lmbda * ln_J - mu / left) / 2


BY_HAND = {
    "saint-venant": saint_venant,
    "neo-hookean": neo_hookean,
    "mooney-rivlin": mooney_rivlin,
    "yeoh": yeoh,
    "gent": gent,
}
"""By the names that scene files use."""


def three_d(F):
    """F of the plane, shape (2, 2), in space."""
    result = np.eye(3, dtype=np.asarray(F).dtype)
    result[:2, :2] = F
    return result


def by_hand(law, C, constants, m=np):
    """W and S [Pa] of a law's name at C, shape (3, 3), whose entries `m` has functions for."""
    I1 = np.trace(C)
    adjugate = np.cross(C[[1, 2, 0]], C[[2, 0, 1]]).T
    I3 = C[0] @ adjugate[:, 0]
    W, by_I1, by_I2, by_I3 = BY_HAND[law](I1, (I1**2 - np.trace(C @ C)) / 2, I3, m, **constants)
    return W, 2 * ((by_I1 + I1 * by_I2) * np.eye(3, dtype=int) - by_I2 * C + by_I3 * adjugate / I3)


def plane_piola(law, F, constants):
    """First Piola-Kirchhoff stress [Pa] in the plane for an F of UFL, shape (2, 2); C is diag(F^T F, 1)."""
    C = F.T * F
    I1, I3 = ufl.tr(C) + 1, ufl.det(C)
    _, by_I1, by_I2, by_I3 = BY_HAND[law](I1, I1 - 1 + I3, I3, UFL, **constants)
    return 2 * F * ((by_I1 + I1 * by_I2) * ufl.Identity(2) - by_I2 * C + by_I3 * ufl.inv(C))


def elasticities(law, F, constants):
    """A_iJkL = dP_iJ/dF_kL [Pa] for F of shape (3, 3), by a complex step: no difference is formed, no digit is lost."""
    step, A = 1e-40, np.empty((3, 3, 3, 3))
    for k, L in np.ndindex(3, 3):
        stepped = F.astype(complex)
        stepped[k, L] += 1j * step
        A[:, :, k, L] = (stepped @ by_hand(law, stepped.T @ stepped, constants)[1]).imag / step
    return A
