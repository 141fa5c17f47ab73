"""Adhesion and contractile actin: their forces, their work, when they come on, what of them is refused."""

from dataclasses import replace

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from mpi4py import MPI
from problems import affine, block, displacement_space, domain_of, hold, moduli, solid
from pytest import approx
from scipy.integrate import quad
from scipy.optimize import brentq, fsolve

from cellmech.cell.driving import driven, ramp
from cellmech.cell.layering import mesh_plan
from cellmech.cell.setup import Setup, obstacles_of
from cellmech.errors import InputError
from cellmech.fem.coefficients import material_fields
from cellmech.fem.domain import build_domain
from cellmech.fem.jit import PointValues, compile_form
from cellmech.mechanics.balance import Body, equilibrium
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.contraction import Contraction
from cellmech.mechanics.drivers import Actin, Adhesion, Timeline
from cellmech.mechanics.kinematics import AXISYMMETRIC, PLANE_STRAIN, THREE_D, green_lagrange
from cellmech.mechanics.laws import LAWS
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.mechanics.sector import DIRECTIONS, Sector
from cellmech.mesh.ball import BallSpec
from cellmech.mesh.disc import TABLE_1, DiscSpec, Grading
from cellmech.runs.case import folds
from cellmech.scene.files import read_scene, scene_to_toml
from cellmech.solver.ellipticity import Ellipticity, StabilityWatch
from cellmech.solver.ellipticity_in_space import EllipticityInSpace
from cellmech.solver.energy_balance import Ledger, owned_values
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

FLAT = Flat(0.0)
WHOLE = ((("nucleus", 1.0), ("outer", 2.0)), 1.0)


def fully(amplitude):
    return 1.0


def round_body(kinematics, gap, drivers, size=0.4):
    """A disc, half of a turned one, or a quarter of a ball of radius 2 µm above the flat."""
    centre, layers = (0.0, 2.0 + gap), (("nucleus", 1.0), ("outer", 2.0))
    if kinematics is THREE_D:
        spec = BallSpec(centre=(*centre, 0.0), interfaces=layers, nucleus_radius_um=1.0, size_um=2 * size)
    else:
        spec = DiscSpec(centre=centre, interfaces=layers, nucleus_radius_um=1.0, size_um=size)
    domain = build_domain(spec, MPI.COMM_SELF)
    space = displacement_space(domain)
    fields = material_fields(domain, dict.fromkeys(("nucleus", "outer"), solid()))
    return Body(
        domain, fields, space, contact=Contact(), obstacles=(FLAT,), drivers=drivers, kinematics=kinematics,
        contact_degree=20,
    )  # fmt: skip


def pull_on(body, u=None):
    """Resultant of the body's only driver, of the modelled part."""
    u, w = u or fem.Function(body.space), ufl.TestFunction(body.space)
    (driver,) = body.drivers
    values = owned_values(compile_form(driver.work(body, u, w), MPI.COMM_SELF))
    return values.reshape(-1, body.kinematics.components).sum(axis=0)


def check_tangent(R, K, state):
    """The compiled tangent is symmetric, and the slope of the force along a step; the state stays where it was."""
    A = petsc.assemble_matrix(K)
    A.assemble()
    dense, step = A[:, :], np.random.default_rng(1).standard_normal(A.size[0])
    slope, start = dense @ step, state.u.x.array.copy()
    ends = []
    for side in (1e-6, -1e-6):
        state.u.x.array[:] = start + side * step
        ends.append(owned_values(R))
    state.u.x.array[:] = start
    assert (ends[0] - ends[1]) / 2e-6 == approx(slope, abs=1e-5 * np.abs(slope).max())
    assert np.abs(dense - dense.T).max() < 1e-9 * np.abs(dense).max()


