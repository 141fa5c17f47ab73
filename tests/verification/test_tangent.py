"""The internal work is the derivative of the energy, the tangent that of the residual.

Finite differences of what the package assembles, with contact, fluid and inertia, in every law.
"""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from problems import LAW_NAMES, affine, block, displacement_space, wet

from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.fem.outline import Outline
from cellmech.mechanics.balance import Body, equilibrium, internal_work, stored_energy
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.solver import bdf
from cellmech.solver.state import State

OBSTACLES = (Flat(0.05), Pillar(0.2, -1.0, 1.5, 1.1, 4.0))
OTHER_FORMS = ("conservative", "volume", "volume-printed")
CASES = [*((law, "surface") for law in LAW_NAMES), *(("neo-hookean", form) for form in OTHER_FORMS)]


def loaded_body(law, form):
    """A wet block in finite, inhomogeneous motion, its bottom inside two obstacles."""
    domain = block(nx=3, ny=3, bottom="outer")
    space = displacement_space(domain)
    contact = Contact(form, fem.Constant(domain.mesh, 20.0), fem.Constant(domain.mesh, 0.2))
    material = wet(law, young=10.0, poisson=0.3, fluid_lambda=4.0, fluid_mu=2.0)
    body = Body(
        domain,
        material_fields(domain, {"solid": material}),
        space,
        body_force=(0.1, -0.5),
        contact=contact,
        obstacles=OBSTACLES,
        density=0.3,
    )
    state = State(body)
    rng = np.random.default_rng(4)
    for k, function in enumerate((state.u, state.u_n, state.u_nn)):
        H = (1 - 0.3 * k) * np.array([[0.2, 0.35], [0.1, -0.25]])
        function.x.array[:] = affine(space, H, (0.0, -0.02)) + 0.01 * rng.uniform(-1, 1, len(function.x.array))
    state.v_n.x.array[:] = rng.uniform(-1, 1, len(state.v_n.x.array))
    state.ddt.set(bdf.coefficients([0.4, 0.3]))
    return body, state, rng


def central_difference(function, h):
    """f'(0) from f at +-h and +-2h, to fourth order in h."""
    return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h)


@pytest.mark.parametrize("law", LAW_NAMES)
def test_stored_energy_differentiated_numerically_is_the_internal_work(law, ladder):
    body, state, rng = loaded_body(law, "surface")
    comm, u = body.domain.mesh.comm, state.u.x.array.copy()
    energy = compile_form(stored_energy(body, state), comm)
    work = compile_form(internal_work(body, state, ufl.TestFunction(body.space)), comm)
    v = rng.uniform(-1, 1, len(u))
    expected = petsc.assemble_vector(work).getArray() @ v

    def stored(epsilon):
        state.u.x.array[:] = u + epsilon * v
        return fem.assemble_scalar(energy)

    ours = central_difference(stored, 5e-5)
    ladder(
        f"stored energy differentiated, {law}: internal work", ours=ours, reference=expected, rel=1e-8, unit="Pa µm²"
    )


@pytest.mark.parametrize(("law", "form"), CASES, ids=["-".join(case) for case in CASES])
def test_tangent_is_the_derivative_of_the_residual(law, form, ladder):
    """By central differences, and by Taylor remainders of order 2."""
    body, state, rng = loaded_body(law, form)
    comm = body.domain.mesh.comm
    R, K = (compile_form(f, comm) for f in equilibrium(body, state, fem.Constant(body.domain.mesh, 0.7)))
    u, v = state.u.x.array.copy(), rng.uniform(-1, 1, len(state.u.x.array))

    def residual(epsilon):
        state.u.x.array[:] = u + epsilon * v
        return petsc.assemble_vector(R).getArray().copy()

    assert Outline(body.domain, body.space, "outer").max_depth(state.u, OBSTACLES[:1]) > 0.05
    assert Outline(body.domain, body.space, "outer").max_depth(state.u, OBSTACLES[1:]) > 0.05
    tangent = petsc.assemble_matrix(K)
    tangent.assemble()
    direction = tangent.createVecRight()
    direction.setArray(v)
    change = (tangent * direction).getArray()
    at_rest = residual(0.0)
    sizes = 2e-3 * 0.5 ** np.arange(4)
    remainders = np.array([np.linalg.norm(residual(e) - at_rest - e * change) for e in sizes])
    first_order = np.array([np.linalg.norm(residual(e) - at_rest) for e in sizes])
    ours, scale = central_difference(residual, 1e-5), np.abs(change).max()
    case = f"residual differentiated, {law}, {form} contact"
    ladder(f"{case}: tangent, over its largest", ours=ours / scale, reference=change / scale, abs=1e-8)
    ladder.order(f"{case}: Taylor remainder", remainders, 2.0, 0.15)
    assert np.all(np.abs(np.log2(first_order[:-1] / first_order[1:]) - 1.0) < 0.15)
