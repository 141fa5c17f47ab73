"""Scenes in 3-D: keys, defaults, arrays, rules and their messages, where a ball first touches, out to TOML and back."""

import itertools
import math
import tomllib

import pytest

from cellmech.errors import InputError
from cellmech.mechanics.obstacles import Pillar
from cellmech.mechanics.pillars import RoundPillar, SquarePillar
from cellmech.scene.files import read_scene, scene_hash, scene_to_toml
from cellmech.scene.placement import _first, overlaps, placement, rest_beside, slope_at
from cellmech.scene.scene import Scene
from cellmech.scene.studies import load_study
from cellmech.scene.substrate import facing, standing
from cellmech.scene.touch import meet

FILE = "my/scene.toml"
SPACE = 'cell.geometry = "3d"\n'
FULL = 'cell = {geometry = "3d", shape = "full"}\n'
QUARTER = 'cell = {geometry = "3d", shape = "quarter"}\n'
BETWEEN_FOUR = '[array]\nprofile = "square"\noffset_um = [5, 5]\n'


def scene_of(text: str) -> Scene:
    return read_scene(tomllib.loads(text), FILE)


def pillar(profile: str = "round", **keys: float) -> str:
    table = {"half_width_um": 2.0} | keys
    return f'[[pillar]]\nprofile = "{profile}"\n' + "".join(f"{key} = {value}\n" for key, value in table.items())


# Keys and defaults


def test_defaults_in_space_are_a_quarter_ball_of_third_order_on_a_round_pillar():
    scene = scene_of(SPACE)
    assert (scene.cell.shape, scene.copies, scene.mirrors, scene.mesh.order) == ("quarter", 4, "xz", 3)
    ((index, mirrored, arch),) = standing(scene)
    assert (index, mirrored, arch) == (0, "", RoundPillar(0.0, -10.0, 0.0, 10.0, 9.5, 4.0))


@pytest.mark.parametrize(
    ("text", "shape", "copies"),
    [
        (BETWEEN_FOUR, "quarter", 4),
        ("[array]\n", "quarter", 4),
        ('[array]\nlattice = "hexagonal"\n', "quarter", 4),
        ('[array]\nlattice = "hexagonal"\noffset_um = [5, 0]\n', "quarter", 4),
        ('[array]\nlattice = "hexagonal"\ncount = 3\n', "quarter", 4),
        ('[array]\nlattice = "hexagonal"\noffset_um = [0, 5]\n', "half", 2),
        ("[array]\noffset_um = [0, 1]\n", "half", 2),
        ("[array]\noffset_um = [1, 0]\n", "full", 1),
        ("[array]\ncount = 2\n", "full", 1),
        ("[array]\ncount = 2\noffset_um = [5, 5]\n", "quarter", 4),
        (pillar(x_um=5), "quarter", 4),  # half cells mirror their pillars, as in the plane
        (pillar(x_um=5, z_um=3), "half", 2),
        (pillar("ridge", x_um=5), "quarter", 4),
        ("cell.centre_z_um = 1\n", "half", 2),
    ],
)
def test_unwritten_shape_is_the_least_that_makes_the_same_whole(text, shape, copies):
    scene = scene_of(SPACE + text)
    assert (scene.cell.shape, scene.copies) == (shape, copies)
    again = scene_of(scene_to_toml(scene))
    assert again == scene and scene_hash(again) == scene_hash(scene)


def test_copies_of_the_other_geometries_are_what_they_were():
    assert [scene_of(text).copies for text in ("", 'cell.shape = "full"', 'cell.geometry = "axisymmetric"')] == [
        2,
        1,
        1,
    ]


def test_width_may_be_given_instead_of_half_of_it():
    for geometry in ("plane", "axisymmetric", "3d"):
        scene = scene_of(f'cell.geometry = "{geometry}"\n[[pillar]]\nwidth_um = 5')
        assert (scene.pillar[0].half_width_um, scene.pillar[0].width_um) == (2.5, None)
        assert scene_hash(scene) == scene_hash(
            scene_of(f'cell.geometry = "{geometry}"\n[[pillar]]\nhalf_width_um = 2.5')
        )


def test_profile_left_out_is_round_and_hashes_like_it():
    written, left_out = (scene_of(SPACE + text) for text in (pillar(), pillar().replace('profile = "round"', "")))
    assert scene_hash(written) == scene_hash(left_out)
    kinds = [type(standing(scene_of(SPACE + pillar(profile)))[0].arch) for profile in ("round", "square", "ridge")]
    assert kinds == [RoundPillar, SquarePillar, Pillar]


