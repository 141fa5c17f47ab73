"""Obstacles and the penalty: level sets, depth, normal, pressure law; forces on a body against quadrature by hand."""

from itertools import pairwise

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from problems import affine, block, displacement_space, solid
from scipy.integrate import quad

from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.fem.outline import Outline, depth
from cellmech.mechanics.balance import Body, contact_work, equilibrium
from cellmech.mechanics.contact import Contact, pressure, smooth_step, symbolic_depth_and_normal
from cellmech.mechanics.kinematics import GEOMETRIES, PLANE_STRAIN, deformation_gradient
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.solver.state import State

PILLARS = [Pillar(0.0, -10.0, 10.0, 9.5), Pillar(3.0, -2.0, 1.0, 4.0, 8.0), Pillar(-1.0, 0.5, 2.0, 3.0, 5.0)]
OBSTACLES = [*PILLARS, Flat(-0.3)]
KAPPA, WIDTH = 50.0, 0.02


def number(expression) -> float:
    return float(ufl.as_ufl(expression)(()))


def points_around(obstacle, count=12):
    rng = np.random.default_rng(2)
    centre = (getattr(obstacle, "x_um", 0.0), getattr(obstacle, "y_um", obstacle.y_um))
    size = (getattr(obstacle, "half_width_um", 1.0), getattr(obstacle, "height_um", 1.0))
    return centre + np.array(size) * rng.uniform(0.5, 1.4, (count, 2)) * rng.choice([-1, 1], (count, 2))


@pytest.mark.parametrize("exponent", [2.0, 3.3, 4.0, 20.0])
def test_top_and_outline_of_a_pillar_lie_where_its_level_set_is_zero(exponent):
    pillar = Pillar(1.5, -10.0, 3.0, 9.5, exponent)
    for x in (-1.4, 0.0, 1.5, 3.0, 4.4):
        assert pillar.level_set((x, pillar.top(x))) == pytest.approx(0.0, abs=1e-12)
        slope = (pillar.rise(x + 1e-7) - pillar.rise(x - 1e-7)) / 2e-7
        assert pillar.slope(x) == pytest.approx(slope, rel=1e-5, abs=1e-6)
    assert pillar.top(4.5) is pillar.top(-1.6) is None and Flat(-2.0).top(77.0) == -2.0
    rim = np.array(pillar.outline(101))
    np.testing.assert_allclose(pillar.level_set(rim.T), 0.0, atol=1e-12)
    assert rim[0] == pytest.approx(rim[-1]) and np.ptp(rim, axis=0) == pytest.approx([6.0, 19.0])


