"""Nuclei that are no circles about the cell's centre: where they lie, in all geometries, and outlines from a file."""

import tomllib

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI

import cellmech
from cellmech.cell.description import describe_model
from cellmech.cell.layering import MeshPlan, mesh_plan
from cellmech.cell.setup import Setup
from cellmech.cell.shape import nucleus_shape as nucleus_measures
from cellmech.cell.shape_words import nucleus_words
from cellmech.errors import InputError
from cellmech.fem.boundary import boundary
from cellmech.mesh.cell_shape import BodyOutline, CellShape, radius_of, radius_of_polygon, symmetric_part, waves_of
from cellmech.scene.files import read_scene, scene_to_toml

COARSE = {"mesh": {"size_um": 6.0}, "time": {"history": False}, "load": {"factor": 1e-6}}


def bean(n=180):
    """Points of a bean, in a picture's own coordinates."""
    angle = 2 * np.pi * np.arange(n) / n
    r = 4.5 + 0.8 * np.cos(2 * angle + 0.3) + 0.4 * np.sin(3 * angle)
    return np.stack([40 + r * np.cos(angle), 25 + r * np.sin(angle)], axis=1)


def area(points):
    x, y = np.asarray(points).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def test_mesh_moves_onto_the_outline_and_stays_beyond_the_cytosol():
    shape = CellShape((4.9, 5.0, 9.5, 10.0), BodyOutline((6.0, 4.0), (1.0, 0.5)))
    angle = np.linspace(0, 2 * np.pi, 50)
    e = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outline = shape.moved(5 * e) - [1.0, 0.5]
    np.testing.assert_allclose(np.linalg.norm(outline / [6.0, 4.0], axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(shape.nucleus.beyond(shape.moved(5 * e)), 0.0, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(shape.moved(4.9 * e) - shape.moved(5 * e), axis=1), 0.1, rtol=1e-12)
    np.testing.assert_allclose(shape.moved(9.5 * e), 9.5 * e, atol=1e-14)
    np.testing.assert_allclose(shape.moved(5.0000001 * e), shape.moved(5 * e), atol=1e-6)
    np.testing.assert_allclose(shape.moved(np.zeros((1, 2))), [[1.0, 0.5]])


@pytest.mark.parametrize(
    ("geometry", "shape"), [("plane", "half"), ("plane", "full"), ("axisymmetric", "half")], ids=str
)
def test_ellipse_keeps_its_area_or_volume(geometry, shape):
    scene = {"title": "ellipse", "cell": {"geometry": geometry, "shape": shape}, "nucleus": {"aspect": 0.7}, **COARSE}
    found = cellmech.solve(scene).result
    nucleus = found["nucleus_shape"]
    assert nucleus["aspect"] == pytest.approx(0.7, rel=1e-3)
    if geometry == "plane":
        assert nucleus["area_um2"] == pytest.approx(25 * np.pi, rel=1e-3)
        assert found["nucleus"]["area_um2"] == pytest.approx(25 * np.pi, rel=1e-3)
    else:
        assert nucleus["volume_um3"] == pytest.approx(500 / 3 * np.pi, rel=1e-3)


def test_nucleus_aside_is_where_it_was_put():
    scene = {"title": "aside", "cell": {"shape": "full"}, "nucleus": {"centre_um": [1.5, -2.0]}, **COARSE}
    result = cellmech.solve(scene)
    cell = result.outline("cell", "reference")
    centre = np.array(result.result["nucleus_shape"]["centroid_um"]) - (cell.min(axis=0) + cell.max(axis=0)) / 2
    assert centre == pytest.approx([1.5, -2.0], abs=0.02)
    assert set(np.asarray(result.fields().cell_data["layer"])) == {0, 1, 2, 3}


def test_ball_may_have_an_ellipsoid_aside():
    cell = {"geometry": "3d", "shape": "half"}
    tables = {"nucleus": {"aspect": 0.8, "centre_um": [0.0, 0.5, 1.0]}, "mesh": {"size_um": 9.0, "order": 2}}
    result = cellmech.solve({**COARSE, "title": "ball", "cell": cell, **tables})
    shape = result.result["nucleus_shape"]
    assert shape["volume_um3"] == pytest.approx(500 / 3 * np.pi, rel=2e-3)
    assert shape["aspect"] == pytest.approx(0.8, rel=2e-3) and shape["width_um"] == pytest.approx(
        shape["depth_um"], rel=2e-3
    )
    assert shape["centroid_um"][2] == pytest.approx(1.0, abs=2e-3)


def test_outline_of_a_file_is_the_nucleus(tmp_path):
    points = bean()
    rows = "\n".join(f"{x:.5f},{y:.5f}" for x, y in points[::-1])
    (tmp_path / "nucleus.csv").write_text(f"x_um,y_um\n{rows}\n")
    (tmp_path / "scene.toml").write_text(
        'cell.shape = "full"\nmesh.size_um = 6.0\ntime.history = false\nload.factor = 1e-6\n'
        '[nucleus]\noutline_csv = "nucleus.csv"\n'
    )
    result = cellmech.solve(tmp_path / "scene.toml", tmp_path / "out")
    shape = result.result["nucleus_shape"]
    perimeter = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1).sum()
    assert shape["area_um2"] == pytest.approx(area(points), rel=2e-3)
    assert shape["perimeter_um"] == pytest.approx(perimeter, rel=2e-3)
    again = read_scene(tomllib.loads((tmp_path / "out" / "scene.toml").read_text()), "elsewhere")
    assert again == result.scene and read_scene(tomllib.loads(scene_to_toml(again)), "again") == again


def test_waves_are_those_of_a_polygon():
    angle = 2 * np.pi * np.arange(90) / 90
    r = 4.0 + 0.5 * np.cos(2 * angle) - 0.3 * np.sin(3 * angle)
    waves = waves_of(np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1))
    assert waves[0][0] == pytest.approx(4.0, abs=0.01)
    assert waves[2] == pytest.approx((0.5, 0.0), abs=0.01) and waves[3] == pytest.approx((0.0, 0.3), abs=0.01)


