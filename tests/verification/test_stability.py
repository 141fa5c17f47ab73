"""A case whose material loses ellipticity stops, says where and when, and keeps the last good state."""

import csv
import re
from xml.etree import ElementTree

import pytest
from mpi4py import MPI

from cellmech.causes import Cause, Reason
from cellmech.cell.driving import ramp
from cellmech.results.records import CaseFolder
from cellmech.runs.case import mesh_plan, solve_case
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene
from cellmech.solver import newton

COARSE = {"mesh": {"size_um": 4.0}}
END_ONLY = {**COARSE, "time": {"history": False}}


def solve(path, data):
    case = Case("case", read_scene(data, "test"))
    folder = CaseFolder(path, MPI.COMM_SELF)
    result = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)
    folder.finish(result)
    folder.close()
    return result


@pytest.mark.parametrize(
    ("law", "least", "most"),
    [
        ("saint-venant", 0.58, 0.61),
        ("neo-hookean", 1 - 1e-9, 1 + 1e-9),
        ("mooney-rivlin", 1 - 1e-9, 1 + 1e-9),
        ("yeoh", 0.89, 0.91),
    ],
)
def test_every_law_is_stable_under_table_1(law, least, most, tmp_path):
    """The last two numbers are observed; they change by less than 0.002 down to mesh.size_um = 0.4."""
    result = solve(tmp_path, {**END_ONLY, "cell": {"law": law}})
    assert result["status"] == "solved", result["reason"]
    assert least <= result["stability"]["margin"] <= most
    assert (result["stability"]["layer"] is None) == (law in ("neo-hookean", "mooney-rivlin"))


@pytest.mark.slow
@pytest.mark.parametrize(("law", "factor"), [("saint-venant", 6.0), ("yeoh", 200.0)])
def test_load_beyond_the_stable_range_stops_at_the_last_stable_state(law, factor, tmp_path):
    result = solve(tmp_path, {**COARSE, "cell": {"law": law}, "load": {"factor": factor}, "time": {"rtol": 1e-2}})
    assert result["status"] == "failed"
    when, where = (
        r"ellipticity is lost at t = ([0-9.]+) s, load amplitude 0\.[0-9]+",
        r"margin (-0\.[0-9]+) at reference x = [-0-9.e]+, y = [0-9.]+ um in the \w+ \(normal at [0-9]+ degrees",
    )
    first = re.match(f"{when}: {where}", result["reason"])
    assert first, result["reason"]
    assert float(first[1]) > result["t_s"] > 1000.0
    assert -1.5 < float(first[2]) < 0 < result["stability"]["margin"] < 0.6
    assert "the material is stable everywhere: margin" in result["reason"]
    with open(tmp_path / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == result["steps"]
    assert float(rows[-1]["t_s"]) == pytest.approx(result["t_s"], rel=1e-12)
    assert float(rows[-1]["cell.det_F_min"]) == result["cell"]["det_F_min"]
    saved = ElementTree.parse(tmp_path / "fields.pvd").findall(".//DataSet")
    assert float(saved[-1].get("timestep")) == result["t_s"]


def test_unstable_end_state_is_no_solution_and_the_last_stable_state_is_sought_along_the_load(tmp_path):
    data = {**END_ONLY, "cell": {"law": "saint-venant"}, "load": {"factor": 3.55}}
    result = solve(tmp_path, data)
    assert result["status"] == "failed"
    when = re.match(r"ellipticity is lost at t = ([0-9.]+) s, load amplitude (0\.9\d+): margin -", result["reason"])
    assert when, result["reason"]
    assert "in the last state, which is saved" in result["reason"]
    assert result["t_s"] < float(when[1])
    assert 0 < float(when[2]) - ramp(5000.0)(result["t_s"]) <= 1 / 64  # so closely it is told
    assert result["stability"]["margin"] > 0 and result["stability"]["layer"] == "cytosol"
    with open(tmp_path / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == result["steps"] == 1
    saved = ElementTree.parse(tmp_path / "fields.pvd").findall(".//DataSet")
    assert [float(one.get("timestep")) for one in saved if not one.get("part")] == [result["t_s"]]
    first = "load amplitude 1: ellipticity is lost at t = 18000 s, load amplitude 1: margin -"
    assert any(line.startswith(first) for line in (tmp_path / "run.log").read_text().splitlines())


def test_verdict_on_a_collapse_says_that_the_material_had_given_way(tmp_path):
    data = {**END_ONLY, "cell": {"law": "saint-venant"}, "load": {"factor": 6.0}}
    result = solve(tmp_path, data)
    assert result["status"] == "failed"
    assert result["reason"].startswith("ellipticity is lost at t = ") and "margin -0." in result["reason"]
    assert "load amplitude 0.5" in result["reason"] or "load amplitude 0.6" in result["reason"]
    assert "in the cytosol" in result["reason"]


def test_verdict_on_a_stable_material_does_not_blame_it(tmp_path, monkeypatch):
    solver = newton.Solver.solve

    def solve_light_loads(self, amplitude, **how):
        if amplitude > 0.01:
            return newton.Outcome(1, 1, 1.0, Reason(Cause.NO_CONVERGENCE, "too heavy"))
        return solver(self, amplitude, **how)

    monkeypatch.setattr(newton.Solver, "solve", solve_light_loads)
    result = solve(tmp_path, {**END_ONLY, "cell": {"law": "saint-venant"}})
    assert result["status"] == "failed"
    assert "too heavy; in the last state, which is saved" in result["reason"]
    assert "the material is stable everywhere: margin 0.9" in result["reason"]
    assert "ellipticity is lost" not in result["reason"]