@pytest.mark.parametrize("obstacle", OBSTACLES, ids=str)
def test_gradient_is_the_derivative_of_the_level_set(obstacle):
    h = 1e-6
    for x, y in points_around(obstacle):
        by_difference = (
            (obstacle.level_set((x + h, y)) - obstacle.level_set((x - h, y))) / (2 * h),
            (obstacle.level_set((x, y + h)) - obstacle.level_set((x, y - h))) / (2 * h),
        )
        np.testing.assert_allclose(obstacle.gradient((x, y)), by_difference, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("obstacle", OBSTACLES, ids=str)
def test_depth_is_positive_inside_and_the_normal_points_out(obstacle):
    inside_seen = outside_seen = 0
    for x, y in points_around(obstacle):
        d, n = symbolic_depth_and_normal(obstacle, ufl.as_vector([x, y]))
        d, n = number(d), np.array([number(n[0]), number(n[1])])
        inside = obstacle.level_set((x, y)) > 0
        inside_seen, outside_seen = inside_seen + inside, outside_seen + (not inside)
        assert (d > 0) == inside
        assert np.linalg.norm(n) == pytest.approx(1.0, rel=1e-12)
        ahead = np.array([x, y]) + 1e-6 * n
        assert obstacle.level_set(ahead) < obstacle.level_set((x, y))
    assert inside_seen and outside_seen


def test_pillar_is_printed_shape_with_its_top_and_flanks_where_they_belong():
    pillar = Pillar(x_um=2.0, y_um=-10.0, half_width_um=10.0, height_um=9.5)
    for x, y in ((2.0, -0.5), (12.0, -10.0), (-8.0, -10.0)):
        assert pillar.level_set((x, y)) == pytest.approx(0.0, abs=1e-14)
    assert pillar.level_set((7.0, -5.25)) == pytest.approx(1 - 0.5**4 - 0.5**4)


@pytest.mark.parametrize(
    ("obstacle", "x", "y", "expected", "normal"),
    [
        (Flat(-0.3), 5.0, -0.7, 0.4, (0, 1)),
        (Flat(-0.3), 5.0, 0.1, -0.4, (0, 1)),
        (PILLARS[0], 0.0, -0.51, 0.01, (0, 1)),
        (PILLARS[0], 9.99, -10.0, 0.01, (1, 0)),
        (PILLARS[0], -10.01, -10.0, -0.01, (-1, 0)),
    ],
)
def test_depth_near_the_edge_is_the_signed_distance(obstacle, x, y, expected, normal):
    d, n = symbolic_depth_and_normal(obstacle, ufl.as_vector([x, y]))
    assert number(d) == pytest.approx(expected, rel=2e-3)
    np.testing.assert_allclose([number(n[0]), number(n[1])], normal, rtol=0, atol=1e-12)
    assert depth(obstacle, np.array([x, y])) == pytest.approx(number(d), rel=1e-14)


def test_depth_at_the_centre_of_a_pillar_is_finite():
    d, n = symbolic_depth_and_normal(PILLARS[0], ufl.as_vector([0.0, -10.0]))
    assert number(d) == PILLARS[0].length_um
    assert number(n[0]) == number(n[1]) == 0.0


def test_depth_for_the_form_and_depth_for_the_report_are_the_same():
    for obstacle in OBSTACLES:
        for point in points_around(obstacle):
            d, _ = symbolic_depth_and_normal(obstacle, ufl.as_vector(point.tolist()))
            assert depth(obstacle, point) == pytest.approx(number(d), rel=1e-12)


@pytest.mark.parametrize(
    ("d", "expected"),
    [(-0.1, 0.0), (0.0, 0.0), (0.01, 0.125), (0.02, 0.5), (0.03, 1.0), (1.0, 49.5)],
)
def test_pressure_is_nil_then_quadratic_then_linear(d, expected):
    assert number(pressure(ufl.as_ufl(d), KAPPA, WIDTH)) == pytest.approx(expected, rel=1e-14, abs=1e-16)


def test_pressure_has_a_continuous_slope():
    def slope(d):
        variable = ufl.variable(ufl.as_ufl(d))
        return number(ufl.diff(pressure(variable, KAPPA, WIDTH), variable))

    assert slope(-1e-9) == 0.0
    assert slope(1e-9) == pytest.approx(0.0, abs=1e-5)
    assert slope(WIDTH * (1 - 1e-9)) == pytest.approx(slope(WIDTH * (1 + 1e-9)), rel=1e-6)
    assert slope(2 * WIDTH) == pytest.approx(KAPPA)


def test_smooth_step_rises_from_0_to_1_with_two_continuous_derivatives():
    def derivatives(d):
        x = ufl.variable(ufl.as_ufl(d))
        first = ufl.diff(smooth_step(x, WIDTH), x)
        return [number(q) for q in (smooth_step(x, WIDTH), first, ufl.diff(first, x))]

    edge = WIDTH * (1 - 1e-9)
    np.testing.assert_allclose(derivatives(-2 * WIDTH), [0, 0, 0], atol=1e-15)
    np.testing.assert_allclose(derivatives(2 * WIDTH), [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(derivatives(-edge), [0, 0, 0], atol=1e-4)
    np.testing.assert_allclose(derivatives(edge), [1, 0, 0], atol=1e-4)
    np.testing.assert_allclose(derivatives(0.0), [0.5, 15 / 16 / WIDTH, 0], atol=1e-12)
    s = 0.75  # half-way up the upper half
    assert derivatives(WIDTH / 2)[0] == pytest.approx(s**3 * (10 - 15 * s + 6 * s**2), rel=1e-14)


@pytest.mark.parametrize("d", [-0.03, -0.01, 0.004, 0.013, 0.05])
def test_pressure_as_a_number_is_what_the_forms_integrate(d):
    """The penalty law itself; for the volume forms int kappa H_w dd from no contact on."""
    assert Contact("surface", KAPPA, WIDTH).pressure_at(d) == pytest.approx(
        number(pressure(ufl.as_ufl(d), KAPPA, WIDTH)), rel=1e-14, abs=1e-16
    )
    summed, _ = quad(lambda x: KAPPA * number(smooth_step(ufl.as_ufl(x), WIDTH)), -2 * WIDTH, d, epsabs=1e-12)
    assert Contact("volume", KAPPA, WIDTH).pressure_at(d) == pytest.approx(summed, rel=1e-9, abs=1e-12)


def test_threshold_is_touch_for_a_pressure_and_the_width_for_a_body_force():
    assert Contact("surface", 50.0, 0.005).threshold_um == 0.0
    assert Contact("volume", 50.0, 0.05).threshold_um == Contact("volume-printed", 50.0, 0.05).threshold_um == -0.05


# Forces on a block in homogeneous deformation, against Gauss quadrature over the deformed shape


LARGE_SHEAR = np.array([[1.1, 1.4], [0.0, 0.8]])  # stretches the bottom 1.1 times, the transpose 1.61
TILTED = np.array([[1.1, 0.6], [0.05, 0.8]])
FLAT = Flat(0.1)  # the block's bottom is at y = 0
ROUND = Pillar(0.3, -1.0, 2.0, 1.15, 2.0)


def contact_force(form, F, obstacle, kappa=KAPPA, width=WIDTH, n=4):
    """Resultant of the obstacle on the unit square in homogeneous deformation F [Pa µm]."""
    domain = block(nx=n, ny=n, bottom="outer")
    space = displacement_space(domain)
    contact = Contact(form, fem.Constant(domain.mesh, kappa), fem.Constant(domain.mesh, width))
    body = Body(
        domain,
        material_fields(domain, {"solid": solid()}),
        space,
        contact=contact,
        obstacles=(obstacle,),
        contact_degree=20,
    )
    state = State(body)
    state.u.x.array[:] = affine(space, F - np.eye(2))
    work = compile_form(contact_work(body, state, ufl.TestFunction(space)), domain.mesh.comm)
    return petsc.assemble_vector(work).getArray().reshape(-1, 2).sum(axis=0)


def penalty(d, kappa=KAPPA, s=WIDTH):
    return np.where(d <= 0, 0.0, np.where(d < s, kappa * d * d / (2 * s), kappa * (d - s / 2)))


def normal(obstacle, x):
    g = -np.stack(obstacle.gradient(np.moveaxis(x, -1, 0)), axis=-1)
    return g / np.linalg.norm(g, axis=-1)[..., None]


def pressure_on_deformed_bottom(F, obstacle):
    """int p n dl along the deformed bottom edge: Nanson's formula never enters."""
    s, weight = np.polynomial.legendre.leggauss(40)
    total, ends = np.zeros(2), np.linspace(0.0, 1.0, 401)
    for a, b in pairwise(ends):
        X = np.column_stack([a + (b - a) * (s + 1) / 2, np.zeros_like(s)])
        x = X @ F.T
        length = np.linalg.norm(F @ [b - a, 0.0])
        total += (weight / 2 * length * penalty(depth(obstacle, x))) @ normal(obstacle, x)
    return total


def body_force_in_deformed_block(F, obstacle, kappa, width, printed):
    """int kappa H_w(d) n da over the deformed block; eq. 27 has cof(F) n dA instead."""
    s, weight = np.polynomial.legendre.leggauss(6)
    ends = np.linspace(0.0, 1.0, 201)
    one = (ends[:-1, None] + np.diff(ends)[:, None] * (s + 1) / 2).ravel()
    w = (np.diff(ends)[:, None] * weight / 2).ravel()
    X = np.stack(np.meshgrid(one, one, indexing="ij"), axis=-1)
    x = X @ F.T
    step = np.clip((depth(obstacle, x) / width + 1) / 2, 0.0, 1.0)
    step = step**3 * (10 - 15 * step + 6 * step**2)
    n = normal(obstacle, x)
    cofactor = np.linalg.det(F) * np.linalg.inv(F).T
    direction = n @ cofactor.T if printed else np.linalg.det(F) * n
    return kappa * np.einsum("i,j,ij,ijk->k", w, w, step, direction)


@pytest.mark.parametrize("F", [LARGE_SHEAR, TILTED], ids=["sheared", "tilted"])
@pytest.mark.parametrize("obstacle", [FLAT, ROUND], ids=["flat", "round"])
def test_surface_contact_is_a_pressure_on_the_deformed_edge(F, obstacle):
    force = contact_force("surface", F, obstacle)
    expected = pressure_on_deformed_bottom(F, obstacle)
    assert expected[1] > 1.0
    np.testing.assert_allclose(force, expected, rtol=0, atol=2e-4 * expected[1])


def test_surface_contact_after_a_large_shear_has_nansons_area_change():
    """|cof(F) N| on the bottom is the stretch of e_x, 1.1; with F transposed it would be sqrt(1.1^2 + 1.4^2)."""
    force = contact_force("surface", LARGE_SHEAR, FLAT)
    np.testing.assert_allclose(force, [0.0, 1.1 * KAPPA * (0.1 - WIDTH / 2)], rtol=1e-12, atol=1e-12)


def test_surface_contact_pushes_out_of_the_obstacle_and_is_frictionless():
    force = contact_force("surface", LARGE_SHEAR, FLAT)
    assert force[1] > 0
    assert abs(force[0]) < 1e-12 * force[1]
    assert np.abs(contact_force("surface", LARGE_SHEAR, Flat(-1e-9))).max() == 0.0  # nothing acts before touch


@pytest.mark.parametrize("F", [LARGE_SHEAR, TILTED], ids=["sheared", "tilted"])
@pytest.mark.parametrize(("form", "printed"), [("volume", False), ("volume-printed", True)])
@pytest.mark.parametrize("obstacle", [FLAT, ROUND], ids=["flat", "round"])
def test_volume_contact_is_a_body_force_on_the_overlap(F, form, printed, obstacle):
    kappa, width = 3.0, 0.3  # wide, so that plain quadrature resolves the step
    force = contact_force(form, F, obstacle, kappa, width)
    expected = body_force_in_deformed_block(F, obstacle, kappa, width, printed)
    np.testing.assert_allclose(force, expected, rtol=0, atol=2e-4 * np.abs(expected).max())
    if obstacle is FLAT:  # the objective form has no friction, the printed cofactor turns the normal
        assert force[0] / force[1] == pytest.approx(-F[1, 0] / F[0, 0] if printed else 0.0, rel=1e-9, abs=1e-12)


def test_volume_and_surface_forces_agree_once_the_step_is_resolved():
    """A body force kappa over the overlap is the pressure kappa d on its edge."""
    surface = contact_force("surface", LARGE_SHEAR, FLAT, width=1e-6)
    volume = contact_force("volume", LARGE_SHEAR, FLAT, width=0.08, n=24)
    np.testing.assert_allclose(volume, surface, rtol=0, atol=1e-4 * surface[1])


def leaning_body(form, kinematics):
    """A crooked block whose bottom leans on a pillar narrower than itself, and its state."""
    domain = block(nx=4, ny=4, bottom="outer")
    space = displacement_space(domain)
    contact = Contact(form, fem.Constant(domain.mesh, KAPPA), fem.Constant(domain.mesh, 0.2))
    materials, obstacles = material_fields(domain, {"solid": solid()}), (Pillar(0.5, -1.0, 0.4, 1.15),)
    place = {"contact_degree": 40, "kinematics": kinematics}
    body = Body(domain, materials, space, contact=contact, obstacles=obstacles, **place)
    state, rng = State(body), np.random.default_rng(3)
    state.u.x.array[:] = affine(space, [[0.1, 0.05], [0.1, -0.1]]) + 0.005 * rng.uniform(-1, 1, len(state.u.x.array))
    return body, state


@pytest.mark.parametrize("geometry", ["plane", "axisymmetric"])
def test_conservative_contact_is_what_a_potential_loses(geometry):
    """Its potential is the integral of p(d) over the deformed body; the surface form's work is another."""
    kinematics, works = GEOMETRIES[geometry], {}
    for form in ("conservative", "surface"):
        body, state = leaning_body(form, kinematics)
        X = ufl.SpatialCoordinate(body.domain.mesh)
        d, _ = symbolic_depth_and_normal(body.obstacles[0], X + state.u)
        density = pressure(d, body.contact.kappa, body.contact.width)
        F = deformation_gradient(state.u, kinematics)
        potential = compile_form(body.over(density * ufl.det(F), degree=40), body.domain.mesh.comm)
        work = compile_form(contact_work(body, state, ufl.TestFunction(body.space)), body.domain.mesh.comm)
        u, v, h = state.u.x.array.copy(), np.random.default_rng(5).uniform(-1, 1, len(state.u.x.array)), 1e-5
        works[form] = petsc.assemble_vector(work).getArray() @ v
        energies = []
        for step in (h, -h):
            state.u.x.array[:] = u + step * v
            energies.append(fem.assemble_scalar(potential))
        lost = -(energies[0] - energies[1]) / (2 * h)
    assert works["conservative"] == pytest.approx(lost, rel=2e-3)
    assert abs(works["surface"] - lost) > 0.02 * abs(lost)


@pytest.mark.parametrize(("form", "symmetric"), [("conservative", True), ("surface", False)])
def test_tangent_of_a_conservative_contact_is_symmetric(form, symmetric):
    """As far as quadrature of its kink goes."""
    body, state = leaning_body(form, PLANE_STRAIN)
    K = petsc.assemble_matrix(compile_form(equilibrium(body, state, 1.0)[1], body.domain.mesh.comm))
    K.assemble()
    dense = K.convert("dense").getDenseArray()
    skew = np.abs(dense - dense.T).max() / np.abs(dense).max()
    assert body.symmetric == symmetric and (skew < 1e-4) == symmetric and (skew > 1e-3) != symmetric


def test_pillars_add_up():
    left, right = Pillar(-0.5, -1.0, 1.0, 1.1), Pillar(1.5, -1.0, 0.9, 1.05)
    domain = block(nx=4, ny=4, bottom="outer")
    space = displacement_space(domain)
    forces = []
    for obstacles in ((left,), (right,), (left, right)):
        body = Body(
            domain,
            material_fields(domain, {"solid": solid()}),
            space,
            contact=Contact(kappa=KAPPA),
            obstacles=obstacles,
        )
        form = compile_form(contact_work(body, State(body), ufl.TestFunction(space)), domain.mesh.comm)
        forces.append(petsc.assemble_vector(form).getArray().copy())
        assert forces[-1].reshape(-1, 2)[:, 1].sum() > 0.01
    np.testing.assert_allclose(forces[2], forces[0] + forces[1], rtol=0, atol=1e-14)


def test_contact_acts_on_the_outer_boundary_alone():
    domain = block(nx=2, ny=2, bottom="outer")
    space = displacement_space(domain)
    body = Body(
        domain, material_fields(domain, {"solid": solid()}), space, contact=Contact(kappa=KAPPA), obstacles=(Flat(2.0),)
    )
    state = State(body)
    form = compile_form(contact_work(body, state, ufl.TestFunction(space)), domain.mesh.comm)
    forces = petsc.assemble_vector(form).getArray().reshape(-1, 2)
    touched = np.unique(Outline(domain, space, "outer").dofs)
    assert np.abs(np.delete(forces, touched, axis=0)).max() == 0.0
    assert forces[touched, 1].min() > 0.0
    assert contact_work(Body(domain, body.materials, space, contact=Contact()), state, ufl.TestFunction(space)) is None
