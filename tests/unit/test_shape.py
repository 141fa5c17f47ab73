"""The nucleus's shape, against ellipses and ellipsoids, and the integrals along curves that it is made of."""

from functools import lru_cache

import numpy as np
import pytest
from balls import MIRRORED, ball
from balls import affine as affine_in_space
from dolfinx import fem
from problems import affine, layered_disc
from scipy.special import ellipe

from cellmech.cell.shape import nucleus_shape
from cellmech.fem import jit
from cellmech.fem.curves import Moments, arcs, below, moments, ranges
from cellmech.fem.outline import Outline, along
from cellmech.fem.surface import Surface

INNER = 5.0
CURVES = np.random.default_rng(1).normal(size=(40, 4, 2))


def turn(degrees):
    angle = np.radians(degrees)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@lru_cache
def disc(shape, order=3):
    domain = layered_disc(shape=shape, size_um=2.0)
    space = jit.displacement_space(domain.mesh, order)
    return Outline(domain, space, "nucleus_outline"), space


def deformed(shape, F, order=3):
    """The nucleus outline, an ellipse about (0, 20), and its displacement."""
    outline, space = disc(shape, order)
    centre = outline.comm.allreduce(outline.reference[..., 1].min() + outline.reference[..., 1].max()) / 2
    u = fem.Function(space)
    u.x.array[:] = affine(space, np.asarray(F) - np.eye(2), np.array([0.0, 20.0]) - np.asarray(F) @ [0.0, centre])
    return outline, u


def around(a, b):
    """Length of an ellipse."""
    return 4 * max(a, b) * ellipe(1 - (min(a, b) / max(a, b)) ** 2)


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("shape", ["half", "full"])
def test_ellipse_has_its_numbers_from_half_and_whole_outlines(shape, order):
    a, b = 1.3 * INNER, 0.7 * INNER
    found = nucleus_shape(*deformed(shape, np.diag([1.3, 0.7]), order), shape == "half", False, 18.0)
    h = 1.5 / b  # the level lies 1.5 um above the lowest point
    segment = a * b * (np.arccos(1 - h) - (1 - h) * np.sqrt(2 * h - h * h))
    expected = {"lowest_um": 20 - b, "highest_um": 20 + b, "height_um": 2 * b, "width_um": 2 * a, "aspect": b / a}
    expected |= {"perimeter_um": around(a, b), "area_um2": np.pi * a * b}
    expected |= {"indentation_um": 18.0 - (20 - b), "below_tops": segment / (np.pi * a * b)}
    for key, value in expected.items():
        assert found[key] == pytest.approx(value, rel=1e-4), key
    assert found["centroid_um"] == pytest.approx([0.0, 20.0], abs=1e-4)
    assert found["tilt_deg"] == (None if shape == "half" else pytest.approx(0.0, abs=1e-3))
    assert "volume_um3" not in found and "depth_um" not in found


@pytest.mark.parametrize("degrees", [-80.0, 30.0, 89.0])
def test_tilt_is_the_angle_of_the_longer_axis(degrees):
    outline, u = deformed("full", turn(degrees) @ np.diag([1.2, 0.9]))
    assert nucleus_shape(outline, u, False, False, None)["tilt_deg"] == pytest.approx(degrees, abs=1e-2)


def test_without_pillars_nothing_is_told_of_their_tops():
    found = nucleus_shape(*deformed("half", np.eye(2)), True, False, None)
    assert found["indentation_um"] is None and found["below_tops"] is None
    assert nucleus_shape(*deformed("half", np.eye(2)), True, False, 15.0 - 1.0)["below_tops"] == 0.0
    above = nucleus_shape(*deformed("half", np.eye(2)), True, False, 26.0)
    assert above["below_tops"] == 1.0 and above["indentation_um"] == pytest.approx(11.0, abs=1e-4)


def spheroid(a, b):
    """Volume and surface of an ellipse of half-axes a > b turned about b."""
    e = np.sqrt(1 - (b / a) ** 2)
    return 4 / 3 * np.pi * a * a * b, 2 * np.pi * a * a * (1 + (1 - e * e) / e * np.arctanh(e))


def cap(a, b, height):
    """Share of a spheroid's volume below its lowest point plus a height."""
    h = height / b
    return h * h * (3 - h) / 4


def test_flattened_ball_is_the_same_turned_and_in_space():
    a, b = 1.2 * INNER, 0.6 * INNER
    volume, surface = spheroid(a, b)
    outline, u = deformed("half", np.diag([1.2, 0.6]))
    ours = {"turned": nucleus_shape(outline, u, True, True, 18.5)}
    for shape, mirrored in MIRRORED.items():
        domain = ball(shape, 1.25, 1.5 * INNER, INNER)
        space = jit.displacement_space(domain.mesh, 3)
        found = Surface(domain, space, "nucleus_outline", mirrored)
        there = affine_in_space(space, np.diag([0.2, -0.4, 0.2]), (0.0, 20.0, 0.0))
        ours[shape] = nucleus_shape(found, there, bool(mirrored), False, 18.5)
        assert ours[shape]["depth_um"] == pytest.approx(2 * a, rel=1e-4)
    sphericity = np.cbrt(np.pi) * np.cbrt(6 * volume) ** 2 / surface
    expected = {"lowest_um": 20 - b, "highest_um": 20 + b, "height_um": 2 * b, "width_um": 2 * a, "aspect": b / a}
    expected |= {"perimeter_um": around(a, b), "area_um2": np.pi * a * b, "volume_um3": volume, "surface_um2": surface}
    expected |= {"sphericity": sphericity, "projection_area_um2": np.pi * a * a, "projection_shape_index": 1.0}
    expected |= {"indentation_um": 1.5, "below_tops": cap(a, b, 18.5 - (20 - b))}
    for case, found in ours.items():
        for key, value in expected.items():
            assert found[key] == pytest.approx(value, rel=2e-4), (case, key)
        assert found["centroid_um"] == pytest.approx([0.0, 20.0, 0.0][: 2 if case == "turned" else 3], abs=2e-3)
        assert found.keys() - ours["turned"].keys() <= {"depth_um"}
    assert ours["turned"]["tilt_deg"] is ours["half"]["tilt_deg"] is ours["quarter"]["tilt_deg"] is None


