"""Patch test: the curved, layered mesh of the cell reproduces an affine displacement to round-off."""

import numpy as np
import pytest
from dolfinx import fem
from problems import affine, displacement_space, layered_disc, prescribe, solid, wet

from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.solver import bdf
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

H = np.array([[0.15, 0.3], [-0.1, -0.2]])
OFFSET = (0.3, -0.2)


@pytest.fixture(scope="module")
def disc():
    return layered_disc(size_um=1.0)


def solved(domain, material, rng):
    """The solution for affine boundary data, from a disturbed first guess; and the affine field itself."""
    space = displacement_space(domain)
    exact = fem.Function(space)
    exact.x.array[:] = affine(space, H, OFFSET)
    body = Body(
        domain,
        material_fields(domain, dict.fromkeys(domain.cells, material)),
        space,
        (prescribe(space, domain, ("outer", "axis"), exact),),
    )
    state = State(body)
    if body.rate_dependent:
        state.ddt.set(bdf.coefficients([0.5, 0.25]))
        for function, share in ((state.u_n, 0.5), (state.u_nn, 0.2)):
            function.x.array[:] = share * exact.x.array
    state.u.x.array[:] = exact.x.array + 1e-3 * rng.uniform(-1, 1, len(exact.x.array))
    outcome = Solver(body, state, 10.0, tolerance=1e-13).solve(1.0)
    assert outcome.converged, outcome.reason
    assert outcome.iterations > 0
    return state.u.x.array, exact.x.array


def test_mesh_of_the_patch_test_is_curved_and_layered(disc):
    assert {"nucleoplasm", "lamina", "cytosol", "membrane"} == set(disc.cells)
    assert disc.quality["min_scaled_jacobian"] < 0.999  # curved
    assert disc.quality["max_aspect_ratio"] > 3  # elongated in the lamina


@pytest.mark.parametrize(
    ("name", "material"),
    [
        ("dry", solid("saint-venant", 10.0, 0.45)),
        ("wet", wet("neo-hookean", fluid_lambda=8.0, fluid_mu=3.0)),
    ],
    ids=["dry", "wet"],
)
def test_affine_boundary_data_are_reproduced_to_round_off(disc, name, material, ladder):
    got, exact = solved(disc, material, np.random.default_rng(6))
    ladder(f"patch test, curved layered mesh, {name}: affine u", ours=got, reference=exact, abs=1e-11, unit="µm")
