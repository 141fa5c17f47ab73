"""However a case ends, nothing of it is left in memory."""

from contextlib import closing, nullcontext

import pytest
from mpi4py import MPI

from cellmech.case import mesh_plan, solve_case
from cellmech.interrupts import Interrupted
from cellmech.records import CaseFolder
from cellmech.scene_file import read_scene
from cellmech.setup import Setup
from cellmech.study_file import Case

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
