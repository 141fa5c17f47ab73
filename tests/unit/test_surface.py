"""What a surface in space measures, against bodies whose numbers are known."""

from functools import lru_cache

import numpy as np
import pytest
from balls import MIRRORED, affine, ball
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from problems import layered_disc
from scipy.special import ellipe

from cellmech.fem import facets, jit
from cellmech.fem.crossing import crossing_of_triangles
from cellmech.fem.curves import moments
from cellmech.fem.domain import Domain
from cellmech.fem.outline import Outline, deepest
from cellmech.fem.surface import Surface
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.mechanics.pillars import RoundPillar

R, INNER = 10.0, 5.0


@lru_cache
def meshed(shape, size):
    return ball(shape, size, R, INNER)


@lru_cache
def surface(shape="quarter", order=2, name="nucleus_outline", size=2.5):
    domain = meshed(shape, size)
    return Surface(domain, jit.displacement_space(domain.mesh, order), name, MIRRORED[shape])


def moved(shape="quarter", order=2, name="nucleus_outline", size=2.5, H=((0.0,) * 3,) * 3, offset=(0.0, 20.0, 0.0)):
    """A surface and the displacement u = H X + offset."""
    found = surface(shape, order, name, size)
    return found, affine(jit.displacement_space(meshed(shape, size).mesh, order), H, offset)


def exact_sphere(shape="quarter", order=3, size=2.5, radius=INNER):
    """The nucleus and a displacement that puts its surface's nodes on a sphere about (0, 20, 0), to round-off."""
    found, u = moved(shape, order, size=size)
    place = u.x.array.reshape(-1, 3)
    X, dofs = found.reference.reshape(-1, 3), found.dofs.ravel()
    place[dofs] += radius * X / np.linalg.norm(X, axis=1)[:, None] - X
    return found, u


@lru_cache
def cube(order):
    """The surface of the unit cube, and its space."""
    mesh = dmesh.create_unit_cube(MPI.COMM_SELF, 2, 2, 2, dmesh.CellType.tetrahedron)
    entities = dmesh.locate_entities_boundary(mesh, 2, lambda x: np.full(x.shape[1], True))
    tags = dmesh.meshtags(mesh, 2, np.sort(entities), np.ones(len(entities), dtype=np.int32))
    space = jit.displacement_space(mesh, order)
    return Surface(Domain(mesh, None, tags, {}, {"outer": 1}, {}), space, "outer"), space


@pytest.mark.parametrize("order", [1, 2, 3])
def test_sheared_cube_has_its_numbers_exactly(order):
    found, space = cube(order)
    H = np.array([[0.2, 0.5, 0.0], [0.0, -0.1, 0.0], [0.0, 0.0, 0.4]])
    u = affine(space, H, (1.0, 3.0, -2.0))
    F = H + np.eye(3)
    area, volume, centroid = found.content(u)
    sides = [np.linalg.norm(np.cross(F[:, i], F[:, j])) for i, j in ((0, 1), (1, 2), (0, 2))]
    assert area == pytest.approx(2 * sum(sides), rel=1e-13) and volume == pytest.approx(np.linalg.det(F), rel=1e-13)
    assert centroid == pytest.approx(F @ np.full(3, 0.5) + (1.0, 3.0, -2.0), rel=1e-12)
    low, high = found.box(u)
    assert low == pytest.approx([1.0, 3.0, -2.0], abs=1e-13) and high == pytest.approx([2.7, 3.9, -0.6], abs=1e-13)
    assert found.volume_below(u, 3.225) == pytest.approx(0.25 * volume, rel=1e-12)
    assert found.volume_below(u, 2.9) == 0.0 and found.volume_below(u, 4.0) == pytest.approx(volume, rel=1e-13)
    cut = found.section_moments(u, 2, -1.31)
    assert cut.length == pytest.approx(2 * (1.2 + np.hypot(0.5, 0.9)), rel=1e-12)
    assert cut.area == pytest.approx(1.2 * 0.9, rel=1e-12)
    assert cut.centroid == pytest.approx(centroid[:2], rel=1e-12)
    shadow = moments(found.shadow(u))
    assert shadow.length == pytest.approx(2 * (1.7 + 1.4), rel=1e-6) and shadow.area == pytest.approx(2.38, rel=1e-5)