class TestAdhesion:
    def test_work_to_part_the_surfaces_is_the_work_of_adhesion(self) -> None:
        adhesion = Adhesion(fully, 7.0, 0.4)
        assert quad(lambda gap: adhesion.pull_at(-gap), 0.0, 0.5, points=[0.4])[0] == approx(7.0, rel=1e-10)
        assert adhesion.pull_at(0.1) == adhesion.pull_at(-0.41) == 0.0
        assert adhesion.pull_at(-0.2) == approx(7.0 / 0.4 * 30 / 16)

    @pytest.mark.parametrize("obstacle", [FLAT, Pillar(0.5, -3.0, 2.0, 3.0, 4.0)])
    def test_potential_falls_by_the_work_from_beyond_the_range_to_touch(self, obstacle) -> None:
        domain = block()
        x = fem.Constant(domain.mesh, np.zeros(2))
        value = PointValues(Adhesion(fully, 7.0, 0.4).potential(x, obstacle), np.array([[0.3, 0.3]]), MPI.COMM_SELF)
        found = []
        for level in (1.0, 1e-9, -0.1):
            x.value = (0.4, level)
            found.append(float(value(np.array([0], dtype=np.int32)).ravel()[0]))
        assert found == approx([0.0, -7.0, -7.0], abs=1e-3)

    @pytest.mark.parametrize(("kinematics", "copies"), [(AXISYMMETRIC, 1), (THREE_D, 4)])
    def test_rigid_ball_in_touch_is_pulled_with_two_pi_r_w(self, kinematics, copies) -> None:
        """Derjaguin's sphere, exact here: the sphere's area between two levels is 2 pi R times their distance."""
        body = round_body(kinematics, 0.0, (Adhesion(fully, 7.0, 0.4),), size=0.2)
        force = pull_on(body) * copies
        assert force[1] == approx(-2 * np.pi * 2.0 * 7.0, rel=2e-3)

    def test_rigid_cylinder_is_pulled_with_the_sum_over_its_arc(self) -> None:
        adhesion = Adhesion(fully, 7.0, 0.4)
        body = round_body(PLANE_STRAIN, 0.1, (adhesion,), size=0.2)
        arc = quad(lambda angle: 2.0 * adhesion.pull_at(-(0.1 + 2.0 * (1 - np.cos(angle)))), 0.0, np.pi / 2, limit=200)
        assert pull_on(body)[1] == approx(-arc[0], rel=2e-3)

    def test_what_is_bare_or_below_the_level_does_not_pull(self) -> None:
        bare = round_body(AXISYMMETRIC, 0.0, (Adhesion(fully, 7.0, 0.4, bare=(FLAT,)),))
        u, w = fem.Function(bare.space), ufl.TestFunction(bare.space)
        assert bare.drivers[0].work(bare, u, w) is None
        printed = round_body(AXISYMMETRIC, 0.0, (Adhesion(fully, 7.0, 0.4, above_um=1.0),))
        assert np.abs(pull_on(printed)).max() < 1e-12

    def test_tangent_is_symmetric_and_that_of_the_force(self) -> None:
        """The potential is per reference area; actin's stress has one, too."""
        sector = Sector((0.0, 2.05), (0.5, None), (40.0, 160.0))
        drivers = (Adhesion(fully, 7.0, 0.4), Actin(fully, 3.0, sector, "meridional"))
        body = round_body(AXISYMMETRIC, 0.05, drivers, size=1.0)
        state = State(body)
        shares = [fem.Constant(body.domain.mesh, value) for value in (0.8, 0.6)]
        R, K = (compile_form(form, MPI.COMM_SELF) for form in equilibrium(body, state, 1.0, shares))
        state.u.x.array[:] = affine(body.space, [[0.03, 0.01], [0.02, -0.04]])
        check_tangent(R, K, state)  # contact along the obstacle's normal is unsymmetric, and out of touch here


