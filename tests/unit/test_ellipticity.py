"""Loss of ellipticity: against closed forms, against moduli coded by hand and a scan over directions, and where."""

from functools import lru_cache

import numpy as np
import pytest
from laws_by_hand import elasticities, three_d
from problems import LAW_NAMES, affine, block, displacement_space, domain_of, moduli, solid, wet
from scipy.optimize import brentq

from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.mechanics.moduli import lame
from cellmech.solver.ellipticity import Ellipticity, StabilityWatch, yeoh_bounds
from cellmech.solver.state import State

YOUNG = 10.0


@lru_cache
def look_at(law, poisson=0.45, beta_over_mu=2.5, **fluid):
    """Stability as a function of F."""
    domain = block()
    dry = solid(law, YOUNG, poisson, beta_over_mu=beta_over_mu)
    material = wet(law, YOUNG, poisson, **fluid) if fluid else dry
    body = Body(domain, material_fields(domain, {"solid": material}), displacement_space(domain))
    state = State(body)
    ellipticity = Ellipticity(body, state.u)

    def look(F):
        state.u.x.array[:] = affine(body.space, np.asarray(F) - np.eye(2))
        return ellipticity.find()

    return look


def root(law, path, least, most, **options):
    """Where along a path of F the margin is 0."""
    return brentq(lambda s: look_at(law, **options)(path(s)).margin, least, most, xtol=1e-13)


def uniaxial(s):
    return np.diag([s, 1.0])


def uniform(s):
    return np.diag([s, s])


def at_constant_area(s):
    return np.diag([s, 1 / s])


def sheared(gamma):
    return np.array([[1.0, gamma], [0.0, 1.0]])


def turned(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s], [s, c]])


def J1(F):
    return np.trace(F.T @ F)