def test_numbers_of_the_circle_converge_with_the_mesh():
    """Second-order edges: fourth order; the tilt of a circle is none."""
    errors = []
    for size in (4.0, 2.0):
        domain = layered_disc(shape="full", size_um=size)
        space = jit.displacement_space(domain.mesh, 2)
        outline = Outline(domain, space, "nucleus_outline")
        found = nucleus_shape(outline, fem.Function(space), False, False, None)
        errors.append(
            [len(outline.dofs), found["area_um2"] / (np.pi * 25) - 1, found["perimeter_um"] / (10 * np.pi) - 1]
        )
        assert found["tilt_deg"] is None
    (n, *coarse), (m, *fine) = errors
    assert np.log(np.array(coarse) / fine) / np.log(m / n) == pytest.approx([4.0, 4.0], abs=0.3)


def test_moments_of_a_polygon_are_exact():
    """Of the triangle (1, 0), (3, 1), (2, 4), on first-, second- and third-order edges."""
    corners = np.array([[1.0, 0.0], [3.0, 1.0], [2.0, 4.0]])
    area, middle = 3.5, corners.mean(axis=0)
    gauss = (corners + corners[[1, 2, 0]]) / 2  # the sides' middles integrate second-order functions
    second = [np.mean(gauss[:, i] * gauss[:, j]) * area for i, j in ((0, 0), (0, 1), (1, 1))]
    sides = np.linalg.norm(corners - corners[[1, 2, 0]], axis=1)
    expected = [sides.sum(), sides @ gauss[:, 0], area, *(middle * area), *second]
    ends = np.stack([corners, corners[[1, 2, 0]]], axis=1)
    for inner in ([], [0.5], [0.5 - 0.05**0.5, 0.5 + 0.05**0.5]):
        x = np.concatenate([ends, *(ends[:, :1] + s * (ends[:, 1:] - ends[:, :1]) for s in inner)], axis=1)
        assert moments(x).values == pytest.approx(expected, rel=1e-13)


def test_mirrored_moments_are_those_of_both_halves():
    half = CURVES
    image = np.concatenate([half[:, [1, 0]], half[:, [3, 2]]], axis=1) * [-1.0, 1.0]
    assert Moments(moments(half).values).mirrored.values[[0, 2, 3, 4, 5, 6, 7]] == pytest.approx(
        (moments(half).values + moments(image).values)[[0, 2, 3, 4, 5, 6, 7]], abs=1e-12
    )


@pytest.mark.parametrize("nodes", [2, 3, 4])
def test_ranges_are_those_of_a_fine_sampling(nodes):
    x = CURVES[:, :nodes]
    fine = along(x, np.linspace(0, 1, 20001))
    low, high = ranges(x)
    assert low == pytest.approx(fine.min(axis=1), abs=1e-6) and high == pytest.approx(fine.max(axis=1), abs=1e-6)
    assert np.all(low <= fine.min(axis=1) + 1e-12) and np.all(high >= fine.max(axis=1) - 1e-12)
    level_run = np.array([[[0.0, 1.0], [2.0, 1.0], [1.0, 1.0]]])
    assert ranges(level_run).tolist() == [[[0.0, 1.0]], [[2.0, 1.0]]]


@pytest.mark.parametrize("nodes", [2, 3, 4])
def test_part_below_a_level_is_cut_where_the_curve_crosses_it(nodes):
    """Cubic edges may cross it three times."""
    x = CURVES[:, :nodes]
    low, high = ranges(x)[..., 1]
    part = below(x, 0.1, low, high)
    assert np.all(ranges(part)[1, :, 1] <= 0.1 + 1e-12)
    s = np.linspace(0, 1, 40001)
    fine = along(x, s)
    middle, step = (fine[:, 1:] + fine[:, :-1]) / 2, np.diff(fine, axis=1)
    under = middle[..., 1] < 0.1
    assert moments(part).area == pytest.approx(np.sum((middle[..., 0] * step[..., 1])[under]), abs=2e-3)
    assert moments(part).length == pytest.approx(np.sum(np.linalg.norm(step, axis=-1)[under]), rel=1e-3)


def test_arcs_of_a_circle_are_off_by_the_fourth_power():
    errors = []
    for n in (12, 24):
        angle = 2 * np.pi * np.arange(n + 1) / n
        points, along_it = (
            np.stack(xy, axis=1) for xy in ((np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle)))
        )
        found = moments(arcs(*(np.stack([rows[:-1], rows[1:]], axis=1) for rows in (points, along_it))))
        errors.append([found.length / (2 * np.pi) - 1, found.area / np.pi - 1])
    assert np.log2(np.array(errors[0]) / errors[1]) == pytest.approx([4.0, 4.0], abs=0.1)
    assert np.max(np.abs(errors)) < 1e-3


def test_arc_with_tangents_that_lead_away_is_straight():
    ends, tangents = np.array([[[0.0, 0.0], [3.0, 4.0]]]), np.array([[[0.0, -1.0], [0.0, -1.0]]])
    assert moments(arcs(ends, tangents)).length == pytest.approx(5.0, rel=1e-14)