@pytest.mark.parametrize(
    ("tables", "key", "told"),
    [
        ({"nucleus": {"centre_um": [1.0, 0.0]}}, "nucleus.centre_um", "must be 0 µm along x"),
        ({"nucleus": {"centre_um": [1.0]}}, "nucleus.centre_um", "must be x and y"),
        ({"nucleus": {"centre_um": [0.0, 4.5]}}, "nucleus", "within 9.2 µm of the cell's centre"),
        ({"nucleus": {"aspect": 0.2}}, "nucleus", "within 9.2 µm of the cell's centre"),
        ({"nucleus": {"outline_csv": "none.csv"}}, "nucleus.outline_csv", "there is no such file"),
        (
            {"cell": {"geometry": "axisymmetric"}, "nucleus": {"outline_um": bean().tolist(), "aspect": 0.5}},
            "nucleus.aspect",
            "must not stand beside an outline from the side",
        ),
        (
            {"cell": {"geometry": "3d"}, "nucleus": {"outline_um": bean().tolist(), "aspect": 3.0}},
            "nucleus",
            "within 9.2 µm of the cell's centre",
        ),
        (
            {"cell": {"geometry": "3d"}, "nucleus": {"outline_um": bean().tolist(), "centre_um": [3.0, -3.0, 2.0]}},
            "nucleus",
            "within 9.2 µm of the cell's centre",
        ),
        (
            {
                "cell": {"shape": "full"},
                "nucleus": {"outline_um": bean()[np.random.default_rng(0).permutation(180)].tolist()},
            },
            "nucleus.outline_um",
            "each ray from its centroid meets once",
        ),
        (
            {"cell": {"layers": "smeared", "smear_um": 0.2}, "nucleus": {"aspect": 0.9}},
            "nucleus",
            "belongs to cell.layers",
        ),
    ],
)
def test_what_does_not_fit_is_refused(tables, key, told):
    with pytest.raises(InputError) as caught:
        read_scene(tables, "test")
    assert caught.value.key == key and told in caught.value.rule


