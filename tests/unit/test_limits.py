"""Who enters the number of a message is never refused for its rounding."""

import re

import pytest

from cellmech.errors import InputError
from cellmech.scene.files import read_scene
from cellmech.scene.limits import ROUNDING, below, told


def layers(*radii):
    """The layers with these outer radii [µm], from the inside out."""
    names = ("nucleoplasm", "lamina", "cytosol", "membrane")
    return {name: {"outer_radius_um": radius} for name, radius in zip(names, radii, strict=True)}


def refusal(data):
    with pytest.raises(InputError) as caught:
        read_scene(data, "my.toml")
    return str(caught.value)


def test_below_counts_the_rounding_of_what_is_subtracted_and_no_more():
    assert 9.4985 - 9.4975 < 0.001
    assert not below(9.4985 - 9.4975, 0.001, 9.4985)
    assert below(0.001 - 20 * ROUNDING, 0.001, 9.4985)
    assert not below(1.0, 1.0) and below(1.0 - 1e-11, 1.0) and not below(1.0, 1.0 - 1e-11)


@pytest.mark.parametrize("limit", [1e-4 * 3, 12.3456789, 6.6666643, 1e5 / 3, 0.1 + 0.2])
def test_told_limit_is_the_limit_but_for_rounding(limit):
    assert not below(float(told(limit)), limit) and not below(limit, float(told(limit)))


@pytest.mark.parametrize(
    "radii",
    [
        (9.4975, 9.4985, 9.5, 10.0),
        (4.9, 5.0, 9.999, 10.0),
        (4.9, 5.0, 5.001, 10.0),
        (0.0003, 1.0, 2.5, 3.0),
        (4.9, 5.0, 10.19898, 10.2),
    ],
    ids=["lamina", "membrane", "cytosol", "nucleoplasm", "membrane of another cell"],
)
def test_thinnest_layer_that_is_allowed_is_accepted(radii):
    data = {"layer": layers(*radii), "mesh": {"size_um": 0.6}}
    assert read_scene(data, "my.toml").radius_um == radii[-1]
    thinner = layers(*radii)
    for k, name in enumerate(thinner):
        if k and radii[k] - radii[k - 1] < 0.0011:
            thinner[name]["outer_radius_um"] -= 1e-9
            assert "a thickness of" in refusal({"layer": thinner, "mesh": {"size_um": 0.6}})


@pytest.mark.parametrize("radius", [1.5, 7.7, 10.0, 12.3456789])
def test_mesh_sizes_that_the_messages_tell_are_accepted(radius):
    data = {"layer": layers(0.4 * radius, 0.5 * radius, 0.9 * radius, radius)}
    told_of = refusal(data | {"mesh": {"size_um": 1e-9}})
    for size in map(float, re.search(r"from (\S+) µm .* radius, (\S+) µm", told_of).groups()):
        read_scene(data | {"mesh": {"size_um": size}}, "my.toml")
    told_of = refusal(data | {"mesh": {"size_um": 0.5, "contact_size_um": 1e-9}})
    least = float(re.search(r"from (\S+) to", told_of).group(1))
    read_scene(data | {"mesh": {"size_um": 0.5, "contact_size_um": least}}, "my.toml")


@pytest.mark.parametrize("widths", [(0.1, 0.2), (3.3333333, 3.333331), (0.7, 1 / 3)])
@pytest.mark.parametrize("x", [0.0, 1000.1])
def test_distance_of_pillars_that_the_message_tells_is_accepted(widths, x):
    def scene(apart):
        places = [{"x_um": x, "half_width_um": widths[0]}, {"x_um": x + apart, "half_width_um": widths[1]}]
        return {"cell": {"shape": "full", "centre_x_um": x}, "pillar": places}

    apart = float(re.search(r"must be (\S+) µm apart", refusal(scene(0.0))).group(1))
    read_scene(scene(apart), "my.toml")
    refusal(scene(apart * (1 - 1e-6)))
