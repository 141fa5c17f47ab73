"""A body at rest on an obstacle: contact force = weight, pressure = p(depth), penetration = pressure/kappa + s/2."""

import numpy as np
import pytest
from problems import affine, block, displacement_space, hold, solid
from scipy.optimize import brentq

from cellmech.fem.coefficients import material_fields
from cellmech.fem.outline import Outline, along, depth, slope
from cellmech.mechanics.balance import Body
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.solver.newton import Solver
from cellmech.solver.schedule import Schedule
from cellmech.solver.simulation import Simulation
from cellmech.solver.state import State

GRAVITY = 2.0


def settled(material, obstacle, contact, pressed=False):
    """The run that brings a unit block to rest under its weight, or under as much pressure on its top.

    Its left side is a plane of symmetry.
    """
    domain = block(nx=4, ny=4, bottom="outer")
    space = displacement_space(domain)
    body = Body(
        domain,
        material_fields(domain, {"solid": material}),
        space,
        (hold(space, domain, "left", 0),),
        (0.0, 0.0 if pressed else -GRAVITY),
        {"top": (0.0, -GRAVITY if pressed else 0.0)},
        contact=contact,
        obstacles=(obstacle,),
        amplitude=lambda t: min(t, 1.0),
    )
    run = Simulation(body, Schedule(1.0, ramp_end_s=1.0), GRAVITY)
    run.run(lambda step: None)
    return run


def outline_force(run, obstacle, kappa, s):
    """int p n dl over the deformed outline, by fine quadrature outside the package's forms."""
    x = run.outline.nodes(run.state.u)
    points, weight = np.polynomial.legendre.leggauss(200)
    position, tangent = along(x, (points + 1) / 2), slope(x, (points + 1) / 2)
    d = depth(obstacle, position)
    p = np.where(d <= 0, 0.0, np.where(d < s, kappa * d * d / (2 * s), kappa * (d - s / 2)))
    g = -np.stack(obstacle.gradient(np.moveaxis(position, -1, 0)), axis=-1)
    n = g / np.linalg.norm(g, axis=-1)[..., None]
    return np.einsum("q,eq,eqk->k", weight / 2, p * np.linalg.norm(tangent, axis=-1), n)


@pytest.mark.parametrize("form", ["surface", "volume"])
def test_contact_force_of_a_settled_body_is_its_weight_to_the_newton_tolerance(form, ladder):
    run = settled(solid(young=20.0), Pillar(0.0, -1.0, 2.0, 1.0, 2.0), Contact(form, 50.0, 0.02))
    force = run.ledger.contact_force()
    case = f"settled weight, {form} contact: force"
    ladder(case, ours=force[1], reference=GRAVITY, rel=1e-7, unit="Pa µm")
    assert force[0] > 0.01 * GRAVITY  # a round obstacle spreads the half block, its plane of symmetry holds


def test_settled_pressure_is_the_law_of_the_depth_pointwise(ladder):
    obstacle = Pillar(0.0, -1.0, 2.0, 1.0, 2.0)
    run = settled(solid(young=20.0), obstacle, Contact("surface", 50.0, 0.02))
    force = outline_force(run, obstacle, 50.0, 0.02)
    ours = run.ledger.contact_force()
    case = "settled weight: force from p(d) along the outline"
    ladder(case, ours=ours, reference=force, abs=1e-3 * GRAVITY, unit="Pa µm")


@pytest.mark.parametrize("kappa", [50.0, 500.0])
def test_penetration_times_kappa_is_the_pressure_where_s_kappa_is_small(kappa, ladder):
    """Uniform pressure under a block on a flat: d = p/kappa + s/2 exactly, kappa d = p within s kappa/(2 p)."""
    s = 1e-5
    run = settled(solid("saint-venant", 20.0, 0.0), Flat(0.0), Contact("surface", kappa, s), pressed=True)
    d = run.outline.max_depth(run.state.u, [Flat(0.0)])
    case = f"settled weight, κ = {kappa:g}"
    ladder(f"{case}: depth", ours=d, reference=GRAVITY / kappa + s / 2, rel=1e-8, unit="µm")
    ladder(f"{case}: depth times κ", ours=kappa * d, reference=GRAVITY, rel=s * kappa / GRAVITY, unit="Pa")


def test_block_pushed_onto_a_flat_has_the_pressure_of_the_strain_left_to_it(ladder):
    """Contact patch: height 2, top pushed down by 0.1, nu = 0, Saint-Venant; stretch a = 1 - (0.1 - d)/2."""
    young, kappa, s, push, height = 10.0, 50.0, 0.005, 0.1, 2.0
    domain = block(1.0, height, 3, 5, bottom="outer")
    space = displacement_space(domain)
    bcs = (hold(space, domain, "left", 0), hold(space, domain, "top", 1, -push))
    body = Body(
        domain,
        material_fields(domain, {"solid": solid("saint-venant", young, 0.0)}),
        space,
        bcs,
        contact=Contact("surface", kappa, s),
        obstacles=(Flat(0.0),),
    )
    state = State(body)
    state.u.x.array[:] = affine(space, [[0.0, 0.0], [0.0, -push / height]])
    outcome = Solver(body, state, young).solve(1.0)
    assert outcome.converged, outcome.reason

    def pressure(d):
        return kappa * (d - s / 2)

    def imbalance(d):
        a = 1 - (push - d) / height
        return young / 2 * a * (1 - a**2) - pressure(d)

    d = brentq(imbalance, s, push, xtol=1e-15)
    assert pressure(d) > 0.2
    bottom = Outline(domain, space, "outer").nodes(state.u)
    ours = pressure(depth(Flat(0.0), bottom))
    ladder("contact patch: pressure", ours=ours, reference=pressure(d), rel=1e-6, unit="Pa")
    np.testing.assert_allclose(bottom[..., 0], Outline(domain, space, "outer").reference[..., 0], rtol=0, atol=1e-8)