def test_section_in_a_plane_of_the_mesh_is_found_once():
    """Facets on both sides meet in it."""
    found, space = cube(2)
    at_rest = fem.Function(space)
    for axis in (0, 2):
        cut = found.section_moments(at_rest, axis, 0.5)
        assert cut.length == pytest.approx(4.0, rel=1e-12) and cut.area == pytest.approx(1.0, rel=1e-12)


def test_contact_of_the_cube_is_its_foot_and_a_strip_of_its_sides():
    found, space = cube(2)
    at_rest = fem.Function(space)
    patch = found.contact_area(at_rest, [Flat(0.13)], 0.03)
    assert patch.area_um2 == pytest.approx(1.0 + 4 * 0.1, rel=1e-12)
    assert (patch.along_x_um, patch.along_z_um) == pytest.approx((1.0, 1.0), rel=1e-12)
    assert patch.radius_um == pytest.approx(np.sqrt(1.4 / np.pi), rel=1e-12)
    assert found.max_depth(at_rest, [Flat(0.13), Flat(0.1)]) == pytest.approx(0.13, rel=1e-13)
    away = found.contact_area(at_rest, [Flat(-0.1)], 0.0)
    assert away.area_um2 == away.along_x_um == away.along_z_um == 0.0
    assert found.contact_area(at_rest, [], 0.0).area_um2 == 0.0 and found.max_depth(at_rest, []) == -np.inf


def test_absent_group_gives_an_empty_surface():
    domain = meshed("quarter", 2.5)
    space = jit.displacement_space(domain.mesh, 2)
    empty, at_rest = Surface(domain, space, "nowhere"), fem.Function(space)
    assert empty.nodes(at_rest).shape == (0, 6, 3) and empty.extent(at_rest)[0] == 0.0
    assert empty.max_depth(at_rest, [Flat(9.0)]) == -np.inf
    assert empty.contact_area(at_rest, [Flat(9.0)], 0.0).area_um2 == 0.0


@pytest.mark.parametrize("shape", MIRRORED)
@pytest.mark.parametrize("name", ["nucleus_outline", "outer"])
def test_third_order_nodes_are_on_the_same_surface_as_second_order_ones(shape, name):
    """The mesh is of second order: both spaces hold it exactly, if their nodes are taken in the right order."""
    numbers = []
    for order in (2, 3):
        found, u = moved(shape, order, name)
        normals = facets.normals(found.nodes(u), facets.gauss()[0])
        outward = facets.positions(found.reference, facets.gauss()[0])
        assert np.min(np.sum(normals * outward, axis=-1)) > 0
        cut, shadow = found.section_moments(u), moments(found.shadow(u))
        numbers.append([*found.extent(u), cut.length, cut.area, shadow.area, found.volume_below(u, 21.0)])
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-9)


@pytest.mark.parametrize("shape", MIRRORED)
def test_interior_facets_are_counted_once_and_mirror_images_complete_the_body(shape):
    found, u = moved(shape)
    area, volume, centroid = found.content(u)
    assert area == pytest.approx(4 * np.pi * INNER**2, rel=1e-3)
    assert volume == pytest.approx(4 / 3 * np.pi * INNER**3, rel=1e-3)
    assert centroid == pytest.approx([0.0, 20.0, 0.0], abs=1e-3)
    low, high = found.box(u)
    assert low == pytest.approx([-5.0, 15.0, -5.0], abs=1e-3) and high == pytest.approx([5.0, 25.0, 5.0], abs=1e-3)
    assert [found.pole(u, sign)[1] for sign in (-1.0, 1.0)] == pytest.approx([15.0, 25.0], abs=1e-3)
    radii = np.sqrt(25.0 - np.square([0.0, 1.0, 3.0]))
    for axis in (0, 2):
        for level, r in zip((0.0, 1.0, 3.0), radii, strict=True):
            cut = found.section_moments(u, axis, level)
            assert cut.length == pytest.approx(2 * np.pi * r, rel=1e-3)
            assert cut.area == pytest.approx(np.pi * r**2, rel=1e-3)
            assert cut.shape_index == pytest.approx(1.0, abs=1e-4)
            assert cut.centroid == pytest.approx([0.0, 20.0], abs=5e-3)


