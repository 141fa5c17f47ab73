"""The three geometries: gradients, weights, sizes; what a scene becomes in each; what is refused."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI
from problems import affine, block, displacement_space, value_at

from cellmech.cell.footing import BEARS, feet, modulus_of
from cellmech.cell.layering import mesh_plan
from cellmech.cell.meshing import mean_curvature
from cellmech.cell.observables import Observer, Ring
from cellmech.cell.setup import Setup, obstacles_of
from cellmech.errors import InputError
from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body
from cellmech.mechanics.kinematics import AXISYMMETRIC, GEOMETRIES, PLANE_STRAIN, THREE_D, deformation_gradient
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.mechanics.pillars import RoundPillar
from cellmech.scene.files import read_scene
from cellmech.solver.resolution import stretches


def scene_of(**tables):
    return read_scene({"mesh": {"size_um": 6.0}, "time": {"history": False}, **tables}, "test")


def turned(**tables):
    return scene_of(cell={"geometry": "axisymmetric", **tables.pop("cell", {})}, **tables)


def setup_of(scene):
    return Setup(scene, MPI.COMM_SELF, mesh_plan(scene))


def test_turned_block_stretches_around_its_axis():
    """u = (0.2 r + 0.1 y + 0.05, …): F33 = 1 + u_r/r."""
    domain = block()
    u = fem.Function(displacement_space(domain, 1))
    u.x.array[:] = affine(u.function_space, [[0.2, 0.1], [0.3, -0.1]], (0.05, 0.0))
    F = deformation_gradient(u, AXISYMMETRIC)
    x, y = value_at(ufl.SpatialCoordinate(domain.mesh), domain)
    got = value_at(ufl.as_vector([F[i, j] for i in range(3) for j in range(3)]), domain).reshape(3, 3)
    around = 1 + 0.2 + (0.1 * y + 0.05) / x
    np.testing.assert_allclose(got, [[1.2, 0.1, 0.0], [0.3, 0.9, 0.0], [0.0, 0.0, around]], atol=1e-15)


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_strain_of_a_uniform_swelling_is_the_same_in_all_stretched_directions(geometry):
    kinematics = GEOMETRIES[geometry]
    swollen = np.array([[float(ufl.as_ufl(kinematics.stretched[i, j])(())) for j in range(3)] for i in range(3)])
    np.testing.assert_array_equal(swollen, np.diag(np.diag(swollen)))
    assert np.trace(swollen) == kinematics.directions
    rest = np.trace(swollen), np.trace(swollen @ swollen), 1.0
    assert kinematics.rest == rest  # tr C, tr C^2, det C of what is stretched


def test_sizes_and_contacts_of_round_bodies():
    assert PLANE_STRAIN.ball(2.0) == pytest.approx(4 * np.pi)
    assert AXISYMMETRIC.ball(2.0) == THREE_D.ball(2.0) == pytest.approx(32 / 3 * np.pi)
    assert PLANE_STRAIN.hertz_um(10.0, 8.0, 200.0 / 0.91) == pytest.approx(0.6808, abs=1e-4)
    assert AXISYMMETRIC.hertz_um(4.0, 3.0, 9.0) == THREE_D.hertz_um(4.0, 3.0, 9.0) == pytest.approx(1.0)
    assert Ring(1.0, 2.0).size(THREE_D) == pytest.approx(28 / 3 * np.pi)


def test_integral_over_a_turned_block_is_its_volume_and_its_side():
    domain = block(width=2.0, height=3.0)
    body = Body(domain, (), displacement_space(domain, 1), kinematics=AXISYMMETRIC)
    one = fem.Constant(domain.mesh, 1.0)
    for form, expected in ((body.over(one), 12 * np.pi), (body.along(one, ("right",)), 12 * np.pi)):
        assert fem.assemble_scalar(compile_form(form, domain.mesh.comm)) == pytest.approx(expected, rel=1e-13)


def test_turned_cell_is_a_whole_ball():
    setup = setup_of(turned())
    assert setup.scene.copies == 1 and setup_of(scene_of()).scene.copies == 2
    assert setup.weight == pytest.approx(41.0921, abs=1e-4)  # model.md
    assert setup.force_scale == setup.weight
    run = setup.create_run(lambda line: None)
    observed = Observer(run, setup.layout()).observe(0.0)
    run.close()
    assert observed["cell"]["volume_um3"] == pytest.approx(4 / 3 * np.pi * 1000, rel=2e-3)
    assert observed["lamina"]["volume_um3"] == pytest.approx(4 / 3 * np.pi * (125 - 4.9**3), rel=5e-3)
    assert "area_um2" not in observed["cell"] and "share_of_area_percent" not in observed
    assert observed["share_of_volume_percent"]["J1"] == pytest.approx(300 / 8, rel=1e-9)
    assert observed["contact"]["weight_pN"] == 0.0 and "weight_Pa_x_um" not in observed["contact"]
    assert observed["nucleus"]["J1_mean"] == observed["nucleus"]["J2_max"] == pytest.approx(3.0, abs=1e-12)


def test_pillar_off_the_axis_is_one_ring():
    pillar = {"x_um": 7.0, "half_width_um": 3.0}
    assert [o.x_um for label, o in obstacles_of(turned(pillar=[pillar])).items() if label != "flat"] == [7.0]
    assert len(obstacles_of(scene_of(pillar=[pillar]))) == 3


@pytest.mark.parametrize(
    ("tables", "key", "told"),
    [
        ({"cell": {"shape": "full"}}, "cell.shape", 'must be "half"'),
        ({"cell": {"trace": "in-plane"}}, "cell.trace", 'must be "3d"'),
        ({"pillar": [{"x_um": -20.0}]}, "pillar.0.x_um", "must be >= 0 µm, the radius of its ring"),
        ({"pillar": [{"x_um": 3.0}]}, "pillar.0.x_um", "must not overlap its own mirror image"),
    ],
)
def test_what_has_no_meaning_about_an_axis_is_refused(tables, key, told):
    with pytest.raises(InputError) as caught:
        turned(**tables)
    assert caught.value.key == key and told in caught.value.rule
    assert "ring" in str(caught.value) or "axi" in str(caught.value)


def test_footprint_of_a_ball_on_its_axis_is_hertzs():
    """a^3 = 3 F R/(4 E*) on a stiff flat, a share of the load to either side of it."""
    scene = turned(pillar=[], contact={"penalty_Pa_per_um": 1e9})
    load = 1e-2
    (foot,) = feet(scene, load, lambda d: 1e9 * max(d, 0.0))
    least, most = (AXISYMMETRIC.hertz_um(share * load, 10.0, modulus_of(scene)) for share in BEARS)
    assert foot.edges == (pytest.approx(least, rel=0.02), pytest.approx(most, rel=0.02))


@pytest.mark.parametrize(
    ("obstacle", "at", "expected"),
    [
        (Flat(-1.0), (3.0, -1.0, 2.0), 0.0),
        (RoundPillar(1.0, 0.0, -1.0, 4.0, 4.0, 2.0), (1.0, 4.0, -1.0), 0.25),
        (Pillar(1.0, 0.0, 4.0, 4.0, 2.0), (1.0, 4.0, 7.0), 0.125),
    ],
    ids=["plane", "sphere", "cylinder"],
)
def test_mean_curvature_of_plain_shapes(obstacle, at, expected):
    assert mean_curvature(obstacle, at, 1e-3) == pytest.approx(expected, abs=1e-6)


def test_contacts_of_a_lattice_share_the_weight_and_get_smaller_elements():
    """Four corners of square pillars bear a quarter each; a solved half-width is 1.12 µm, and 3.3 µm on a round one."""
    lattice = {"pitch_um": 10.0, "width_um": 5.0, "profile": "square", "offset_um": [5.0, 5.0]}
    zones = []
    for tables in ({"array": lattice}, {}):
        scene = read_scene({"cell": {"geometry": "3d"}, **tables}, "test")
        (zone,) = Setup(scene, MPI.COMM_SELF, mesh_plan(scene)).spec.zones
        zones.append(zone)
    narrow, wide = zones
    assert 1.12 < narrow.radius_um < 1.6 and 3.3 < wide.radius_um < 5.0
    assert 2.0 < 1.12 / narrow.size_um < 5.0 and wide.size_um == pytest.approx(0.2 * 3.6)


def test_contact_that_a_plane_of_symmetry_cuts_goes_on_behind_it():
    """Seen alike on a quarter, a half and a whole ball, so that a warning is: a quarter saw half of the radius."""
    found = []
    for shape in ("quarter", "half", "full"):
        scene = read_scene({"cell": {"geometry": "3d", "shape": shape}, "mesh": {"size_um": 8.0, "order": 2}}, "test")
        run = Setup(scene, MPI.COMM_SELF, mesh_plan(scene)).create_run(lambda line: None)
        run.u[1::3] = -0.3
        found += stretches(run, None)
        run.close()
    assert len(found) == 3
    for one in found[:2]:
        assert (one.half_width_um, one.edges) == pytest.approx((found[2].half_width_um, found[2].edges), rel=1e-9)
