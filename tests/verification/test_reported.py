"""Reported numbers of states that are known: put into the mesh, not solved for, and worked out by hand beside it."""

from dataclasses import replace

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from problems import affine, displacement_space, layered_disc, moduli, solid, wet
from scipy.special import ellipe
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from cellmech.cell.observables import Layout, Observer, Ring, point_fields
from cellmech.fem.coefficients import material_fields
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.results.field_files import write_fields
from cellmech.results.records import CaseFolder, flatten
from cellmech.runs.case import mesh_plan, solve_case
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene
from cellmech.scene.scene import Scene
from cellmech.solver.principal import ENTRIES, principal_stretches
from cellmech.solver.schedule import Schedule
from cellmech.solver.simulation import Simulation

CENTRE = (0.0, 9.5)
RADII = {"nucleoplasm": 4.9, "lamina": 5.0, "cytosol": 9.5, "membrane": 10.0}
FLUID = {"fluid_lambda": 40.0, "fluid_mu": 7.0}
SOLIDS = {"nucleoplasm": (10.0, 0.3), "lamina": (1000.0, 0.6), "cytosol": (12.0, 0.5), "membrane": (100.0, 0.2)}
LAW = {name: "saint-venant" if name == "lamina" else "neo-hookean" for name in RADII}
PILLAR = Pillar(0.0, -10.0, 10.0, 9.5)
MERGED_YOUNG = {"nucleus": 1000.0, "cytoplasm": 10.0}
STEP_S = 0.5
FIELDS_OF_PRESSURE = ("pressure_Pa", "pressure_gradient_Pa_per_um")


