"""The mixed form: its energy, its pressure, Newton's method for it, and its element."""

import basix
import numpy as np
import pytest
import scipy.linalg
import ufl
from dolfinx import fem
from problems import LAW_NAMES, affine, block, domain_of, hold, moduli, solid
from scipy.sparse import csr_matrix

from cellmech.fem import jit, p2_bubble
from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import PointValues, compile_form
from cellmech.mechanics.balance import Body
from cellmech.mechanics.invariants import Invariants
from cellmech.mechanics.kinematics import PLANE_STRAIN, green_lagrange
from cellmech.mechanics.laws import LAWS
from cellmech.mechanics.materials import Material
from cellmech.mechanics.stress import energy_and_stress, measure_of, mixed_energy_and_stress
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

H = np.array([[0.2, 0.35], [-0.1, -0.25]])
YOUNG, NEARLY = 10.0, 0.499


def mixed(law="neo-hookean", poisson=NEARLY, **more):
    constants = moduli(law, YOUNG, poisson)
    return Material(LAWS[law], constants, mixed=True, **more)


def body_of(domain, material, bubble=True, degree=1, **more):
    space = jit.displacement_space(domain.mesh, 2, bubble)
    bcs = (hold(space, domain, "left", 0), hold(space, domain, "bottom", 1))
    materials = material if isinstance(material, dict) else {"solid": material}
    pressure = jit.pressure_space(domain.mesh, degree)
    return Body(domain, material_fields(domain, materials), space, bcs, pressure_space=pressure, **more)


# The energy


@pytest.mark.parametrize("law", LAW_NAMES)
def test_energy_is_that_without_lambda_and_half_lambda_times_the_square_of_the_measure(law):
    domain = block()
    u = fem.Function(jit.displacement_space(domain.mesh, 1))
    u.x.array[:] = affine(u.function_space, H)
    E, constants = green_lagrange(u, PLANE_STRAIN), moduli(law, YOUNG, 0.3)
    lmbda = constants.pop("lmbda")
    W, S = energy_and_stress(LAWS[law], E, lmbda=lmbda, **constants)
    bare, _ = energy_and_stress(LAWS[law], E, lmbda=0.0, **constants)
    g = measure_of(LAWS[law]).of(Invariants(E))
    both, stress = mixed_energy_and_stress(LAWS[law], E, lmbda * g, lmbda=lmbda, **constants)
    entries = [tensor[i, j] for tensor in (S, stress) for i in range(3) for j in range(3)]
    parts = ufl.as_vector([W, bare + lmbda / 2 * g**2, both, *entries])
    found = PointValues(parts, np.array([[0.3, 0.3]]), domain.mesh.comm)(np.array([0], dtype=np.int32))[0, 0]
    assert abs(found[0]) > 0.1
    np.testing.assert_allclose(found[1:3], found[0], rtol=1e-12)
    np.testing.assert_allclose(found[3:12], found[12:], rtol=1e-12, atol=1e-12)


def test_law_without_a_volumetric_measure_is_not_mixed():
    def nameless(C, *, lmbda, mu):
        return mu * C.square + lmbda * C.trace**4

    domain = block()
    assert material_fields(domain, {"solid": Material(nameless, {"lmbda": 1.0, "mu": 1.0})})
    with pytest.raises(ValueError, match="nameless states no volumetric measure"):
        material_fields(domain, {"solid": Material(nameless, {"lmbda": 1.0, "mu": 1.0}, mixed=True)})


# The pressure


def test_pressure_is_lambda_times_the_measure_where_mixed_and_nothing_elsewhere():
    mesh = block(2.0, 1.0, 4, 2).mesh
    groups = {
        "plain": lambda x: x[0] < 0.5 + 1e-9,
        "wet": lambda x: (x[0] > 0.5 - 1e-9) & (x[0] < 1.0 + 1e-9),
        "mixed": lambda x: x[0] > 1.0 - 1e-9,
    }
    sides = {"left": lambda x: np.isclose(x[0], 0.0), "bottom": lambda x: np.isclose(x[1], 0.0)}
    domain = domain_of(mesh, groups, sides)
    body = body_of(domain, {"plain": solid(), "wet": mixed(fluid_fraction=1.0), "mixed": mixed(fluid_fraction=0.7)})
    state = State(body)
    state.u.x.array[:] = affine(body.space, H)
    state.update()
    lmbda = moduli("neo-hookean", YOUNG, NEARLY)["lmbda"]
    expected = {"plain": 0.0, "wet": 0.0, "mixed": lmbda * np.log(np.linalg.det(np.eye(2) + H))}
    for name, value in expected.items():
        for cell in domain.cell_tags.find(domain.cells[name]):
            found = state.p.x.array[body.pressure_space.dofmap.cell_dofs(cell)]
            np.testing.assert_allclose(found, value, rtol=1e-11)


