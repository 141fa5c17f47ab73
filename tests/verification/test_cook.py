"""Cook's membrane in plane strain at finite strain, with a law that the package does not have.

48/44/16 mm, clamped at the left, a dead shear of 62.5 kPa on the right; lengths in mm and stresses in kPa throughout.
By two independent codes the middle of the right edge rises by 14.74 ± 0.02 mm.
"""

import numpy as np
from problems import block, displacement_space, hold

from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.mechanics.materials import Material
from cellmech.solver.schedule import Schedule
from cellmech.solver.simulation import Simulation

MU, POISSON, SHEAR = 422.5, 0.3, 62.5
KAPPA = 2 * MU * (1 + POISSON) / (3 * (1 - 2 * POISSON))


def isochoric(C, *, mu, kappa):
    """µ/2 (I1/J^(2/3) - 3) + kappa/4 (J^2 - 1 - 2 ln J), with the invariants of the 3-D C, C33 = 1."""
    I1, I3 = 3 + C.I1_gap, 1 + C.I3_gap
    return mu / 2 * (I1 / I3 ** (1 / 3) - 3) + kappa / 4 * (C.I3_gap - 2 * C.ln_J)


def rise(n):
    """Vertical displacement of the middle of the right edge (48, 52), n elements along each side."""
    domain = block(1.0, 1.0, n, n)
    X = domain.mesh.geometry.x
    xi, eta = X[:, 0].copy(), X[:, 1].copy()
    X[:, 0], X[:, 1] = 48 * xi, 44 * xi + eta * (44 - 28 * xi)
    space = displacement_space(domain)
    body = Body(
        domain,
        material_fields(domain, {"solid": Material(isochoric, {"mu": MU, "kappa": KAPPA})}),
        space,
        tuple(hold(space, domain, "left", component) for component in (0, 1)),
        tractions={"right": (0.0, SHEAR)},
        amplitude=lambda t: t,
    )
    run = Simulation(body, Schedule(1.0, ramp_end_s=1.0, load_steps=4), SHEAR * 16)
    run.run(lambda step: None)
    X = space.tabulate_dof_coordinates()[:, :2]
    (middle,) = np.nonzero(np.linalg.norm(X - [48.0, 52.0], axis=1) < 1e-9)[0]
    return run.u[2 * middle + 1]


def test_cooks_membrane_rises_as_two_independent_codes_say(ladder):
    """The clamped corner at the top is singular: the rise converges with an order of some 1.6, not with 4."""
    rises = np.array([rise(n) for n in (8, 16, 32)])
    first, last = np.diff(rises)
    extrapolated = rises[-1] + last / (first / last - 1)
    case = "Cook's membrane: rise of the middle of the right edge"
    ladder(f"{case}, 32 x 32", ours=rises[-1], reference=14.74, abs=0.02, unit="mm")
    ladder(f"{case}, extrapolated", ours=extrapolated, reference=14.74, abs=0.01, unit="mm")
    ladder.order(f"{case}, what refinement adds", [first, last], 1.6, 0.3)
