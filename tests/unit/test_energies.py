"""The strain energies of all laws: at rest, at small strain, against the same coded by hand, under rotation."""

from functools import lru_cache
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import ufl
from dolfinx import fem
from laws_by_hand import by_hand, three_d
from problems import LAW_NAMES, affine, block, displacement_space, moduli, solid

from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import PointValues
from cellmech.mechanics.kinematics import PLANE_STRAIN, green_lagrange
from cellmech.mechanics.laws import LAWS
from cellmech.mechanics.moduli import lame
from cellmech.mechanics.stress import energy_and_stress

YOUNG, POISSON = 10.0, 0.3
LMBDA, MU = lame(YOUNG, POISSON)
FIRST_CELL = np.array([0], dtype=np.int32)
CASES = [*((law, 3.0) for law in LAW_NAMES), ("yeoh", 0.0)]  # the last one is eq. 20 as printed
STRESS_FREE = CASES[:-1]


def hand(law, F, m=np, **more):
    """(W, S) by hand."""
    return by_hand(law, F.T @ F, moduli(law, YOUNG, POISSON, **more), m)


def named(law: str, i1_rest: float) -> str:
    """A law's name in the table."""
    return law if i1_rest else f"{law} as printed"


@lru_cache
def law_at(law: str, i1_rest: float = 3.0):
    """(W, S) of the package as a function of the displacement gradient, S of shape (3, 3)."""
    domain = block()
    u = fem.Function(displacement_space(domain, 1))
    (mixture,) = material_fields(domain, {"solid": solid(law, YOUNG, POISSON, i1_rest=i1_rest)})
    W, S = mixture.solid(green_lagrange(u, PLANE_STRAIN))
    compiled = PointValues(packed(W, S), np.array([[0.25, 0.25]]), domain.mesh.comm)

    def evaluate(H):
        u.x.array[:] = affine(u.function_space, H)
        return unpacked(compiled(FIRST_CELL)[0, 0])

    return evaluate


@lru_cache
def spatial_law_at(law: str, **more: float):
    """(W, S) as a function of any 3-D displacement gradient."""
    domain = block()
    E = fem.Constant(domain.mesh, np.zeros((3, 3)))
    constants = {k: fem.Constant(domain.mesh, v) for k, v in moduli(law, YOUNG, POISSON, **more).items()}
    W, S = energy_and_stress(LAWS[law], E, **constants)
    compiled = PointValues(packed(W, S), np.array([[0.25, 0.25]]), domain.mesh.comm)

    def evaluate(H):
        E.value[:] = (H + H.T + H.T @ H) / 2
        return unpacked(compiled(FIRST_CELL)[0, 0])

    return evaluate


def packed(W, S):
    return ufl.as_vector([W, *(S[i, j] for i in range(3) for j in range(3))])


def unpacked(values):
    return values[0], values[1:].reshape(3, 3)


def random_gradients(size, count=8, seed=1):
    """Displacement gradients with det F > 0."""
    rng = np.random.default_rng(seed)
    gradients = []
    while len(gradients) < count:
        H = size * rng.uniform(-1, 1, (2, 2))
        if np.linalg.det(np.eye(2) + H) > 0.05:
            gradients.append(H)
    return gradients


