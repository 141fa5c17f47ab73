"""Kinematics: invariants measured from rest, the series that keep their digits, what is reported."""

import mpmath
import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import affine, block, displacement_space, value_at

from cellmech.mechanics import kinematics
from cellmech.mechanics.invariants import Invariants, excess, reported_strains
from cellmech.mechanics.kinematics import PLANE_STRAIN, green_lagrange

SERIES_AND_PLAIN = [1e-12, 1e-5, 3e-3, 0.0099999, 0.0100001, 0.05, 0.3, 4.0]


def number(expression) -> float:
    return float(ufl.as_ufl(expression)(()))


def exact_excess(t, a):
    t = mpmath.mpf(t)
    if a == 0:
        return t - mpmath.log(1 + t)
    return t - ((1 + t) ** mpmath.mpf(a) - 1) / mpmath.mpf(a)


@pytest.mark.parametrize("a", [0.0, 1 / 3, 2 / 3])
@pytest.mark.parametrize("size", SERIES_AND_PLAIN)
@pytest.mark.parametrize("sign", [1, -1])
def test_excess_keeps_eleven_digits_on_both_sides_of_the_switch(a, size, sign):
    t = sign * min(size, 0.9) if sign < 0 else size
    with mpmath.workdps(60):
        exact = float(exact_excess(t, a))
    assert number(excess(ufl.as_ufl(t), a)) == pytest.approx(exact, rel=1e-11, abs=0.0)


@pytest.mark.parametrize("a", [0.0, 1 / 3, 2 / 3])
@pytest.mark.parametrize("t", [-0.3, -0.0101, -0.0099, 1e-7, 0.0099, 0.0101, 2.0])
def test_excess_has_the_derivative_of_the_function_it_stands_for(a, t):
    """d/dt (t - ((1 + t)^a - 1)/a) = 1 - (1 + t)^(a - 1)."""
    variable = ufl.variable(ufl.as_ufl(t))
    with mpmath.workdps(60):
        exact = float(1 - (1 + mpmath.mpf(t)) ** (mpmath.mpf(a) - 1))
    assert number(ufl.diff(excess(variable, a), variable)) == pytest.approx(exact, rel=1e-12, abs=0.0)


def test_invariants_are_those_of_the_three_dimensional_c():
    rng = np.random.default_rng(3)
    for _ in range(4):
        F = np.eye(3) + 0.4 * rng.uniform(-1, 1, (3, 3))
        C = F.T @ F
        got = Invariants(ufl.as_matrix(((C - np.eye(3)) / 2).tolist()))
        I1, I2, I3 = np.trace(C), (np.trace(C) ** 2 - np.trace(C @ C)) / 2, np.linalg.det(C)
        expected = {
            "I1_gap": I1 - 3,
            "I2_gap": I2 - 3,
            "I3_gap": I3 - 1,
            "ln_J": np.log(I3) / 2,
            "I1_less_ln_I3": I1 - 3 - np.log(I3),
            "I1_less_root": I1 - 3 * I3 ** (1 / 3),
            "I2_less_root": I2 - 3 * I3 ** (2 / 3),
        }
        for name, value in expected.items():
            assert number(getattr(got, name)) == pytest.approx(value, rel=1e-12, abs=1e-13), name


def test_displacement_gradient_gives_f_and_e():
    domain = block()
    u = fem.Function(displacement_space(domain, 1))
    H = np.array([[0.2, -0.5], [0.7, -0.1]])
    u.x.array[:] = affine(u.function_space, H)
    F, E = kinematics.deformation_gradient(u, PLANE_STRAIN), green_lagrange(u, PLANE_STRAIN)
    entries = ufl.as_vector([A[i, j] for A in (F, E) for i in range(3) for j in range(3)])
    F_got, E_got = value_at(entries, domain).reshape(2, 3, 3)
    expected = np.eye(3)
    expected[:2, :2] += H
    np.testing.assert_allclose(F_got, expected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(E_got, (expected.T @ expected - np.eye(3)) / 2, rtol=0, atol=1e-15)


def test_plane_strain_stretches_nothing_across_the_plane():
    domain = block()
    u = fem.Function(displacement_space(domain, 1))
    u.x.array[:] = affine(u.function_space, np.array([[0.2, -0.5], [0.7, -0.1]]))
    E = green_lagrange(u, PLANE_STRAIN)
    across = ufl.as_vector([E[2, 2], E[0, 2], E[1, 2], E[2, 0], E[2, 1]]) + 0.0 * ufl.as_vector([u[0]] * 5)
    assert not value_at(across, domain).any()  # E33 = 0, that is F33 = 1
    v = PLANE_STRAIN.vector(ufl.as_vector([3.0, 4.0]))
    assert [number(v[k]) for k in range(3)] == [3.0, 4.0, 0.0]
    assert [number(PLANE_STRAIN.stretched[k, k]) for k in range(3)] == [1.0, 1.0, 0.0]
    assert number(ufl.tr(PLANE_STRAIN.stretched)) == PLANE_STRAIN.directions == PLANE_STRAIN.components
    assert PLANE_STRAIN.weight(ufl.SpatialCoordinate(domain.mesh)) == 1


def test_reported_strains_of_a_body_in_space_are_its_invariants_less_3_3_1():
    F = np.array([[1.3, 0.4, 0.1], [-0.2, 0.8, 0.3], [0.05, -0.1, 1.1]])
    C = F.T @ F
    J1, J2, J3 = (number(q) for q in reported_strains(ufl.as_matrix(((C - np.eye(3)) / 2).tolist())))
    assert pytest.approx(np.trace(C) - 3, rel=1e-13) == J1
    assert pytest.approx(np.trace(C @ C) - 3, rel=1e-13) == J2
    assert pytest.approx(np.linalg.det(C) - 1, rel=1e-13) == J3


def test_reported_strains_are_the_plane_invariants_less_2_2_1():
    assert PLANE_STRAIN.rest == (2.0, 2.0, 1.0)
    F = np.array([[1.3, 0.4], [-0.2, 0.8]])
    C = F.T @ F
    E = np.zeros((3, 3))
    E[:2, :2] = (C - np.eye(2)) / 2
    E = ufl.as_matrix(E.tolist())
    J1, J2, J3 = (number(q) for q in reported_strains(E))
    assert pytest.approx(np.trace(C) - 2, rel=1e-13) == J1
    assert pytest.approx(np.trace(C @ C) - 2, rel=1e-13) == J2
    assert pytest.approx(np.linalg.det(C) - 1, rel=1e-13) == J3
    assert pytest.approx((J1 + 2) ** 2 - 2 * (J3 + 1) - 2, rel=1e-12) == J2