def test_array_replaces_table_1s_pillar_and_stands_beside_written_ones():
    assert scene_of(SPACE + "[array]").pillar == ()
    both = scene_of(SPACE + BETWEEN_FOUR + pillar(half_width_um=2.0))
    assert [stand.label for stand in standing(both)][:1] == ["pillar 0"] and len(standing(both)) == 13
    assert scene_of("[array]\nwidth_um = 4").pillar == ()


def test_study_sweeps_and_sets_keys_of_an_array(tmp_path):
    path = tmp_path / "lattice.toml"
    path.write_text(
        SPACE + BETWEEN_FOUR + '[sweep]\n"array.width_um" = [4, 5]\n"array.profile" = ["round", "square"]\n'
    )
    study = load_study(path, ["array.height_um=7", "array.offset_um=[0, 0]"])
    assert [case.name for case in study.cases][1] == "width_um=4,profile=square"
    arrays = [case.scene.array for case in study.cases]
    assert [(a.width_um, a.profile, a.height_um, a.offset_um) for a in arrays if a] == [
        (width, profile, 7.0, (0.0, 0.0)) for width in (4.0, 5.0) for profile in ("round", "square")
    ]
    with pytest.raises(InputError, match="there are no pillars"):
        load_study(path, ["pillar.0.x_um=1"])


# Where pillars stand


def places(text: str) -> list[tuple[float, float]]:
    return sorted((stand.arch.x_um, stand.arch.z_um) for stand in standing(scene_of(text)))


def test_pillars_of_a_quarter_are_mirrored_at_both_planes_but_not_doubled_on_them():
    scene = scene_of(QUARTER + pillar(x_um=5, z_um=6) + pillar(x_um=-5) + pillar(z_um=-6) + pillar())
    labels = {stand.label: (stand.arch.x_um, stand.arch.z_um) for stand in standing(scene)}
    assert labels == {
        "pillar 0": (5, 6), "pillar 0 mirrored": (-5, 6), "pillar 0 mirrored in z": (5, -6),
        "pillar 0 mirrored in x and z": (-5, -6), "pillar 1": (-5, 0), "pillar 1 mirrored": (5, 0),
        "pillar 2": (0, -6), "pillar 2 mirrored in z": (0, 6), "pillar 3": (0, 0),
    }  # fmt: skip
    facing_it = {stand.label for stand in facing(scene)}
    assert facing_it == {"pillar 0", "pillar 1 mirrored", "pillar 2 mirrored in z", "pillar 3"}


def test_pillars_of_a_half_cell_are_mirrored_at_x_alone_and_ridges_once():
    text = 'cell = {geometry = "3d", shape = "half"}\n'
    assert places(text + pillar(x_um=5, z_um=6)) == [(-5, 6), (5, 6)]
    ridges = standing(scene_of(QUARTER + pillar("ridge", x_um=5)))
    assert [ridge.label for ridge in ridges] == ["pillar 0", "pillar 0 mirrored"]


def test_lattices_have_their_pillars_where_they_belong():
    assert places(SPACE + "[array]\ncount = 2\noffset_um = [5, 5]") == [(-5, -5), (-5, 5), (5, -5), (5, 5)]
    assert places(SPACE + "[array]\ncount = 3\noffset_um = [0, 2]")[:3] == [(-10, -12), (-10, -2), (-10, 8)]
    row = 10 * math.sqrt(3) / 2
    expected = [(-10, 0), (-5, -row), (-5, row), (0, 0), (5, -row), (5, row), (10, 0)]
    found = places(SPACE + '[array]\nlattice = "hexagonal"\ncount = 3')
    assert [at for place in found for at in place] == pytest.approx(
        [at for place in expected for at in place], abs=1e-9
    )


def test_lattice_goes_with_the_cell():
    scene = scene_of('cell = {geometry = "3d", shape = "full", centre_x_um = 3, centre_z_um = -2}\n[array]\ncount = 1')
    assert [(stand.arch.x_um, stand.arch.z_um) for stand in standing(scene)] == [(3, -2)]


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_filling_array_has_all_pillars_within_one_and_a_half_radii_and_no_other(lattice):
    text = FULL + f'[array]\nlattice = "{lattice}"\npitch_um = 7.3\noffset_um = [1.1, 2.3]'
    row = 7.3 * (math.sqrt(0.75) if lattice == "hexagonal" else 1.0)
    near = [
        place
        for i, j in itertools.product(range(-9, 10), repeat=2)
        for place in [((i + (j % 2) / 2 * (lattice == "hexagonal")) * 7.3 - 1.1, j * row - 2.3)]
        if math.hypot(*place) <= 1.5 * 10 + 2.5
    ]
    found = places(text)
    assert len(found) == len(near) > 12
    for place, other in zip(found, sorted(near), strict=True):
        assert place == pytest.approx(other, abs=1e-8)


