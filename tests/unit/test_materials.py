"""Materials over named groups: grouped by law, piecewise constants where they belong, blends, mixture fractions."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import affine, block, displacement_space, domain_of, moduli, solid, value_at, wet

from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body, stored_energy, viscous_work
from cellmech.mechanics.kinematics import PLANE_STRAIN, green_lagrange
from cellmech.mechanics.laws import LAWS
from cellmech.mechanics.materials import Material
from cellmech.solver.state import State

H = np.array([[0.2, 0.1], [0.0, -0.1]])


def two_halves():
    mesh = block(width=2.0, nx=4, ny=2).mesh
    return domain_of(mesh, cells={"left": lambda x: x[0] <= 1.0 + 1e-9, "right": lambda x: x[0] >= 1.0 - 1e-9})


def stored(domain, materials, blend=None):
    body = Body(domain, material_fields(domain, materials, blend), displacement_space(domain, 1))
    state = State(body)
    state.u.x.array[:] = affine(body.space, H)
    return fem.assemble_scalar(compile_form(stored_energy(body, state), domain.mesh.comm))


def test_groups_of_one_law_share_a_mixture_and_keep_their_own_constants():
    domain = two_halves()
    soft, stiff = solid(young=10.0), solid(young=70.0)
    assert len(material_fields(domain, {"left": soft, "right": stiff})) == 1
    energy = stored(domain, {"left": soft, "right": stiff})
    halves = [stored(domain, {"left": m, "right": m}) / 2 for m in (soft, stiff)]
    assert energy == pytest.approx(sum(halves), rel=1e-12)
    assert halves[1] == pytest.approx(7 * halves[0], rel=1e-12)


def test_groups_of_different_laws_get_a_mixture_each():
    domain = two_halves()
    materials = {"left": solid("neo-hookean"), "right": solid("saint-venant", young=20.0)}
    assert [m.names for m in material_fields(domain, materials)] == [("left",), ("right",)]
    halves = [stored(domain, {"left": m, "right": m}) / 2 for m in materials.values()]
    assert stored(domain, materials) == pytest.approx(sum(halves), rel=1e-12)
    assert abs(halves[1] - 2 * halves[0]) > 1e-3 * halves[0]


def test_group_without_material_is_refused():
    with pytest.raises(ValueError, match="right"):
        material_fields(two_halves(), {"left": solid()})


def test_blend_weighs_the_constants_of_each_material():
    """E = sum g_i E_i and c_s = sum g_i c_s,i (eqs 8, 9), every law being linear in its moduli."""
    domain = two_halves()
    x = ufl.SpatialCoordinate(domain.mesh)
    weight = {"a": x[0] / 2, "b": 1 - x[0] / 2}
    a, b = wet(young=10.0, fluid_fraction=0.5), wet(young=70.0, fluid_fraction=0.1)
    (mixture,) = material_fields(domain, {"a": a, "b": b}, weight)
    expected_mu = (10.0 * 0.5 + 70.0 * 0.5) / 2.6
    expected_solid = 0.5 * 0.5 + 0.5 * 0.9
    corner = [0.25, 0.25]
    centre = value_at(x, domain, corner, cell=0)[0] / 2
    got = value_at(ufl.as_vector([mixture.constants["mu"], mixture.solid_fraction]), domain, corner, cell=0)
    assert got[0] == pytest.approx((10.0 * centre + 70.0 * (1 - centre)) / 2.6, rel=1e-12)
    assert got[1] == pytest.approx(0.5 * centre + 0.9 * (1 - centre), rel=1e-12)
    average = compile_form((mixture.constants["mu"]) * domain.dx(2), domain.mesh.comm)
    assert fem.assemble_scalar(average) == pytest.approx(2.0 * expected_mu, rel=1e-12)
    average = compile_form(mixture.solid_fraction * domain.dx(2), domain.mesh.comm)
    assert fem.assemble_scalar(average) == pytest.approx(2.0 * expected_solid, rel=1e-12)


def test_blend_of_different_laws_is_refused():
    domain = two_halves()
    with pytest.raises(ValueError, match="one law"):
        material_fields(domain, {"a": solid("neo-hookean"), "b": solid("yeoh")}, {"a": 0.5, "b": 0.5})


def test_solid_stress_is_weighted_by_the_solid_fraction():
    domain = block()
    u = fem.Function(displacement_space(domain, 1))
    u.x.array[:] = affine(u.function_space, H)

    def stress(material):
        (mixture,) = material_fields(domain, {"solid": material})
        S = mixture.solid(green_lagrange(u, PLANE_STRAIN))[1]
        return value_at(ufl.as_vector([S[0, 0], S[0, 1], S[1, 1], S[2, 2]]), domain)

    dry = stress(solid())
    assert np.abs(dry).min() > 0.1
    np.testing.assert_allclose(stress(wet(fluid_fraction=0.3, fluid_lambda=5.0)), 0.7 * dry, rtol=1e-12)


@pytest.mark.parametrize(
    ("fraction", "lmbda", "mu", "expected"),
    [(0.5, 10.0, 0.0, True), (0.5, 0.0, 1e-3, True), (0.0, 10.0, 1.0, False), (0.5, 0.0, 0.0, False)],
)
def test_material_depends_on_rate_only_if_its_fluid_carries_stress(fraction, lmbda, mu, expected):
    material = Material(LAWS["neo-hookean"], moduli("neo-hookean", 10.0, 0.3), fraction, lmbda, mu)
    domain = block()
    body = Body(domain, material_fields(domain, {"solid": material}), displacement_space(domain, 1))
    assert material.rate_dependent == body.rate_dependent == expected
    form = viscous_work(body, State(body), ufl.TestFunction(body.space))
    assert (form is not None) == expected


def test_body_with_inertia_depends_on_rate():
    domain = block()
    body = Body(domain, material_fields(domain, {"solid": solid()}), displacement_space(domain, 1), density=1e-9)
    assert body.rate_dependent
