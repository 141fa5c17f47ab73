"""Meshes are the same on 1, 2 and 3 ranks, and what fails on one rank fails on all."""

import json
import math
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

BUILD = """
import json, sys
from dolfinx import fem
from mpi4py import MPI
from cellmech.mesh.disc import DiscSpec
from cellmech.fem.domain import build_domain
from cellmech.fem.jit import compile_form

comm = MPI.COMM_WORLD
domain = build_domain(DiscSpec("full"), comm)
one = fem.Constant(domain.mesh, 1.0)
measures = {"outline": domain.dS(4, ("nucleus_outline",)), "outer": domain.ds(4, ("outer",))}
measures |= {name: domain.dx(2, (name,)) for name in domain.cells}
sizes = {name: comm.allreduce(fem.assemble_scalar(compile_form(one * m, comm))) for name, m in measures.items()}
if comm.rank == 0:
    print(json.dumps({"sizes": sizes, "quality": domain.quality}))
"""

FAIL = """
from mpi4py import MPI
from cellmech.fem.domain import from_gmsh
from cellmech.errors import MeshError
from cellmech.mesh.geometry import DiscSpec, build_disc, interrupt_kept

comm = MPI.COMM_WORLD

def attempt(model):
    try:
        from_gmsh(model, comm)
    except MeshError as error:
        texts = comm.allgather(str(error))
        assert len(set(texts)) == 1, texts
        if comm.rank == 0:
            print(texts[0], flush=True)

if comm.rank == 0:
    for break_it in (
        lambda model: model.removePhysicalGroups(),
        lambda model: model.mesh.setNode(int(model.mesh.getElementsByType(9)[1][0]), [50.0, 0.0, 0.0], []),
    ):
        with build_disc(DiscSpec(size_um=1.5)) as model:
            break_it(model)
            attempt(model)
else:
    attempt(None)
    attempt(None)
"""

BALL = """
import json
from mpi4py import MPI
from cellmech.fem import fenicsx
from cellmech.fem.domain import build_domain
from cellmech.mesh.ball import BallSpec
from cellmech.mesh.elements import jacobian_coefficients

comm = MPI.COMM_WORLD
domain = build_domain(BallSpec(size_um=5.0), comm)
volumes = jacobian_coefficients(fenicsx.cell_points(domain.mesh)).mean(axis=1) / 6
tags, own = domain.cell_tags, len(volumes)
sizes = {}
for name, number in domain.cells.items():
    cells = tags.find(number)
    sizes[name] = comm.allreduce(float(volumes[cells[cells < own]].sum()))
if comm.rank == 0:
    print(json.dumps({"sizes": sizes, "quality": domain.quality}))
"""

REFUSED = """
import tempfile
from mpi4py import MPI
from cellmech.mesh import geometry, store
from cellmech.fem.domain import build_domain
from cellmech.mesh.geometry import DiscSpec

world = MPI.COMM_WORLD
if world.rank == 0:
    tempfile.tempdir = "/nowhere"
    store.kept = lambda spec: None
for _ in range(2):
    try:
        build_domain(DiscSpec(size_um=8.0), world)
    except Exception as error:
        met = world.allgather((type(error).__name__, getattr(error, "filename", str(error))[:18]))
        if world.rank == 0:
            print(len(set(met)), *met[0])
    geometry.disc_sectors = None
"""

REUSE = """
from mpi4py import MPI
from cellmech.cell.layering import MeshPlan
from cellmech.scene.files import read_scene
from cellmech.cell.setup import Setup

world, scene = MPI.COMM_WORLD, read_scene({"mesh": {"size_um": 8.0}}, "test")
both = world.Dup()
shared = Setup(scene, both, MeshPlan()).number_of_cells
number = both.py2f()
both.Free()
own = world.Split(world.rank)
alone = Setup(scene, own, MeshPlan())
for kept in (world, MPI.COMM_SELF):  # until MPI ends
    Setup(scene, kept, MeshPlan())
told = world.gather((own.py2f() == number, alone.domain.mesh.comm.size, alone.number_of_cells == shared))
if world.rank == 0:
    print(told)
"""


def run(ranks: int, code: str) -> str:
    command = ["mpirun", "-n", str(ranks), sys.executable, "-c", code]
    out = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env={**os.environ, **MPIRUN}, timeout=300)
    assert out.returncode == 0, out.stderr
    return out.stdout


@pytest.fixture(scope="module")
def serial():
    return json.loads(run(1, BUILD))


@pytest.mark.parametrize("ranks", [2, 3])
def test_distributed_mesh_has_the_groups_and_quality_of_the_serial_one(ranks, serial):
    distributed = json.loads(run(ranks, BUILD))
    assert serial["sizes"]["outline"] == pytest.approx(31.4159, rel=1e-5)
    assert distributed["sizes"] == pytest.approx(serial["sizes"], rel=1e-12)
    assert distributed["quality"] == pytest.approx(serial["quality"], rel=1e-12)


def test_distributed_ball_has_the_volumes_and_quality_of_the_serial_one():
    one, two = (json.loads(run(ranks, BALL)) for ranks in (1, 2))
    assert one["sizes"]["lamina"] == pytest.approx(math.pi / 3 * (5.0**3 - 4.9**3), rel=3e-4)
    assert two["sizes"] == pytest.approx(one["sizes"], rel=1e-12)
    assert two["quality"] == pytest.approx(one["quality"], rel=1e-12)


def test_bad_mesh_raises_the_same_error_on_every_rank(ladder):
    said = run(2, FAIL).splitlines()
    expected = ("no physical group of surfaces", "the Jacobian is not positive all over")
    same = sum(text in line for text, line in zip(expected, said, strict=True))
    ladder("2 ranks: errors of one that raise alike on both", ours=same, reference=2)


def test_what_is_no_fault_of_the_mesh_raises_the_same_error_on_every_rank():
    said = run(2, REFUSED).splitlines()
    assert said[0].startswith("1 FileNotFoundError /nowhere/")
    assert said[1] == "1 RuntimeError TypeError: 'NoneTy"


def test_communicator_gets_no_mesh_of_one_that_had_its_number():
    assert run(2, REUSE) == f"{[(True, 1, True)] * 2}\n"