def observer_of(shape="half", apart=True, obstacles=(), contact=None, order=2):
    """An observer of a layered disc at rest, every layer with its own solid and fluid, or two merged ones."""
    interfaces = tuple(RADII.items()) if apart else (("nucleus", 5.0), ("cytoplasm", 10.0))
    domain = layered_disc(shape=shape, centre=CENTRE, interfaces=interfaces, size_um=3.0)
    space = displacement_space(domain, order)
    materials = (
        {name: wet(LAW[name], young, fluid_fraction=share, **FLUID) for name, (young, share) in SOLIDS.items()}
        if apart
        else {name: solid(young=MERGED_YOUNG[name]) for name, _ in interfaces}
    )
    body = Body(domain, material_fields(domain, materials), space, contact=contact, obstacles=obstacles)
    inner = dict(zip(RADII, (0.0, *RADII.values()), strict=False))
    regions = {name: Ring(inner[name], outer) for name, outer in RADII.items()}
    regions |= {"nucleus": Ring(0.0, 5.0), "cell": Ring(0.0, 10.0)}
    names = tuple(name for name, _ in interfaces)
    groups = {name: (name,) for name in names} | {"cell": names, "nucleus": names[: len(names) // 2]}
    run = Simulation(replace(body, obstacles=()), Schedule(1.0), 1.0)
    run.body = body  # obstacles at once, without the search for first touch
    half = shape == "half"
    return Observer(run, Layout(CENTRE, (0,) if half else (), 2 if half else 1, regions, groups, (PILLAR,)))


@pytest.fixture(scope="module")
def observers():
    return {shape: observer_of(shape) for shape in ("half", "full")} | {"third order": observer_of(order=3)}


def deform(observer, F, F_before=None):
    """Put the homogeneous deformation F about the centre into the state; it was F_before a step ago."""
    state, space = observer.run.state, observer.run.body.space
    for function, gradient in ((state.u, F), (state.u_n, F if F_before is None else F_before)):
        H = np.asarray(gradient) - np.eye(2)
        function.x.array[:] = affine(space, H, -H @ np.array(CENTRE))
    state.ddt.set((1 / STEP_S, -1 / STEP_S, 0.0))
    return observer.observe(1.0)


def in_space(a, a_zz):
    whole = np.zeros((3, 3))
    whole[:2, :2], whole[2, 2] = a, a_zz
    return whole


def stress_by_hand(name, F, F_before):
    """The mixture's Cauchy stress in three dimensions (eqs 17, 18, 23) [Pa]."""
    young, share = SOLIDS[name]
    constants = moduli(LAW[name], young, 0.3)
    lmbda, mu = constants["lmbda"], constants["mu"]
    F, before = in_space(F, 1.0), in_space(F_before, 1.0)
    C, J, one = F.T @ F, np.linalg.det(F), np.eye(3)
    C_inv, C_dot = np.linalg.inv(C), (C - before.T @ before) / STEP_S
    if LAW[name] == "saint-venant":
        S = lmbda * np.trace(C - one) / 2 * one + mu * (C - one)
    else:
        S = mu * (one - C_inv) + lmbda * np.log(J) * C_inv
    volumetric = FLUID["fluid_lambda"] / 2 * np.trace(C_inv @ C_dot) * C_inv
    S_f = J * (volumetric + FLUID["fluid_mu"] * C_inv @ C_dot @ C_inv)
    return F @ ((1 - share) * S + share * S_f) @ F.T / J


def mises_by_hand(name, F, F_before):
    """Its von Mises norm [Pa]."""
    sigma = stress_by_hand(name, F, F_before)
    deviator = sigma - np.trace(sigma) / 3 * np.eye(3)
    return np.sqrt(1.5 * np.sum(deviator**2))


SHEARED, BEFORE = np.array([[1.15, 0.0], [0.2, 0.85]]), np.array([[1.05, 0.0], [0.12, 0.96]])


@pytest.mark.parametrize("which", ["half", "third order"])
def test_stress_of_a_homogeneous_state_is_the_one_by_hand_in_every_layer(observers, which):
    """The lamina's is some fifty times its neighbours': an average over an interface would show."""
    result = deform(observers[which], SHEARED, BEFORE)
    expected = {name: mises_by_hand(name, SHEARED, BEFORE) for name in RADII}
    assert expected["lamina"] > 20 * expected["nucleoplasm"] > 0.1
    for name, value in expected.items():
        for kind in ("max", "mean"):
            assert result[name][f"sigma_mises_{kind}_Pa"] == pytest.approx(value, rel=1e-10), (name, kind)
    assert result["cell"]["sigma_mises_max_Pa"] == pytest.approx(expected["lamina"], rel=1e-10)
    share = (5.0**2 - 4.9**2) / 5.0**2
    mean = share * expected["lamina"] + (1 - share) * expected["nucleoplasm"]
    assert result["nucleus"]["sigma_mises_mean_Pa"] == pytest.approx(mean, rel=1e-3)


@pytest.mark.parametrize(("which", "triangles"), [("half", 1), ("third order", 4)])
def test_pressure_is_minus_a_third_of_the_trace_of_the_stress(observers, which, triangles):
    observer = observers[which]
    deform(observer, SHEARED, BEFORE)
    fields = point_fields(observer)
    tags, body = np.repeat(observer.samples.groups, triangles), observer.run.body
    for name in RADII:
        expected = -np.trace(stress_by_hand(name, SHEARED, BEFORE)) / 3
        pressure, gradient = (fields[key][tags == body.domain.cells[name]] for key in FIELDS_OF_PRESSURE)
        np.testing.assert_allclose(pressure, expected, rtol=1e-9)
        np.testing.assert_allclose(gradient, 0, atol=1e-7 * abs(expected))


def test_strains_of_a_homogeneous_state_are_those_of_c(observers):
    result = deform(observers["full"], [[1.1, 0.3], [-0.1, 0.9]])
    F = np.array([[1.1, 0.3], [-0.1, 0.9]])
    C, stretches = F.T @ F, np.linalg.svd(F, compute_uv=False)
    for name in ("nucleus", "lamina", "membrane", "cell"):
        for quantity, value in (("J1", np.trace(C)), ("J2", np.trace(C @ C)), ("J3", np.linalg.det(C))):
            assert result[name][f"{quantity}_max"] == pytest.approx(value, rel=1e-11)
            assert result[name][f"{quantity}_mean"] == pytest.approx(value, rel=1e-11)
        assert result[name]["det_F_min"] == pytest.approx(np.sqrt(np.linalg.det(C)), rel=1e-11)
        assert result[name]["principal_stretch_min"] == pytest.approx(min(stretches), rel=1e-11)
        assert result[name]["principal_stretch_max"] == pytest.approx(max(stretches), rel=1e-11)


def test_principal_stretches_in_space_are_the_singular_values_of_f():
    F = np.eye(3) + 0.3 * np.random.default_rng(0).uniform(-1, 1, (5, 3, 3))
    E = (np.swapaxes(F, 1, 2) @ F - np.eye(3)) / 2
    expected = np.linalg.svd(F, compute_uv=False)
    found = principal_stretches(np.stack([E[:, i, j] for i, j in ENTRIES], axis=-1))
    np.testing.assert_allclose(found, expected[:, [2, 0]], rtol=1e-12)


@pytest.mark.parametrize("shape", ["half", "full"])
def test_areas_are_of_the_whole_cell_at_rest(observers, shape):
    result = deform(observers[shape], np.diag([1.3, 0.9]))
    inner = dict(zip(RADII, (0.0, *RADII.values()), strict=False))
    for name, outer in RADII.items():
        assert result[name]["area_um2"] == pytest.approx(np.pi * (outer**2 - inner[name] ** 2), rel=2e-3)


def bend(observer, rate=0.02):
    """u = (0, rate (y - y_c)^2): F = diag(1, 1 + 2 rate (y - y_c)), largest at the top."""
    state, space = observer.run.state, observer.run.body.space
    y = space.tabulate_dof_coordinates()[:, 1] - CENTRE[1]
    for function in (state.u, state.u_n, state.u_nn):
        function.x.array[0::2], function.x.array[1::2] = 0.0, rate * y**2
    return observer.observe(1.0)


def test_means_are_over_the_reference_area(observers):
    """Against plain integrals of tr C and det C, on the deformed area 4 % larger; and against a^2 r^2 by hand."""
    result, observer = bend(observers["half"]), observers["half"]
    body, u = observer.run.body, observer.run.state.u
    F = ufl.Identity(2) + ufl.grad(u)
    C = F.T * F
    for region, groups in (("nucleus", ("nucleoplasm", "lamina")), ("cytosol", ("cytosol",)), ("cell", tuple(RADII))):
        dx = body.domain.dx(body.bulk_degree, groups)
        one = fem.Constant(body.domain.mesh, 1.0)
        area, trace, det, stretched = (
            fem.assemble_scalar(compile_form(q * dx, body.domain.mesh.comm))
            for q in (one, ufl.tr(C), ufl.det(C), ufl.tr(C) * ufl.det(F))
        )
        size = fem.assemble_scalar(compile_form(ufl.det(F) * dx, body.domain.mesh.comm))
        assert abs(stretched / size - trace / area) > 0.01 * (trace / area - 2)
        assert result[region]["J1_mean"] == pytest.approx(trace / area, rel=1e-10)
        assert result[region]["J3_mean"] == pytest.approx(det / area, rel=1e-10)
    # mean of (1 + 2 a y)^2 over a disc of radius r: 1 + a^2 r^2
    assert result["nucleus"]["J1_mean"] - 2 == pytest.approx((0.02 * 5) ** 2, rel=1e-3)
    assert result["cell"]["J1_mean"] - 2 == pytest.approx((0.02 * 10) ** 2, rel=2e-3)


@pytest.mark.parametrize("apart", [True, False], ids=["meshed apart", "rings"])
def test_percentile_of_stress_is_of_the_area(apart, monkeypatch):
    """A stress of r^2: 1 % of a ring's area is outside of a^2 + 0.99 (b^2 - a^2); one row of elements is coarser."""
    observer = observer_of(apart=apart)
    for samples in filter(None, (observer.samples, observer._fine)):
        r = np.linalg.norm(samples.position - np.array(CENTRE), axis=-1)
        monkeypatch.setattr(samples, "update", lambda values=samples.values, r=r: np.copyto(values[..., 0], r**2))
    result = observer.observe(1.0)
    for name, ring in observer.layout.regions.items():
        inner, outer = ring.inner_um**2, ring.outer_um**2
        share = (result[name]["sigma_mises_p99_Pa"] - inner) / (outer - inner)
        assert share == pytest.approx(0.99, abs=0.09 if name in ("lamina", "membrane") else 0.015), name


@pytest.mark.parametrize("which", ["half", "third order"])
def test_maxima_are_found_at_the_nodes_where_they_are(observers, which):
    result = bend(observers[which])
    for region, radius in (("nucleoplasm", 4.9), ("nucleus", 5.0), ("cytosol", 9.5), ("membrane", 10.0)):
        row, stretch = result[region], 1 + 2 * 0.02 * radius
        x, y = row["J1_max_at_um"]
        assert abs(x) < 1e-9  # on the axis, where there are nodes but no quadrature points
        assert y == pytest.approx(CENTRE[1] + radius, abs=0.06)  # curved elements interpolate u: next node at most
        assert row["J1_max"] - 2 == pytest.approx(stretch**2 - 1, rel=1e-2)
        assert row["J3_max"] - 1 == pytest.approx(stretch**2 - 1, rel=1e-2)
    assert result["cell"]["det_F_min"] == pytest.approx(1 - 2 * 0.02 * 10, rel=1e-2)


def test_maximum_over_time_keeps_the_largest_and_its_time():
    observer = observer_of()
    for t, stretch in ((1.0, 1.1), (2.0, 1.3), (3.0, 1.2)):
        H = np.diag([stretch - 1, 0.0])
        observer.run.state.u.x.array[:] = affine(observer.run.body.space, H)
        row = observer.observe(t)["nucleus"]
        assert row["J1_max"] == pytest.approx(stretch**2 + 1, rel=1e-11)
    assert row["J1_max_over_time"] == pytest.approx(1.3**2 + 1, rel=1e-11)
    assert row["J1_max_time_s"] == 2.0


def test_layers_that_are_not_meshed_apart_are_reported_by_their_rings():
    observer = observer_of(apart=False)
    result = bend(observer)
    assert result["lamina"]["area_um2"] == pytest.approx(np.pi * (5.0**2 - 4.9**2), rel=1e-12)
    assert result["membrane"]["area_um2"] == pytest.approx(np.pi * (10.0**2 - 9.5**2), rel=1e-12)
    for region, outer in (("nucleoplasm", 4.9), ("lamina", 5.0), ("cytosol", 9.5)):
        stretch = 1 + 2 * 0.02 * outer
        assert result[region]["J1_max"] - 2 == pytest.approx(stretch**2 - 1, rel=0.02)
        x, y = result[region]["J1_max_at_um"]
        assert np.hypot(x, y - CENTRE[1]) <= outer * (1 + 1e-6)


def test_stress_of_a_ring_is_of_its_own_side_of_the_nucleus_outline():
    """A point on the outline belongs to elements of both sides, a hundred times as stiff on one."""
    result = deform(observer_of(apart=False), SHEARED)
    nucleus, cytosol = (result[name]["sigma_mises_mean_Pa"] for name in ("nucleus", "cytosol"))
    assert nucleus == pytest.approx(100 * cytosol, rel=1e-9)
    for name in ("nucleoplasm", "lamina", "cytosol", "membrane"):
        expected = nucleus if name in ("nucleoplasm", "lamina") else cytosol
        for kind in ("max", "mean"):
            assert result[name][f"sigma_mises_{kind}_Pa"] == pytest.approx(expected, rel=1e-9), (name, kind)


@pytest.mark.parametrize("shape", ["half", "full", "third order"])
def test_shape_index_of_a_stretched_nucleus_is_that_of_an_ellipse(observers, shape):
    a, b = 5.0 * 1.25, 5.0 * 0.8
    result = deform(observers[shape], np.diag([1.25, 0.8]))
    area, length = np.pi * a * b, 4 * a * ellipe(1 - (b / a) ** 2)
    index = result["shape_index"]
    assert index["full"] == pytest.approx(4 * np.pi * area / length**2, rel=2e-5)
    assert index["half_outline"] == pytest.approx(4 * np.pi * (area / 2) / (length / 2 + 2 * b) ** 2, rel=2e-5)
    assert index["half_area_full_perimeter"] == pytest.approx(index["full"] / 2, rel=1e-12)
    # the pillar's top is at -0.5
    assert result["lamina_pillar_distance_um"] == pytest.approx(CENTRE[1] - b + 0.5, rel=1e-9)


def test_shares_of_a_homogeneous_state(observers):
    """The nucleus is a quarter of the cell's area; a uniform strain is shared by area, its maxima are equal."""
    result = deform(observers["half"], np.diag([1.1, 0.95]))
    J1 = 1.1**2 + 0.95**2
    assert result["share_of_area_percent"]["J1"] == pytest.approx(25 * J1, rel=1e-3)
    assert result["share_of_max"]["J1"] == pytest.approx(1.0, rel=1e-10)
    assert result["share_of_integral"]["J1"] == pytest.approx(0.25, rel=1e-3)


@pytest.mark.parametrize("shape", ["half", "full"])
def test_contact_of_a_sunken_disc_is_that_of_its_chord(shape):
    """A rigid disc 0.4 deep in a flat: the chord's half-length, the depth of its lowest point, the law's pressure."""
    deep = 0.4
    observer = observer_of(shape, obstacles=(Flat(CENTRE[1] - 10.0 + deep),), contact=Contact("surface", 50.0, 0.1))
    observer.run.ledger.rebind(observer.run.body, observer.run.state)
    contact = observer.observe(1.0)["contact"]
    assert contact["half_width_um"] == pytest.approx(np.sqrt(2 * 10.0 * deep - deep**2), rel=1e-3)
    assert contact["max_depth_um"] == pytest.approx(deep, rel=1e-9)
    assert contact["max_pressure_Pa"] == pytest.approx(50.0 * (deep - 0.05), rel=1e-9)
    # int kappa (d - s/2) over the chord; the arc is a little longer, and d < s beside its ends
    angle = np.arccos(1 - deep / 10.0)
    segment, chord = 100.0 * (angle - np.sin(angle) * np.cos(angle)), 2 * 10.0 * np.sin(angle)
    assert contact["force_Pa_x_um"] == pytest.approx(50.0 * (segment - 0.05 * chord), rel=0.03)


def test_energies_are_of_the_whole_cell_and_balance(observers, monkeypatch):
    ledger = observers["half"].run.ledger
    monkeypatch.setattr(ledger, "works", {"load": 9.0, "viscous": 1.0, "contact": -0.25})
    energy = deform(observers["half"], SHEARED)["energy"]
    assert [energy[name] for name in ("gravity_work", "dissipated", "contact_work")] == [18.0, 2.0, 0.5]
    assert energy["stored"] == pytest.approx(2 * ledger.stored(), rel=1e-12)
    assert energy["balance_error"] == pytest.approx(18.0 - 2.0 - 0.5 - energy["stored"], rel=1e-12)


@pytest.mark.parametrize(("which", "triangles"), [("half", 1), ("third order", 4)])
def test_field_file_has_every_element_as_it_is(observers, tmp_path, which, triangles):
    """Read back by VTK: middle nodes lie between their ends, displacement and stress at each point are those there.

    An element of third order is four triangles, which cover it.
    """
    observer = observers[which]
    deform(observer, SHEARED, BEFORE)
    folder = CaseFolder(tmp_path / "case", MPI.COMM_SELF)
    write_fields(folder, Scene.model_validate({"output": {"whole_cell": False}}), observer, 7.0, [])
    folder.close()
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "case" / "fields_0000.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    X = vtk_to_numpy(grid.GetPoints().GetData())[:, :2].reshape(-1, 6, 2)
    data = {name: vtk_to_numpy(grid.GetPointData().GetArray(name)) for name in ("displacement_um", "sigma_mises_Pa")}
    layer, r = vtk_to_numpy(grid.GetCellData().GetArray("layer")), np.linalg.norm(X - CENTRE, axis=-1).mean(axis=1)
    assert len(X) == triangles * observer.run.body.domain.mesh.topology.index_map(2).size_local
    sides = X[:, [1, 2]] - X[:, :1]
    assert np.abs(np.linalg.det(sides)).sum() / 2 == pytest.approx(np.pi * 100 / 2, rel=0.02)  # a straight one's
    for middle, (a, b) in zip((3, 4, 5), ((0, 1), (1, 2), (2, 0)), strict=True):  # of VTK's quadratic triangle
        edge = np.linalg.norm(X[:, a] - X[:, b], axis=-1)
        assert np.all(np.linalg.norm(X[:, middle] - (X[:, a] + X[:, b]) / 2, axis=-1) < 0.1 * edge)
    u = (X - CENTRE) @ (SHEARED - np.eye(2)).T
    np.testing.assert_allclose(data["displacement_um"].reshape(-1, 6, 3)[..., :2], u, rtol=0, atol=1e-9)
    for code, (name, outer) in enumerate(RADII.items()):
        inner = (0.0, *RADII.values())[code]
        assert np.all((r[layer == code] > inner) & (r[layer == code] < outer))
        mises = data["sigma_mises_Pa"].reshape(-1, 6)[layer == code]
        np.testing.assert_allclose(mises, mises_by_hand(name, SHEARED, BEFORE), rtol=1e-9)


def end_state(folder, shape, scene=None):
    scene = scene or {"cell": {"shape": shape}, "mesh": {"size_um": 4.0}, "time": {"history": False}}
    case = Case(shape, read_scene(scene, "test"))
    files = CaseFolder(folder / shape, MPI.COMM_SELF)
    result = solve_case(case, files, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)
    files.close()
    assert result["status"] == "solved", result["reason"]
    return result


def test_smeared_layers_are_resolved_on_the_mesh_as_it_comes(tmp_path):
    """Where a fade lay inside one element, the nucleoplasm's J1 - 2 beside the lamina came out three times as large."""
    scene = {"cell": {"layers": "smeared", "smear_um": 0.5}, "time": {"history": False}}
    coarse, fine = (end_state(tmp_path, "half", scene | {"mesh": {"size_um": size}}) for size in (2.4, 1.2))
    for key in ("J1_max", "J3_max", "sigma_mises_max_Pa", "sigma_mises_mean_Pa"):
        rest = {"J1": 2.0, "J3": 1.0}.get(key[:2], 0.0)
        assert coarse["nucleoplasm"][key] - rest == pytest.approx(fine["nucleoplasm"][key] - rest, rel=0.02), key


def test_half_cell_reports_what_the_full_one_does(tmp_path):
    """The full mesh is the half one and its mirror image; the force is the weight, 0.00981 Pa/um times pi 100 um^2."""
    half, full = end_state(tmp_path, "half"), end_state(tmp_path, "full")
    assert half["contact"]["weight_Pa_x_um"] == pytest.approx(0.00981 * np.pi * 100, rel=2e-3)
    assert half["contact"]["force_Pa_x_um"] == pytest.approx(half["contact"]["weight_Pa_x_um"], rel=1e-6)
    assert full["dofs"] > 1.9 * half["dofs"]
    regions = (*RADII, "nucleus", "cell", "shape_index", "contact", "energy", "share_of_area_percent")
    here, there = (flatten({name: result[name] for name in regions}) for result in (half, full))
    for key in here:
        if "_at_um" in key or "lateral" in key or key.endswith("balance_error"):
            continue  # a maximum may be the mirror image's; round-off
        known = None if here[key] is None else pytest.approx(here[key], rel=1e-6, abs=1e-9)
        assert there[key] == known, key
