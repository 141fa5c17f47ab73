"""From a scene to a body: units, signs, mirror images, what is meshed apart, what waits out of reach."""

import dataclasses
import gc
import math
import weakref
from contextlib import nullcontext

import numpy as np
import pytest
import ufl
from mpi4py import MPI

from cellmech.cell.driving import ramp
from cellmech.cell.layering import MeshPlan, mesh_plan, shells
from cellmech.cell.setup import Setup, material, obstacles_of, smeared_weights
from cellmech.errors import SolveError
from cellmech.fem.jit import PointValues
from cellmech.fem.subdivision import lattice
from cellmech.mechanics.laws import yeoh_in_plane
from cellmech.scene.files import read_scene
from cellmech.scene.parts import LAYER_NAMES
from cellmech.solver.ellipticity import StabilityWatch
from cellmech.solver.simulation import Simulation


def scene_of(**tables):
    return read_scene({"mesh": {"size_um": 6.0}, **tables}, "test")


def setup_of(scene, comm=MPI.COMM_SELF):
    return Setup(scene, comm, mesh_plan(scene))


def test_ramp_is_the_c2_step_of_eq_25_with_the_sign_of_the_text():
    """From 0 to 1 over 2 T_g, a half at T_g, no slope at either end."""
    amplitude = ramp(5000.0)
    assert [amplitude(t) for t in (0.0, 5000.0, 10000.0, 18000.0)] == [0.0, 0.5, 1.0, 1.0]
    assert amplitude(2500.0) == pytest.approx(0.25**3 * (10 - 15 * 0.25 + 6 * 0.25**2), rel=1e-14)
    assert amplitude(1.0) == pytest.approx(10 * 1e-4**3, rel=1e-3)
    assert 1 - amplitude(9999.0) == pytest.approx(10 * 1e-4**3, rel=1e-3)
    assert ramp(0.0)(0.0) == 1.0


def test_weight_is_that_of_the_cell_less_the_medium():
    """1000 kg/m3 x 9.81 m/s2 = 0.00981 Pa/um."""
    assert setup_of(scene_of()).force_density == pytest.approx(0.00981, rel=1e-12)
    assert setup_of(scene_of()).weight == pytest.approx(0.00981 * np.pi * 100, rel=1e-12)
    buoyant = setup_of(scene_of(cell={"medium_density_kg_m3": 900.0}, load={"factor": 2.0}))
    assert buoyant.force_density == pytest.approx(2 * 0.1 * 0.00981, rel=1e-12)
    w = buoyant.body.body_force
    assert (w[0], w[1]) == (0.0, -buoyant.force_density)


def test_half_cell_stands_on_both_pillars_of_a_pair():
    pillar = {"x_um": 7.0, "half_width_um": 3.0}
    half = obstacles_of(scene_of(pillar=[pillar]))
    whole = obstacles_of(scene_of(cell={"shape": "full"}, pillar=[pillar]))
    assert sorted(o.x_um for label, o in half.items() if label != "flat") == [-7.0, 7.0]
    assert [o.x_um for label, o in whole.items() if label != "flat"] == [7.0]
    on_axis = obstacles_of(scene_of(pillar=[{"x_um": 0.0}]))
    assert [label for label in on_axis] == ["pillar 0", "flat"]


def test_only_smeared_layers_are_meshed_as_one():
    alike = scene_of(layer={"membrane": {"young_Pa": 10.0}, "lamina": {"young_Pa": 10.0}})
    smeared = scene_of(cell={"layers": "smeared", "smear_um": 0.5})
    assert mesh_plan(smeared).merged == (("nucleoplasm", "lamina"), ("cytosol", "membrane"))
    assert mesh_plan(alike).merged == ()


def test_shells_are_the_thin_layers_each_as_stiff_beside_the_softest_as_it_is():
    """Table 1: 100 and 1000 Pa beside 10; equal solid shares cancel."""
    scene = scene_of(layer={"lamina": {"young_Pa": 1000.0}})
    assert shells(scene, mesh_plan(scene).interfaces(scene)) == pytest.approx({"lamina": 100.0, "membrane": 10.0})
    scene = scene_of(cell={"layers": "smeared", "smear_um": 0.36})
    found = shells(scene, mesh_plan(scene).interfaces(scene))
    assert len(found) > 4
    assert set(found.values()) == {100.0}