@pytest.mark.parametrize("law", LAW_NAMES)
def test_reported_strain_has_the_volume_of_the_pressure_and_the_shape_of_the_displacement(law):
    domain = block()
    u = fem.Function(jit.displacement_space(domain.mesh, 2))
    u.x.array[:] = affine(u.function_space, H)
    (mixture,) = material_fields(domain, {"solid": mixed(law)})
    E, p = green_lagrange(u, PLANE_STRAIN), fem.Constant(domain.mesh, 0.0)
    reported = mixture.strain(E, p, PLANE_STRAIN)
    numbers = [mixture.volumetric(E), mixture.volumetric(reported)]
    entries = [tensor[i, j] for tensor in (E, reported) for i in range(2) for j in range(2)]
    values = PointValues(ufl.as_vector(numbers + entries), np.array([[0.3, 0.3]]), domain.mesh.comm)
    lmbda = moduli(law, YOUNG, NEARLY)["lmbda"]
    for measure in (0.3, -1e-5, None):
        first = np.array([0], dtype=np.int32)
        p.value = lmbda * (values(first)[0, 0, 0] if measure is None else measure)
        own, new, *tensors = values(first)[0, 0]
        before, after = np.reshape(tensors, (2, 2, 2))
        assert new == pytest.approx(float(p.value) / lmbda, rel=1e-11, abs=1e-15)
        assert (abs(own - new) > 0.01) == (measure is not None)
        if law == "saint-venant":
            np.testing.assert_allclose(after - before, (new - own) / 2 * np.eye(2), atol=1e-14)
        else:
            ratio = (np.eye(2) + 2 * after) / (np.eye(2) + 2 * before)
            np.testing.assert_allclose(ratio, np.exp(new - own), rtol=1e-12)


# Newton's method


def disturbed(law):
    body = body_of(block(nx=2, ny=2), mixed(law, fluid_fraction=0.3), tractions={"right": (1.0, 0.3)})
    state, rng = State(body), np.random.default_rng(3)
    state.u.x.array[:] = affine(body.space, H) + 0.01 * rng.uniform(-1, 1, len(state.u.x.array))
    state.pressure.values[:] = rng.uniform(-5, 5, len(state.pressure.values))
    return body, state, rng


def block_residual(solver, x):
    x_vector, b = solver._saddle.vector(), solver._saddle.vector()
    x_vector.setArray(x)
    solver._residual(solver._snes, x_vector, b)
    return b.getArray().copy()


@pytest.mark.parametrize("law", LAW_NAMES)
def test_block_tangent_leaves_a_taylor_remainder_of_order_2_and_is_inverted_by_elimination(law):
    body, state, rng = disturbed(law)
    solver = Solver(body, state, 1.0)
    solver.amplitude.value = 1.0
    x = solver._unknowns()
    at_rest = block_residual(solver, x)
    held = np.unique(np.concatenate([bc.dof_indices()[0] for bc in body.bcs]))
    v = rng.uniform(-1, 1, len(x))
    v[held] = 0.0
    solver._tangent(solver._snes, None, None, None)
    operator = solver._saddle.operator
    direction, change, back = (solver._saddle.vector() for _ in range(3))
    direction.setArray(v)
    operator.mult(direction, change)
    linear = change.getArray().copy()
    sizes = 2e-3 * 0.5 ** np.arange(4)
    remainders = np.array([np.linalg.norm(block_residual(solver, x + e * v) - at_rest - e * linear) for e in sizes])
    assert np.all(np.abs(np.log2(remainders[:-1] / remainders[1:]) - 2.0) < 0.15)

    pc = solver._snes.getKSP().getPC()
    pc.setOperators(operator)
    pc.setUp()
    pc.apply(change, back)
    np.testing.assert_allclose(back.getArray(), v, rtol=1e-7, atol=1e-8)


