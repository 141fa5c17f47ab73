"""Lamé's thick ring under inner pressure in plane strain, of one material and of two layers, at small strain."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest
import ufl
from dolfinx import fem
from manufactured import plane_gradient
from problems import displacement_space, hold, rows_ring, solid

from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body
from cellmech.mechanics.kinematics import PLANE_STRAIN, green_lagrange
from cellmech.mechanics.moduli import lame
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

PRESSURE = 1e-7  # Pa: strains of some 1e-8, so that finite strain adds nothing that is seen here
INNER, INTERFACE, OUTER = 1.0, 1.5, 2.0
RINGS = {
    "one material": {"solid": (OUTER, 10.0, 0.3)},  # layer: outer radius [µm], Young's modulus [Pa], Poisson's ratio
    "two layers": {"soft": (INTERFACE, 10.0, 0.3), "stiff": (OUTER, 40.0, 0.2)},
}


def closed_form(layers):
    """(a, b) of u = a r + b/r in each layer: sigma_rr = 2 (lambda + mu) a - 2 mu b/r^2.

    sigma_rr = -p at the inner radius, 0 at the outer one; u and sigma_rr continuous in between.
    """
    radii = [INNER, *(radius for radius, _, _ in layers.values())]
    moduli = [lame(young, poisson) for _, young, poisson in layers.values()]
    n = len(moduli)
    rows, right = [], []

    def row(entries, value):
        rows.append(np.zeros(2 * n))
        for layer, (a, b) in entries:
            rows[-1][2 * layer : 2 * layer + 2] = a, b
        right.append(value)

    def stress(layer, r, sign=1):
        lmbda, mu = moduli[layer]
        return layer, (sign * 2 * (lmbda + mu), -sign * 2 * mu / r**2)

    row([stress(0, INNER)], -PRESSURE)
    for k, r in enumerate(radii[1:-1]):
        row([(k, (r, 1 / r)), (k + 1, (-r, -1 / r))], 0.0)
        row([stress(k, r), stress(k + 1, r, -1)], 0.0)
    row([stress(n - 1, OUTER)], 0.0)
    return np.linalg.solve(rows, right).reshape(n, 2)


def between(low, high, x):
    r = np.linalg.norm(x, axis=0)
    return (low - 1e-9 < r) & (r < high + 1e-9)


def pressurised(layers, n):
    """The solved state of the quarter ring under a dead pressure along the normal of its inner side."""
    bounds = dict(zip(layers, pairwise([INNER, *(radius for radius, _, _ in layers.values())]), strict=True))
    domain = rows_ring(n, {name: partial(between, *radii) for name, radii in bounds.items()})
    space = displacement_space(domain)
    body = Body(
        domain,
        material_fields(domain, {name: solid("neo-hookean", young, nu) for name, (_, young, nu) in layers.items()}),
        space,
        (hold(space, domain, "axis_x", 1), hold(space, domain, "axis_y", 0)),
        tractions={"inner": -PRESSURE * ufl.FacetNormal(domain.mesh)},
    )
    state = State(body)
    outcome = Solver(body, state, PRESSURE, tolerance=1e-12).solve(1.0)
    assert outcome.converged, outcome.reason
    return body, state


def radial_stress(body, state):
    """e_r . P e_r [Pa]; at strains of 1e-8 that is the Cauchy stress."""
    (mixture,) = body.materials
    X = ufl.SpatialCoordinate(body.domain.mesh)
    S = mixture.solid(green_lagrange(state.u, PLANE_STRAIN))[1]
    P = plane_gradient(state.u) * ufl.as_matrix([[S[i, j] for j in range(2)] for i in range(2)])
    return ufl.dot(X, P * X) / ufl.dot(X, X)


def integral(form, domain):
    return fem.assemble_scalar(compile_form(form, domain.mesh.comm))


def errors(layers, n):
    """Relative errors: displacement in L2 and H1, and the jump of the radial stress over the interface in L2."""
    body, state = pressurised(layers, n)
    domain, coefficients = body.domain, closed_form(layers)
    X = ufl.SpatialCoordinate(domain.mesh)
    r = ufl.sqrt(ufl.dot(X, X))
    parts = np.zeros(4)
    for (a, b), name in zip(coefficients, layers, strict=True):
        exact = (a + b / r**2) * X
        for k, field in enumerate((state.u - exact, exact)):
            dx = domain.dx(8, (name,)) if len(layers) > 1 else domain.dx(8)
            parts[2 * k] += integral(ufl.inner(field, field) * dx, domain)
            parts[2 * k + 1] += integral(ufl.inner(ufl.grad(field), ufl.grad(field)) * dx, domain)
    return np.sqrt(parts[:2] / parts[2:]), body, state


def at_inner_radius(body, state, coefficients):
    """Radial displacement at the nodes of the inner side, and the closed form."""
    X = body.space.tabulate_dof_coordinates()[:, :2]
    r = np.linalg.norm(X, axis=1)
    inner = np.isclose(r, INNER)
    a, b = coefficients[0]
    return np.einsum("ni,ni->n", state.u.x.array.reshape(-1, 2)[inner], X[inner]) / INNER, a * INNER + b / INNER


@pytest.mark.parametrize("name", RINGS)
def test_pressurised_ring_is_lames(name, ladder):
    layers, found = RINGS[name], []
    for n in (4, 8, 16):
        error, body, state = errors(layers, n)
        found.append(error)
    for norm, order, column in zip(("L2", "H1"), (3.0, 2.0), np.array(found).T, strict=True):
        ladder.order(f"Lamé ring, {name}: displacement, {norm}", column, order, 0.15)
    got, exact = at_inner_radius(body, state, closed_form(layers))
    ladder(f"Lamé ring, {name}: displacement of the inner side", ours=got, reference=exact, rel=3e-5, unit="µm")


def test_radial_stress_is_continuous_over_the_interface_of_two_layers(ladder):
    """From each side's own elements; the hoop stress jumps there."""
    layers, jumps = RINGS["two layers"], []
    for n in (8, 16, 32):
        body, state = pressurised(layers, n)
        domain = body.domain
        is_stiff = fem.Function(body.materials[0].constants["mu"].function_space)
        tags = domain.cell_tags
        for cell in tags.indices[tags.values == domain.cells["stiff"]]:
            is_stiff.x.array[is_stiff.function_space.dofmap.cell_dofs(cell)] = 1.0
        interface = ufl.jump(is_stiff) ** 2  # 1 between the layers, 0 on all other edges
        sigma = radial_stress(body, state)
        dS = domain.dS(8)
        length = integral(interface * dS, domain)
        assert length == pytest.approx(np.pi / 2 * INTERFACE, rel=1e-4)
        jump = np.sqrt(integral(interface * ufl.jump(sigma) ** 2 * dS, domain) / length)
        mean = integral(interface * ufl.avg(sigma) * dS, domain) / length
        jumps.append(jump / PRESSURE)
    (a, b), (lmbda, mu) = closed_form(layers)[0], lame(*layers["soft"][1:])
    exact = 2 * (lmbda + mu) * a - 2 * mu * b / INTERFACE**2
    ladder.order("Lamé ring, two layers: jump of the radial stress at the interface", jumps, 2.0, 0.15)
    case = "Lamé ring, two layers: mean radial stress at the interface"
    ladder(case, ours=mean, reference=exact, rel=1e-3, unit="Pa")