class TestActin:
    @pytest.mark.parametrize("law", ["saint-venant", "neo-hookean"])
    def test_free_bundle_contracts_as_its_law_says(self, law) -> None:
        """No stress is left: along the bundle the solid's is -T, across none (plane strain)."""
        young, poisson, stress = 10.0, 0.3, 2.5
        domain = block()
        space = displacement_space(domain)
        bcs = (hold(space, domain, "left", 0), hold(space, domain, "bottom", 1))
        actin = Actin(fully, stress, Sector((-50.0, 0.0)), "x")
        body = Body(
            domain, material_fields(domain, {"solid": solid(law, young, poisson)}), space, bcs, drivers=(actin,)
        )
        state = State(body)
        assert Solver(body, state, 1.0).solve(1.0).converged
        constants = moduli(law, young, poisson)
        lmbda, mu = constants["lmbda"], constants["mu"]

        def second_piola(E):
            along, across = E
            if law == "saint-venant":
                trace = lmbda * (along + across)
                return np.array([trace + 2 * mu * along, trace + 2 * mu * across])
            c = 1 + 2 * np.array([along, across])
            return mu * (1 - 1 / c) + lmbda * 0.5 * np.log(np.prod(c)) / c

        E = fsolve(lambda E: second_piola(E) - np.array([-stress, 0.0]), [-0.1, 0.05], xtol=1e-13)
        stretches = np.sqrt(1 + 2 * E)
        expected = affine(space, np.diag(stretches - 1))
        assert state.u.x.array == approx(expected, abs=1e-8)
        assert stretches[0] < 0.9

    @pytest.mark.parametrize(("kinematics", "ways"), [(PLANE_STRAIN, 1), (AXISYMMETRIC, 2), (THREE_D, 2)])
    def test_contractile_shell_presses_as_laplace_says(self, kinematics, ways) -> None:
        """A ball of one material whose outer shell, a < r < b, contracts with T in its tangent plane; small strains.

        Equilibrium is (lambda + 2 mu)(u'' + m u'/r - m u/r^2) = m T/r, m = 1 in the plane, 2 in space, with the
        particular solution m T r ln r/((m + 1)(lambda + 2 mu)); inside u = A r. In the limit of a thin shell the
        pressure inside is m T (b - a)/b: Laplace's law.
        """
        T, a, b, m = 1e-5, 1.0, 2.0, ways
        constants = moduli("neo-hookean", 10.0, 0.3)
        lmbda, mu = constants["lmbda"], constants["mu"]
        P, c = lmbda + 2 * mu, m * T / ((m + 1) * (lmbda + 2 * mu))
        # unknowns A, B, C: u = B r + C/r^m + c r ln r in the shell
        rows = [
            [a, -a, -(a**-m)],
            [P + m * lmbda, -(P + m * lmbda), m * (P - lmbda) * a ** (-m - 1)],
            [0.0, P + m * lmbda, -m * (P - lmbda) * b ** (-m - 1)],
        ]
        particular = lambda r: P * c * (np.log(r) + 1) + m * lmbda * c * np.log(r)  # noqa: E731
        A, _, _ = np.linalg.solve(rows, [c * a * np.log(a), particular(a), -particular(b)])
        shell = Sector((0.0, 5.0), names=("outer",))
        sector = shell if kinematics is not THREE_D else Sector((0.0, 5.0, 0.0), names=("outer",))
        body = round_body(kinematics, 3.0, (Actin(fully, T, sector),), size=0.6)
        body = Body(
            **{
                **{f: getattr(body, f) for f in body.__dataclass_fields__},
                "bcs": held(body),
                "obstacles": (),
                "body_force": (0.0,) * body.kinematics.components,
            }
        )
        state = State(body)
        assert Solver(body, state, T).solve(1.0).converged
        place = body.space.tabulate_dof_coordinates()[:, : body.kinematics.components]
        from_centre = place - np.array(sector.centre)
        inside = np.linalg.norm(from_centre, axis=1) < 0.9
        u = state.u.x.array.reshape(from_centre.shape)
        rise = u[np.argmin(np.linalg.norm(from_centre, axis=1))]
        assert u[inside] - rise == approx(A * from_centre[inside], abs=0.01 * abs(A))
        assert A < 0

    @pytest.mark.parametrize("direction", DIRECTIONS)
    def test_structural_tensor_is_of_unit_directions(self, direction) -> None:
        body = round_body(THREE_D, 0.0, (), size=1.0)
        actin = Actin(fully, 1.0, Sector((0.0, 2.0, 0.0)), direction)
        values = PointValues(actin.stress(body), np.array([[0.2, 0.3, 0.1]]), MPI.COMM_SELF)
        H = values(np.arange(20, dtype=np.int32)).reshape(-1, 3, 3)
        ways = 2 if direction == "tangential" else 1
        assert np.trace(H, axis1=1, axis2=2) == approx(ways)
        assert np.einsum("nij,njk->nik", H, H) == approx(H, abs=1e-9)

    def test_sector_is_where_it_is_said_to_be(self) -> None:
        domain = domain_of(block(4.0, 4.0, 8, 8).mesh)
        sector = Sector((2.0, 2.0), (0.5, 1.5), (0.0, 60.0), 0.05, 0.05)
        X = ufl.SpatialCoordinate(domain.mesh)
        values = PointValues(ufl.as_vector([*X, sector.inside(X)]), np.array([[0.3, 0.3]]), MPI.COMM_SELF)
        x, y, inside = values(np.arange(128, dtype=np.int32)).reshape(-1, 3).T
        r, angle = np.hypot(x - 2, y - 2), np.degrees(np.arccos((y - 2) / np.hypot(x - 2, y - 2)))
        expected = (r > 0.5) & (r < 1.5) & (angle < 60.0)
        clear = (np.abs(r - 0.5) > 0.06) & (np.abs(r - 1.5) > 0.06) & (np.abs(angle - 60.0) > 8.0)
        np.testing.assert_allclose(inside[clear], expected[clear], atol=1e-12)
        assert expected[clear].any()


