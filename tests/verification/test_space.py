"""Bodies in space: patch, order of convergence, tangent, and scenes that must agree with one another."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dmesh
from dolfinx.fem import petsc
from mpi4py import MPI
from problems import affine, displacement_space, domain_of, moduli, prescribe, solid, wet

from cellmech.cell import cascade
from cellmech.fem.coefficients import material_fields
from cellmech.fem.domain import build_domain
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body, equilibrium, internal_work, stored_energy
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.kinematics import THREE_D
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.mechanics.pillars import RoundPillar, SquarePillar
from cellmech.mesh.ball import BallSpec
from cellmech.runs.library import solve
from cellmech.scene.files import read_scene
from cellmech.solver import bdf
from cellmech.solver.newton import TOLERANCE, Solver
from cellmech.solver.state import State

YOUNG, POISSON = 10.0, 0.3
H = np.array([[0.1, 0.2, -0.1], [-0.1, -0.15, 0.05], [0.05, 0.1, 0.15]])


def cube(n):
    """The unit cube in 6 n^3 tetrahedra; contact acts on its bottom, "outer"."""
    mesh = dmesh.create_unit_cube(MPI.COMM_SELF, n, n, n)
    mesh.topology.create_connectivity(2, 3)
    cells = {"solid": lambda x: np.full(x.shape[1], True)}
    rest = {"sides": lambda x: np.any(np.isclose(x, 0.0) | np.isclose(x, 1.0), axis=0)}
    return domain_of(mesh, cells, rest | {"outer": lambda x: np.isclose(x[1], 0.0)})


def test_curved_layered_ball_reproduces_an_affine_displacement(ladder):
    domain = build_domain(BallSpec(size_um=6.0), MPI.COMM_SELF)
    space = displacement_space(domain)
    exact = fem.Function(space)
    exact.x.array[:] = affine(space, H, (0.3, -0.2, 0.1))
    sides = ("outer", "symmetry x", "symmetry z")
    materials = material_fields(domain, dict.fromkeys(domain.cells, solid("mooney-rivlin", YOUNG, POISSON)))
    body = Body(
        domain, materials, space, (prescribe(space, domain, sides, exact),), (0.0, 0.0, 0.0), kinematics=THREE_D
    )
    state = State(body)
    state.u.x.array[:] = exact.x.array + 1e-3 * np.random.default_rng(3).uniform(-1, 1, len(exact.x.array))
    outcome = Solver(body, state, 10.0, tolerance=1e-13).solve(1.0)
    assert outcome.converged and outcome.iterations > 0, outcome.reason
    ladder("patch in space: displacement", ours=state.u.x.array, reference=exact.x.array, abs=1e-10)


def chosen(x, sin, cos):
    """A displacement whose gradient reaches some 0.4."""
    return [
        0.15 * sin(1.5 * x[1]) + 0.1 * x[0] * x[2],
        0.12 * cos(1.5 * x[0]) - 0.05 * x[1] ** 2 + 0.1 * x[2] ** 2,
        0.1 * sin(1.2 * x[0] + x[1]),
    ]


def manufactured_errors(n):
    """L2 and H1 errors on the cube; P is the neo-Hookean solid's, mu (F - F^-T) + lambda ln J F^-T (eq. 18)."""
    domain = cube(n)
    X = ufl.SpatialCoordinate(domain.mesh)
    u = ufl.as_vector(chosen(X, ufl.sin, ufl.cos))
    F = ufl.Identity(3) + ufl.grad(u)
    constants = moduli("neo-hookean", YOUNG, POISSON)
    P = constants["mu"] * F + (constants["lmbda"] * ufl.ln(ufl.det(F)) - constants["mu"]) * ufl.inv(F).T
    space = displacement_space(domain)
    boundary = fem.Function(space)
    boundary.x.array[:] = np.stack(chosen(space.tabulate_dof_coordinates().T, np.sin, np.cos), axis=1).ravel()
    held = (prescribe(space, domain, ("sides", "outer"), boundary),)
    materials = material_fields(domain, {"solid": solid("neo-hookean", YOUNG, POISSON)})
    body = Body(domain, materials, space, held, body_force=-ufl.div(P), kinematics=THREE_D)
    state = State(body)
    state.u.x.array[:] = boundary.x.array
    outcome = Solver(body, state, YOUNG, tolerance=1e-12).solve(1.0)
    assert outcome.converged, outcome.reason
    gap = state.u - u
    norms = ufl.inner(gap, gap), ufl.inner(ufl.grad(gap), ufl.grad(gap))
    return [np.sqrt(fem.assemble_scalar(compile_form(m * domain.dx(6), domain.mesh.comm))) for m in norms]


