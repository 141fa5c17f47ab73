"""The viscous stress: by hand, under rotation, and after BDF2 has discretised the rate."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from problems import affine, block, displacement_space, wet

from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body, viscous_work
from cellmech.mechanics.fluid import fluid_stress
from cellmech.solver import bdf
from cellmech.solver.state import State

LMBDA_F, MU_F = 3.0, 0.7


def matrix(a):
    return ufl.as_matrix(np.asarray(a, dtype=float).tolist())


def numbers(a, n=2):
    return np.array([[float(a[i, j](())) for j in range(n)] for i in range(n)])


def by_hand(F, C_dot, lmbda_f, mu_f):
    """Eq. 23."""
    J, C_inv = np.linalg.det(F), np.linalg.inv(F.T @ F)
    return J * lmbda_f / 2 * np.trace(C_inv @ C_dot) * C_inv + J * mu_f * C_inv @ C_dot @ C_inv


def rotation(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def test_pure_stretching_flow_has_the_stress_worked_out_by_hand(ladder):
    """F = diag(2, 1), dF/dt = diag(1, 0): C_dot = diag(4, 0), C^-1 C_dot = diag(1, 0), J = 2.

    S_11 = 2 (lambda_f/2) (1) (1/4) + 2 mu_f (1/16) 4 = lambda_f/4 + mu_f/2;  S_22 = 2 (lambda_f/2) (1) 1 = lambda_f.
    """
    S = numbers(fluid_stress(matrix(np.diag([2.0, 1.0])), matrix(np.diag([4.0, 0.0])), LMBDA_F, MU_F))
    by_hand = np.diag([LMBDA_F / 4 + MU_F / 2, LMBDA_F])
    ladder("fluid: stretching flow by hand", ours=S, reference=by_hand, rel=1e-14, abs=1e-14, unit="Pa")


def test_swelling_flow_has_the_cauchy_pressure_lambda_f_times_the_volume_rate():
    """At F = I and D = g I, sigma = lambda_f tr D I + 2 mu_f D (eq. 21)."""
    g = 0.3
    S = numbers(fluid_stress(matrix(np.eye(2)), matrix(2 * g * np.eye(2)), LMBDA_F, MU_F))
    np.testing.assert_allclose(S, (LMBDA_F * 2 * g + 2 * MU_F * g) * np.eye(2), rtol=1e-14, atol=1e-14)


def test_fluid_stress_equals_eq_23_for_any_flow_in_the_plane_and_in_space(ladder):
    rng = np.random.default_rng(11)
    for _ in range(5):
        F, F_dot = np.eye(2) + 0.4 * rng.uniform(-1, 1, (2, 2)), rng.uniform(-1, 1, (2, 2))
        C_dot = F_dot.T @ F + F.T @ F_dot
        S = by_hand(F, C_dot, LMBDA_F, MU_F)
        got = numbers(fluid_stress(matrix(F), matrix(C_dot), LMBDA_F, MU_F))
        ladder("fluid: random flow, eq. 23 by hand", ours=got, reference=S, rel=1e-12, abs=1e-13, unit="Pa")
        spatial = np.eye(3)
        spatial[:2, :2] = F
        rate = np.zeros((3, 3))
        rate[:2, :2] = C_dot
        got = numbers(fluid_stress(matrix(spatial), matrix(rate), LMBDA_F, MU_F), 3)
        np.testing.assert_allclose(got[:2, :2], S, rtol=1e-12, atol=1e-13)  # F33 = 1 adds nothing in the plane


def test_fluid_stress_is_frame_indifferent_and_dissipates(ladder):
    rng = np.random.default_rng(12)
    F, F_dot = np.eye(2) + 0.4 * rng.uniform(-1, 1, (2, 2)), rng.uniform(-1, 1, (2, 2))
    Q, spin = rotation(0.8), np.array([[0.0, -2.0], [2.0, 0.0]])
    turned, turned_dot = Q @ F, Q @ (F_dot + spin @ F)
    C_dot = F_dot.T @ F + F.T @ F_dot
    S = numbers(fluid_stress(matrix(F), matrix(C_dot), LMBDA_F, MU_F))
    S_turned = numbers(
        fluid_stress(matrix(turned), matrix(turned_dot.T @ turned + turned.T @ turned_dot), LMBDA_F, MU_F)
    )
    ladder("fluid: S_f of QF and of F", ours=S_turned, reference=S, rel=1e-12, abs=1e-13, unit="Pa")
    assert np.sum(S * C_dot) / 2 > 0.1


class Flow:
    """A wet unit square in homogeneous deformation, and the nodal viscous forces of the package on it."""

    def __init__(self):
        domain = block(nx=2, ny=2)
        space = displacement_space(domain)
        material = wet(fluid_fraction=0.25, fluid_lambda=LMBDA_F / 0.25, fluid_mu=MU_F / 0.25)
        self.body = Body(domain, material_fields(domain, {"solid": material}), space)
        self.state = State(self.body)
        self.form = compile_form(viscous_work(self.body, self.state, ufl.TestFunction(space)), domain.mesh.comm)

    def forces(self, F, steps):
        """For deformation gradients F now and at the two times before."""
        for function, gradient in zip((self.state.u, self.state.u_n, self.state.u_nn), F, strict=True):
            function.x.array[:] = affine(self.body.space, gradient - np.eye(2))
        self.state.ddt.set(bdf.coefficients(steps))
        return petsc.assemble_vector(self.form).getArray().copy()

    def forces_of(self, P):
        """Nodal forces int P : grad w of a given homogeneous stress."""
        w = ufl.TestFunction(self.body.space)
        constant = fem.Constant(self.body.domain.mesh, P)
        form = compile_form(ufl.inner(constant, ufl.grad(w)) * self.body.domain.dx(4), self.body.domain.mesh.comm)
        return petsc.assemble_vector(form).getArray().copy()


@pytest.fixture(scope="module")
def flow():
    return Flow()


@pytest.mark.parametrize("steps", [(1.0, 1.0), (1.0, 0.5), (0.7, 1.5)])
def test_rigid_spin_of_0_3_rad_a_step_has_no_viscous_force_after_bdf2(flow, steps, ladder):
    """Also of a body held stretched. BDF2 on F instead of C would leave 1 %."""
    U = np.array([[1.3, 0.2], [0.2, 0.8]])
    ages = np.array([0.0, steps[0], steps[0] + steps[1]])
    for held in (np.eye(2), U):
        spin = flow.forces([rotation(1.0 - 0.3 * age) @ held for age in ages], steps)
        flowing = flow.forces([held * (1 - 0.3 * age) for age in ages], steps)
        case = "fluid: rigid spin of 0.3 rad a step, nodal force over that of a flow"
        ladder(case, ours=spin / np.abs(flowing).max(), abs=1e-13)


@pytest.mark.parametrize("steps", [(0.2, 0.2), (0.2, 0.35)])
def test_homogeneous_flow_after_bdf2_has_the_force_of_eq_23(flow, steps, ladder):
    """F linear in time makes C quadratic, whose rate BDF2 has exactly."""
    F, F_dot = np.array([[1.2, 0.3], [-0.1, 0.9]]), np.array([[0.5, -0.8], [0.4, 0.3]])
    ages = np.array([0.0, steps[0], steps[0] + steps[1]])
    got = flow.forces([F - age * F_dot for age in ages], steps)
    expected = flow.forces_of(F @ by_hand(F, F_dot.T @ F + F.T @ F_dot, LMBDA_F, MU_F))
    scale = np.abs(expected).max()
    case = "fluid: homogeneous flow after BDF2 and eq. 23 by hand, over the largest force"
    ladder(case, ours=got / scale, reference=expected / scale, abs=1e-12)
