"""Lamé's thick sphere under inner pressure, of one material and of two layers, at small strain."""

import numpy as np
import ufl
from dolfinx import fem

from cellmech.fem.jit import compile_form
from cellmech.mechanics.moduli import lame

PRESSURE = 1e-7  # Pa: strains of 1e-8
SPHERES = {
    "one material": {"solid": (2.0, 10.0, 0.3)},  # layer: outer radius [µm], Young's modulus [Pa], Poisson's ratio
    "two layers": {"soft": (1.5, 10.0, 0.3), "stiff": (2.0, 40.0, 0.2)},
}


def thick_sphere(layers: dict[str, tuple[float, float, float]]) -> np.ndarray:
    """(A, B) of u = A R + B/R^2 in each layer: sigma_RR = (3 lambda + 2 mu) A - 4 mu B/R^3."""
    radii = [1.0, *(radius for radius, _, _ in layers.values())]
    moduli = [lame(young, poisson) for _, young, poisson in layers.values()]
    rows, right = np.zeros((2 * len(moduli), 2 * len(moduli))), np.zeros(2 * len(moduli))

    def stress(layer: int, R: float) -> np.ndarray:
        lmbda, mu = moduli[layer]
        return np.array([3 * lmbda + 2 * mu, -4 * mu / R**3])

    rows[0, :2], right[0] = stress(0, 1.0), -PRESSURE
    for k, R in enumerate(radii[1:-1]):
        place = slice(2 * k, 2 * k + 2), slice(2 * k + 2, 2 * k + 4)
        for row, one in zip((2 * k + 1, 2 * k + 2), (lambda _, R: np.array([R, R**-2]), stress), strict=True):
            rows[row, place[0]], rows[row, place[1]] = one(k, R), -one(k + 1, R)
    rows[-1, -2:] = stress(len(moduli) - 1, radii[-1])
    return np.linalg.solve(rows, right).reshape(-1, 2)


def displacement_error(state, domain, layers: dict[str, tuple[float, float, float]]) -> float:
    """Relative L2 error of a state's displacement [-], without a weight: of two coordinates or of three."""
    X, parts = ufl.SpatialCoordinate(domain.mesh), np.zeros(2)
    for (A, B), layer in zip(thick_sphere(layers), layers, strict=True):
        exact = (A + B / ufl.sqrt(ufl.dot(X, X)) ** 3) * X
        for k, field in enumerate((state.u - exact, exact)):
            form = ufl.inner(field, field) * domain.dx(8, (layer,) if len(layers) > 1 else None)
            parts[k] += fem.assemble_scalar(compile_form(form, domain.mesh.comm))
    return float(np.sqrt(parts[0] / parts[1]))
