"""A cell that is flattened before the load: its mesh, where it first touches, and the contacts that are expected."""

import math
import tomllib

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

import cellmech
from cellmech.cell.description import describe_model
from cellmech.cell.footing import feet
from cellmech.cell.layering import mesh_plan
from cellmech.cell.meshing import bends_of, mean_curvature
from cellmech.cell.outlines import cell_outline, points_of
from cellmech.cell.setup import Setup
from cellmech.errors import InputError
from cellmech.figures.body import read_body
from cellmech.mechanics.pillars import RoundPillar
from cellmech.mechanics.sector import Sector
from cellmech.mesh.cell_shape import BodyOutline, CellShape
from cellmech.scene.files import read_scene, scene_to_toml
from cellmech.scene.placement import placement
from cellmech.scene.substrate import standing

SHAPE = CellShape((4.9, 5.0, 9.5, 10.0), BodyOutline((5.0, 5.0), (0.0, 0.0)), BodyOutline((12.5, 8.0), (0.0, 0.0)))
TWO = [{"x_um": x, "half_width_um": 2.5, "height_um": 5.0} for x in (-5.0, 5.0)]
LATTICE = {"pitch_um": 8.0, "width_um": 4.0, "offset_um": [4.0, 4.0]}
STIFF = {"penalty_Pa_per_um": 2e6, "smoothing_um": 1e-5}


def scene_of(geometry="plane", aspect=0.6, **tables):
    cell = {"geometry": geometry, "aspect": aspect, **tables.pop("cell", {})}
    return read_scene({"cell": cell, "time": {"history": False}, **tables}, "test")


def setup_of(*args, **tables):
    scene = scene_of(*args, **tables)
    return Setup(scene, MPI.COMM_SELF, mesh_plan(scene))


def rays(count, dimension=2):
    e = np.random.default_rng(3).standard_normal((count, dimension))
    return e / np.linalg.norm(e, axis=1)[:, None]


