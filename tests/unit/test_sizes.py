"""Radii and thicknesses as an experiment gives them."""

import tomllib

import pytest

from cellmech.errors import InputError
from cellmech.scene.files import read_scene, scene_to_toml
from cellmech.scene.parts import LAYER_NAMES


def radii(**tables):
    scene = read_scene(tables, "test")
    assert read_scene(tomllib.loads(scene_to_toml(scene)), "again") == scene
    assert "thickness" not in scene_to_toml(scene) and "[nucleus]" not in scene_to_toml(scene)
    return [scene.layer_of(name).outer_radius_um for name in LAYER_NAMES]


def test_radius_keeps_the_thickness_of_its_shell():
    assert radii(cell={"radius_um": 8.0}) == [8.0, 7.5, 5.0, 4.9]
    assert radii(cell={"radius_um": 8.0}, nucleus={"radius_um": 3.0}) == [8.0, 7.5, 3.0, 2.9]
    assert radii() == [10.0, 9.5, 5.0, 4.9]


def test_thickness_is_of_the_shell():
    shells = {"membrane": {"thickness_um": 0.3}, "lamina": {"thickness_um": 0.05}}
    assert radii(layer=shells) == [10.0, 9.7, 5.0, 4.95]
    assert radii(cell={"radius_um": 7.0}, layer=shells) == [7.0, 6.7, 5.0, 4.95]


def test_outer_radius_inside_stands_as_it_is_written():
    assert radii(cell={"radius_um": 8.0}, layer={"cytosol": {"outer_radius_um": 7.0}}) == [8.0, 7.0, 5.0, 4.9]


@pytest.mark.parametrize(
    ("tables", "key", "told"),
    [
        ({"cell": {"radius_um": 8.0}, "layer": {"membrane": {"outer_radius_um": 8.0}}}, "cell.radius_um", "beside"),
        ({"nucleus": {"radius_um": 4.0}, "layer": {"lamina": {"outer_radius_um": 4.0}}}, "nucleus.radius_um", "beside"),
        (
            {"layer": {"membrane": {"thickness_um": 0.5}, "cytosol": {"outer_radius_um": 9.0}}},
            "layer.membrane.thickness_um",
            "must not stand beside layer.cytosol.outer_radius_um",
        ),
        (
            {"layer": {"lamina": {"thickness_um": 6.0}}},
            "layer.lamina.thickness_um",
            "less than the nucleus's radius, 5",
        ),
        ({"layer": {"cytosol": {"thickness_um": 1.0}}}, "layer.cytosol.thickness_um", "of membrane or lamina"),
        ({"cell": {"radius_um": 5.2}}, "layer.lamina.outer_radius_um", "less than layer.cytosol.outer_radius_um"),
    ],
)
def test_what_is_said_twice_or_cannot_be_is_refused(tables, key, told):
    with pytest.raises(InputError) as caught:
        read_scene(tables, "test")
    assert caught.value.key == key and told in caught.value.rule