def deformations(n, spread, seed):
    """Random F with principal stretches within exp(± spread)."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        one, other = (turned(angle) for angle in rng.uniform(0.0, 360.0, 2))
        yield one @ np.diag(np.exp(rng.uniform(-spread, spread, 2))) @ other


# Moduli by hand


def scanned(A, n=3600):
    """Least eigenvalue of the acoustic tensor over n directions."""
    theta = np.pi / n * np.arange(n)
    N = np.array([np.cos(theta), np.sin(theta)])
    return np.linalg.eigvalsh(np.einsum("iJkL,Jn,Ln->nik", A, N, N)).min()


@pytest.mark.parametrize("law", LAW_NAMES)
def test_margin_is_that_of_hand_coded_moduli_scanned_over_all_directions(law):
    seen, constants = [], moduli(law, YOUNG, 0.4)
    for F in deformations(60, 0.8, seed=3):
        found = look_at(law, 0.4)(F)
        A = elasticities(law, three_d(F), constants)[:2, :2, :2, :2] / constants["mu"]
        size = np.abs(A).max()
        assert scanned(A) - 1e-5 * size <= found.margin <= scanned(A) + 1e-12 * size
        if found.at_um is not None:
            theta, phi = np.radians([found.angle_deg, found.amplitude_deg])
            N, a = np.array([np.cos(theta), np.sin(theta)]), np.array([np.cos(phi), np.sin(phi)])
            assert np.einsum("iJkL,i,J,k,L", A, a, N, a, N) == pytest.approx(found.margin, abs=1e-9 * size)
        seen.append(found.lost)
    assert any(seen) == (law in ("saint-venant", "yeoh")) and not all(seen)


# At rest


@pytest.mark.parametrize("law", LAW_NAMES)
@pytest.mark.parametrize("fluid", [0.0, 0.5])
def test_margin_at_rest_is_1_everywhere(law, fluid):
    found = look_at(law, fluid_fraction=fluid)(np.eye(2))
    assert found.margin == pytest.approx(1.0, abs=1e-13)
    assert found.at_um is found.layer is found.angle_deg is None


@pytest.mark.parametrize("strain", [1e-4, 1e-7, 1e-9])
def test_small_strains_keep_their_digits(strain):
    """Saint-Venant under equal compression, where every shear wave sees 1 + (lambda/mu + 2)(s^2 - 1)."""
    s = 1 - strain
    margin = look_at("saint-venant")(uniform(s)).margin
    assert 1 - margin == pytest.approx(11 * (1 - s * s), rel=1e-5)


# Closed forms


def test_saint_venant_along_a_pressed_axis_is_lost_at_1_over_root_3():
    """d^2W/dF^2 = 0, the limit point of the one-dimensional law; a stretch across keeps the other waves faster."""
    assert root("saint-venant", at_constant_area, 0.4, 0.9, poisson=0.0) == pytest.approx(3**-0.5, abs=1e-12)
    found = look_at("saint-venant", 0.0)(at_constant_area(0.57))
    assert found.margin == pytest.approx(3 * 0.57**2 - 1, abs=1e-12)
    assert min(found.angle_deg, 180 - found.angle_deg) < 1e-3  # a wave along the axis …
    assert min(found.amplitude_deg, 180 - found.amplitude_deg) < 1e-3  # … that compresses


def test_saint_venant_without_lateral_strain_is_lost_by_an_oblique_wave_before_that():
    """For nu = 0, det Q/mu^2 = 2 L - (L + 2) y + 2 y^2 with L = s^2 and y = (1 - L) cos^2 theta.

    Its discriminant is 0 at L = 6 - 4 sqrt(2), s = 2 - sqrt(2), y = (L + 2)/4.
    """
    lost = 2 - np.sqrt(2)
    assert root("saint-venant", uniaxial, 0.4, 0.9, poisson=0.0) == pytest.approx(lost, abs=1e-9)
    found = look_at("saint-venant", 0.0)(uniaxial(lost))
    cosine = np.sqrt((lost**2 + 2) / 4 / (1 - lost**2))
    assert abs(np.cos(np.radians(found.angle_deg))) == pytest.approx(cosine, abs=1e-4)


@pytest.mark.parametrize("poisson", [0.0, 0.1, 0.3, 0.45])
def test_saint_venant_under_equal_compression_is_lost_by_shear(poisson):
    lmbda, mu = lame(1.0, poisson)
    expected = np.sqrt((lmbda + mu) / (lmbda + 2 * mu))
    assert root("saint-venant", uniform, 0.5, 0.99, poisson=poisson) == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("law", ["neo-hookean", "mooney-rivlin"])
def test_neo_hookean_and_printed_mooney_rivlin_keep_the_margin_of_rest_in_compression(law):
    for F in deformations(40, 1.5, seed=5):
        F /= max(1.0, np.sqrt(np.linalg.det(F)))
        assert look_at(law)(F).margin == pytest.approx(1.0, abs=1e-9)


def test_neo_hookean_is_lost_in_large_expansion_only():
    """Q = I + (1 + lambda/mu (1 - ln J)) b b^T, |b| = 1 along a uniaxial stretch: lost at ln J = 1 + 2 mu/lambda."""
    lmbda, mu = lame(1.0, 0.45)
    assert root("neo-hookean", uniaxial, 2.0, 5.0) == pytest.approx(np.exp(1 + 2 * mu / lmbda), rel=1e-12)
    assert look_at("mooney-rivlin")(uniaxial(5.0)).margin == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("poisson", [0.3, 0.45, 0.49])
@pytest.mark.parametrize("path", [uniaxial, uniform, lambda s: np.diag([s, 0.95])])
def test_printed_yeoh_in_compression_is_lost_at_one_j1_in_every_mode(path, poisson):
    """J1 = 1.542; model.md says about 1.54."""
    lost = root("yeoh", path, 0.6, 0.99, poisson=poisson)
    assert J1(path(lost)) == pytest.approx(2 + (5 - np.sqrt(35)) / 2, abs=1e-9)


@pytest.mark.parametrize(
    ("path", "poisson", "expected"),
    [
        (sheared, 0.45, 5.1084),
        (at_constant_area, 0.45, 5.1084),
        (sheared, 0.4999, 5.158),
        (uniaxial, 0.45, 5.387),
        (uniform, 0.45, 6.706),
    ],
)
def test_printed_yeoh_in_stretch_is_lost_at_j1_of_5_to_7(path, poisson, expected):
    """model.md says J1 about 5.1, which is that of shear at nu = 0.45."""
    least = 0.5 if path is sheared else 1.2
    assert J1(path(root("yeoh", path, least, 2.3, poisson=poisson))) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("beta_over_mu", [0.0, 0.02, 0.25, 0.4, 0.5, 0.8, 1.0, 2.5, 10.0])
def test_yeoh_bounds_are_where_the_margin_changes_sign(beta_over_mu):
    below, beyond = yeoh_bounds(beta_over_mu)
    look = look_at("yeoh", 0.4999, beta_over_mu)

    def pressed(j1):
        return look(uniform(np.sqrt(j1 / 2))).lost

    def stretched(j1):
        return look(sheared(np.sqrt(j1 - 2))).lost

    if below is None:
        assert not pressed(0.02)
    else:
        assert pressed(below - 1e-6) and not pressed(below + 1e-6)
    if beyond is None:
        assert not any(stretched(j1) for j1 in np.linspace(2.0, 8.0, 61))
    else:
        assert stretched(beyond + 0.02) and not any(stretched(j1) for j1 in np.linspace(2.0, beyond - 0.01, 30))


# Frames, places, shares


@pytest.mark.parametrize("law", ["saint-venant", "yeoh"])
def test_margin_and_normal_do_not_depend_on_the_observer(law):
    for F in deformations(10, 0.6, seed=7):
        here, there, other = (look_at(law)(G) for G in (F, turned(33.0) @ F, F @ turned(-33.0)))
        assert there.margin == pytest.approx(here.margin, abs=1e-11)
        assert other.margin == pytest.approx(here.margin, abs=1e-11)
        expected = np.array([here.angle_deg, here.amplitude_deg + 33.0, here.angle_deg + 33.0, here.amplitude_deg])
        found = np.array([there.angle_deg, there.amplitude_deg, other.angle_deg, other.amplitude_deg])
        mirrored = 2 * np.array([1.0, 1.0, 1.0, 1.0]) * _principal(F, 33.0) - expected  # the pair weighs the same
        apart = np.min([_apart(found, expected), _apart(found, mirrored)], axis=0)
        assert apart.max() < 0.01


def _principal(F, turn):
    """Angles of principal axes: reference, deformed and turned, reference and turned, deformed [deg]."""
    rotated, _, reference = np.linalg.svd(F)
    N, n = np.degrees([np.arctan2(reference[0, 1], reference[0, 0]), np.arctan2(rotated[1, 0], rotated[0, 0])])
    return np.array([N, n + turn, N + turn, n])


def _apart(one, other):
    return np.abs((one - other + 90.0) % 180.0 - 90.0)


def two_halves(left, right):
    mesh = block(width=2.0, nx=4, ny=2).mesh
    sides = {"left": lambda x: x[0] <= 1.0 + 1e-9, "right": lambda x: x[0] >= 1.0 - 1e-9}
    domain = domain_of(mesh, cells=sides)
    body = Body(domain, material_fields(domain, {"left": left, "right": right}), displacement_space(domain))
    state = State(body)
    return state, Ellipticity(body, state.u)


def bend(state):
    """Pressed along x the more, the further to the right: u_x' = -0.04 x."""
    x = state.u.function_space.tabulate_dof_coordinates()
    state.u.x.array[0::2] = -0.02 * x[:, 0] ** 2


