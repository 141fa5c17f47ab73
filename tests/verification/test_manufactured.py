"""Convergence of P2, and P3, on curved triangles against manufactured displacements at finite strain.

The stresses are written by hand, not by the package: dry in every law, wet, and under contact pressure.
"""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from manufactured import POISSON, YOUNG, body_with, solid_piola, solved, symbolic
from problems import LAW_NAMES, rows_ring, solid, wet

from cellmech.fem.jit import PointValues, compile_form
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.obstacles import Flat

SHARE, LMBDA_F, MU_F = 0.4, 6.0, 3.0  # of the wet solid
KAPPA, SMOOTHING, FLAT = 2.0, 0.1, Flat(3.0)  # of the contact; the whole ring lies inside the flat
ORDERS = {2: {"L2": 3.0, "H1": 2.0}, 3: {"L2": 4.0, "H1": 3.0}}


def fluid_piola(F, F_dot):
    """Eq. 23."""
    C_inv, J = ufl.inv(F.T * F), ufl.det(F)
    C_dot = F_dot.T * F + F.T * F_dot
    return F * (J * LMBDA_F / 2 * ufl.tr(C_inv * C_dot) * C_inv + J * MU_F * C_inv * C_dot * C_inv)


def errors(body, history=()):
    """L2 error and H1-seminorm error of the solution on one mesh; `history` as for `solved`."""
    gap = solved(body, history).u - symbolic(body.domain.mesh)
    norms = ufl.inner(gap, gap), ufl.inner(ufl.grad(gap), ufl.grad(gap))
    return [np.sqrt(fem.assemble_scalar(compile_form(m * body.domain.dx(8), body.domain.mesh.comm))) for m in norms]


def state_orders(ladder, case, found, degree=2):
    for (norm, order), column in zip(ORDERS[degree].items(), np.array(found).T, strict=True):
        ladder.order(f"manufactured, curved P{degree}, {case}: {norm}", column, order, 0.15)


@pytest.mark.parametrize("law", LAW_NAMES)
def test_p2_on_curved_triangles_converges_with_order_3_in_l2_and_2_in_h1(law, ladder):
    found = []
    for n in (2, 4, 8):
        domain = rows_ring(n)
        F = ufl.Identity(2) + ufl.grad(symbolic(domain.mesh))
        found.append(errors(body_with(domain, solid(law, YOUNG, POISSON), solid_piola(law, F))))
    state_orders(ladder, law, found)


def test_p3_on_triangles_curved_by_parabolas_converges_with_order_4_in_l2_and_3_in_h1(ladder):
    found = []
    for n in (2, 4, 8):
        domain = rows_ring(n)
        P = solid_piola("neo-hookean", ufl.Identity(2) + ufl.grad(symbolic(domain.mesh)))
        found.append(errors(body_with(domain, solid("neo-hookean", YOUNG, POISSON), P, order=3)))
    state_orders(ladder, "neo-hookean", found, degree=3)


def test_wet_solid_in_motion_converges_with_the_orders_of_a_dry_one(ladder):
    """u = t u(1) at t = 1 makes the strain quadratic in time, whose rate BDF2 has exactly: what is left is the mesh."""
    found = []
    for n in (2, 4, 8):
        domain = rows_ring(n)
        H = ufl.grad(symbolic(domain.mesh))
        F = ufl.Identity(2) + H
        P = (1 - SHARE) * solid_piola("neo-hookean", F) + SHARE * fluid_piola(F, 0.2 * H)
        material = wet("neo-hookean", YOUNG, POISSON, fluid_fraction=SHARE, fluid_lambda=LMBDA_F, fluid_mu=MU_F)
        found.append(errors(body_with(domain, material, P), history=(0.8, 0.6)))
    state_orders(ladder, "fluid in motion", found)


def test_contact_pressure_on_a_curved_side_leaves_the_orders_alone(ladder):
    """At a fixed penalty: the outer side is free, and a dead traction makes up for what P N and the pressure differ by.

    p(d) |cof(F) N| n with n = (0, 1) and d = 3 - (Y + u_y), well beyond the smoothing.
    """
    found = []
    for n in (2, 4, 8):
        domain = rows_ring(n)
        u, X, N = symbolic(domain.mesh), ufl.SpatialCoordinate(domain.mesh), ufl.FacetNormal(domain.mesh)
        F = ufl.Identity(2) + ufl.grad(u)
        cof_N = ufl.det(F) * ufl.inv(F).T * N
        push = KAPPA * (FLAT.y_um - X[1] - u[1] - SMOOTHING / 2) * ufl.sqrt(ufl.dot(cof_N, cof_N))
        P = solid_piola("neo-hookean", F)
        body = body_with(
            domain,
            solid("neo-hookean", YOUNG, POISSON),
            P,
            free=("outer",),
            tractions={"outer": P * N - push * ufl.as_vector([0.0, 1.0])},
            contact=Contact("surface", KAPPA, SMOOTHING),
            obstacles=(FLAT,),
        )
        found.append(errors(body))
    state_orders(ladder, "contact at fixed κ", found)


def test_manufactured_displacement_is_a_finite_strain():
    domain = rows_ring(4)
    H = ufl.grad(symbolic(domain.mesh))
    norm = PointValues(ufl.sqrt(ufl.inner(H, H)), np.array([[0.2, 0.2]]), domain.mesh.comm)
    largest = norm(np.arange(domain.quality["cells"], dtype=np.int32)).max()
    assert 0.3 < largest < 0.6