def test_damaged_file_is_named(tmp_path):
    (tmp_path / "bad.csv").write_text("1,2\n3,four\n")
    with pytest.raises(InputError, match="line 2 does not"):
        read_scene({"cell": {"shape": "full"}, "nucleus": {"outline_csv": "bad.csv"}}, str(tmp_path / "scene.toml"))


@pytest.mark.parametrize(
    ("geometry", "head", "told"),
    [
        ("3d", "x_um,y_um", "columns x_um and z_um, as in 3-D"),
        ("plane", "x_um,z_um", "columns x_um and y_um, those of an outline from the side"),
        ("axisymmetric", "z_um,x_um", "columns x_um and y_um, those of an outline from the side"),
    ],
)
def test_outline_of_another_view_is_refused(tmp_path, geometry, head, told):
    (tmp_path / "nucleus.csv").write_text(f"{head}\n" + "".join(f"{x},{y}\n" for x, y in bean()))
    with pytest.raises(InputError) as caught:
        read_outline(tmp_path, geometry)
    assert caught.value.key == "nucleus.outline_csv" and told in caught.value.rule


def read_outline(folder, geometry):
    tables = {"cell": {"geometry": geometry}, "nucleus": {"outline_csv": "nucleus.csv"}}
    return read_scene(tables, str(folder / "scene.toml"))


@pytest.mark.parametrize(("geometry", "second"), [("axisymmetric", "y"), ("3d", "z")])
def test_columns_are_taken_by_their_names(tmp_path, geometry, second):
    rows = "".join(f"{k},{v},{u}\n" for k, (u, v) in enumerate(bean()))
    (tmp_path / "nucleus.csv").write_text(f"number,{second}_um,x_um\n{rows}")
    named = read_outline(tmp_path, geometry).nucleus.outline_um
    (tmp_path / "nucleus.csv").write_text("X,Y\n" + "".join(f"{u},{v}\n" for u, v in bean()))
    assert named == read_outline(tmp_path, geometry).nucleus.outline_um


def halves_mean(angle):
    """The mean of the bean's radius and its image's at x = 0 [µm], of its own waves, about its centroid."""
    waves = waves_of(read_scene({"cell": {"shape": "full"}, "nucleus": BEAN}, "test").nucleus.outline_um)
    return (radius_of(waves, angle) + radius_of(waves, np.pi - angle)) / 2


BEAN = {"outline_um": bean().tolist()}
ANGLES = 2 * np.pi * (np.arange(2000) + 0.5) / 2000


def test_symmetric_part_is_the_mean_of_mirror_images():
    waves = waves_of(bean() - [40, 25])
    for axes, images in (((0,), [np.pi - ANGLES]), ((0, 1), [np.pi - ANGLES, -ANGLES, np.pi + ANGLES])):
        mean = np.mean([radius_of(waves, at) for at in (ANGLES, *images)], axis=0)
        np.testing.assert_allclose(radius_of(symmetric_part(waves, axes), ANGLES), mean, rtol=1e-12)
    assert symmetric_part(waves, ()) == waves


def test_outline_of_a_half_cell_is_its_symmetric_part():
    found = cellmech.solve({"title": "half", "nucleus": BEAN, **COARSE}).result["nucleus_shape"]
    assert found["area_um2"] == pytest.approx(np.pi * np.mean(halves_mean(ANGLES) ** 2), rel=1e-3)


