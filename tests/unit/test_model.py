"""What a case says of itself: what could be left out of it without a change of its numbers."""

import pytest
from mpi4py import MPI

from cellmech.cell.description import describe_model
from cellmech.cell.layering import mesh_plan
from cellmech.cell.setup import Setup
from cellmech.scene.files import read_scene

FULL = {"shape": "full"}
PAIR = [{"x_um": -7.0, "half_width_um": 3.0}, {"x_um": 7.0, "half_width_um": 3.0}]
SHORT = {"end_s": 10400.0}  # 15 relaxation times after the ramp


def model_of(**tables):
    scene = read_scene({"mesh": {"size_um": 8.0}, **tables}, "test")
    return describe_model(Setup(scene, MPI.COMM_SELF, mesh_plan(scene)))


@pytest.mark.parametrize(
    ("tables", "hints"),
    [
        ({}, {"history"}),
        ({"time": {"history": False}}, set()),
        ({"time": SHORT}, set()),
        ({"time": SHORT, "cell": {"fluid_lambda_Pa_s": 100.0}}, {"history"}),
        ({"cell": FULL, "time": SHORT}, {"shape"}),
        ({"cell": FULL, "pillar": PAIR, "time": SHORT}, {"shape"}),
        ({"cell": FULL, "pillar": PAIR[:1], "time": SHORT}, set()),
        ({"cell": FULL, "pillar": [PAIR[0], PAIR[1] | {"height_um": 9.0}], "time": SHORT}, set()),
        ({"cell": {"inertia": True}}, {"inertia"}),
        ({"cell": {"inertia": True}, "load": {"half_ramp_s": 0.0}}, set()),
        ({"cell": {"inertia": True}, "load": {"half_ramp_s": 0.1}}, set()),
        ({"cell": {"inertia": True, "gap_um": 1.0}}, set()),
        ({"cell": FULL | {"inertia": True}, "pillar": PAIR[:1]}, set()),
        ({"cell": {"inertia": True}, "load": {"factor": 0.0}}, set()),
        ({"time": SHORT, "mesh": {"order": 2, "size_um": 2.4}}, {"mesh"}),
        ({"time": SHORT, "mesh": {"order": 2, "size_um": 1.2}}, set()),
    ],
)
def test_hints_name_what_does_nothing_and_only_that(tables, hints):
    model = model_of(**tables)
    assert set(model.hints) == hints
    assert [line for line in model.lines() if line.startswith("hint: ")] == [
        f"hint: {k}: {v}" for k, v in model.hints.items()
    ]
    assert model.as_dict()["hints"] == model.hints
