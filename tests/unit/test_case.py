"""However a case ends, nothing of it is left in memory."""

import csv
from contextlib import closing, nullcontext

import numpy as np
import pytest
from mpi4py import MPI

from cellmech.causes import Cause, Reason
from cellmech.cell.observables import Observer
from cellmech.cell.setup import Setup
from cellmech.errors import SolveError
from cellmech.results.records import CaseFolder
from cellmech.runs import case as cases
from cellmech.runs.case import mesh_plan, solve_case
from cellmech.runs.interrupts import Interrupted
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene
from cellmech.solver.acceptance import Acceptance, Refused
from cellmech.solver.ellipticity import StabilityWatch

ENDS = [None, OSError(28, "No space left on device"), ZeroDivisionError(), KeyboardInterrupt(), Interrupted(15)]


@pytest.mark.parametrize("end", ENDS, ids=lambda end: type(end).__name__)
def test_solver_is_freed_however_its_case_ends(end, tmp_path, monkeypatch):
    """PETSc's objects have no handle afterwards."""
    case = Case("case", read_scene({"mesh": {"size_um": 8.0}, "time": {"history": False}}, "test"))
    create, runs = Setup.create_run, []

    def kept(self, log):
        runs.append(create(self, log))
        return runs[-1]

    def report(progress):
        if end is not None:
            raise end

    monkeypatch.setattr(Setup, "create_run", kept)
    raises = nullcontext() if end is None else pytest.raises(type(end))
    with closing(CaseFolder(tmp_path, MPI.COMM_SELF)) as folder, raises:
        solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), report)
    (run,) = runs
    assert [held.handle for held in (run.solver._snes, run.solver._A, run.solver._x)] == [0, 0, 0]


class Pushed:
    """An object like another one but for the contact's force, which points aside."""

    def __init__(self, ledger, push):
        self.ledger, self.push = ledger, push

    def __getattr__(self, name):
        return getattr(self.ledger, name)

    def contact_force(self, amplitude=None):
        return self.push * abs(self.ledger.load_resultant()[1]) * self.ledger.amplitude


class Turned(Pushed):
    """An object like another one but for the moment; `push` is its arm [µm]."""

    def contact_force(self, amplitude=None):
        return self.ledger.contact_force()

    def moment(self, amplitude):
        return self.push * abs(self.ledger.load_resultant()[1]) * self.ledger.amplitude


def test_cell_slides_only_beyond_what_an_unsymmetric_mesh_pushes():
    scene = read_scene({"cell": {"shape": "full"}, "mesh": {"size_um": 8.0}, "time": {"history": False}}, "test")
    run = Setup(scene, MPI.COMM_SELF, mesh_plan(scene)).create_run(lambda line: None)
    with closing(run):
        run.run(lambda step: None)
        real, unseen = run.ledger, [0.0]
        accepted = Acceptance(run, StabilityWatch(run.body, run.state.u), 1.0, False, lambda: unseen[0])

        def held(ledger):
            run.ledger = ledger
            return accepted.held(real.amplitude)

        assert held(Pushed(real, np.array([0.9e-3, 1.0]))) is held(Turned(real, 0.9e-2)) is None
        slides, turns = Pushed(real, np.array([-1.1e-3, 1.0])), Turned(real, -1.1e-2)
        assert (held(slides).cause, held(turns).cause) == (Cause.SLIDES, Cause.TURNS)
        assert held(slides).text.startswith("slides: no equilibrium; the obstacles push sideways with -")
        assert held(turns).text.startswith("turns: no equilibrium; the obstacles turn it with -")
        assert held(turns).text.endswith("0.011 um times the load")
        unseen[0] = 0.98
        assert (held(slides).cause, held(turns).cause) == (Cause.TOO_COARSE, Cause.TOO_COARSE)
        assert "98 % of their force lie between the points" in held(slides).text
        assert held(slides).text.startswith("the mesh is too coarse to tell whether the cell slides")
        assert held(turns).text.startswith("the mesh is too coarse to tell whether the cell turns")


def test_cell_in_contact_with_itself_does_not_count(monkeypatch):
    scene = read_scene({"mesh": {"size_um": 8.0}, "time": {"history": False}}, "test")
    run = Setup(scene, MPI.COMM_SELF, mesh_plan(scene)).create_run(lambda line: None)
    with closing(run):
        run.acceptance.judge(1.0, 0.0)
        monkeypatch.setattr(run, "crossing", lambda: (1.0, 2.0))
        with pytest.raises(Refused, match=r"contact with itself \(at x = 1, y = 2 um\)") as caught:
            run.acceptance.judge(1.0, 0.0)
        assert caught.value.cause is Cause.SELF_CONTACT


def test_moment_is_that_of_the_forces_about_where_the_load_acts(monkeypatch):
    """A cell at rest feels none; a force along x at a node feels its height above the load's centre."""
    scene = read_scene({"cell": {"shape": "full"}, "mesh": {"size_um": 8.0}, "time": {"history": False}}, "test")
    run = Setup(scene, MPI.COMM_SELF, mesh_plan(scene)).create_run(lambda line: None)
    with closing(run):
        run.run(lambda step: None)
        ledger, weight = run.ledger, abs(run.ledger.load_resultant()[1]) * run.ledger.amplitude
        assert abs(ledger.moment(ledger.amplitude)) < 1e-3 * weight * 10.0
        forces, load = ledger._assemble("contact").reshape(-1, 2), ledger.load_vector.reshape(-1, 2)[:, 1]
        height = run.body.space.tabulate_dof_coordinates()[: len(forces), 1] + run.u.reshape(-1, 2)[: len(forces), 1]
        lowest = np.argmin(height)
        forces[lowest] += 0.1 * weight, 0.0
        monkeypatch.setattr(ledger, "_assemble", lambda name: forces.ravel())
        arm = load @ height / load.sum() - height[lowest]
        assert ledger.moment(ledger.amplitude) == pytest.approx(0.1 * weight * arm, rel=1e-3) and arm > 9.0