def test_meridian_is_the_mean_of_both_halves():
    scene = {"title": "turned", "cell": {"geometry": "axisymmetric"}, "nucleus": BEAN, **COARSE}
    found = cellmech.solve(scene).result["nucleus_shape"]
    radius = halves_mean(ANGLES)
    volume = 2 * np.pi * np.pi / 3 * np.mean(radius**3 * abs(np.cos(ANGLES)))
    assert found["volume_um3"] == pytest.approx(volume, rel=1e-3)
    assert found["width_um"] == pytest.approx(2 * np.max(radius * np.cos(ANGLES)), rel=2e-3)


def test_sections_of_a_nucleus_in_space_are_copies_of_its_outline():
    waves = waves_of(bean() - [40, 25])
    offset = (0.5, -1.0, 0.2)
    shape = CellShape((4.9, 5.0, 9.5, 10.0), BodyOutline((4.5, 2.5), offset, waves))
    e = np.random.default_rng(0).standard_normal((200, 3))
    e /= np.linalg.norm(e, axis=1)[:, None]
    x = shape.moved(5 * e) - offset
    share = np.sqrt(1 - (x[:, 1] / 2.5) ** 2)
    outline = radius_of(waves, np.arctan2(x[:, 2], x[:, 0]))
    np.testing.assert_allclose(np.hypot(x[:, 0], x[:, 2]), share * outline, rtol=1e-12)


@pytest.mark.parametrize(("shape", "size", "near"), [("quarter", 4.0, 2e-3), ("half", 9.0, 1e-2), (None, 9.0, 1e-2)])
def test_ball_has_the_outline_from_above_and_a_height(shape, size, near):
    """Four thirds of the outline's area times half the height is the volume; a quarter has its symmetric part."""
    cell = {"geometry": "3d"} | ({"shape": shape} if shape else {})
    tables = {"nucleus": {**BEAN, "aspect": 0.7}, "mesh": {"size_um": size, "order": 2}}
    scene = read_scene({**COARSE, "title": "ball", "cell": cell, **tables}, "test")
    setup = Setup(scene, MPI.COMM_SELF, mesh_plan(scene))
    assert scene.cell.shape == (shape or "full")
    images = {"full": [ANGLES], "half": [ANGLES, np.pi - ANGLES]}.get(scene.cell.shape)
    images = images or [ANGLES, np.pi - ANGLES, -ANGLES, np.pi + ANGLES]
    waves = waves_of(scene.nucleus.outline_um)
    radius = np.mean([radius_of(waves, at) for at in images], axis=0)
    high = 0.7 * np.sqrt(area(bean()) / np.pi)
    projected = np.pi * np.mean(radius**2)
    rest = fem.Function(setup.body.space)
    nucleus = boundary(setup.domain, setup.body.space, "nucleus_outline", setup.layout().mirrored)
    found = nucleus_measures(nucleus, rest, True, False, None)
    assert found["projection_area_um2"] == pytest.approx(projected, rel=near)
    assert found["volume_um3"] == pytest.approx(4 / 3 * high * projected, rel=near)
    assert found["height_um"] == pytest.approx(2 * high, rel=2e-3)
    assert found["depth_um"] == pytest.approx(np.ptp(radius * np.sin(ANGLES)), rel=near)


def steps_of_pixels(um):
    """The bean's outline as a picture has it: along the edges of its pixels."""
    on = np.round((bean(4000) - [40, 25]) / um) * um
    return on[[k for k in range(len(on)) if np.any(on[k] != on[k - 1])]]


@pytest.mark.parametrize("first", [0, 7, 40])
def test_steps_of_pixels_are_smoothed(first):
    points = np.roll(steps_of_pixels(0.32), first, axis=0)
    angles = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    assert np.diff(angles).min() < -0.02
    scene = read_scene({"cell": {"shape": "full"}, "nucleus": {"outline_um": points.tolist()}}, "test")
    found = waves_of(scene.nucleus.outline_um)
    smooth = waves_of(bean() - [40, 25])
    assert np.pi * np.mean(radius_of(found, ANGLES) ** 2) == pytest.approx(area(points), rel=2e-3)
    assert np.abs(radius_of(found, ANGLES) - radius_of(smooth, ANGLES)).max() < 0.8 * 0.32