def contracting(domain, e, sector=None, kinematics=PLANE_STRAIN, **more):
    """A contraction of the whole body along x, or of a sector."""
    sector = sector or Sector((-50.0, 0.0))
    more = {"direction": "x", **more}
    return Contraction(lambda progress: progress, e, sector, domain.constant(0.0), kinematics, **more)


def bundle(e, law="neo-hookean", held=("left",), nx=1, **more):
    """A block held at these sides along x, and at its bottom across, that contracts by e; and its state."""
    domain = block(nx=nx)
    space = displacement_space(domain)
    bcs = (*(hold(space, domain, side, 0) for side in held), hold(space, domain, "bottom", 1))
    one = contracting(domain, e, **more)
    fields = material_fields(domain, {"solid": solid(law, 10.0, 0.3)}, None, [one])
    body = Body(domain, fields, space, bcs, drivers=(one,))
    return body, State(body)


def largest(body, value):
    """Largest entry of a UFL expression at the middle of the first cells."""
    return np.abs(PointValues(value, np.array([[0.3, 0.3]]), MPI.COMM_SELF)(np.arange(2, dtype=np.int32))).max()


class TestContraction:
    @pytest.mark.parametrize("law", ["saint-venant", "neo-hookean", "yeoh"])
    def test_free_bundle_is_as_long_as_its_rest_and_free_of_stress(self, law, ladder) -> None:
        """At every stiffness; Saint-Venant's law, which is lost in a compression by a tenth, is that of rest."""
        body, state = bundle(0.6, law, stiffness_factor=10.0)
        for share in (0.25, 0.5, 0.75, 1.0):
            assert Solver(body, state, 1.0).solve(share).converged
        assert state.u.x.array == approx(affine(body.space, np.diag([-0.6, 0.0])), abs=1e-9)
        ladder(f"free bundle, active strain, {law}: stretch", ours=1 + state.u.x.array.min(), reference=0.4, rel=1e-8)
        (material,) = body.materials
        E = green_lagrange(state.u, PLANE_STRAIN)
        assert largest(body, material.solid(E)[1]) < 1e-6
        assert Ellipticity(body, state.u).find().margin == approx(1.0, abs=1e-8)
        assert EllipticityInSpace(body, state.u).find().margin == approx(1.0, abs=1e-8)

    @pytest.mark.parametrize("law", ["saint-venant", "neo-hookean"])
    def test_held_bundle_pulls_as_its_law_stretched_from_the_shorter_rest(self, law, ladder) -> None:
        """Free across, plane strain: S_11 = k S_law,11(E_e)/lambda_a, E_e,11 = (lambda_a^-2 - 1)/2."""
        e, k = 0.3, 4.0
        body, state = bundle(e, law, held=("left", "right"), stiffness_factor=k)
        assert Solver(body, state, 1.0).solve(1.0).converged
        constants = moduli(law, 10.0, 0.3)
        lmbda, mu = constants["lmbda"], constants["mu"]
        rest = 1 - e
        along = (rest**-2 - 1) / 2

        def of_law(across):
            if law == "saint-venant":
                trace = lmbda * (along + across)
                return np.array([trace + 2 * mu * along, trace + 2 * mu * across])
            c = 1 + 2 * np.array([along, across])
            return mu * (1 - 1 / c) + lmbda * 0.5 * np.log(np.prod(c)) / c

        across = brentq(lambda value: of_law(value)[1], -0.4, 0.1, xtol=1e-14)
        pull = k * rest * of_law(across)[0] / rest**2
        (material,) = body.materials
        E = green_lagrange(state.u, PLANE_STRAIN)
        S = PointValues(material.solid(E)[1], np.array([[0.3, 0.3]]), MPI.COMM_SELF)(np.zeros(1, np.int32)).reshape(
            3, 3
        )
        ladder(f"held bundle, active strain, {law}: S", ours=S[0, 0], reference=pull, rel=1e-8, unit="Pa")
        assert abs(S[1, 1]) < 1e-6 * pull
        # the waves are those of the law at E_e, per modulus of the law at rest, however stiff the bundle is
        elastic, stretched = bundle(1e-9, law)
        stretched.u.x.array[:] = affine(elastic.space, np.diag([1 / rest - 1, np.sqrt(1 + 2 * across) - 1]))
        for look in (Ellipticity, EllipticityInSpace):
            assert look(body, state.u).find().margin == approx(look(elastic, stretched.u).find().margin, rel=1e-6)

    def test_watch_sees_what_is_stretched_at_rest(self) -> None:
        """A bundle held at both ends does not deform along, and its law is stretched all the same."""
        body, state = bundle(0.6, "yeoh", held=("left", "right"))
        watch = StabilityWatch(body, state.u)
        assert watch.look_if_due() is None
        body.contract(1.0)
        found = watch.look_if_due()
        assert found is not None and found.lost

    @pytest.mark.parametrize(
        ("kinematics", "direction"),
        [
            (PLANE_STRAIN, "tangential"),
            (AXISYMMETRIC, "tangential"),
            (AXISYMMETRIC, "meridional"),
            (THREE_D, "tangential"),
        ],
    )
    def test_tangent_is_symmetric_and_that_of_the_force(self, kinematics, direction) -> None:
        body = round_body(kinematics, 3.0, (), size=1.0)
        space = kinematics is THREE_D
        sector = Sector((0.0, 5.0, 0.0) if space else (0.0, 5.0), (0.5, None), (40.0, 160.0))
        one = contracting(body.domain, 0.4, sector, kinematics, direction=direction, stiffness_factor=3.0)
        materials = material_fields(body.domain, dict.fromkeys(("nucleus", "outer"), solid()), None, [one])
        body = replace(
            body, materials=materials, drivers=(one,), obstacles=(), body_force=(0.0,) * kinematics.components
        )
        state = State(body)
        body.contract(0.8)
        R, K = (compile_form(form, MPI.COMM_SELF) for form in equilibrium(body, state, 1.0, [1.0]))
        H = np.array([[0.03, 0.01, 0.0], [0.02, -0.04, 0.01], [0.0, 0.02, 0.03]])[: 2 + space, : 2 + space]
        state.u.x.array[:] = affine(body.space, H)
        check_tangent(R, K, state)
        # and the force is the slope of the stored energy, its power that of the energy by the contraction
        ledger, e = Ledger(body, state), 1e-5
        energies = []
        for side in (e, -e):
            one.now.value = 0.32 + side
            energies.append(ledger._store())
        assert ledger._acting("actin", 0.8).sum() == approx((energies[0] - energies[1]) / (2 * e), rel=1e-6)

    @pytest.mark.parametrize("at_once", [False, True])
    def test_work_of_a_contraction_is_what_is_stored(self, at_once) -> None:
        """Half of a bundle contracts and stretches the other half; nothing else takes or gives energy."""
        half = Sector((0.0, 0.0), (0.0, 0.5), fade_um=0.1)
        body, state = bundle(0.3, held=("left", "right"), nx=6, sector=half, stiffness_factor=2.0)
        ledger, solver = Ledger(body, state), Solver(body, state, 1.0)
        ledger.begin(1.0 if at_once else 0.0)
        for k in () if at_once else range(1, 9):
            assert solver.solve(k / 8).converged
            ledger.add_step(k / 8, 1.0)
            state.advance((1.0, -1.0, 0.0), False)
        assert ledger.works["actin"] == approx(ledger.stored(), rel=1e-12 if at_once else 2e-3)
        assert ledger.stored() > 0.01


