"""Distance from obstacles: of points against dense outlines and surfaces, of a nucleus against what is worked out."""

from functools import lru_cache

import numpy as np
import pytest
from balls import MIRRORED, ball
from dolfinx import fem
from problems import affine, layered_disc

import cellmech
from cellmech.fem import jit
from cellmech.fem.distance import distance, nearest
from cellmech.fem.outline import Outline
from cellmech.fem.surface import Surface
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.mechanics.pillars import RoundPillar, SquarePillar

INNER = 5.0
EXPONENTS = [2.0, 2.7, 4.0, 20.0, 50.0]
PLACE, HALF_WIDTH, HEIGHT = (1.0, -10.0, 0.5), 3.0, 9.0
AROUND = np.random.default_rng(4).uniform([-9.0, -6.0, -7.0], [11.0, 6.0, 8.0], (30, 3))


def octant_of(exponent, n):
    """Points of |q_i|^e adding to 1 from those of a cube's sides, shape (m, 3): fine at corners and on flat sides."""
    a, b = np.meshgrid(*[np.linspace(0.0, 1.0, n)] * 2)
    cube = np.concatenate([np.stack(side, -1).reshape(-1, 3) for side in ((a, b, a**0), (a, a**0, b), (a**0, a, b))])
    return cube / np.sum(cube**exponent, axis=1, keepdims=True) ** (1 / exponent)


def by_search(exponent, half_axes, offsets):
    """Smallest distance of points from those of a surface; two coordinates, then a curve's."""
    if len(half_axes) == 2:
        line = np.linspace(0.0, 1.0, 40001)
        rows = np.concatenate([np.stack([line, line**0], 1), np.stack([line**0, line], 1)])
        surface = rows / np.sum(rows**exponent, axis=1, keepdims=True) ** (1 / exponent)
    else:
        surface = octant_of(exponent, 401)
    return np.array([np.sqrt(np.min(np.sum((surface * half_axes - a) ** 2, axis=1))) for a in offsets])


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("kind", ["ridge", "round", "square"])
def test_distance_from_a_pillar_is_that_of_the_nearest_point_of_its_surface(kind, exponent):
    x, y, z = PLACE
    across, up, along = np.abs(AROUND - PLACE).T
    if kind == "ridge":
        pillar, offsets = Pillar(x, y, HALF_WIDTH, HEIGHT, exponent), np.stack([across, up], 1)
    elif kind == "round":
        pillar = RoundPillar(x, y, z, HALF_WIDTH, HEIGHT, exponent)
        offsets = np.stack([np.hypot(across, along), up], 1)
    else:
        pillar, offsets = SquarePillar(x, y, z, HALF_WIDTH, HEIGHT, exponent), np.stack([across, along, up], 1)
    axes = np.array([HALF_WIDTH] * (offsets.shape[1] - 1) + [HEIGHT])
    found, inside = distance(pillar, AROUND), pillar.level_set(AROUND.T) > 0.0
    assert np.count_nonzero(inside) < 8
    assert np.array_equal(found < 0.0, inside)
    searched = by_search(exponent, axes, offsets)
    far = searched > 0.3  # nearer by, points of a surface are as far apart
    assert np.count_nonzero(far) > 20
    assert np.abs(found[far]) == pytest.approx(searched[far], abs=5e-4)


@lru_cache
def disc(shape, order):
    domain = layered_disc(shape=shape, size_um=2.0)
    space = jit.displacement_space(domain.mesh, order)
    return Outline(domain, space, "nucleus_outline"), space


def circle(shape, centre, order=2, F=((1.0, 0.0), (0.0, 1.0))):
    """A nucleus outline about a place, and the displacement that puts it there; an ellipse if it is deformed."""
    outline, space = disc(shape, order)
    middle = (outline.reference[..., 1].min() + outline.reference[..., 1].max()) / 2
    u = fem.Function(space)
    u.x.array[:] = affine(space, np.array(F) - np.eye(2), np.array(centre) - np.array(F) @ [0.0, middle])
    return outline, u


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("shape", ["half", "full"])
def test_circle_over_a_flat_is_as_far_as_its_lowest_point(shape, order):
    found = nearest(*circle(shape, (0.0, 8.0), order), {"flat": Flat(1.5)})
    assert found == ("flat", pytest.approx(8.0 - INNER - 1.5, abs=1e-6))


@pytest.mark.parametrize("exponent", [2.0, 50.0])
def test_circle_beside_a_pillars_corner_is_as_far_as_its_centre_less_its_radius(exponent):
    """Nowhere near the axis: the pillar's nearest place is an ellipse's, or a box's corner, to which one can count."""
    aside, centre = Pillar(9.0, -10.0, 4.0, 10.0, exponent), np.array([0.0, 6.0])
    found = nearest(*circle("full", centre), {"flat": Flat(-10.0), "pillar 1": aside})
    corner = by_search(exponent, np.array([4.0, 10.0]), [np.abs(centre - [9.0, -10.0])])[0]
    if exponent == 50.0:
        assert corner == pytest.approx(np.hypot(5.0, 6.0), abs=0.15)  # a box's with an edge a little round
    assert found == ("pillar 1", pytest.approx(corner - INNER, abs=1e-3))