def test_residual_turns_with_the_body():
    body, state, _ = disturbed("neo-hookean")
    solver = Solver(body, state, 1.0)
    x, n = solver._unknowns(), len(state.u.x.array)
    held = np.unique(np.concatenate([bc.dof_indices()[0] for bc in body.bcs]))
    free = np.setdiff1d(np.arange(n // 2), held // 2)
    before = block_residual(solver, x)
    Q = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    X = body.space.tabulate_dof_coordinates()[:, :2]
    state.u.x.array[:] = ((X + state.u.x.array.reshape(-1, 2)) @ Q.T - X).ravel()
    after = block_residual(solver, np.concatenate([state.u.x.array, x[n:]]))
    assert np.abs(before[n:]).max() > 1e-3
    np.testing.assert_allclose(after[n:], before[n:], atol=1e-12)
    forces = before[:n].reshape(-1, 2)[free] @ Q.T
    np.testing.assert_allclose(after[:n].reshape(-1, 2)[free], forces, atol=1e-11 * np.abs(forces).max())


def stretched(material, bubble, degree):
    """A block pulled at its right side, its left side held."""
    domain = block(2.0, 1.0, 4, 2)
    space = jit.displacement_space(domain.mesh, 2, bubble)
    bcs = [hold(space, domain, "left", k) for k in (0, 1)]
    pressure = None if degree is None else jit.pressure_space(domain.mesh, degree)
    body = Body(
        domain,
        material_fields(domain, {"solid": material}),
        space,
        tuple(bcs),
        tractions={"right": (2.0, 0.5)},
        pressure_space=pressure,
    )
    state = State(body)
    outcome = Solver(body, state, 2.0, tolerance=1e-11).solve(1.0)
    assert outcome.converged, outcome.reason
    return state, outcome


def test_quadratic_pressure_on_p2_is_p2_alone():
    """Which is how the locking study has P2 alone where P2's own Newton iteration finds no equilibrium."""
    plain, _ = stretched(solid(poisson=0.4), False, None)
    collocated, _ = stretched(mixed(poisson=0.4), False, 2)
    np.testing.assert_allclose(collocated.u.x.array, plain.u.x.array, atol=1e-10)
    other, _ = stretched(mixed(poisson=0.4), False, 0)
    assert np.abs(other.u.x.array - plain.u.x.array).max() > 1e-4


def test_iterations_of_newton_do_not_grow_as_nu_goes_to_a_half():
    """Those of a failed first attempt with full steps included."""
    near, nearer = (stretched(mixed(poisson=poisson), True, 1)[1].iterations for poisson in (0.499, 0.4999))
    assert 3 <= near <= 24
    assert abs(nearer - near) <= 3


def test_failed_solve_leaves_the_pressure_as_it_was():
    body = body_of(block(nx=2, ny=2), mixed(), tractions={"right": (-1e9, 0.0)})
    state = State(body)
    state.pressure.values[:] = 0.25
    assert not Solver(body, state, 1.0).solve(1.0).converged
    np.testing.assert_array_equal(state.pressure.values, 0.25)


# The element


def test_element_has_its_values_at_seven_nodes_and_its_bubble_inside():
    element = jit.displacement_space(block().mesh, 2, bubble=True).element
    nodes = np.asarray(element.interpolation_points())
    np.testing.assert_allclose(element.basix_element.tabulate(0, nodes)[0, :, :, 0], np.eye(7), atol=1e-12)
    x, y = np.random.default_rng(2).dirichlet([1, 1, 1], 20)[:, :2].T
    bubble = element.basix_element.tabulate(0, np.stack([x, y], axis=-1))[0, :, 6, 0]
    np.testing.assert_allclose(bubble, 27 * x * y * (1 - x - y), atol=1e-12)
    points = np.stack([x, y], axis=-1)  # the tables themselves: the compiled element may come from a cache
    legendre = basix.tabulate_polynomials(basix.PolynomialType.legendre, basix.CellType.triangle, 3, points)
    np.testing.assert_allclose(p2_bubble.coefficients()[6] @ legendre, x * y * (1 - x - y), atol=1e-12)


def dense(form, comm):
    matrix = fem.petsc.assemble_matrix(compile_form(form, comm))
    matrix.assemble()
    indptr, columns, values = matrix.getValuesCSR()
    return csr_matrix((values, columns, indptr), shape=matrix.getSize()).toarray()


def inf_sup(n, bubble):
    """The least of sup_w (q, div w)/(|w|_1 |q|_0) over pressures q of mean 0; w = 0 on the whole boundary."""
    domain = block(nx=n, ny=n)
    mesh, dx = domain.mesh, domain.dx(6)
    V, P = jit.displacement_space(mesh, 2, bubble), jit.pressure_space(mesh, 1)
    u, w, p, q = ufl.TrialFunction(V), ufl.TestFunction(V), ufl.TrialFunction(P), ufl.TestFunction(P)
    facets = np.concatenate([domain.facet_tags.find(k) for k in domain.facets.values()])
    held = fem.locate_dofs_topological(V, 1, facets)
    free = np.setdiff1d(np.arange(V.dofmap.index_map.size_local), held)
    free = np.sort(np.concatenate([2 * free, 2 * free + 1]))
    K = dense(ufl.inner(ufl.grad(u), ufl.grad(w)) * dx, mesh.comm)[np.ix_(free, free)]
    B = dense(q * ufl.div(u) * dx, mesh.comm)[:, free]
    values = scipy.linalg.eigvalsh(B @ np.linalg.solve(K, B.T), dense(p * q * dx, mesh.comm))
    assert abs(values[0]) < 1e-10  # the constant pressure
    return np.sqrt(max(values[1], 0.0))


def test_element_is_stable_and_without_its_bubble_it_is_not():
    stable = [inf_sup(n, True) for n in (2, 4, 8)]
    assert all(0.2 < value < 0.6 for value in stable), stable
    assert stable[2] > 0.8 * stable[1]
    assert inf_sup(4, False) < 1e-5