def held(body):
    """No displacement across the axis or the planes of symmetry, and none at the bottom."""
    planes = {"axis": 0, "symmetry x": 0, "symmetry z": 2}
    found = [hold(body.space, body.domain, group, k) for group, k in planes.items() if group in body.domain.facets]
    V = body.space.sub(1)
    low = body.space.tabulate_dof_coordinates()[:, 1].argmin()
    return (*found, fem.dirichletbc(np.float64(0.0), np.array([low * body.kinematics.components + 1], np.int32), V))


class TestTimeline:
    def test_one_ramp_is_its_own_progress(self) -> None:
        line = Timeline([ramp(5.0)], 10.0)
        assert [line.progress(t) for t in (0.0, 5.0, 10.0)] == [0.0, 0.5, 1.0]
        assert line.share(0)(0.3) == approx(0.3, rel=1e-12)

    def test_drivers_come_in_the_order_of_their_times(self) -> None:
        line = Timeline([ramp(5.0), ramp(2.0, 20.0)], 30.0)
        first, second = line.share(0), line.share(1)
        assert (first(0.25), second(0.25)) == approx((0.5, 0.0), abs=1e-12)
        assert (first(0.75), second(0.75)) == approx((1.0, 0.5), abs=1e-12)
        for t in (1.0, 7.0, 21.0, 23.0, 30.0):
            assert first(line.progress(t)) == approx(ramp(5.0)(t), abs=1e-12)
            assert second(line.progress(t)) == approx(ramp(2.0, 20.0)(t), abs=1e-12)

    def test_what_is_there_at_once_is_put_on_in_proportion(self) -> None:
        line = Timeline([ramp(0.0), ramp(5.0)], 10.0)
        assert line.progress(0.0) == 0.5
        assert (line.share(0)(0.25), line.share(1)(0.25)) == (0.5, 0.0)