def ellipse_index(a, b):
    """4 pi S/l^2 of an ellipse."""
    return 4 * np.pi**2 * a * b / (4 * max(a, b) * ellipe(1 - (min(a, b) / max(a, b)) ** 2)) ** 2


def test_shape_indices_of_an_ellipsoid():
    """Section and shadow within 1e-4 on 50 facets of a quarter, of a half and of a full body."""
    H = np.diag([0.6, -0.4, 0.2])
    a, b, c = INNER * (1 + np.diag(H))
    for shape in MIRRORED:
        found, u = moved(shape, H=H)
        assert found.section_moments(u).shape_index == pytest.approx(ellipse_index(a, b), abs=1e-4)
        assert found.section_moments(u, 0).shape_index == pytest.approx(ellipse_index(c, b), abs=1e-4)
        assert moments(found.shadow(u)).shape_index == pytest.approx(ellipse_index(a, c), abs=1e-4)
        assert found.extent(u)[1] == pytest.approx(4 / 3 * np.pi * a * b * c, rel=1e-3)
        assert found.box(u)[1] == pytest.approx([a, 20 + b, c], rel=1e-3)


def test_tilted_ellipsoid_has_its_tilt():
    angle = np.radians(20.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    found, u = moved("full", H=turn @ np.diag([1.5, 0.8, 1.1]) - np.eye(3))
    assert found.section_moments(u).tilt_deg == pytest.approx(20.0, abs=0.02)
    assert found.extent(u)[1] == pytest.approx(1.5 * 0.8 * 1.1 * 4 / 3 * np.pi * INNER**3, rel=1e-3)


def test_numbers_of_a_sphere_converge():
    """Third-order facets whose nodes lie on it: fourth order in the mesh size, or better."""
    errors = []
    for size in (2.5, 1.25):
        found, u = exact_sphere(size=size)
        area, volume = found.extent(u)
        cut, shadow = found.section_moments(u), moments(found.shadow(u))
        below = found.volume_below(u, 18.0)
        exact = (4 * np.pi * 25, 4 / 3 * np.pi * 125, 10 * np.pi, 25 * np.pi, 1.0, 10 * np.pi, 25 * np.pi)
        ours = (area, volume, cut.length, cut.area, cut.shape_index, shadow.length, shadow.area)
        errors.append(np.abs(np.array(ours) / exact - 1))
        assert below == pytest.approx(np.pi * 9 * (15 - 3) / 3, rel=3e-4)
    facets_of = np.sqrt([len(surface(order=3, size=size).dofs) for size in (2.5, 1.25)])
    order = np.log(errors[0] / errors[1]) / np.log(facets_of[1] / facets_of[0])
    assert np.all((order > 3.4) | (errors[1] < 1e-7)), (order, errors)
    assert np.max(errors[1]) < 5e-6


@pytest.mark.parametrize("axis", [0, 2])
def test_sections_of_a_bent_body_add_up_to_its_volume(axis):
    """Cavalieri: the volume is the integral of the sections' areas; a banana has nothing convex about it."""
    found, u = moved("full", 3, "outer")
    X = found.reference.reshape(-1, 3)
    bent = X * [1.2, 0.5, 0.8] + np.stack(
        [0 * X[:, 0], 0.06 * X[:, 0] ** 2 - 0.04 * X[:, 2] ** 2, 0.2 * X[:, 1]], axis=1
    )
    u.x.array.reshape(-1, 3)[found.dofs.ravel()] = bent - X
    low, high = (limit[axis] for limit in found.box(u))
    s, weights = np.polynomial.legendre.leggauss(24)
    levels = low + (high - low) * (s + 1) / 2
    areas = [found.section_moments(u, axis, level).area for level in levels]
    assert weights @ areas * (high - low) / 2 == pytest.approx(found.extent(u)[1], rel=1e-5)
    assert found.extent(u)[1] == pytest.approx((1.2 * 0.5 * 0.8) * 4 / 3 * np.pi * R**3, rel=1e-3)


@pytest.mark.parametrize("shape", MIRRORED)
def test_depth_and_area_of_a_cap(shape):
    """A sphere 0.3 um deep in a flat: depth 0.3, area 2 pi R h, as wide as the circle it is cut off at."""
    found, u = exact_sphere(shape, size=1.25)
    obstacle = [Flat(15.3)]
    assert found.max_depth(u, obstacle) == pytest.approx(0.3, abs=1e-4)
    patch = found.contact_area(u, obstacle, 0.0)
    radius = np.sqrt(25 - 4.7**2)
    assert patch.area_um2 == pytest.approx(2 * np.pi * 5 * 0.3, rel=1e-3)
    assert (patch.along_x_um, patch.along_z_um) == pytest.approx((2 * radius, 2 * radius), rel=1e-3)
    assert patch.radius_um == pytest.approx(radius, rel=0.02)
    deeper = found.contact_area(u, obstacle, 0.1)
    assert deeper.area_um2 == pytest.approx(2 * np.pi * 5 * 0.2, rel=1e-3)


class Knob:
    """A small ball, as an obstacle is."""

    length_um = 1.0

    def __init__(self, centre, radius):
        self.centre, self.radius = centre, radius

    def gap(self, x):
        """From its centre."""
        return [x[k] - self.centre[k] for k in range(3)]

    def level_set(self, x):
        """Depth below its surface."""
        return self.radius - np.sqrt(sum(g * g for g in self.gap(x)))

    def gradient(self, x):
        """Of length 1."""
        gap = self.gap(x)
        return tuple(-g / np.sqrt(sum(g * g for g in gap)) for g in gap)


def test_contact_far_smaller_than_a_facet_is_seen():
    """A knob 0.01 um deep, 0.2 um wide, where the samples of a facet are 0.6 um apart; each of four quarters has it."""
    found, u = exact_sphere()
    facet, between = found.nodes(u)[:1], np.array([[1 / 3, 1 / 3]])
    outward = facets.normals(facet, between)[0, 0]
    centre = facets.positions(facet, between)[0, 0] + 0.49 * outward / np.linalg.norm(outward)
    knob, d = Knob(centre, 0.5), INNER + 0.49
    area = 2 * np.pi * INNER * (INNER - (d * d + INNER**2 - 0.25) / (2 * d))
    assert found.max_depth(u, [knob]) == pytest.approx(0.01, rel=1e-3)
    assert found.contact_area(u, [knob], 0.0).area_um2 == pytest.approx(4 * area, rel=0.05)


def test_depth_between_nodes_in_a_ridge():
    """A pillar's top edge pokes between the nodes; endless along z, it is deepest where a fine sampling says."""
    found, u = moved("half")
    ridge = [Pillar(x_um=0.9, y_um=10.0, half_width_um=0.5, height_um=5.5, exponent=8.0)]
    fine = np.stack(np.meshgrid(*[np.linspace(0, 1, 201)] * 2), axis=-1).reshape(-1, 2)
    fine = fine[fine.sum(axis=1) <= 1.0]
    x = found.nodes(u)
    low = x[x[..., 1].min(axis=1) < 16.5]
    largest = max(float(deepest(ridge, facets.positions(facet[None], fine)).max()) for facet in low)
    at_nodes = float(deepest(ridge, x).max())
    assert largest > at_nodes + 0.01
    assert found.max_depth(u, ridge) == pytest.approx(largest, abs=1e-4) and found.max_depth(u, ridge) > largest - 1e-5


def test_ball_on_a_round_pillar_is_the_disc_that_is_turned():
    """Depth and width of the contact, of the outline in the plane and of the surface in space."""
    disc = layered_disc(shape="half", size_um=1.0)
    space = jit.displacement_space(disc.mesh, 3)
    outline, at_rest = Outline(disc, space, "nucleus_outline"), fem.Function(space)
    lowest = float(outline.reference[..., 1].min())
    found, u = exact_sphere(size=1.25)
    measures = {"y_um": 15.0 - 3.0, "half_width_um": 2.0, "height_um": 3.2, "exponent": 4.0}
    patch = found.contact_area(u, [RoundPillar(0.0, z_um=0.0, **measures)], 0.02)
    depth = found.max_depth(u, [RoundPillar(0.0, z_um=0.0, **measures)])
    flat = [Pillar(0.0, **(measures | {"y_um": lowest - 3.0}))]
    width = outline.contact_length_x(at_rest, flat, 0.02)
    assert depth == pytest.approx(outline.max_depth(at_rest, flat), rel=1e-3)
    assert (patch.along_x_um, patch.along_z_um) == pytest.approx((2 * width, 2 * width), rel=1e-3)
    assert patch.area_um2 == pytest.approx(2 * np.pi * INNER * (INNER - np.sqrt(INNER**2 - width**2)), rel=2e-3)


def test_pole_is_a_point_of_the_body():
    """It moves with the lowest point of the undeformed surface, which another may have passed."""
    found, u = moved("full")
    X = found.reference.reshape(-1, 3)
    u.x.array.reshape(-1, 3)[found.dofs.ravel(), 1] += 0.3 * X[:, 0] + 0.1
    assert found.pole(u, -1.0)[1] == pytest.approx(15.1, abs=5e-3)
    assert found.box(u)[0][1] < 14.9


def test_round_off_does_not_choose_between_points_equally_far():
    """A cube's flat sides, then a waist that leaves two bulges: 1e-14 on every node moves no outermost point."""
    found, _ = cube(2)
    y = found.reference[..., 1:2] - 0.5
    for x in (found.reference, found.reference + (y**2 - y**4) * [1.0, 0.0, 0.0]):
        both = np.vstack([-np.eye(3), np.eye(3)])
        places = found.outermost(x, both)
        for seed in range(5):
            noise = 1e-14 * np.random.default_rng(seed).standard_normal(x.shape)
            assert found.outermost(x + noise, both) == pytest.approx(places, abs=1e-9)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_surface_that_crosses_itself_is_found_and_one_that_is_folded_is_not(order):
    """A ball whose top comes down through its bottom, and one that stops short of it; a quarter past its plane."""
    found, u = moved("full", order)
    assert found.crossing(u, ()) is None
    X, rest = found.reference.reshape(-1, 3), u.x.array.copy()
    top, place = np.maximum(X[:, 1], 0.0), u.x.array.reshape(-1, 3)
    for way, crossed in ((1.6, False), (2.4, True)):
        u.x.array[:] = rest
        place[found.dofs.ravel(), 1] -= way * top**2 / INNER
        hit = found.crossing(u, ())
        assert (hit is not None) == crossed
    assert np.hypot(*hit[::2]) < INNER and hit[1] < 20.0
    quarter, u = moved("quarter", order)
    assert quarter.crossing(u, (0, 2)) is None
    u.x.array[2::3] -= 0.01
    assert quarter.crossing(u, (0,)) is None and quarter.crossing(u, (0, 2)) is not None


def test_crossing_of_triangles_of_any_size_is_found():
    """A large one that a far smaller one pierces, their outsides opposed; turned about, or beside it, none."""
    large = np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0]])
    small = np.array([[2.0, 2.0, 0.04], [2.0, 2.08, 0.04], [2.02, 2.04, -0.04]])
    assert crossing_of_triangles(np.array([large, small])) is not None
    assert crossing_of_triangles(np.array([large, small[[0, 2, 1]]])) is None
    assert crossing_of_triangles(np.array([large, small + np.array([5.0, 5.0, 0.0])])) is None
    assert crossing_of_triangles(np.array([large, small + np.array([0.0, 0.0, 0.05])])) is None
    assert crossing_of_triangles(np.zeros((0, 3, 3))) is None