def test_array_in_the_plane_is_a_row_of_ridges_and_in_space_may_be_one():
    flat = scene_of("[array]\npitch_um = 8\noffset_um = [4, 0]")
    row = [stand.arch for stand in standing(flat)]
    assert [ridge.x_um for ridge in row] == [-12, -4, 4, 12] and {type(ridge) for ridge in row} == {Pillar}
    space = scene_of(SPACE + '[array]\nprofile = "ridge"\npitch_um = 8\noffset_um = [4, 0]')
    assert [stand.arch for stand in standing(space)] == row and space.cell.shape == "quarter"
    written = scene_of("".join(f"[[pillar]]\nx_um = {x}\nhalf_width_um = 2.5\n" for x in (4, 12)))
    assert placement(flat).centre == placement(written).centre


# Rules


BAD = [
    ('cell.shape = "quarter"', "cell.shape", 'must be "half" or "full" where cell.geometry is plane'),
    (
        'cell = {geometry = "axisymmetric", shape = "quarter"}',
        "cell.shape",
        'must be "half" where cell.geometry is axi',
    ),
    ("cell.centre_z_um = 1", "cell.centre_z_um", 'belongs to cell.geometry = "3d" only (µm)'),
    ("[[pillar]]\nz_um = 1", "pillar.0.z_um", 'belongs to cell.geometry = "3d" only (µm)'),
    ('[[pillar]]\nprofile = "round"', "pillar.0.profile", 'belongs to cell.geometry = "3d" only'),
    ('[array]\nprofile = "ridge"', "array.profile", 'belongs to cell.geometry = "3d" only'),
    ('cell.geometry = "axisymmetric"\n[array]', "array", "must be left out where cell.geometry is axisymmetric"),
    ('cell = {geometry = "3d", trace = "in-plane"}', "cell.trace", 'must be "3d" where cell.geometry is 3d'),
    (SPACE + pillar("ridge", z_um=1), "pillar.0.z_um", "must be 0 µm for a ridge"),
    ("[array]\noffset_um = [0, 1]", "array.offset_um.1", "must be 0 µm for ridges"),
    ('[array]\nlattice = "hexagonal"', "array.lattice", 'must be "square" for ridges'),
    (SPACE + '[array]\nprofile = "ridge"\nlattice = "hexagonal"', "array.lattice", 'must be "square" for ridges'),
    (
        "[[pillar]]\nwidth_um = 5\nhalf_width_um = 2.5",
        "pillar.0.width_um",
        "must not stand beside pillar.0.half_width_um",
    ),
    (QUARTER + "[array]\noffset_um = [0, 1]", "cell.shape", "the array is not its own mirror image at z = 0"),
    (QUARTER + "[array]\noffset_um = [1, 0]", "cell.shape", "the array is not its own mirror image at x = 0"),
    ("[array]\noffset_um = [1, 0]", "cell.shape", "the array is not its own mirror image at x = 0"),
    (SPACE + "[array]\nwidth_um = 10", "array.width_um", "must be less than 10 µm: the array would overlap itself"),
    ("[array]\nwidth_um = 10", "array.width_um", "must be less than 10 µm: the array would overlap itself"),
    (
        SPACE + '[array]\nlattice = "hexagonal"\nprofile = "square"\nwidth_um = 8.9',
        "array.width_um",
        "must be less than 8.891397",
    ),
    (
        SPACE + "[array]\npitch_um = 0.8\nwidth_um = 0.5",
        "array.pitch_um",
        "must leave at most 1,000 pillars within reach",
    ),
    (SPACE + "[array]\ncount = 31", "array.count", 'must be a whole number from 1 to 30 or "fill"'),
    (SPACE + '[array]\ncount = "all"', "array.count", 'must be a whole number from 1 to 30 or "fill"'),
    (SPACE + "[array]\noffset_um = 5", "array.offset_um", "must be a list of two numbers, along x and along z (µm)"),
    (SPACE + '[array]\noffset_um = [1, "2"]', "array.offset_um", "must be a finite number"),
    (SPACE + "array = 5", "array", "must be a table"),
    (FULL + pillar() + pillar(x_um=2.5, z_um=3), "pillar.1.x_um", "must not overlap pillar.0"),
    (QUARTER + pillar(x_um=5, z_um=1), "pillar.0.x_um", "must not overlap its own mirror image at z = 0"),
    (
        QUARTER + pillar(x_um=5, z_um=5) + pillar(x_um=-5, z_um=4),
        "pillar.1.x_um",
        "must not overlap the mirror image of",
    ),
    (SPACE + BETWEEN_FOUR + pillar(x_um=4, z_um=4), "pillar.0.x_um", "must not overlap the array"),
    (SPACE + "flat.y_um = -9\n[array]", "flat.y_um", "must be <= -10 µm, the foot of the array"),
    (QUARTER.replace("}", ", centre_z_um = 1}"), "cell.centre_z_um", "must be 0 µm for a quarter cell"),
    (SPACE + "mesh.size_um = 0.11", "mesh.size_um", "must be from 0.12 µm (about 5e+06 tetrahedra)"),
    (SPACE + "flat = false\n" + pillar(x_um=14, z_um=14), "pillar", "between x = -10 and 10 µm and z = -10 and 10 µm"),
    (SPACE + "cell.gap_um = -1\n[array]", "cell.gap_um", "the cell would overlap the array 0,0 by 1 µm"),
]