def test_mesh_moves_onto_the_ellipse_and_the_nucleus_stays():
    e = rays(50)
    np.testing.assert_allclose(np.linalg.norm(SHAPE.moved(10 * e) / [12.5, 8.0], axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(SHAPE.moved(10 * e) - SHAPE.moved(9.5 * e), axis=1), 0.5, rtol=1e-12)
    np.testing.assert_allclose(SHAPE.moved(3.0 * e), 3.0 * e, rtol=1e-12)
    np.testing.assert_allclose(SHAPE.moved(5.0000001 * e), SHAPE.moved(5 * e), atol=1e-6)
    np.testing.assert_allclose(SHAPE.moved(9.5000001 * e), SHAPE.moved(9.5 * e), atol=1e-6)


def test_places_of_the_outline_are_found_in_the_mesh_with_their_stretch():
    for e in rays(20):
        along = np.array([-e[1], e[0]]) * 1e-6
        ends = SHAPE.moved(10 * np.array([(e + part) / np.linalg.norm(e + part) for part in (-along, along)]))
        (place,) = SHAPE.moved(10 * e[None])
        found, longer = SHAPE.on_circle(place)
        np.testing.assert_allclose(found, 10 * e, rtol=1e-12)
        assert longer == pytest.approx(np.linalg.norm(ends[1] - ends[0]) / 2e-5, rel=1e-6)


@pytest.mark.parametrize(
    ("geometry", "cell"), [("plane", {}), ("plane", {"shape": "full"}), ("axisymmetric", {}), ("3d", {})], ids=str
)
def test_mesh_has_the_area_or_volume_of_the_round_cell(geometry, cell):
    mesh = {"size_um": 4.0, "order": 2} if geometry == "3d" else {"size_um": 4.8}
    setup = setup_of(geometry, 0.55, cell=cell, mesh=mesh)
    x, domain = ufl.SpatialCoordinate(setup.domain.mesh), setup.domain
    weight = 2 * math.pi * x[0] if geometry == "axisymmetric" else 1.0
    size = fem.assemble_scalar(fem.form(weight * domain.dx(8))) * setup.scene.copies
    assert size == pytest.approx(setup.kinematics.ball(10.0), rel=1e-4)
    high = domain.mesh.geometry.x[:, 1]
    assert np.ptp(high) / 2 == pytest.approx(setup.scene.semi_axes_um[1], rel=1e-6)
    assert np.array(setup.scene.semi_axes_um) @ [0.55, -1.0] == pytest.approx(0.0, abs=1e-12)


def surface_of(scene, centre):
    """Points all over the lower half of the cell's outline [µm], shape (d, n)."""
    wide, high = scene.semi_axes_um
    if scene.cell.geometry != "3d":
        x = np.linspace(-1, 1, 200001)
        return np.stack([centre[0] + wide * x, centre[1] - high * np.sqrt(1 - x**2)])
    u, v = np.meshgrid(np.linspace(-1, 1, 801), np.linspace(-1, 1, 801))
    inside = u**2 + v**2 <= 1
    u, v = u[inside], v[inside]
    return np.stack(
        [centre[0] + wide * u, centre[1] - high * np.sqrt(np.maximum(1 - u**2 - v**2, 0.0)), centre[2] + wide * v]
    )


@pytest.mark.parametrize(
    ("geometry", "tables", "touches"),
    [
        ("plane", {}, 1),
        ("plane", {"cell": {"shape": "full"}, "pillar": TWO}, 2),
        ("plane", {"cell": {"shape": "full", "centre_x_um": 0.7}, "pillar": TWO}, 2),
        ("axisymmetric", {"pillar": [{"x_um": 5.0, "half_width_um": 2.0}]}, 1),
        ("3d", {"cell": {"shape": "full"}, "array": LATTICE}, 4),
        ("3d", {"cell": {"shape": "full"}, "array": LATTICE | {"profile": "square"}}, 4),
        ("3d", {"cell": {"shape": "full", "centre_x_um": 0.3, "centre_z_um": -0.4}, "pillar": [
            {"x_um": x, "z_um": z, "half_width_um": 2.0} for x in (-4.0, 4.0) for z in (-4.0, 4.0)]}, 4),
    ],
)  # fmt: skip
def test_cell_just_touches_at_the_start(geometry, tables, touches):
    """No gap and no overlap: each touch is on both outlines, which have one normal there; nowhere else is deeper."""
    scene = scene_of(geometry, **tables)
    found = placement(scene)
    assert len(found.touch) == touches
    arches = {stand.pillar: stand.arch for stand in standing(scene) if not stand.mirrored}
    for touch in found.touch:
        arch, at = arches[touch.obstacle], np.array(touch.at)
        gradient = -np.array(arch.gradient(tuple(at)))
        assert touch.normal == pytest.approx(gradient / np.linalg.norm(gradient), abs=1e-6)
        scaled = (at - found.centre) / [scene.semi_axes_um[1 if k == 1 else 0] for k in range(len(at))]
        assert np.linalg.norm(scaled) == pytest.approx(1.0, abs=1e-9)
        assert arch.level_set(tuple(at)) == pytest.approx(0.0, abs=1e-9)
        outline = -np.array([s / scene.semi_axes_um[1 if k == 1 else 0] for k, s in enumerate(scaled)])
        assert touch.normal == pytest.approx(outline / np.linalg.norm(outline), abs=1e-6)
    everywhere = surface_of(scene, found.centre)
    for arch in arches.values():
        assert np.max(arch.level_set(everywhere)) < 1e-9


def test_cell_off_the_middle_slides_to_rest_on_both_pillars():
    found = placement(scene_of(cell={"shape": "full", "centre_x_um": 0.7}, pillar=TWO))
    assert found.centre[0] == pytest.approx(0.0, abs=1e-9) and found.slide_um == pytest.approx((-0.7,))


@pytest.mark.parametrize("geometry", ["plane", "axisymmetric"])
def test_expected_contact_is_hertz_s_of_the_curvature_at_the_touch(geometry):
    """The lowest point has the radius a^2/b, 0.6^-1.5 of the circle's in the plane, 0.6^(-4/3) of the ball's."""
    radius = 10.0 * 0.6 ** (-1.5 if geometry == "plane" else -4 / 3)
    scene = scene_of(geometry, pillar=[], load={"factor": 0.1}, contact=STIFF)
    assert bends_of(scene, (0.0, 5.0), (0.0, -3.0)) == pytest.approx((radius, radius))
    setup = Setup(scene, MPI.COMM_SELF, mesh_plan(scene))
    (foot,) = feet(scene, setup.weight, setup.contact.pressure_at)
    modulus = 5.0 / (1 - 0.45**2)
    hertz = setup.kinematics.hertz_um(setup.weight, radius, modulus)
    power = 0.5 if geometry == "plane" else 1 / 3
    assert foot.edges == pytest.approx((0.5**power * hertz, 1.2**power * hertz), rel=0.03)
    assert foot.at == pytest.approx((0.0, -scene.semi_axes_um[1]))


@pytest.mark.parametrize("aspect", [1.0, 0.6, 0.3])
def test_mean_curvature_of_a_cell_is_that_of_its_outline(aspect):
    scene = scene_of("3d", aspect, cell={"shape": "full"}, nucleus={"radius_um": 2.0})
    wide, high = scene.semi_axes_um
    at = np.array([0.5 * wide, -math.sqrt(1 - 0.25 - 0.09) * high, 0.3 * wide])
    measured = mean_curvature(RoundPillar(0.0, 0.0, 0.0, wide, high, 2.0), tuple(at), 1e-4)
    assert sum(1 / one for one in bends_of(scene, (0.0, 0.0, 0.0), tuple(at))) / 2 == pytest.approx(measured, rel=1e-6)


def test_mesh_is_fine_where_the_contact_is():
    """Elements at a narrow contact of a flattened cell are as small beside its width as those of a round one."""
    shares = []
    for aspect in (1.0, 0.5):
        setup = setup_of("plane", aspect, pillar=[{"half_width_um": 2.0}], contact=STIFF, load={"factor": 0.01})
        x = setup.domain.mesh.geometry.x[:, :2] - setup.centre
        low = x[np.abs(np.linalg.norm(x / setup.scene.semi_axes_um, axis=1) - 1) < 1e-9]
        (foot,) = feet(setup.scene, setup.weight, setup.contact.pressure_at)
        width = sum(foot.edges) / 2
        shares.append(np.sum(np.abs(low[low[:, 1] < 0, 0]) < 2 * width))
    assert 0.7 < shares[1] / shares[0] < 1.4


def test_footprint_is_the_contact_s_in_the_mesh_of_circles():
    """On the circle, and as much narrower as the outline there is shorter: at the bottom b/R times."""
    setup = setup_of("plane", 0.5, pillar=[{"half_width_um": 2.0}], contact=STIFF, load={"factor": 0.01})
    (expected,) = feet(setup.scene, setup.weight, setup.contact.pressure_at)
    (found,) = setup.spec.footprints
    assert found.at == pytest.approx((0.0, -10.0))
    shorter = setup.scene.semi_axes_um[1] / 10.0
    assert [edge * shorter for edge in found.edges] == pytest.approx(expected.edges)
    assert found.scale_um * shorter == pytest.approx(expected.scale_um)
    (touch,) = setup.spec.touch
    assert touch == pytest.approx((setup.centre[0], setup.centre[1] - 10.0))


def test_half_a_flattened_cell_is_the_whole_one():
    array = {"pitch_um": 8.0, "width_um": 4.0, "offset_um": [4.0, 0.0]}
    tables = {"array": array, "time": {"history": False}, "mesh": {"size_um": 4.8}}
    half, full = (
        cellmech.solve({"title": shape, "cell": {"shape": shape, "aspect": 0.6}, **tables}).result
        for shape in ("half", "full")
    )
    for keys in ("contact.max_depth_um", "contact.half_width_um", "nucleus.J1_max", "nucleus.sigma_mises_max_Pa"):
        table, key = keys.split(".")
        assert half[table][key] == pytest.approx(full[table][key], rel=1e-8)


def test_surfaces_of_a_flattened_ball_are_found_for_pictures(tmp_path):
    """All of the cell's surface and of its nucleus's, which the field file does not name."""
    tables = {"title": "ball", "cell": {"geometry": "3d", "aspect": 0.6}, "mesh": {"size_um": 9.0, "order": 2}}
    result = cellmech.solve({**tables, "time": {"history": False}, "load": {"factor": 1e-3}}, tmp_path)
    body = read_body(result.last_fields()[1], result.scene)
    a, b = result.scene.semi_axes_um
    e = math.sqrt(1 - (b / a) ** 2)
    areas = {"membrane": 2 * math.pi * a**2 * (1 + (1 - e**2) / e * math.atanh(e)), "lamina": 100 * math.pi}
    for layer, area in areas.items():
        sides = np.diff(body.surface(layer).whole(body.mirrors).start, axis=1)
        measured = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2
        assert measured == pytest.approx(area, rel=1e-2)
    outline = points_of(cell_outline(result.scene))
    assert np.ptp(outline, axis=0) == pytest.approx((2 * a, 2 * b))
    cell = result.outline("cell", "reference")
    assert np.ptp(cell, axis=0) == pytest.approx((2 * a, 2 * b), rel=1e-3)


def test_fibres_of_a_cortex_lie_along_the_flattened_surface():
    setup = setup_of("axisymmetric", 0.6, mesh={"size_um": 4.8})
    sector, X = Sector(setup.centre, aspect=0.6), ufl.SpatialCoordinate(setup.domain.mesh)
    n = ufl.FacetNormal(setup.domain.mesh)
    normal = setup.kinematics.vector(n)
    along = ufl.dot(sector.structure(X, "tangential", setup.kinematics), normal)
    ds = setup.domain.ds(8, "outer")
    total = fem.assemble_scalar(fem.form(ufl.dot(along, along) * ds))
    assert total < 1e-4 * fem.assemble_scalar(fem.form(1.0 * ds))


@pytest.mark.parametrize(
    ("tables", "key", "told"),
    [
        ({"cell": {"aspect": 1.2}}, "cell.aspect", "≤ 1"),
        ({"cell": {"aspect": 0.3}}, "nucleus", "within 4.67723 µm of the cell's centre"),
        (
            {"cell": {"aspect": 0.5, "geometry": "3d"}, "nucleus": {"centre_um": [0.0, 1.0, 0.0]}},
            "nucleus",
            "within 5.",
        ),
        ({"cell": {"aspect": 0.6, "layers": "smeared", "smear_um": 0.2}}, "cell.aspect", "must be 1 where cell.layers"),
    ],
)
def test_what_does_not_fit_is_refused(tables, key, told):
    with pytest.raises(InputError) as caught:
        read_scene(tables, "test")
    assert caught.value.key == key and told in caught.value.rule.replace("<=", "≤")


def test_flattened_nucleus_has_room_in_a_flattened_cell():
    scene = scene_of("3d", 0.35, nucleus={"aspect": 0.5})
    assert read_scene(tomllib.loads(scene_to_toml(scene)), "again") == scene
    told = describe_model(Setup(scene, MPI.COMM_SELF, mesh_plan(scene))).modelled["cell"]
    start = "an ellipsoid, 28.38 um wide and 9.933 um high before the load"
    assert told == f"{start}, its volume that of a ball of 10 um in radius"