def test_p2_on_tetrahedra_converges_with_order_3_in_l2_and_2_in_h1(ladder):
    found = np.array([manufactured_errors(n) for n in (2, 4, 8)])
    for norm, order, column in zip(("L2", "H1"), (3.0, 2.0), found.T, strict=True):
        ladder.order(f"manufactured, tetrahedra P2: {norm}", column, order, 0.2)


@pytest.mark.parametrize("form", ["surface", "conservative", "volume"])
def test_energy_and_tangent_in_space_are_derivatives(form, ladder):
    """Of a wet block that leans on pillars of every kind and the flat, with inertia."""
    domain = cube(2)
    space, mesh = displacement_space(domain), domain.mesh
    obstacles = (
        Flat(0.05),
        RoundPillar(0.3, -1.0, 0.4, 1.0, 1.1, 4.0),
        SquarePillar(0.8, -1.0, 0.7, 1.0, 1.1, 5.0),
        Pillar(0.5, -1.0, 1.5, 1.05, 4.0),
    )
    contact = Contact(form, fem.Constant(mesh, 20.0), fem.Constant(mesh, 0.2))
    material = wet("yeoh", YOUNG, POISSON, fluid_lambda=4.0, fluid_mu=2.0)
    materials = material_fields(domain, {"solid": material})
    load = {"body_force": (0.1, -0.5, 0.2), "density": 0.3}
    body = Body(domain, materials, space, contact=contact, obstacles=obstacles, kinematics=THREE_D, **load)
    state, rng = State(body), np.random.default_rng(4)
    for k, function in enumerate((state.u, state.u_n, state.u_nn)):
        shake = 0.005 * rng.uniform(-1, 1, len(function.x.array))
        function.x.array[:] = affine(space, (1 - 0.3 * k) * H, (0.0, -0.02, 0.0)) + shake
    state.ddt.set(bdf.coefficients([0.4, 0.3]))
    u, v = state.u.x.array.copy(), rng.uniform(-1, 1, len(state.u.x.array))

    def difference(value, h):
        values = []
        for step in (h, -h, 2 * h, -2 * h):
            state.u.x.array[:] = u + step * v
            values.append(value())
        state.u.x.array[:] = u
        return (8 * (values[0] - values[1]) - (values[2] - values[3])) / (12 * h)

    energy = compile_form(stored_energy(body, state), mesh.comm)
    work = petsc.assemble_vector(compile_form(internal_work(body, state, ufl.TestFunction(space)), mesh.comm))
    ours = difference(lambda: fem.assemble_scalar(energy), 2e-5)
    ladder(f"space, {form}: energy differentiated", ours=ours, reference=work.getArray() @ v, rel=1e-7, unit="aJ")
    R, K = (compile_form(f, mesh.comm) for f in equilibrium(body, state, fem.Constant(mesh, 0.7)))
    tangent = petsc.assemble_matrix(K)
    tangent.assemble()
    direction = tangent.createVecRight()
    direction.setArray(v)
    change = (tangent * direction).getArray()
    ours, size = difference(lambda: petsc.assemble_vector(R).getArray().copy(), 1e-5), np.abs(change).max()
    ladder(f"space, {form}: residual differentiated", ours=ours / size, reference=change / size, abs=1e-7)


# Scenes


def end_state(tmp_path, name, **tables):
    """Of a cell whose layers are smeared, so that few elements mesh it; solved."""
    cell = {"layers": "smeared", "smear_um": 1.0, "geometry": "3d", **tables.pop("cell", {})}
    mesh = {"size_um": 5.0, "order": 2, "fade_rings": 0, **tables.pop("mesh", {})}
    scene = read_scene({"cell": cell, "time": {"history": False}, "mesh": mesh, **tables}, name)
    found = solve(scene, tmp_path / name)
    assert not found.failure, found.failure
    return found.result


def alike(one, other, rel):
    for key in ("sigma_mises_mean_Pa", "sigma_mises_max_Pa", "J2_max"):
        for region in ("nucleus", "cell"):
            assert one[region][key] == pytest.approx(other[region][key], rel=rel), (region, key)
    assert one["contact"]["force_pN"] == pytest.approx(other["contact"]["force_pN"], rel=1e-6)
    assert one["contact"]["max_depth_um"] == pytest.approx(other["contact"]["max_depth_um"], rel=rel)
    assert one["shape_index"]["full"] == pytest.approx(other["shape_index"]["full"], rel=rel)
    assert one["energy"]["stored"] == pytest.approx(other["energy"]["stored"], rel=rel)


def test_quarter_half_and_full_ball_agree(tmp_path):
    """The half's and the full ball's meshes are mirror images of the quarter's: the same equations."""
    coarse = {"size_um": 9.0}
    quarter, half, full = (
        end_state(tmp_path, shape, cell={"shape": shape}, mesh=coarse) for shape in ("quarter", "half", "full")
    )
    alike(half, quarter, 1e-6)
    alike(full, quarter, 1e-6)
    assert quarter["dofs"] < 0.6 * half["dofs"] < 0.4 * full["dofs"]


