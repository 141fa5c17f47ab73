"""A case that is stopped goes on from its checkpoint as if it had never been stopped."""

import csv
import json
import os
import re
import shutil

import pytest
from mpi4py import MPI

from cellmech.results.records import CHECKPOINT, CaseFolder
from cellmech.runs.case import mesh_plan, solve_case
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene

SCENES = {
    "fluid": {},
    "inertia": {"cell": {"inertia": True}, "load": {"factor": 3.0}, "mesh": {"size_um": 6.0}, "time": {"rtol": 0.02}},
    "comes-into-reach": {
        "pillar": [{"half_width_um": 3.0}, {"x_um": 8.0, "half_width_um": 3.0, "height_um": 8.5}],
        "load": {"factor": 8.0},
    },
    "solid": {"layer": {name: {"fluid_fraction": 0.0} for name in ("membrane", "cytosol", "lamina", "nucleoplasm")}},
    "mixed": {"cell": {"poisson": 0.499}},
    "driven": {
        "adhesion": {"work_uJ_m2": 0.5},
        "actin": [{"where": "basal", "stress_Pa": 1.0, "start_s": 2000.0, "half_ramp_s": 3000.0}],
        "medium": {"viscosity_Pa_s": 100.0},
    },
    "contracting": {"actin": [{"where": "basal", "contraction": 0.2, "start_s": 2000.0, "half_ramp_s": 3000.0}]},
    "full": {"cell": {"shape": "full"}, "mesh": {"size_um": 6.0}},
}


class Stop(Exception):
    """In place of a kill."""


def case_of(name):
    data = {"mesh": {"size_um": 4.0}, "time": {"rtol": 1e-2}, "output": {"times_s": [4000.0]}} | SCENES[name]
    return Case(name, read_scene(data, "test"))


def solve(case, path, stop_after=None, key="k"):
    """The result; None after a stop at a step, before anything of the next one is saved."""
    folder = CaseFolder(path, MPI.COMM_SELF, key)

    def report(progress):
        if progress.step == stop_after:
            raise Stop

    try:
        result = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), report)
        folder.finish(result)
        return result
    except Stop:
        return None
    finally:
        folder.close()


def kept(result):
    left_out = ("wall_s", "memory_MB")
    return json.dumps({key: value for key, value in result.items() if key not in left_out}, sort_keys=True)


@pytest.mark.parametrize("name", SCENES)
def test_resumed_run_is_the_uninterrupted_one_to_the_last_digit(name, tmp_path):
    case, parts, whole = case_of(name), tmp_path / "parts", tmp_path / "whole"
    expected = solve(case, whole)
    assert expected["status"] == "solved", expected["reason"]
    assert expected["steps"] > 15
    assert ("now in reach" in (whole / "run.log").read_text()) == (name == "comes-into-reach")
    for stop in (13, expected["steps"]):  # the second one after the last checkpoint, and before result.json
        assert solve(case, parts, stop_after=stop) is None
        assert (parts / CHECKPOINT).exists()
        assert not (parts / "result.json").exists()
    assert kept(solve(case, parts)) == kept(expected)
    assert (parts / "history.csv").read_bytes() == (whole / "history.csv").read_bytes()
    assert (parts / "run.log").read_text().count("goes on from the checkpoint") == 2
    files = sorted(path.name for path in whole.iterdir())
    assert sorted(path.name for path in parts.iterdir()) == files
    assert all((parts / file).read_bytes() == (whole / file).read_bytes() for file in files if file[:6] == "fields")


UNUSABLE = {
    "other key": "other inputs",
    "cut short": "it is damaged",
    "one bit": "it is damaged",
    "garbage": "it is damaged",
    "empty": "it is damaged",
    "history gone": "No such file",
    "history cut short": "has not the 10 whole rows",
    "history digit": "history.csv is damaged",
    "history quote": "history.csv is damaged: field larger than field limit",
    "other mesh": "it is of another mesh",
}


@pytest.mark.parametrize("damage", UNUSABLE)
def test_unusable_checkpoint_is_told_of_and_the_case_solved_from_the_start(damage, tmp_path):
    case, path, key = case_of("fluid"), tmp_path / "case", "k"
    assert solve(case, path, stop_after=13) is None
    checkpoint = path / CHECKPOINT
    if damage == "other key":
        key = "other"
    elif damage == "history gone":
        (path / "history.csv").unlink()
    elif damage == "history cut short":
        os.truncate(path / "history.csv", 6000)
    elif damage == "history digit":
        content = (path / "history.csv").read_bytes()
        end = content.index(b"\n", content.index(b"\n") + 1)  # of the first row
        (path / "history.csv").write_bytes(content[: end - 1] + bytes([content[end - 1] ^ 1]) + content[end:])
    elif damage == "history quote":  # one opens a cell that goes on to the end
        content = (path / "history.csv").read_bytes()
        end = content.index(b"\n")
        (path / "history.csv").write_bytes(
            content[: end + 1] + b'"' + content[end + 2 :] + b"1" * csv.field_size_limit()
        )
    elif damage == "other mesh":
        mesh = case.scene.mesh.model_copy(update={"size_um": 3.4})
        finer = Case("finer", case.scene.model_copy(update={"mesh": mesh}))
        assert solve(finer, tmp_path / "finer", stop_after=13) is None
        for name in (CHECKPOINT, "history.csv"):
            shutil.copy(tmp_path / "finer" / name, path / name)
    else:
        content = checkpoint.read_bytes()
        middle = len(content) // 2
        flipped = content[:middle] + bytes([content[middle] ^ 16]) + content[middle + 1 :]
        new = {"cut short": content[:middle], "one bit": flipped, "garbage": b"PK" * 500, "empty": b""}
        checkpoint.write_bytes(new[damage])
    assert solve(case, path, stop_after=2, key=key) is None  # in time to see where it began
    log = (path / "run.log").read_text()
    assert re.search(rf"the checkpoint cannot be used \([^)]*{UNUSABLE[damage]}", log)
    assert "goes on" not in log
    assert len((path / "history.csv").read_text().splitlines()) == 3
