"""Pillars in space: level set, gradient and its derivative, depth, normal, sections; ridges are the plane's."""

import math

import numpy as np
import pytest
import ufl

from cellmech.fem.outline import depth
from cellmech.mechanics.contact import symbolic_depth_and_normal
from cellmech.mechanics.obstacles import Flat, Pillar, depth_and_normal
from cellmech.mechanics.pillars import RoundPillar, SquarePillar

EXPONENTS = [2.0, 2.7, 4.0, 5.0, 20.0]
UPRIGHT = [kind(1.0, -3.0, -0.5, 2.5, 4.0, e) for kind in (RoundPillar, SquarePillar) for e in EXPONENTS]
NAMES = [f"{type(pillar).__name__}-{pillar.exponent:g}" for pillar in UPRIGHT]
uprights = pytest.mark.parametrize("pillar", UPRIGHT, ids=NAMES)
DICE = np.random.default_rng(3)
POINTS = np.array([1.0, -3.0, -0.5]) + np.array([2.4, 3.9, 2.4]) * DICE.uniform(-1.0, 1.0, (40, 3))


def derivatives(function, x, step=1e-6):
    """Central differences by each coordinate, of a number or of a tuple of them."""
    moves = step * np.eye(3)
    return np.array([(np.array(function(x + h)) - np.array(function(x - h))) / (2 * step) for h in moves])


@uprights
def test_gradient_is_the_derivative_of_the_level_set(pillar):
    for x in POINTS:
        assert pillar.gradient(x) == pytest.approx(derivatives(pillar.level_set, x), rel=1e-6, abs=1e-7)


@uprights
def test_symbolic_gradient_has_the_derivative_that_differences_have(pillar):
    x = ufl.variable(ufl.as_vector([ufl.variable(c) for c in POINTS[0]]))
    hessian = ufl.algorithms.expand_derivatives(ufl.diff(ufl.as_vector(pillar.gradient(x)), x))
    found = [[float(hessian[i, j](())) for j in range(3)] for i in range(3)]
    np.testing.assert_allclose(found, derivatives(pillar.gradient, POINTS[0]).T, rtol=1e-6, atol=1e-7)


@uprights
def test_gradient_and_its_derivative_are_finite_on_the_axis(pillar):
    """0/0 lurks where the distance from the axis, or the height above the foot, is 0."""
    for place in ((1.0, 0.7, -0.5), (1.0, -3.0, -0.5), (1.5, -3.0, -0.5)):
        x = ufl.variable(ufl.as_vector([ufl.variable(c) for c in place]))
        gradient = ufl.as_vector(pillar.gradient(x))
        hessian = ufl.algorithms.expand_derivatives(ufl.diff(gradient, x))
        twice = ufl.algorithms.expand_derivatives(ufl.diff(ufl.diff(pillar.level_set(x), x), x))
        for i in range(3):
            assert math.isfinite(float(gradient[i](())))
            for j in range(3):
                assert float(hessian[i, j](())) == pytest.approx(float(twice[i, j](())), rel=1e-9, abs=1e-9)
    assert pillar.gradient((1.0, 0.7, -0.5))[::2] == (0.0, 0.0)


@uprights
def test_depth_near_the_surface_is_the_distance_and_the_normal_points_out(pillar):
    for x, z in ((1.0, -0.5), (2.3, 0.4), (0.2, -1.9)):
        level = pillar.top(x, z)
        surface = np.array([x, level, z])
        assert pillar.level_set(surface) == pytest.approx(0.0, abs=1e-12)
        _, normal = depth_and_normal(pillar, surface, np.sqrt, np.maximum)
        assert np.linalg.norm(normal) == pytest.approx(1.0) and normal[1] > 0.0
        for far in (1e-4, -1e-4):
            moved = surface - far * np.array(normal)
            d, n = symbolic_depth_and_normal(pillar, ufl.as_vector(moved.tolist()))
            assert float(d(())) == pytest.approx(far, rel=1e-2)
            assert depth(pillar, moved) == pytest.approx(float(d(())), rel=1e-12)
            np.testing.assert_allclose([float(n[k](())) for k in range(3)], normal, rtol=0, atol=0.02)


@uprights
def test_quarter_turn_changes_nothing(pillar):
    turned = np.array([1.0, 0.0, -0.5]) + np.stack([-(POINTS[:, 2] + 0.5), POINTS[:, 1], POINTS[:, 0] - 1.0], axis=1)
    np.testing.assert_allclose(pillar.level_set(turned.T), pillar.level_set(POINTS.T), rtol=0, atol=1e-12)


def test_round_pillar_is_the_planes_in_every_plane_through_its_axis():
    plane, pillar = Pillar(0.0, -3.0, 2.5, 4.0, 5.0), RoundPillar(1.0, -3.0, -0.5, 2.5, 4.0, 5.0)
    for angle in (0.0, 0.4, 2.0):
        for r, y in ((0.3, -1.0), (2.0, 0.8), (-1.7, -4.0)):
            x = (1.0 + r * math.cos(angle), y, -0.5 + r * math.sin(angle))
            assert pillar.level_set(x) == pytest.approx(plane.level_set((r, y)), rel=1e-12)


@pytest.mark.parametrize("obstacle", [Pillar(1.0, -3.0, 2.5, 4.0, 5.0), Flat(-0.3)], ids=["ridge", "flat"])
def test_ridge_and_flat_in_space_are_the_planes(obstacle):
    for x in POINTS:
        assert obstacle.level_set(x) == obstacle.level_set(x[:2])
        assert obstacle.gradient(x) == (*obstacle.gradient(x[:2]), 0.0)
    d, n = symbolic_depth_and_normal(obstacle, ufl.as_vector(POINTS[0].tolist()))
    flat_d, flat_n = symbolic_depth_and_normal(obstacle, ufl.as_vector(POINTS[0, :2].tolist()))
    assert float(d(())) == float(flat_d(()))
    assert [float(n[k](())) for k in range(3)] == [*(float(flat_n[k](())) for k in range(2)), 0.0]


@uprights
@pytest.mark.parametrize("z", [-0.5, 0.9, -2.7])
def test_outline_of_a_section_lies_where_the_level_set_is_zero(pillar, z):
    rim = np.array(pillar.outline(41, z))
    np.testing.assert_allclose(pillar.level_set((*rim.T, z)), 0.0, rtol=0, atol=1e-12)
    assert rim[0] == pytest.approx(rim[-1])
    assert rim[:, 1].max() == pytest.approx(pillar.top(1.0, z))
    ends = [pillar.across(z).half_width_um, pillar.along(z + 1.5).half_width_um]  # as far aside along x as along z
    assert ends == pytest.approx([rim[:, 0].max() - 1.0] * 2)


@uprights
def test_section_beside_a_pillar_is_none(pillar):
    assert pillar.outline(9, 2.0) is None and pillar.outline(9, -3.1) is None
    assert pillar.top(1.0, 2.01) is None and pillar.top(-1.6, -0.5) is None


@uprights
def test_arches_of_sections_are_the_surface(pillar):
    across, along = pillar.across(0.3), pillar.along(2.2)
    assert -3.0 + across.rise(2.2) == pytest.approx(pillar.top(2.2, 0.3))
    assert -3.0 + along.rise(0.3) == pytest.approx(pillar.top(2.2, 0.3))
    for arch, at in ((across, 2.2), (along, 0.3), (across, 0.4)):
        slope = (arch.rise(at + 1e-6) - arch.rise(at - 1e-6)) / 2e-6
        assert arch.slope(at) == pytest.approx(slope, rel=1e-5, abs=1e-8)