def test_state_that_only_the_constraint_holds_is_not_the_one_saved(tmp_path, monkeypatch):
    """The verdict comes with the last state in balance, here the third."""
    data = {"cell": {"shape": "full", "law": "saint-venant"}, "mesh": {"size_um": 8.0}}
    case = Case("case", read_scene(data, "test"))
    slides = Reason(Cause.SLIDES, "slides")
    monkeypatch.setattr(Acceptance, "held", lambda self, amplitude: slides if self.run.totals.steps > 2 else None)
    observe, seen, written = Observer.observe, [], []

    def observe_and_keep(self, t_s):
        seen.append(self.run.u.copy())
        return observe(self, t_s)

    monkeypatch.setattr(Observer, "observe", observe_and_keep)
    monkeypatch.setattr(
        cases, "write_fields", lambda folder, scene, observer, *rest: written.append(observer.run.u.copy())
    )
    with closing(CaseFolder(tmp_path, MPI.COMM_SELF)) as folder:
        result = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)
        folder.flush()
    rows = list(csv.DictReader((tmp_path / "history.csv").read_text().splitlines()))
    assert (result["status"], result["cause"]) == ("failed", "slides")
    assert result["reason"].startswith("slides; in the last state, which is saved")
    assert len(rows) == result["steps"] == 3 and float(rows[-1]["t_s"]) == result["t_s"]
    assert result["contact"]["force_Pa_x_um"] == float(rows[-1]["contact.force_Pa_x_um"])
    assert len(seen) == 3 and len(written) == 1 and np.array_equal(written[0], seen[2])


@pytest.mark.parametrize(("last", "saved"), [(1, False), (10, True)])
def test_first_state_of_a_fall_that_ends_there_is_not_saved(last, saved, tmp_path):
    """A first step under a load that grows makes up to twenty times too much of it; the later ones let that fade."""
    data = {"cell": {"inertia": True}, "pillar": [], "flat": False, "load": {"half_ramp_s": 0}, "time": {"end_s": 1e-3}}
    case = Case("case", read_scene(data | {"mesh": {"size_um": 6.0, "order": 1}}, "test"))

    def report(progress):
        if progress.step == last:
            raise SolveError("no way on")

    with closing(CaseFolder(tmp_path, MPI.COMM_SELF)) as folder:
        result = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), report)
        folder.flush()
    rows = list(csv.DictReader((tmp_path / "history.csv").read_text().splitlines()))
    assert result["status"] == "failed" and len(rows) == result["steps"] == last
    assert ("which is saved" if saved else "is not saved") in result["reason"]
    assert ("nucleus" in result, result["settled"] is not None, bool([*tmp_path.glob("*.vtu")])) == (saved,) * 3


def test_state_asked_for_when_a_fall_has_hardly_begun_is_in_doubt(tmp_path):
    """It has fallen 5e-10 um, of which the sixteen digits of a radius leave six."""
    data = {"cell": {"inertia": True}, "pillar": [], "flat": False, "load": {"half_ramp_s": 0}, "time": {"end_s": 1e-4}}
    data |= {"mesh": {"size_um": 6.0, "order": 1}, "output": {"times_s": [1e-8, 5e-5]}}
    case = Case("case", read_scene(data, "test"))
    with closing(CaseFolder(tmp_path, MPI.COMM_SELF)) as folder:
        result = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)
        folder.flush()
    assert result["status"] == "solved"
    assert result["model"]["warnings"]["motion"].startswith("at t = 1e-08 s the cell has hardly begun to move")


def test_case_goes_on_beyond_the_loss_of_ellipticity_where_it_is_asked_to(tmp_path):
    """Marked in the result, in the history from the step on, in the field file and among what is in doubt."""
    data = {
        "cell": {"law": "saint-venant"},
        "load": {"factor": 3.55},
        "mesh": {"size_um": 6.0},
        "time": {"history": False},
    }

    def solved(choice):
        case, place = Case("case", read_scene(data | {"stability": choice}, "test")), tmp_path / choice
        place.mkdir()
        with closing(CaseFolder(place, MPI.COMM_SELF)) as folder:
            result = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)
            folder.flush()
        return result, list(csv.DictReader((place / "history.csv").read_text().splitlines())), place

    stopped, rows, place = solved("stop")
    assert (stopped["status"], stopped["cause"]) == ("failed", "ellipticity")
    assert stopped["reason"].startswith("ellipticity is lost at")
    assert "beyond_ellipticity" not in stopped and "beyond_ellipticity" not in rows[0]
    assert b"beyond_ellipticity" not in (place / "fields_0000.vtu").read_bytes()
    gone_on, rows, place = solved("warn")
    assert gone_on["status"] == "solved" and gone_on["t_s"] == 18000.0 and gone_on["stability"]["margin"] < 0
    assert gone_on["beyond_ellipticity"]["since_s"] == 18000.0  # the end state alone was asked for
    assert "ellipticity is lost at" in gone_on["model"]["warnings"]["ellipticity"]
    assert rows[-1]["beyond_ellipticity"] == "1"
    assert b'Name="beyond_ellipticity"' in (place / "fields_0000.vtu").read_bytes()
