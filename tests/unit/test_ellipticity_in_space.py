"""Ellipticity against waves in all directions of space: closed forms, moduli by hand, and a scan of directions."""

import numpy as np
import pytest
from laws_by_hand import elasticities, three_d
from problems import LAW_NAMES, affine, block, displacement_space, moduli, solid, wet
from scipy.optimize import brentq

from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.mechanics.kinematics import AXISYMMETRIC, PLANE_STRAIN
from cellmech.mechanics.moduli import lame
from cellmech.solver.ellipticity import Ellipticity
from cellmech.solver.ellipticity_in_space import EllipticityInSpace
from cellmech.solver.state import State
from cellmech.solver.waves_in_space import SpaceWaves

YOUNG, POISSON = 10.0, 0.4


def look_at(law, H, kinematics=PLANE_STRAIN, **fluid):
    """Margins of a uniformly strained block: in its plane, and in space."""
    domain = block()
    domain.mesh.geometry.x[:, 0] += 1.0  # a turned one is off its axis
    material = wet(law, YOUNG, POISSON, **fluid) if fluid else solid(law, YOUNG, POISSON)
    body = Body(domain, material_fields(domain, {"solid": material}), displacement_space(domain), kinematics=kinematics)
    state = State(body)
    state.u.x.array[:] = affine(body.space, H)
    return Ellipticity(body, state.u).find(), EllipticityInSpace(body, state.u).find()


def elasticities_over_mu(law, F):
    """A_iJkL/mu by hand."""
    constants = moduli(law, YOUNG, POISSON)
    return elasticities(law, F, constants) / constants["mu"]


def scanned(law, F, directions):
    """Least eigenvalue of the acoustic tensor over directions."""
    Q = np.einsum("iJkL,nJ,nL->nik", elasticities_over_mu(law, F), directions, directions)
    return float(np.linalg.eigvalsh(Q).min())


@pytest.fixture(scope="module")
def directions():
    found = np.random.default_rng(1).normal(size=(20000, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@pytest.mark.parametrize("law", LAW_NAMES)
def test_margin_is_that_of_a_scan_over_directions_of_space(law, directions):
    rng, below = np.random.default_rng(2), 0
    for _ in range(4):
        H = 0.35 * rng.uniform(-1, 1, (2, 2))
        F = three_d(np.eye(2) + H)
        plane, space = look_at(law, H)
        expected = scanned(law, F, directions)
        size = abs(expected) + 1.0
        assert expected - 2e-2 * size <= space.margin <= expected + 1e-6 * size
        assert space.margin <= plane.margin + 1e-9
        below += space.margin < plane.margin - 1e-6
    assert below >= 1 or law not in ("mooney-rivlin", "yeoh")


def test_hoop_stretch_of_a_turned_block_counts(directions):
    """Far from the axis of u = (a r, b y), F = diag(1 + a, 1 + b, 1 + a)."""
    _, space = look_at("yeoh", np.diag([0.2, -0.3]), AXISYMMETRIC)
    expected = scanned("yeoh", np.diag([1.2, 0.7, 1.2]), directions)
    assert space.margin == pytest.approx(expected, abs=2e-3)


def test_wave_that_is_named_has_the_margin():
    H = np.array([[-0.1, 0.2], [0.0, 0.05]])
    _, space = look_at("saint-venant", H)
    F, N, a = three_d(np.eye(2) + H), np.array(space.normal), np.array(space.motion)
    found = np.einsum("iJkL,i,J,k,L", elasticities_over_mu("saint-venant", F), a, N, a, N)
    assert found == pytest.approx(space.margin, abs=1e-9)
    assert np.linalg.norm(N) == pytest.approx(1.0) and np.linalg.norm(a) == pytest.approx(1.0)


def test_printed_mooney_rivlin_pressed_in_its_plane_gives_way_out_of_it():
    """A wave along 1 that moves points along 3 sees 2 (alpha + beta s_2^2)/mu, lost at s_2^2 = 0.8 (beta/mu = 2.5).

    In the plane that law keeps the margin of rest in every state.
    """
    lost = brentq(lambda s: look_at("mooney-rivlin", np.diag([0.0, s - 1.0]))[1].margin, 0.8, 0.99, xtol=1e-10)
    assert lost == pytest.approx(np.sqrt(0.8), abs=1e-8)
    plane, space = look_at("mooney-rivlin", np.diag([0.0, -0.15]))
    assert plane.margin == pytest.approx(1.0, abs=1e-9) and not plane.lost
    assert space.lost and abs(space.motion[2]) == pytest.approx(1.0, abs=1e-6)
    assert "in the solid" in str(space)


@pytest.mark.parametrize("law", LAW_NAMES)
def test_margin_of_rest_is_1(law):
    _, space = look_at(law, np.zeros((2, 2)))
    assert space.margin == pytest.approx(1.0, abs=1e-12) and space.at_um is None and str(space) == "margin 1 everywhere"


def test_fluid_alone_has_no_margin():
    _, nothing = look_at("neo-hookean", np.zeros((2, 2)), fluid_fraction=1.0)
    assert nothing.margin is None and not nothing.lost and str(nothing) == "no solid"


def test_saint_venant_under_equal_compression_in_space_is_lost_by_shear():
    """s^2 = (3 lambda + 2 mu)/(3 lambda + 4 mu): shear waves see (3 lambda + 2 mu)(s^2 - 1)/2 + mu s^2."""
    lmbda, mu = lame(1.0, POISSON)
    lost = brentq(
        lambda s: look_at("saint-venant", (s - 1) * np.eye(2), AXISYMMETRIC)[1].margin, 0.7, 0.999, xtol=1e-11
    )
    assert lost**2 == pytest.approx((3 * lmbda + 2 * mu) / (3 * lmbda + 4 * mu), abs=1e-8)


@pytest.mark.parametrize("level", [0.9, 1.0])
def test_points_that_are_not_searched_have_no_slower_wave(level):
    """Of random points: all those that a scan finds below the level are searched, and hardly any other."""
    rng, n = np.random.default_rng(0), 2000
    straight = 1 + rng.uniform(0, 2, (3, 3, n))
    half = rng.normal(size=(3, 3, n))
    waves = SpaceWaves(straight, 0.8 * (half + np.swapaxes(half, 0, 1)))
    angles = np.linspace(0, np.pi / 2, 40)
    lowest = np.full(n, np.inf)
    for theta in angles:
        for phi in angles:
            n_0 = np.array([np.cos(phi) * np.cos(theta), np.cos(phi) * np.sin(theta), np.sin(phi)])
            lowest = np.minimum(lowest, np.linalg.eigvalsh(waves.tensor(n_0[:, None]))[:, 0])
    searched = waves._may_be_below(level)
    assert 0.2 * n < np.count_nonzero(lowest < level) < 0.8 * n
    assert searched[lowest < level].all()
    assert np.count_nonzero(searched[lowest > level]) < 0.01 * n