@pytest.mark.parametrize(("text", "key", "rule"), BAD, ids=[f"{index}-{bad[1]}" for index, bad in enumerate(BAD)])
def test_rule_of_space_is_told_with_file_and_key(text, key, rule):
    with pytest.raises(InputError) as caught:
        scene_of(text)
    assert (caught.value.key, rule in caught.value.rule) == (key, True), str(caught.value)
    assert str(caught.value).startswith(f"{FILE}: {key}: ") and "\n" not in str(caught.value)


def test_unknown_key_of_an_array_is_told_with_the_nearest():
    with pytest.raises(InputError, match=r"Did you mean array\.pitch_um"):
        scene_of(SPACE + "[array]\npich_um = 4")


def test_pillars_that_a_plane_would_see_overlap_stand_side_by_side_in_space():
    assert len(standing(scene_of(FULL + pillar() + pillar(x_um=1, z_um=4)))) == 2
    corner = 'half_width_um = 2\nexponent = 20\nprofile = "square"\n'
    with pytest.raises(InputError, match="must not overlap"):  # squares meet where circles of that width do not
        scene_of(f"{FULL}[[pillar]]\n{corner}[[pillar]]\nx_um = 3.5\nz_um = 3.5\n{corner}")
    assert scene_of(
        f"{FULL}[[pillar]]\n{corner}[[pillar]]\nx_um = 3.5\nz_um = 3.5\n{corner}".replace("square", "round")
    )


def test_mesh_may_be_as_fine_as_five_million_tetrahedra():
    volume = 4 / 3 * math.pi * 10**3
    assert scene_of(SPACE + "mesh.size_um = 0.12").mesh.size_um == 0.12
    assert volume / 4 / (0.12**3 / (6 * math.sqrt(2))) == pytest.approx(5e6, rel=0.05)


# Where the ball starts


def lowest_clearance(scene: Scene, n: int = 60) -> float:
    """The least vertical distance of ball and obstacles [µm] over a grid, without the package's search."""
    x0, y0, z0 = placement(scene).centre
    radius, least = scene.radius_um, math.inf
    for i, j in itertools.product(range(-n, n + 1), repeat=2):
        x, z = x0 + radius * i / n, z0 + radius * j / n
        if math.hypot(x - x0, z - z0) < radius:
            bottom = y0 - math.sqrt(radius**2 - (x - x0) ** 2 - (z - z0) ** 2)
            tops = [top for stand in standing(scene) if (top := stand.arch.top(x, z)) is not None]
            tops += [] if scene.flat is None else [scene.flat.y_um]
            least = min([least, *(bottom - top for top in tops)])
    return least