def scene_with(**tables):
    return read_scene({"mesh": {"size_um": 6.0}, **tables}, "test")


class TestScene:
    def test_without_drivers_the_body_is_what_it_was(self) -> None:
        scene = scene_with()
        setup = Setup(scene, MPI.COMM_SELF, mesh_plan(scene))
        assert setup.body.drivers == () and setup.body.drag is None and setup.body.dead(0.3) == 0.3
        assert setup.body.amplitude(4000.0) == ramp(5000.0)(4000.0)
        assert not {"adhesion", "actin", "medium"} & set(scene_to_toml(scene).split())

    def test_scene_goes_out_and_in(self) -> None:
        scene = scene_with(
            adhesion={"on": ["flat"], "above_um": -1.0},
            actin=[{"where": "cap"}, {"where": "sector", "radii_um": [1.0, 2.0]}, {"contraction": 0.2}],
            medium={"viscosity_Pa_s": 1.0},
        )
        text = scene_to_toml(scene)
        import tomllib

        assert read_scene(tomllib.loads(text), "again") == scene
        assert text.count("[[actin]]") == 3

    def test_load_may_begin_after_the_adhesion_and_lift(self) -> None:
        for lifting in ({"load": {"factor": -2.0}}, {"cell": {"medium_density_kg_m3": 3000.0}}):
            load = {"start_s": 8000.0, "half_ramp_s": 1000.0} | lifting.get("load", {})
            tables = {"adhesion": {"half_ramp_s": 4000.0}} | lifting | {"load": load}
            scene = scene_with(**tables)
            setup = Setup(scene, MPI.COMM_SELF, mesh_plan(scene))
            assert scene.ramp_end_s == 10000.0 and setup.weight < 0 < setup.body.body_force[1]
            whole = setup.body.amplitude(8000.0)
            assert setup.body.dead(whole) == approx(0.0, abs=1e-12) and setup.body.drivers[0].share(whole) == approx(
                1.0
            )
            assert setup.body.dead(setup.body.amplitude(9000.0)) == approx(0.5)

    def test_equal_parts_of_actin_are_two_drivers(self) -> None:
        """With forces and works of their own: neither takes the other's place in the books."""
        scene = scene_with(actin=[{"where": "cap"}, {"where": "cap"}, {"stress_Pa": 0.0}])
        assert [name for name, _ in scene.drivers] == ["actin_0", "actin_1"]
        assert [one.name for one in driven(scene, (0.0, 9.5), {}, ())["drivers"]] == ["actin_0", "actin_1"]

    def test_mesh_has_an_interface_wherever_actin_ends(self) -> None:
        """None of a cap is in the lamina. Smeared layers have no interfaces, and there it fades in and out."""
        places = [
            {"where": "cap"},
            {"where": "basal"},
            {"where": "cortex"},
            {"where": "sector", "radii_um": [5.5, 6.0]},
        ]
        scene = scene_with(actin=places)
        interfaces = mesh_plan(scene).interfaces(scene)
        assert [rim for name, rim in interfaces if name.startswith("cytosol")] == [5.5, 6.0, 9.5]
        cap, basal, cortex, own = (one.sector for one in driven(scene, (0.0, 9.5), {}, interfaces)["drivers"])
        assert cap.names == ("cytosol 1", "cytosol 2") and basal.names == (*cap.names, "cytosol")
        assert cortex.names == ("membrane",) and own.names == ("cytosol 2",)
        assert {one.radii_um for one in (cap, basal, cortex, own)} == {(None, None)}
        smeared = [one.sector for one in driven(scene, (0.0, 9.5), {}, ())["drivers"]]
        assert smeared[0].names is None and smeared[0].radii_um == (5.0, 6.0)
        assert mesh_plan(scene_with()).interfaces(scene_with()) == TABLE_1

    def test_nucleus_is_meshed_finely_wherever_actin_pulls_at_it(self) -> None:
        """A cap's largest strains were five times too large on elements meant for a back that nothing pulls at."""
        for place, fine in (("cap", True), ("basal", False), ("cortex", False)):
            grading = mesh_plan(scene_with(actin=[{"where": place}])).grading
            assert (grading.back == grading.outline) == fine and (grading == Grading()) != fine

    def test_actin_pulls_by_a_stress_unless_it_contracts(self) -> None:
        (cap, cortex) = scene_with(actin=[{"where": "cap"}, {"contraction": 0.2, "stiffness_factor": 3.0}]).actin
        assert (cap.pull_Pa, cortex.pull_Pa) == (100.0, 0.0)
        assert cap.told == "100 Pa" and cortex.told == "shorter by 0.2 where free and 3 times as stiff"

    def test_cortex_alone_contracts_where_it_is_meshed_apart(self) -> None:
        """By the groups of cells that hold it: all other layers keep their material."""
        scene = scene_with(actin=[{"contraction": 0.2}])
        body = Setup(scene, MPI.COMM_SELF, mesh_plan(scene)).body
        holds = {name: bool(m.contractions) for m in body.materials for name in m.names}
        assert {name for name, held in holds.items() if held} == {n for n in holds if n.startswith("membrane")}
        assert len(body.contracting) == 1 and body.pulling == ()

    def test_pillars_or_the_flat_may_be_bare(self) -> None:
        scene = scene_with(adhesion={"on": ["pillar"]})
        obstacles = obstacles_of(scene)
        (adhesion,) = driven(scene, (0.0, 9.5), obstacles, ())["drivers"]
        assert adhesion.bare == (obstacles["flat"],)

    def test_obstacle_within_the_range_is_modelled_from_the_start(self) -> None:
        pillars = [{"half_width_um": 2.0}, {"x_um": 4.0, "half_width_um": 1.5, "height_um": 9.3}]
        for tables, reached in (({}, 1), ({"adhesion": {"range_um": 1.5}}, 3)):
            scene = scene_with(pillar=pillars, **tables)
            setup = Setup(scene, MPI.COMM_SELF, mesh_plan(scene))
            assert len(setup.body.obstacles) == reached

    @pytest.mark.parametrize(
        ("tables", "key", "told"),
        [
            ({"adhesion": {"range_um": 6.0}}, "adhesion.range_um", "must be <= half of the cell's radius, 5 µm"),
            ({"adhesion": {"on": []}}, "adhesion.on", "must name pillar, flat or both"),
            ({"adhesion": {"on": ["flat"]}, "flat": False}, "adhesion.on", "must name an obstacle that the scene has"),
            (
                {"adhesion": {"range_um": 0.1}, "mesh": {"contact_size_um": 0.2}},
                "mesh.contact_size_um",
                "must be <= adhesion.range_um = 0.1 µm",
            ),
            ({"actin": [{"where": "sector"}]}, "actin.0.radii_um", "must be set"),
            ({"actin": [{"contraction": 0.2, "stress_Pa": 5.0}]}, "actin.0.stress_Pa", "must be left out beside"),
            ({"actin": [{"contraction": 1.0}]}, "actin.0.contraction", "<= 0.95"),
            ({"actin": [{"stiffness_factor": 2.0}]}, "actin.0.stiffness_factor", "needs a contraction"),
            (
                {"actin": [{"contraction": 0.2}], "mesh": {"order": 2, "pressure": "mixed"}},
                "actin.0.contraction",
                "needs a scene without the pressure as an unknown",
            ),
            (
                {"actin": [{"contraction": 0.2}], "cell": {"poisson": 0.48}},
                "actin.0.contraction",
                "without the pressure",
            ),
            ({"actin": [{"radii_um": [3.0, 2.0]}]}, "actin.0.radii_um", "must rise"),
            ({"actin": [{"radii_um": [12.0, 13.0]}]}, "actin.0.radii_um", "must begin inside the cell"),
            ({"actin": [{"angles_deg": [0.0, 200.0]}]}, "actin.0.angles_deg", "180"),
        ],
    )
    def test_what_makes_no_sense_is_refused(self, tables, key, told) -> None:
        with pytest.raises(InputError) as caught:
            scene_with(**tables)
        assert caught.value.key == key and told in caught.value.rule

    def test_works_of_drivers_are_booked(self) -> None:
        """A bundle at rest that contracts freely: what its actin does is what it stores."""
        domain = block()
        space = displacement_space(domain)
        bcs = (hold(space, domain, "left", 0), hold(space, domain, "bottom", 1))
        actin = Actin(lambda share: share, 0.02, Sector((-50.0, 0.0)), "x")
        body = Body(domain, material_fields(domain, {"solid": solid()}), space, bcs, drivers=(actin,))
        state = State(body)
        ledger, solver = Ledger(body, state), Solver(body, state, 1.0)
        for k in range(1, 9):
            assert solver.solve(k / 8).converged
            ledger.add_step(k / 8, 1.0)
            state.advance((1.0, -1.0, 0.0), False)
        assert ledger.works["actin"] == approx(ledger.stored(), rel=1e-3)
        assert ledger.numbers()["actin"] == ledger.works["actin"] and LAWS

    def test_membrane_that_folds_is_told_of(self) -> None:
        """Where it is squeezed to half of a length a wider range may lead elsewhere."""
        sticks = scene_with(adhesion={})
        assert "squeezed to 0.37 of a length" in folds(sticks, 0.37)
        assert folds(sticks, 0.7) == folds(sticks, None) == folds(scene_with(), 0.37) == ""
