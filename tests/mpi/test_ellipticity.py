"""The point nearest to losing ellipticity is the same on 1, 2 and 3 ranks."""

import json
import subprocess
import sys

import pytest
from cli.programs import ENVIRONMENT, PATIENCE_S, ROOT

pytestmark = pytest.mark.mpi

FIND = """
import json
import numpy as np
from mpi4py import MPI
from cellmech.runs.case import mesh_plan
from cellmech.solver.ellipticity import StabilityWatch
from cellmech.scene.files import read_scene
from cellmech.cell.setup import Setup
from cellmech.scene.studies import Case

comm = MPI.COMM_WORLD
found = []
for law in ("saint-venant", "neo-hookean", "yeoh"):
    layers = {"cytosol": {"law": law}, "lamina": {"law": "saint-venant"}}
    case = Case("case", read_scene({"mesh": {"size_um": 3.0}, "layer": layers}, "test"))
    setup = Setup(case.scene, comm, mesh_plan(case.scene))
    run = setup.create_run(lambda line: None)
    x = run.body.space.tabulate_dof_coordinates()[:, :2] / 10.0
    run.u[0::2] = 0.3 * x[:, 0] ** 2 + 0.1 * np.sin(x[:, 1])
    run.u[1::2] = -1.5 * x[:, 1] * (1 - 0.3 * x[:, 0])
    watch = StabilityWatch(run.body, run.state.u)
    found.append([watch.look_if_due().as_dict(), *watch.seen, str(watch.look_if_due())])
    run.close()
if comm.rank == 0:
    print(json.dumps(found))
"""


def find(ranks):
    command = ["mpirun", "-n", str(ranks), sys.executable, "-c", FIND]
    out = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=ENVIRONMENT, timeout=PATIENCE_S)
    assert out.returncode == 0, out.stderr
    return json.loads(out.stdout)


def test_least_margin_does_not_depend_on_the_decomposition():
    serial = find(1)
    assert {found["layer"] for found, *_ in serial} == {"cytosol", "lamina"}
    for ranks in (2, 3):
        for (ours, *numbers), (theirs, *expected) in zip(find(ranks), serial, strict=True):
            assert numbers[:2] == pytest.approx(expected[:2], rel=1e-11) and numbers[2] == expected[2] == "None"
            assert ours["layer"] == theirs["layer"]
            for key in ("margin", "angle_deg", "amplitude_deg"):
                assert ours[key] == pytest.approx(theirs[key], rel=1e-5 if key.endswith("deg") else 1e-11), key
            assert ours["at_um"] == pytest.approx(theirs["at_um"], rel=1e-9)
