"""Multigrid finds the same body on 1, 2 and 3 ranks."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.mpi
ROOT = Path(__file__).parents[2]
MPIRUN = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    "OMP_NUM_THREADS": "1",
}

SOLVE = """
import json, sys
sys.path.insert(0, "tests")
import numpy as np
from mpi4py import MPI
from slab import PUSH, slab
from cellmech.solver import linear
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

linear.LARGE = 0
comm = MPI.COMM_WORLD
body = slab(comm)
state = State(body)
solver = Solver(body, state, PUSH, tolerance=1e-11)
outcome = solver.solve(1.0)
coarse = solver._linear._P.getSize()[1]
iterations = solver._linear._ksp.getIterationNumber()
u = state.u.x.array.reshape(-1, 3)[: body.space.dofmap.index_map.size_local]
largest = np.max(comm.allgather(np.abs(u).max(axis=0, initial=0.0)), axis=0)
sums = comm.allreduce((u**2).sum(axis=0))
solver.close()
if comm.rank == 0:
    print(json.dumps([outcome.converged, coarse, iterations, *largest, *sums]))
"""


def solved(ranks):
    start = [] if ranks == 1 else ["mpirun", "-n", str(ranks)]
    command = [*start, sys.executable, "-c", SOLVE]
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, **MPIRUN}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_multigrid_finds_the_same_body_on_any_number_of_ranks():
    alone = solved(1)
    assert alone[0]
    for ranks in (2, 3):
        found = solved(ranks)
        assert found[:2] == alone[:2]
        assert found[2] <= alone[2] + 2
        assert found[3:] == pytest.approx(alone[3:], rel=1e-8)