PLACED = {
    "between four squares": SPACE + BETWEEN_FOUR,
    "between four round ones": SPACE + BETWEEN_FOUR.replace("square", "round"),
    "between three": FULL + f'[array]\nlattice = "hexagonal"\noffset_um = [5, {5 / math.sqrt(3)}]',
    "on a square": FULL + pillar("square", x_um=0.5, z_um=-1),
    "on a square's edge": FULL + pillar("square", x_um=5, z_um=1),
    "on a square's corner": FULL + "flat = false\n" + pillar("square", x_um=6, z_um=7, exponent=20),
    "grazing a square": FULL + "flat = false\n" + pillar("square", x_um=8.2, z_um=7.9, exponent=4),
    "real exponents": FULL + pillar("square", x_um=4, z_um=5, exponent=2.7) + pillar(x_um=-6, z_um=1, exponent=3.3),
    "beside a ridge": FULL + pillar("ridge", x_um=5),
    "on a flat": FULL + "pillar = []",
    "off the middle": 'cell = {geometry = "3d", shape = "full", centre_x_um = 2, centre_z_um = -3}\n[[pillar]]\n',
}


@pytest.mark.parametrize("text", PLACED.values(), ids=PLACED)
def test_ball_touches_and_does_not_overlap(text):
    scene = scene_of(text)
    place = placement(scene)
    assert 0.0 < 1e-12 + lowest_clearance(scene) < 0.3
    assert place.touch and overlaps(scene, place) == ()
    for touch in place.touch:
        x, y, z = touch.at
        if touch.obstacle != "flat":
            tops = [top for stand in standing(scene) if (top := stand.arch.top(x, z)) is not None]
            assert y == pytest.approx(max(tops), abs=1e-9)
        foot = [middle - scene.radius_um * n for middle, n in zip(place.centre, touch.normal, strict=True)]
        assert foot == pytest.approx(touch.at, abs=1e-9)
        assert math.hypot(*touch.normal) == pytest.approx(1.0, abs=1e-12)
        for stand in standing(scene):
            if stand.pillar == touch.obstacle and len(standing(scene)) == 1 and stand.arch.exponent < 10:
                gradient = stand.arch.gradient(touch.at)  # both surfaces share the normal
                length = math.hypot(*gradient)
                assert [-g / length for g in gradient] == pytest.approx(touch.normal, abs=1e-5)


@pytest.mark.parametrize("offset", [(0.0, 0.0), (3.0, 4.0), (-6.0, 8.0), (0.0, -9.0)])
def test_ball_on_a_round_pillar_is_a_disc_on_a_pillar_in_the_plane_through_both_axes(offset):
    apart = math.hypot(*offset)
    space = placement(scene_of(FULL + "flat = false\n" + pillar(x_um=offset[0], z_um=offset[1], half_width_um=3)))
    plane = scene_of(f'cell.shape = "full"\nflat = false\n[[pillar]]\nx_um = {apart}\nhalf_width_um = 3')
    flat = placement(plane)
    assert space.centre[1] == flat.centre[1] and space.touch[0].at[1] == pytest.approx(flat.touch[0].at[1], abs=1e-12)
    share = flat.touch[0].at[0] / (apart or 1.0)
    assert space.touch[0].at[::2] == pytest.approx([share * way for way in offset], abs=1e-12)


def test_ball_on_a_ridge_is_a_disc_on_it():
    space = placement(scene_of(FULL + pillar("ridge", x_um=5)))
    flat = placement(scene_of('cell.shape = "full"\n[[pillar]]\nx_um = 5\nhalf_width_um = 2'))
    (x, y), (sine, cosine) = flat.touch[0].at, flat.touch[0].normal
    assert space.centre == (flat.centre[0], flat.centre[1], 0.0)
    assert (space.touch[0].at, space.touch[0].normal) == ((x, y, 0.0), (sine, cosine, 0.0))


def test_search_between_a_square_and_a_round_shape_finds_what_the_round_ones_know():
    """Of exponent 2 a square pillar is a round one, in the search with two bisections instead of one."""
    ball = RoundPillar(0.3, 0.0, -0.2, 10.0, 10.0, 2.0)
    for x, z in ((6.0, 7.0), (-2.0, 1.0), (0.3, -9.0), (8.2, 8.1)):
        round_one, square = (kind(x, -4.0, z, 3.0, 5.0, 2.0) for kind in (RoundPillar, SquarePillar))
        one, other = meet(ball, round_one), meet(ball, square)
        assert other[2] == pytest.approx(one[2], rel=1e-14) and other[:2] == pytest.approx(one[:2], abs=1e-6)
    far = SquarePillar(9.5, -4.0, 9.5, 3.0, 5.0, 2.0)
    assert meet(ball, far) is None and meet(ball, RoundPillar(*vars(far).values())) is None