def test_fades_of_smeared_layers_are_some_rings_of_elements_wide():
    """Circles a quarter of the half-width apart from where a fade begins to where it ends; the nucleus has its own."""
    setup = setup_of(scene_of(cell={"layers": "smeared", "smear_um": 0.4}))
    names, radii = zip(*setup.interfaces, strict=True)
    assert radii == tuple(sorted(radii)) and names[names.index("nucleus") - 1] == f"nucleus {names.index('nucleus')}"
    np.testing.assert_allclose(radii[:5], [4.5, 4.6, 4.7, 4.8, 4.9], rtol=1e-12)
    assert dict(setup.interfaces)["nucleus"] == 5.0 and names[-1] == "cytoplasm"
    edges = np.array([4.5, *[r for r in radii if 4.5 < r <= 5.4]])
    assert np.diff(edges).max() < 0.4 / 4 * 1.6 and np.diff(radii).min() > 0.4 / 8
    groups = setup.layout().groups
    assert set(groups["nucleus"]) == {n for n in names if n.startswith("nucleus")} and set(groups["cell"]) == set(names)


def test_verdict_names_the_layer_not_the_ring():
    """Smeared layers are meshed in rings, each a group of its own."""
    setup = setup_of(scene_of(cell={"law": "saint-venant", "layers": "smeared", "smear_um": 0.5}))
    run = setup.create_run(lambda line: None)
    run.u[1::2] = -0.04 * run.body.space.tabulate_dof_coordinates()[:, 1] ** 2
    assert StabilityWatch(run.body, run.state.u).look_if_due().layer in ("nucleus", "cytoplasm")
    run.close()


def test_meshes_are_kept_by_their_communicator_and_end_with_it():
    first, scenes = MPI.COMM_SELF.Dup(), [scene_of(mesh={"size_um": size}) for size in (6.0, 6.5, 7.0, 7.5, 8.0)]
    domains = [setup_of(scene, first).domain for scene in scenes]
    assert setup_of(scenes[-1], first).domain is domains[-1]
    assert setup_of(scenes[0], first).domain is not domains[0]  # the last four are kept
    assert setup_of(scenes[-1]).domain is not domains[-1]
    gone = [weakref.ref(domain) for domain in domains]
    del domains
    first.Free()
    gc.collect()
    assert not any(domain() for domain in gone)


@pytest.mark.parametrize(("smear", "most"), [(0.01, 4), (0.04, 4), (0.1, 14), (0.5, 22)])
def test_a_thin_fade_takes_few_rings_or_none(smear, most):
    interfaces = MeshPlan().interfaces(scene_of(cell={"layers": "smeared", "smear_um": smear}))
    assert 4 <= len(interfaces) <= most


def test_smeared_weights_are_the_layers_and_sum_to_one():
    """Deep in a layer its weight is 1; where two meet each has a half."""
    scene = scene_of(cell={"layers": "smeared", "smear_um": 0.04})
    setup = setup_of(scene)
    weights = smeared_weights(scene, setup.domain, setup.centre)
    X = ufl.SpatialCoordinate(setup.domain.mesh)
    r = ufl.sqrt((X[0] - setup.centre[0]) ** 2 + (X[1] - setup.centre[1]) ** 2)
    points = np.array([(i / 12, j / 12) for j in range(13) for i in range(13 - j)])
    cells = np.arange(setup.number_of_cells, dtype=np.int32)
    values = PointValues(ufl.as_vector([r, *weights.values()]), points, setup.domain.mesh.comm)(cells).reshape(-1, 5)
    radius, weight = values[:, 0], dict(zip(weights, values[:, 1:].T, strict=True))
    np.testing.assert_allclose(sum(weight.values()), 1.0, rtol=0, atol=1e-12)
    inner = 0.0
    for name, outer in (("nucleoplasm", 4.9), ("lamina", 5.0), ("cytosol", 9.5), ("membrane", 10.0)):
        inside = (radius > inner + 0.04 * (inner > 0)) & (radius < outer - 0.04)
        outside = (radius < inner - 0.04) | (radius > outer + 0.04)
        assert inside.sum() > 10
        np.testing.assert_allclose(weight[name][inside], 1.0, rtol=0, atol=1e-12)
        np.testing.assert_allclose(weight[name][outside], 0.0, rtol=0, atol=1e-12)
        inner = outer


