"""A rigid wedge pressed into an elastic half-plane: p(x) = (E* tan theta/pi) arccosh(a/|x|), F = E* a tan theta.

Johnson, Contact Mechanics, 5.2. The half-plane is the right half of a block 18 times as large as the contact. The slope
keeps strains small; what is left at the apex, where the pressure has a logarithm, is not compared.
"""

from dataclasses import dataclass

import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import affine, block, displacement_space, hold, solid

from cellmech.fem.coefficients import material_fields
from cellmech.fem.outline import Outline, along, depth, slope
from cellmech.mechanics.balance import Body
from cellmech.mechanics.contact import Contact
from cellmech.solver.energy_balance import Ledger
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

YOUNG, POISSON, SIZE, PUSH = 200.0, 0.3, 20.0, 0.03
STIFFNESS = YOUNG / (1 - POISSON**2)  # E*
SLOPE = 0.01  # tan theta
KAPPA, SMOOTHING = 5e4, 2e-5  # 25 times as stiff as the half-plane over the contact; s is the depth at 1 Pa


@dataclass(frozen=True)
class Wedge:
    """l = -slope |x| - y [µm]: a roof with its ridge at the origin."""

    slope: float
    length_um: float = 1e9

    def level_set(self, x):
        return -self.slope * abs(x[0]) - x[1]

    def gradient(self, x):
        sign = ufl.sign(x[0]) if isinstance(x[0], ufl.core.expr.Expr) else np.sign(x[0])
        return -self.slope * sign, -1 + 0 * x[1]


WEDGE = Wedge(SLOPE)


def penalty(d):
    return np.where(d <= 0, 0.0, np.where(d < SMOOTHING, KAPPA * d * d / (2 * SMOOTHING), KAPPA * (d - SMOOTHING / 2)))


@pytest.fixture(scope="module")
def pressed():
    """Outline and state after the top was pushed down, the penalty raised in steps; and the force on the whole block.

    The elements grow away from the apex, from a/26 to a tenth of the block.
    """
    domain = block(1.0, 1.0, 48, 24, bottom="outer")
    X = domain.mesh.geometry.x
    X[:, :2] = SIZE * (0.1 * X[:, :2] + 0.9 * X[:, :2] ** 6)
    space = displacement_space(domain)
    body = Body(
        domain,
        material_fields(domain, {"solid": solid("neo-hookean", YOUNG, POISSON)}),
        space,
        (hold(space, domain, "left", 0), hold(space, domain, "top", 1, -PUSH)),
        contact=Contact("surface", fem.Constant(domain.mesh, 0.0), fem.Constant(domain.mesh, 0.0)),
        obstacles=(WEDGE,),
    )
    state = State(body)
    state.u.x.array[:] = affine(space, [[0.0, 0.0], [0.0, -PUSH / SIZE]])
    solver = Solver(body, state, STIFFNESS * SLOPE, tolerance=1e-10)
    for share in 0.25 ** np.arange(4, -1, -1):
        body.contact.kappa.value, body.contact.width.value = KAPPA * share, SMOOTHING / share
        outcome = solver.solve(1.0)
        assert outcome.converged, outcome.reason
    return Outline(domain, space, "outer"), state, 2 * Ledger(body, state).contact_force()[1]


def test_half_width_under_a_wedge_is_the_force_over_e_star_and_slope(pressed, ladder):
    """Where the pressure ends, and the a of the pressure's second moment: int p x^2 = a^2/6 int p."""
    outline, state, force = pressed
    a = force / (STIFFNESS * SLOPE)
    nodes = outline.nodes(state.u)
    q, weight = np.polynomial.legendre.leggauss(20)
    x, stretch = along(nodes, (q + 1) / 2), np.linalg.norm(slope(nodes, (q + 1) / 2), axis=-1)
    share = weight * stretch * penalty(depth(WEDGE, x))
    by_moment = np.sqrt(6 * (share * x[..., 0] ** 2).sum() / share.sum())
    edge = outline.contact_length_x(state.u, [WEDGE], 0.0)
    ladder("rigid wedge: half-width a, edge of the contact", ours=edge, reference=a, rel=0.01, unit="µm")
    ladder("rigid wedge: half-width a, by the pressure's moment", ours=by_moment, reference=a, rel=0.005, unit="µm")


def test_pressure_under_a_wedge_is_the_arccosh_of_a_over_x(pressed, ladder):
    outline, state, force = pressed
    a, unit = force / (STIFFNESS * SLOPE), STIFFNESS * SLOPE / np.pi
    x = along(outline.nodes(state.u), np.linspace(0.0, 1.0, 9)).reshape(-1, 2)
    inside, outside = x[(0.1 * a < x[:, 0]) & (x[:, 0] < 0.9 * a)], x[(1.1 * a < x[:, 0]) & (x[:, 1] < 1.0)]
    assert len(inside) > 150 and len(outside) > 100
    p, exact = penalty(depth(WEDGE, inside)), unit * np.arccosh(a / inside[:, 0])
    ladder("rigid wedge: p(x), 0.1 a < x < 0.9 a", ours=p, reference=exact, abs=0.03 * unit, unit="Pa")
    ladder("rigid wedge: p(x) beyond 1.1 a", ours=penalty(depth(WEDGE, outside)), unit="Pa")