def test_ball_is_the_turned_disc(tmp_path):
    ball = end_state(tmp_path, "ball", mesh={"size_um": 4.0, "contact_size_um": 0.3})
    disc = end_state(tmp_path, "disc", cell={"geometry": "axisymmetric", "shape": "half"}, mesh={"size_um": 1.5})
    for region in ("nucleus", "cell"):
        for key in ("sigma_mises_mean_Pa", "J1_mean", "J3_mean", "volume_um3"):
            assert ball[region][key] == pytest.approx(disc[region][key], rel=0.01), (region, key)
    assert ball["contact"]["max_depth_um"] == pytest.approx(disc["contact"]["max_depth_um"], rel=0.02)
    assert ball["energy"]["stored"] == pytest.approx(disc["energy"]["stored"], rel=0.01)


@pytest.mark.by_hand
def test_lattice_turned_by_90_degrees_gives_the_same_numbers(tmp_path):
    """A row of two pillars along x, and along z. The mesh does not turn: at 5 µm the largest stress differs by 12 %."""

    def pillars(axis):
        place = {"y_um": -10.0, "half_width_um": 2.5, "height_um": 5.0, "profile": "square", axis: 4.0}
        return [place]

    quarter, fine = {"shape": "quarter"}, {"size_um": 3.0}
    along_x, along_z = (
        end_state(tmp_path, axis, cell=quarter, mesh=fine, pillar=pillars(axis)) for axis in ("x_um", "z_um")
    )
    for key in ("sigma_mises_mean_Pa", "sigma_mises_max_Pa", "J1_mean"):
        assert along_x["cell"][key] == pytest.approx(along_z["cell"][key], rel=0.03), key
    x, _, z = along_x["cell"]["sigma_mises_max_at_um"]
    assert x > z  # towards the pillars


def guessed(tmp_path, monkeypatch, told, **mesh):
    """Newton iterations without and with a first guess, which changes no number."""
    plain = end_state(tmp_path, "plain", mesh=mesh)
    monkeypatch.setattr(cascade, "UNKNOWNS", plain["dofs"] / (1.5 * cascade.WORTH))
    near = end_state(tmp_path, "near", mesh=mesh)
    assert told in (tmp_path / "near" / "run.log").read_text(encoding="utf-8")
    assert "first guess" not in (tmp_path / "plain" / "run.log").read_text(encoding="utf-8")
    alike(near, plain, 1e-6)
    return plain["newton_iterations"], near["newton_iterations"]


def test_second_order_is_a_first_guess_of_third_that_saves_iterations(tmp_path, monkeypatch):
    """On the same mesh, where nothing is looked up at places, which would take one rank alone; and only roughly."""
    go_far, left = cascade._go_far, []

    def watched(run):
        share = go_far(run)
        left.append(run.solver.solve(1.0).iterations)  # to the same tolerance none is left to make
        run.solver._tolerance = TOLERANCE
        left.append(run.solver.solve(1.0).iterations)
        return share

    monkeypatch.setattr(cascade, "_carried_over", None)
    monkeypatch.setattr(cascade, "_go_far", watched)
    plain, near = guessed(tmp_path, monkeypatch, "unknowns (second order)", size_um=6.0, order=3)
    assert near < 0.7 * plain
    assert left[0] == 0 < left[1]


def test_first_guess_that_leads_half_the_way_is_where_the_load_is_followed_from(tmp_path, monkeypatch):
    def half(run):
        assert run.solve(0.5).converged
        return 0.5

    monkeypatch.setattr(cascade, "_go_far", half)
    guessed(tmp_path, monkeypatch, "unknowns at 0.5 of the load (second order)", size_um=9.0, order=3)


def test_no_equilibrium_with_fewer_unknowns_gives_no_first_guess(tmp_path, monkeypatch):
    monkeypatch.setattr(cascade, "_go_far", lambda run: 0.0)
    guessed(tmp_path, monkeypatch, "find no equilibrium", size_um=9.0, order=3)


@pytest.mark.by_hand
def test_first_guess_of_a_coarser_mesh_changes_no_number(tmp_path, monkeypatch):
    """It may cost iterations, here 25 for 11; on the cell of Table 1 with 98,637 unknowns they are 6 for 29."""
    guessed(tmp_path, monkeypatch, "(mesh.size_um = ", size_um=3.0)


def test_mesh_that_cannot_be_much_coarser_gives_no_first_guess(tmp_path, monkeypatch):
    monkeypatch.setattr(cascade, "UNKNOWNS", 1)
    found = end_state(tmp_path, "coarse", mesh={"size_um": 6.0})
    assert found["status"] == "solved"
    assert "first guess" not in (tmp_path / "coarse" / "run.log").read_text(encoding="utf-8")