def test_pillar_that_the_cell_comes_to_pushes_as_if_modelled_from_the_start():
    """A lower pillar beside the one the cell stands on: left out at first, reached, put in; nothing may change."""
    pillars = [{"half_width_um": 3.0}, {"x_um": 8.0, "half_width_um": 3.0, "height_um": 8.5}]
    scene = scene_of(pillar=pillars, load={"factor": 8.0}, time={"history": False})
    setup, log = setup_of(scene), []
    assert len(setup.out_of_reach) >= 2
    waiting = setup.create_run(log.append)
    waiting.run(lambda step: None)
    assert sum("now in reach" in line for line in log) == 1
    body = dataclasses.replace(setup.body, obstacles=tuple(setup.obstacles.values()))
    ready = Simulation(body, setup.schedule(), setup.force_scale)
    ready.run(lambda step: None)
    beside = [o for label, o in setup.obstacles.items() if label == "pillar 1"]
    assert ready.outline.max_depth(ready.state.u, beside) > 0.01
    np.testing.assert_allclose(waiting.u, ready.u, rtol=0, atol=1e-7)


def test_quasi_static_cell_above_the_substrate_is_moved_to_first_touch():
    touching, above = setup_of(scene_of()), setup_of(scene_of(cell={"gap_um": 2.0}))
    falling = setup_of(scene_of(cell={"gap_um": 2.0, "inertia": True}))
    assert touching.lift_um == falling.lift_um == 0.0 and above.lift_um == 2.0
    np.testing.assert_allclose(above.centre, touching.centre, rtol=0, atol=1e-12)
    np.testing.assert_allclose(falling.centre, np.add(touching.centre, (0.0, 2.0)), rtol=0, atol=1e-12)
    assert touching.centre[1] == pytest.approx(9.5, abs=1e-12)
    assert above.layout().lift_um == 2.0


@pytest.mark.parametrize(
    ("cell", "why"),
    [
        ({"shape": "full", "centre_x_um": 12.0}, "slides"),
        ({"shape": "full", "centre_x_um": 12.0, "inertia": True}, ""),
        ({"shape": "full", "centre_x_um": 12.0, "medium_density_kg_m3": 1000.0}, ""),
        ({"shape": "full"}, ""),
        ({}, ""),
    ],
)
def test_scene_without_equilibrium_is_refused_with_the_reason(cell, why):
    setup = setup_of(scene_of(cell=cell))
    with pytest.raises(SolveError, match=f"^{why}: .*no equilibrium") if why else nullcontext():
        setup.refuse_without_equilibrium()


def test_plan_without_merged_layers_keeps_every_interface():
    names = [name for name, _ in MeshPlan().interfaces(scene_of())]
    assert names == ["nucleoplasm", "lamina", "cytosol", "membrane"]


def test_factor_of_the_moduli_is_that_of_every_layer():
    def numbers(**tables):
        run = setup_of(scene_of(time={"history": False}, mesh={"size_um": 8.0}, **tables)).create_run(lambda line: None)
        run.run(lambda step: None)
        return run.u.copy()

    young = {"membrane": 100.0, "cytosol": 10.0, "lamina": 1000.0, "nucleoplasm": 10.0}
    layers = {name: {"young_Pa": 0.25 * value} for name, value in young.items()}
    np.testing.assert_allclose(numbers(cell={"young_factor": 0.25}), numbers(layer=layers), rtol=0, atol=1e-12)
    assert scene_of(cell={"young_factor": 0.25}).relaxation_s == pytest.approx(4 * scene_of().relaxation_s, rel=1e-12)


def test_power_of_the_solid_share_is_that_of_every_layer():
    scene = scene_of(cell={"solid_exponent": 2.0}, layer={"lamina": {"fluid_fraction": 0.7}})
    shares = {name: material(scene, name).numbers()["solid_fraction"] for name in LAYER_NAMES}
    assert shares == pytest.approx({"membrane": 0.25, "cytosol": 0.25, "lamina": 0.09, "nucleoplasm": 0.25}, rel=1e-12)
    assert scene.layer_solid("lamina") == shares["lamina"]


