"""An elastic strip that sticks to a flat and is peeled off: F (1 - cos theta) + F^2/(2 h E*) = w.

Kendall (1975), J. Phys. D: Appl. Phys. 8, 1449-1452, per width; without the elastic term w/(1 - cos theta). His flat
holds a strip along itself as well. Adhesion here is frictionless: what sticks still bears the force along the flat,
F cos theta, and stores its energy, so that F (1 - cos theta) + F^2 sin^2(theta)/(2 h E*) = w; at 90 degrees it is
Kendall's. In plane strain; the strip is 30 times as long as thick, E* h is 110 w, the range 0.3 of the thickness, cells
are a third of it. The end is lifted by what makes the free arm several times as long as its bend, where the outermost
strain is about a quarter.
"""

import math

import numpy as np
import pytest
from dolfinx import fem
from problems import block, displacement_space, hold, solid

from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.drivers import Adhesion
from cellmech.mechanics.obstacles import Flat
from cellmech.solver.energy_balance import Ledger
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

YOUNG, POISSON, LENGTH, THICKNESS = 1000.0, 0.3, 30.0, 1.0
STIFFNESS = YOUNG / (1 - POISSON**2) * THICKNESS  # h E*
WORK, RANGE = 10.0, 0.3


def peel(along, lifts, cells=(90, 2)):
    """Forces that lift the middle of a strip's right end, its left end held sideways.

    Args:
        along: dead force at the right end, along the flat [Pa µm].
        lifts: of that point, one after the other [µm].
        cells: rectangles of two triangles along and across.
    """
    domain = block(LENGTH, THICKNESS, *cells, bottom="outer")
    space = displacement_space(domain)
    lift = fem.Constant(domain.mesh, 0.0)
    nodes = space.tabulate_dof_coordinates()[:, :2]
    (end,) = np.flatnonzero(np.all(np.isclose(nodes, (LENGTH, THICKNESS / 2)), axis=1))
    held = fem.dirichletbc(lift, np.array([2 * end + 1], dtype=np.int32), space.sub(1))
    body = Body(
        domain,
        material_fields(domain, {"solid": solid("neo-hookean", YOUNG, POISSON)}),
        space,
        (hold(space, domain, "left", 0), held),
        tractions={"right": (along / THICKNESS, 0.0)},
        contact=Contact("surface", fem.Constant(domain.mesh, 1e4), fem.Constant(domain.mesh, 1e-3)),
        obstacles=(Flat(0.0),),
        drivers=(Adhesion(lambda amplitude: 1.0, WORK, RANGE),),
        contact_degree=20,
    )
    state = State(body)
    solver, ledger, forces = Solver(body, state, WORK, tolerance=1e-8), Ledger(body, state), []
    before, step = np.zeros_like(state.u.x.array), 0.0
    for height in lifts:
        onward, before = state.u.x.array - before, state.u.x.array.copy()
        state.u.x.array[:] += onward * (height - lift.value) / step if step else 0.0
        step, lift.value = height - lift.value, height
        outcome = solver.solve(1.0)
        assert outcome.converged, outcome.reason
        forces.append(-ledger.contact_force(1.0)[1])
    return np.array(forces)


@pytest.mark.parametrize(("along", "highest"), [(0.0, 12.0), (15.0, 7.0), (-2.0, 14.0)])
def test_strip_peels_at_kendalls_force(along, highest, ladder):
    """At 90, 53 and 104 degrees; first it takes more, to bend the strip."""
    lifts = np.arange(0.1, highest, 0.2)
    up = peel(along, lifts)
    angle = math.atan2(up[-1], along)
    force = math.hypot(up[-1], along)
    plateau = up[lifts > 0.9 * highest]
    assert np.ptp(plateau) < 0.004 * up[-1] and up.max() > 1.2 * up[-1]
    freed = force * (1 - math.cos(angle)) + (force * math.sin(angle)) ** 2 / (2 * STIFFNESS)
    what = f"strip peeled at {math.degrees(angle):.0f} degrees: what the force frees"
    ladder(what, ours=freed, reference=WORK, rel=3e-3, unit="Pa µm")
