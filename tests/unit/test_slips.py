"""Likely slips: each is told where it is made, none where it is not, and results keep silent of them."""

import pytest
from mpi4py import MPI

from cellmech.cell.description import describe_model, summarised
from cellmech.cell.layering import mesh_plan
from cellmech.cell.placed import Placed
from cellmech.cell.setup import Setup
from cellmech.cell.slips import expected_depth_um, slips
from cellmech.scene.files import read_scene
from cellmech.scene.starter import GEOMETRIES, starter
from cellmech.scene.toml_file import parse

# A scene without any slip: in medium, a nucleus near the tops, hard pillars.
SOUND = {
    "cell": {"density_kg_m3": 1050.0, "medium_density_kg_m3": 1000.0},
    "layer": {"lamina": {"outer_radius_um": 7.5}, "nucleoplasm": {"outer_radius_um": 7.4}},
}


def placed(**tables):
    scene = read_scene({"mesh": {"size_um": 6.0}, **SOUND, **tables}, "test")
    return Placed(scene, mesh_plan(scene))


def test_sound_scene_has_none():
    assert slips(placed()) == {}


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_first_scene_of_ones_own_has_none(geometry):
    scene = read_scene(parse(starter(geometry), "new"), "new")
    assert slips(Placed(scene, mesh_plan(scene))) == {}


def layers(**modulus):
    radii = {"lamina": 7.5, "nucleoplasm": 7.4}
    return {"layer": {name: {"outer_radius_um": radii[name], **modulus.get(name, {})} for name in radii}}


MADE = {
    "weight as in air": ({"cell": {"density_kg_m3": 1000.0}}, "weight", "would have 5 % of it"),
    "nucleus far above": ({"layer": {}}, "nucleus", "starts 5 um above the pillar tops"),
    "soft pillars": ({"contact": {"penalty_Pa_per_um": 1.0}}, "penetration", "more than a tenth of the membrane"),
    "metres": ({"cell": {**SOUND["cell"], "gap_um": 2e-6}}, "cell.gap_um", "in metres it would be 2 um"),
    "kPa": (layers(lamina={"young_Pa": 1.5}), "layer.lamina.young_Pa", "in kPa it would be 1500 Pa"),
    "whole width": (
        {"pillar": [{"x_um": 5.0, "half_width_um": 5.0}], "flat": False},
        "pillar.0.half_width_um",
        "5 um is half of its width",
    ),
}


@pytest.mark.parametrize(("tables", "key", "told"), MADE.values(), ids=MADE)
def test_slip_is_told_alone(tables, key, told):
    found = slips(placed(**tables))
    assert [*found] == [key] and told in found[key]


def test_slip_is_not_told_where_it_is_none():
    assert "weight" not in slips(placed(cell={}, load={"factor": 0.0}))
    assert slips(placed(pillar=[{"x_um": 7.0, "half_width_um": 3.0}])).keys() <= {"penetration"}
    assert slips(placed(**layers(nucleoplasm={"young_Pa": 2.0}))) == {}
    assert slips(placed(cell={**SOUND["cell"], "gap_um": 0.01})) == {}


@pytest.mark.parametrize(
    ("tables", "depth_um"),
    [
        ({"cell": {}}, 0.0164),
        ({"cell": {}, "pillar": [{"x_um": 7.0, "half_width_um": 3.0}]}, 0.0523),
    ],
    ids=["Table 1", "between two"],
)
def test_expected_depth_is_near_the_solved_one(tables, depth_um):
    """Solved with the default mesh; a third is as near as Hertz comes where two narrow pillars bear."""
    assert expected_depth_um(placed(**tables)) == pytest.approx(depth_um, rel=0.35)


def test_expected_depth_halves_as_the_penalty_doubles():
    soft, hard = (expected_depth_um(placed(contact={"penalty_Pa_per_um": kappa})) for kappa in (1000.0, 2000.0))
    assert soft == pytest.approx(2 * hard, rel=0.02)


SHORT = {
    "Table 1": (
        {"cell": {}},
        "a cylinder on endless ridges (plane strain), driven by its weight without buoyancy; "
        "without adhesion, actin, friction, inertia",
    ),
    "driven ball": (
        {"cell": {"geometry": "axisymmetric", **SOUND["cell"]}, "adhesion": {}, "actin": [{"where": "cortex"}]},
        "a ball on what is round about its axis, driven by its weight in medium of 1000 kg/m3 and adhesion and actin; "
        "without friction, inertia",
    ),
    "nothing": (
        {"load": {"factor": 0.0}, "time": {"history": False}},
        "a cylinder on endless ridges (plane strain), driven by nothing; "
        "without adhesion, actin, friction, inertia, the way to the end",
    ),
}


@pytest.mark.parametrize(("tables", "line"), SHORT.values(), ids=SHORT)
def test_one_line_tells_geometry_drivers_and_what_is_left_out(tables, line):
    assert summarised(placed(**tables).scene) == line


def test_check_tells_them_and_results_do_not():
    scene = read_scene({"mesh": {"size_um": 6.0}}, "test")
    model = describe_model(Setup(scene, MPI.COMM_SELF, mesh_plan(scene)))
    lines = model.lines()
    assert lines[0].startswith("in short: a cylinder on endless ridges")
    assert [line for line in lines if line.startswith("warning: weight: ")]
    assert model.as_dict().keys() == {"modelled", "left_out", "warnings", "hints"} and "weight" not in model.warnings