@pytest.mark.parametrize(
    ("fade", "lamina", "membrane"),
    [
        ("centred", (4.6, 5.4), (9.1, 9.9)),
        ("inside", (4.2, 5.0), (8.7, 9.5)),
        ("outside", (5.0, 5.8), (9.5, 10.3)),
        ("squared", (math.sqrt(21.0), math.sqrt(29.0)), (math.sqrt(86.25), math.sqrt(94.25))),
    ],
)
def test_fades_begin_and_end_where_they_should(fade, lamina, membrane):
    """What lies inside an interface has weight 1 up to where its fade begins, and 0 from where it ends."""
    cell = {"layers": "smeared", "smear_um": 0.4, "fade": fade}
    setup = setup_of(scene_of(cell=cell, mesh={"size_um": 1.5, "grading": "uniform", "fade_rings": 0}))
    mesh, weights = setup.domain.mesh, smeared_weights(setup.scene, setup.domain, setup.centre)
    X = ufl.SpatialCoordinate(mesh)
    r = ufl.sqrt((X[0] - setup.centre[0]) ** 2 + (X[1] - setup.centre[1]) ** 2)
    inside = [weights["nucleoplasm"] + weights["lamina"], 1.0 - weights["membrane"]]
    cells = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32)
    points = lattice(8)[0]
    values = PointValues(ufl.as_vector([r, *inside]), points, MPI.COMM_SELF)(cells).reshape(-1, 3)
    for column, (begin, end) in ((1, lamina), (2, membrane)):
        before, beyond = values[:, 0] < begin - 1e-6, values[:, 0] > end + 1e-6
        within = (values[:, 0] > begin + 0.02) & (values[:, 0] < end - 0.02)
        assert np.allclose(values[before, column], 1.0, atol=1e-13) and before.any()
        assert np.allclose(values[beyond, column], 0.0, atol=1e-13) and (beyond.any() or end > 10.0)
        assert np.all((values[within, column] > 0.0) & (values[within, column] < 1.0)) and within.any()


def test_constants_of_a_law_are_the_layers_own_then_the_cells_then_the_laws():
    cell = {"law": "gent", "constants": {"i1_limit": 0.3}}
    layer = {
        "lamina": {"constants": {"i1_limit": 0.05}},
        "cytosol": {"law": "yeoh", "constants": {"beta_over_mu": 0.1}},
    }
    scene = scene_of(cell=cell, layer=layer)
    limits = {name: material(scene, name).constants.get("i1_limit") for name in LAYER_NAMES}
    assert limits == {"membrane": 0.3, "cytosol": None, "lamina": 0.05, "nucleoplasm": 0.3}
    own = material(scene, "cytosol").constants
    assert own["beta"] == pytest.approx(0.1 * scene.lame("cytosol")[1], rel=1e-15) and own["i1_rest"] == 3.0
    assert material(scene_of(cell={"law": "gent"}), "lamina").constants["i1_limit"] == 1.0
    printed = scene_of(cell={"law": "yeoh", "yeoh_reference": "printed", "beta_over_mu": 0.7})
    constants = material(printed, "lamina").constants
    assert constants["i1_rest"] == 0.0 and constants["beta"] == 0.7 * printed.lame("lamina")[1]


def test_smeared_layers_may_be_meshed_without_rings():
    cell = {"layers": "smeared", "smear_um": 0.4}
    assert [n for n, _ in setup_of(scene_of(cell=cell, mesh={"fade_rings": 0})).interfaces] == ["nucleus", "cytoplasm"]


@pytest.mark.parametrize(
    ("tables", "law", "rest"),
    [
        ({"trace": "in-plane"}, yeoh_in_plane, 3.0),
        ({"trace": "in-plane", "yeoh_reference": "printed"}, yeoh_in_plane, 0.0),
    ],
)
def test_in_plane_trace_leaves_yeohs_reference_alone(tables, law, rest):
    made = material(scene_of(cell={"law": "yeoh", **tables}), "cytosol")
    assert made.law is law and made.constants["i1_rest"] == rest