def test_symmetric_pillars_are_touched_at_the_same_level_to_the_last_bit():
    full = placement(scene_of(FULL + BETWEEN_FOUR))
    assert [touch.obstacle for touch in full.touch] == ["array 0,0", "array 1,0", "array 0,1", "array 1,1"]
    assert len({(abs(x), y, abs(z)) for x, y, z in (touch.at for touch in full.touch)}) == 1
    quarter = placement(scene_of(SPACE + BETWEEN_FOUR))
    assert (quarter.centre, quarter.touch) == (full.centre, full.touch[3:])


def test_lattice_turned_by_a_quarter_places_the_ball_alike():
    one, other = (
        placement(
            scene_of(FULL + f'load.factor = 0\n[array]\nprofile = "square"\npitch_um = 8\noffset_um = [{a}, {b}]')
        )
        for a, b in ((1.5, -0.5), (0.5, 1.5))
    )
    x, y, z = one.touch[0].at
    assert one.centre == other.centre and other.touch[0].at == pytest.approx((-z, y, x), abs=1e-12)


@pytest.mark.parametrize(
    ("text", "rests"),
    [
        (FULL + BETWEEN_FOUR, True),
        (SPACE + BETWEEN_FOUR, True),
        (FULL + pillar(x_um=5) + pillar(x_um=-5), True),
        (FULL + "".join(pillar(x_um=5 * math.cos(a), z_um=5 * math.sin(a)) for a in (0.3, 2.3, 4.4)), True),
        (FULL + "".join(pillar(x_um=5 * math.cos(a), z_um=5 * math.sin(a)) for a in (0.3, 1.3, 2.4)), False),
        (FULL + pillar(x_um=5), False),
        ('cell = {geometry = "3d", shape = "half"}\n' + pillar(x_um=5), True),
        ('cell = {geometry = "3d", shape = "half"}\n' + pillar(x_um=4, z_um=3), False),
        (QUARTER + pillar(x_um=4, z_um=3), True),
        (FULL + "pillar = []", True),
    ],
)
def test_ball_rests_where_weights_of_its_touches_balance(text, rests):
    scene = scene_of(text)
    touch = tuple(found for _, found in _first(scene, scene.centre_um))
    assert (slope_at(scene, touch) < 1e-12) == rests == (rest_beside(scene) is None)


@pytest.mark.parametrize(
    ("aside", "taller"), [((0.7, 0.4), 0.0), ((2.0, -1.0), 0.0), ((0.5, 0.2), 0.3), ((0.0, 0.01), 0.0)]
)
def test_ball_aside_starts_in_the_hollow_between_four_pillars(aside, taller):
    """It touches on all sides there; a taller pillar pushes it off the middle."""
    text = FULL.replace('shape = "full"', f'shape = "full", centre_x_um = {aside[0]}, centre_z_um = {aside[1]}')
    assert text != FULL
    heights = [5.0 + taller, 5.0, 5.0, 5.0]
    places = [(-5, -5), (5, -5), (-5, 5), (5, 5)]
    scene = scene_of(
        text + "".join(pillar(x_um=x, z_um=z, height_um=h) for (x, z), h in zip(places, heights, strict=True))
    )
    start = placement(scene)
    assert len(start.touch) >= 3 and slope_at(scene, start.touch) < 1e-9 and overlaps(scene, start) == ()
    x, _, z = start.centre
    assert (x, z) == pytest.approx((aside[0] + start.slide_um[0], aside[1] + start.slide_um[1]), abs=1e-12)
    assert (math.hypot(x, z) < 1e-8) == (taller == 0.0)


def test_ball_on_the_mirror_slides_along_it():
    text = 'cell = {geometry = "3d", shape = "half", centre_z_um = 0.5}\n'
    scene = scene_of(text + pillar(x_um=4, z_um=-4) + pillar(x_um=4, z_um=4))
    assert placement(scene).slide_um == pytest.approx((0.0, -0.5), abs=1e-8)


def test_slope_of_one_touch_is_its_tilt_and_of_two_that_of_the_way_between():
    one = scene_of(FULL + pillar(x_um=3, z_um=4))
    (touch,) = placement(one).touch
    assert slope_at(one, (touch,)) == pytest.approx(math.hypot(*touch.normal[::2]), rel=1e-14)
    two = scene_of('cell = {geometry = "3d", shape = "half"}\n' + pillar(x_um=4, z_um=3))
    assert slope_at(two, placement(two).touch) == pytest.approx(abs(placement(two).touch[0].normal[2]), rel=1e-12)