@pytest.mark.parametrize("degrees", np.arange(-95.0, 96.0, 19.0))
def test_two_circles_are_as_far_as_their_centres_less_their_radii(degrees):
    """At angles where the nearest point of the outline is between nodes, and on either side of an edge's first."""
    angle = np.radians(degrees)
    round_one = Pillar(11.0 * np.cos(angle), 11.0 * np.sin(angle), 3.0, 3.0, 2.0)
    outline, u = circle("full", (0.0, 0.0), order=3)
    assert nearest(outline, u, {"pillar 0": round_one}).distance_um == pytest.approx(3.0, abs=2e-5)


def test_what_is_near_the_middle_need_not_be_near_the_outline():
    stand = {"flat": Flat(0.0), "pillar 0": Pillar(10.2, 0.0, 3.0, 30.0)}
    found = nearest(*circle("full", (0.0, 5.0), F=((1.3, 0.0), (0.0, 0.7))), stand)
    assert found == ("pillar 0", pytest.approx(10.2 - 3.0 - 1.3 * INNER, abs=2e-3))


def test_nearest_of_several_is_named_and_the_first_of_equal_ones():
    stand = {"left": Pillar(-9.0, 0.0, 2.0, 30.0), "right": Pillar(9.0, 0.0, 2.0, 30.0), "flat": Flat(0.0)}
    outline, u = circle("full", (0.0, 9.0))
    assert nearest(outline, u, stand) == ("left", pytest.approx(2.0, abs=2e-2))
    assert nearest(outline, u, dict(reversed(stand.items()))).label == "right"
    assert nearest(*circle("full", (0.3, 9.0)), stand).label == "right"
    assert nearest(*circle("full", (0.0, 6.0)), stand) == ("flat", pytest.approx(1.0, abs=1e-6))
    assert nearest(outline, u, {}) is None


def test_a_nucleus_within_an_obstacle_has_a_negative_distance():
    assert nearest(*circle("half", (0.0, 4.6)), {"flat": Flat(0.0)}).distance_um == pytest.approx(-0.4, abs=1e-6)


@pytest.mark.parametrize("shape", MIRRORED)
def test_ball_is_as_far_as_its_centre_less_its_radius_in_space(shape):
    domain = ball(shape, 2.5, 1.5 * INNER, INNER)
    space = jit.displacement_space(domain.mesh, 2)
    surface = Surface(domain, space, "nucleus_outline", MIRRORED[shape])
    u = fem.Function(space)
    u.x.array[:] = np.tile([0.0, 8.0, 0.0], len(u.x.array) // 3)
    stand = {"flat": Flat(0.0), "round": RoundPillar(6.0, 0.0, 6.0, 2.0, 7.0, 4.0)}
    stand["square"] = SquarePillar(-40.0, 0.0, 0.0, 3.0, 7.0, 4.0)
    corner = by_search(4.0, np.array([2.0, 7.0]), [[6.0 * np.sqrt(2.0), 8.0]])[0]
    assert nearest(surface, u, stand) == ("round", pytest.approx(corner - INNER, abs=2e-3))


def test_obstacle_of_ones_own_counts_if_it_has_a_distance():
    class Wall:
        length_um = 5.0

        def level_set(self, x):
            return x[0] - 7.0

        def gradient(self, x):
            return 1.0 + 0 * x[0], 0 * x[1]

    class Measured(Wall):
        def distance(self, x):
            return 7.0 - x[0]

    outline, u = circle("full", (0.0, 20.0))
    assert nearest(outline, u, {"flat": Flat(0.0), "wall": Wall()}) == ("flat", pytest.approx(15.0, abs=1e-6))
    assert nearest(outline, u, {"flat": Flat(0.0), "wall": Measured()}) == ("wall", pytest.approx(2.0, abs=1e-6))


@pytest.mark.parametrize("layers", ["conforming", "smeared"])
@pytest.mark.parametrize("geometry", ["plane", "axisymmetric"])
def test_a_result_has_it_without_a_pillar_on_the_axis(geometry, layers):
    cell = {"geometry": geometry, "layers": layers} | ({"smear_um": 0.5} if layers == "smeared" else {})
    tables = {"cell": cell, "mesh": {"size_um": 4.8}, "time": {"history": False}}
    scene = cellmech.Scene(pillar=[{"x_um": 8.0, "half_width_um": 3.0}], **tables)
    result = cellmech.solve(scene).result
    assert result["lamina_pillar_distance_um"] is None
    assert result["nucleus_obstacle"] == "pillar 0"
    low = result["nucleus_shape"]["lowest_um"]
    assert 0.5 < result["nucleus_obstacle_distance_um"] < low + 10.0
    alone = cellmech.solve(cellmech.Scene(pillar=[], **tables)).result
    level, low = alone["scene"]["flat"]["y_um"], alone["nucleus_shape"]["lowest_um"]
    assert alone["nucleus_obstacle"] == "flat"
    assert alone["nucleus_obstacle_distance_um"] == pytest.approx(low - level, abs=1e-6)