def test_radius_at_a_step_back_lies_between_those_on_the_ray():
    """Half circles of 4 and 5 um, from one to the other 4 degrees back; looked up anywhere, nothing is beyond them."""
    inner, outer = np.radians(np.linspace(-178, 2, 50)), np.radians(np.linspace(-2, 178, 50))
    points = [[r * np.cos(a), r * np.sin(a)] for r, angles in ((4, inner), (5, outer)) for a in angles]
    for first in (0, 20, 50, 51):
        _, radius = radius_of_polygon(np.roll(points, first, axis=0))
        assert 3.99 < radius.min() and radius.max() < 5.0 + 1e-9
        assert np.mean(radius**2) == pytest.approx((16 + 25) / 2, rel=1e-2)


def test_check_says_what_becomes_of_an_outline():
    scene = read_scene({"cell": {"shape": "full"}, "nucleus": BEAN}, "test")
    told = describe_model(Setup(scene, MPI.COMM_SELF, mesh_plan(scene))).modelled["nucleus"]
    start = (
        "an outline of 180 points as 12 waves around, its centroid at (0, 0) um: area 64.86 um2 (of the points 64.86)"
    )
    assert told == f"{start}, shape index 0.929 (0.929), at most 0.00099 um from the points"
    ellipse = read_scene({"nucleus": {"aspect": 0.64, "centre_um": [0.0, -1.0]}}, "test")
    told = describe_model(Setup(ellipse, MPI.COMM_SELF, mesh_plan(ellipse))).modelled["nucleus"]
    assert told == "12.5 um wide, 8 um high, its centre at (0, -1) um from the cell's"


def test_check_says_how_far_from_symmetric_an_outline_was():
    axis = read_scene({"cell": {"geometry": "axisymmetric"}, "nucleus": BEAN}, "test")
    angle, radius = radius_of_polygon(axis.nucleus.outline_um)
    apart = abs(np.interp(np.pi - angle, angle, radius, period=2 * np.pi) - radius).max()
    told = nucleus_words(axis)
    volume = 2 * np.pi**2 / 3 * np.mean(radius**3 * abs(np.cos(angle)))
    assert f"volume 466.9 um3 ({volume:.4g} the mean of its two halves')" in told
    assert told.endswith(
        f"made symmetric about x = 0: the mean of what was measured and its mirror images, whose radii differ by up to "
        f"{apart:.2g} um"
    )
    ball = read_scene({"cell": {"geometry": "3d", "shape": "quarter"}, "nucleus": {**BEAN, "aspect": 0.6}}, "test")
    told = nucleus_words(ball)
    assert "projected area 64.52 um2 (of the points 64.86), horizontal shape index 0.958 (0.929), 5.452 um high" in told
    assert "about x = 0 and z = 0" in told and told.endswith("differ by up to 1.1 um")


def test_nucleus_aside_moves_the_cell_between_two_pillars_and_not_on_one():
    """Contact on both sides says where the cell rests: nothing else may hold it there."""
    pillars = [{"x_um": x, "half_width_um": 2.5, "height_um": 5.0} for x in (-3.0, 3.0)]
    stiff = {name: {"young_Pa": 1000.0} for name in ("lamina", "nucleoplasm")}
    for pillar, rests in ((pillars, True), ([{}], False)):
        tables = {"nucleus": {"centre_um": [1.0, -0.5]}, "pillar": pillar, "layer": stiff, "load": {"factor": 1.0}}
        setup = Setup(read_scene({**COARSE, "cell": {"shape": "full"}, **tables}, "test"), MPI.COMM_SELF, MeshPlan())
        assert setup.free_sideways != rests
    result = cellmech.solve({"title": "two", **COARSE, "cell": {"shape": "full"}, **tables, "pillar": pillars})
    assert abs(result.number("contact.lateral_force_Pa_x_um")) < 1e-8 * result.number("contact.weight_Pa_x_um")