def rotation(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@pytest.mark.parametrize(("law", "i1_rest"), STRESS_FREE)
def test_law_at_rest_has_no_energy_and_no_stress(law, i1_rest, ladder):
    W, S = law_at(law, i1_rest)(np.zeros((2, 2)))
    ladder(f"law at rest, {law}: W and S over µ", ours=[W / MU, *(S / MU).ravel()], abs=1e-14)


def test_printed_yeoh_at_rest_has_the_stress_minus_1_2_alpha(ladder):
    alpha = MU / 2 - MU / 0.4
    _, S = law_at("yeoh", 0.0)(np.zeros((2, 2)))
    ladder("law at rest, yeoh as printed: S over µ", ours=S / MU, reference=-1.2 * alpha / MU * np.eye(3), abs=1e-13)


@pytest.mark.parametrize("law", LAW_NAMES)
def test_law_at_small_strain_has_the_stated_moduli(law, ladder):
    """mu for every law; lambda as given, for Yeoh lambda + 4 alpha_Y1 = lambda + 4 mu at the printed beta."""
    h = 1e-9
    lmbda = LMBDA + 4 * MU if law == "yeoh" else LMBDA
    stress = law_at(law)
    shear = stress([[0.0, h], [0.0, 0.0]])[1] / h
    stretch = stress([[h, 0.0], [0.0, 0.0]])[1] / h
    np.testing.assert_allclose(shear, MU * (np.eye(3)[[1, 0, 2]] - np.diag([0, 0, 1])), rtol=0, atol=1e-6 * MU)
    np.testing.assert_allclose(stretch, np.diag([lmbda + 2 * MU, lmbda, lmbda]), rtol=0, atol=1e-6 * MU)
    ladder(f"small strain, {law}: shear modulus over µ", ours=shear[0, 1] / MU, reference=1.0, abs=1e-6)
    ladder(f"small strain, {law}: λ over µ", ours=stretch[1, 1] / MU, reference=lmbda / MU, abs=1e-6)


@pytest.mark.parametrize(("law", "i1_rest"), CASES)
@pytest.mark.parametrize("size", [0.02, 0.3, 1.5])
def test_stress_by_differentiation_equals_the_equations_by_hand(law, i1_rest, size, ladder):
    """All nine components, S_zz included."""
    for H in random_gradients(size):
        F = three_d(np.eye(2) + H)
        W, S = law_at(law, i1_rest)(H)
        W_hand, S_hand = hand(law, F, i1_rest=i1_rest)
        scale = max(np.abs(S_hand).max(), MU)
        ladder(f"{named(law, i1_rest)}: W by hand, over µ", ours=W / MU, reference=W_hand / MU, rel=1e-12, abs=1e-13)
        case = f"{named(law, i1_rest)}: S by differentiation and by hand, over the largest"
        ladder(case, ours=S / scale, reference=S_hand / scale, abs=1e-12)


@pytest.mark.parametrize("law", LAW_NAMES)
def test_stress_by_differentiation_holds_for_any_spatial_strain(law):
    """The invariants are those of the full 3-D C, with any F33 and any out-of-plane shear."""
    rng = np.random.default_rng(5)
    for _ in range(5):
        F = np.eye(3) + 0.3 * rng.uniform(-1, 1, (3, 3))
        W, S = spatial_law_at(law)(F - np.eye(3))
        W_hand, S_hand = hand(law, F)
        assert np.linalg.det(F) > 0
        assert W == pytest.approx(W_hand, rel=1e-12, abs=1e-13 * MU)
        np.testing.assert_allclose(S, S_hand, rtol=0, atol=1e-12 * max(np.abs(S_hand).max(), MU))


@pytest.mark.parametrize(("law", "i1_rest"), CASES)
@pytest.mark.parametrize("size", [1e-4, 1e-6, 1e-8, 1e-10])
def test_stress_at_small_strain_keeps_its_digits(law, i1_rest, size, ladder):
    """Against the same law in 60 digits; a plain ln J or C - I would be left with 6 digits at 1e-10, or with none."""
    for H in random_gradients(size, count=3):
        with mpmath.workdps(60):
            F = three_d(
                np.array(
                    [
                        [mpmath.mpf(h) + i for h, i in zip(*rows, strict=True)]
                        for rows in zip(H, np.eye(2, dtype=int), strict=True)
                    ]
                )
            )
            W_exact, S_exact = hand(law, F, mpmath, i1_rest=i1_rest)
            S_exact, W_exact = S_exact.astype(float), float(W_exact)
        W, S = law_at(law, i1_rest)(H)
        scale = np.abs(S_exact).max()
        case = f"{named(law, i1_rest)}: S at gradients 1e-4 … 1e-10 and in 60 digits, over the largest"
        ladder(case, ours=S / scale, reference=S_exact / scale, abs=1e-9)
        if i1_rest == 3.0:
            assert W == pytest.approx(W_exact, rel=1e-9, abs=0.0)


@pytest.mark.parametrize(("law", "i1_rest"), CASES)
def test_law_is_frame_indifferent(law, i1_rest, ladder):
    """W and S of Q F equal those of F; and W depends on F, so that the claim is not empty."""
    evaluate = law_at(law, i1_rest)
    for H in random_gradients(0.4, count=4):
        F = np.eye(2) + H
        W, S = evaluate(H)
        for angle in (0.1, 1.0, 3.0):
            W_turned, S_turned = evaluate(rotation(angle) @ F - np.eye(2))
            case, scale = f"{named(law, i1_rest)}: W(QF) = W(F), over µ", max(np.abs(S).max(), MU)
            ladder(case, ours=W_turned / MU, reference=W / MU, rel=1e-12, abs=1e-12)
            np.testing.assert_allclose(S_turned, S, rtol=0, atol=1e-12 * scale)
        assert abs(evaluate(F @ rotation(0.5) @ np.diag([1.1, 1.0]) - np.eye(2))[0] - W) > 1e-3 * MU


@pytest.mark.parametrize("law", LAW_NAMES)
def test_law_is_isotropic(law):
    evaluate = law_at(law)
    for H in random_gradients(0.4, count=3):
        Q = rotation(0.7)
        W, S = evaluate(H)
        W_turned, S_turned = evaluate((np.eye(2) + H) @ Q - np.eye(2))
        assert W_turned == pytest.approx(W, rel=1e-12)
        np.testing.assert_allclose(
            S_turned, three_d(Q).T @ S @ three_d(Q), rtol=0, atol=1e-12 * max(np.abs(S).max(), MU)
        )


def test_mooney_rivlin_beta_shows_only_out_of_plane():
    """In plane strain I2 = I1 - 1 + I3: at equal in-plane isochoric strain only S_zz depends on beta."""
    H = np.array([[0.25, 0.3], [0.0, -0.2]])  # det F = 1
    F = three_d(np.eye(2) + H)
    _, S = law_at("mooney-rivlin")(H)
    _, S_neo = hand("neo-hookean", F)
    gap = (S - S_neo)[:2, :2] @ (F.T @ F)[:2, :2]
    np.testing.assert_allclose(gap, gap[0, 0] * np.eye(2), rtol=0, atol=1e-12 * MU)  # a pressure in the plane
    assert abs(S[2, 2] - S_neo[2, 2]) > 0.1 * MU


@pytest.mark.parametrize(
    ("printed", "lmbda"), [(False, 10.0 * 0.45 / (1.45 * 0.1)), (True, 10.0 * 0.45 / 0.1)], ids=["standard", "printed"]
)
def test_lame_constants_are_those_of_young_and_poisson(printed, lmbda):
    got = SimpleNamespace(**dict(zip(("lmbda", "mu"), lame(10.0, 0.45, printed), strict=True)))
    assert got.lmbda == pytest.approx(lmbda, rel=1e-12)
    assert got.mu == pytest.approx(10.0 / 2.9, rel=1e-12)


def test_lame_constants_give_back_uniaxial_young_and_poisson():
    lmbda, mu = lame(7.0, 0.2)
    stiffness = lmbda * np.ones((3, 3)) + 2 * mu * np.eye(3)
    strain = np.linalg.solve(stiffness, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(strain, [1 / 7.0, -0.2 / 7.0, -0.2 / 7.0], rtol=1e-12)


@pytest.mark.parametrize("limit", [0.05, 0.5, 1e6])
def test_gent_stiffens_towards_its_limit_and_has_the_moduli_it_is_given(limit):
    """W and S near the limit and far below it; at a strain of 1e-7 they are Hooke's."""
    for stretch in (1e-7, 0.1, 1.0):
        H = stretch * np.array([[0.05, 0.12, 0.0], [0.02, -0.08, 0.01], [0.0, 0.03, 0.04]])
        W, S = spatial_law_at("gent", i1_limit=limit)(H)
        if stretch > 1e-3:
            with mpmath.workdps(30):  # the logarithm of 1 - t/10^6 in doubles would leave 8 digits
                W_hand, S_hand = hand("gent", (np.eye(3) + H).astype(object), mpmath, i1_limit=limit)
            assert pytest.approx(float(W_hand), rel=1e-10) == W
            np.testing.assert_allclose(S, S_hand.astype(float), rtol=1e-9, atol=1e-11 * MU)
        else:
            small = (H + H.T) / 2
            hooke = LMBDA * np.trace(small) * np.eye(3) + 2 * MU * small
            np.testing.assert_allclose(S, hooke, atol=1e-6 * MU * stretch)


@pytest.mark.parametrize(("law", "i1_rest"), [("mooney-rivlin", None), ("yeoh", 3.0), ("yeoh", 0.0)])
def test_in_plane_trace_gives_the_printed_stress_with_tr_of_the_plane_tensor(law, i1_rest):
    """Eqs 19, 20 by hand, all tensors 2 x 2; at rest Mooney-Rivlin has the stress -2 beta I."""
    beta, domain = 0.1 * MU, block()
    alpha, lmbda = MU / 2 - beta, LMBDA + 2 * MU / 3
    E = fem.Constant(domain.mesh, np.zeros((3, 3)))
    constants = {"lmbda": LMBDA, "mu": MU, "beta": beta} | ({} if i1_rest is None else {"i1_rest": i1_rest})
    parts = {key: fem.Constant(domain.mesh, value) for key, value in constants.items()}
    compiled = PointValues(
        packed(*energy_and_stress(LAWS[law].in_plane, E, **parts)), np.array([[0.25, 0.25]]), domain.mesh.comm
    )
    for H in [np.zeros((2, 2)), *random_gradients(0.3)]:
        C = (np.eye(2) + H).T @ (np.eye(2) + H)
        E.value[:] = three_d_of((C - np.eye(2)) / 2)
        S = unpacked(compiled(FIRST_CELL)[0, 0])[1][:2, :2]
        I3, inverse, tr = np.linalg.det(C), np.linalg.inv(C), np.trace(C)
        hand = 2 * alpha * (np.eye(2) - I3 ** (1 / 3) * inverse)
        hand = hand + 2 * beta * (tr * np.eye(2) - C - 2 * I3 ** (2 / 3) * inverse) + lmbda * np.log(I3) / 2 * inverse
        if i1_rest is not None:
            hand = hand + 2 * (-0.5 * alpha * (tr - i1_rest) + 0.1 * alpha * (tr - i1_rest) ** 2) * np.eye(2)
        np.testing.assert_allclose(S, hand, rtol=0, atol=1e-12 * max(np.abs(hand).max(), MU))
    if law == "mooney-rivlin":
        E.value[:] = 0.0
        np.testing.assert_allclose(unpacked(compiled(FIRST_CELL)[0, 0])[1][:2, :2], -2 * beta * np.eye(2), atol=1e-13)


def three_d_of(E):
    """A plane tensor as the plane part of a 3 x 3 one."""
    return np.pad(E, ((0, 1), (0, 1)))