def test_worst_point_is_named_with_its_layer():
    state, ellipticity = two_halves(solid("saint-venant", 10.0, 0.45), solid("saint-venant", 30.0, 0.45))
    bend(state)
    found = ellipticity.find()
    assert found.layer == "right" and found.at_um[0] == pytest.approx(2.0)
    assert found.margin == pytest.approx(look_at("saint-venant")(uniaxial(0.92)).margin, abs=1e-9)
    assert "in the right" in str(found) and "x = 2," in str(found)


def test_layers_of_other_laws_have_their_own_margin():
    state, ellipticity = two_halves(solid("saint-venant", 10.0, 0.45), solid("neo-hookean", 10.0, 0.45))
    bend(state)
    found = ellipticity.find()
    assert found.layer == "left" and found.at_um[0] == pytest.approx(1.0)


def test_layer_that_is_all_fluid_has_no_margin():
    law = ("saint-venant", 10.0, 0.45)
    state, ellipticity = two_halves(wet(*law, fluid_fraction=0.9), wet(*law, fluid_fraction=1.0))
    bend(state)
    assert ellipticity.find().layer == "left"
    _, ellipticity = two_halves(wet(*law, fluid_fraction=1.0), wet(*law, fluid_fraction=1.0))
    nothing = ellipticity.find()
    assert nothing.margin is None and not nothing.lost and str(nothing) == "no solid"


# The watch


@pytest.mark.parametrize(("law", "sign", "late"), [("saint-venant", -1, 0.0), ("yeoh", -1, 0.0), ("yeoh", 1, 0.05)])
def test_watch_looks_seldom_and_misses_no_loss(law, sign, late):
    """In stretch the Yeoh law gives no sign before it gives way: there the loss is seen one increment later at most."""
    domain = block()
    body = Body(domain, material_fields(domain, {"solid": solid(law, YOUNG, 0.45)}), displacement_space(domain))
    state = State(body)
    watch, looks, lost = StabilityWatch(body, state.u), 0, []
    for steps, stretch in enumerate(np.exp(sign * np.geomspace(1e-6, 1.0, 1000))):  # noqa: B007
        state.u.x.array[:] = affine(body.space, uniaxial(stretch) - np.eye(2))
        found = watch.look_if_due()
        looks += found is not None
        if look_at(law)(uniaxial(stretch)).lost:
            lost.append((stretch**2 - 1) / 2)
        if found is not None and found.lost:
            break
    assert found.lost
    assert abs(lost[-1] - lost[0]) <= late * 1.2
    assert looks < steps / 10


def test_watch_rests_while_nothing_moves():
    domain = block()
    body = Body(domain, material_fields(domain, {"solid": solid("saint-venant")}), displacement_space(domain))
    state = State(body)
    watch = StabilityWatch(body, state.u)
    state.u.x.array[:] = affine(body.space, [[-0.1, 0.0], [0.0, 0.0]])
    assert watch.look_if_due() == watch.look()
    assert watch.look_if_due() is None
