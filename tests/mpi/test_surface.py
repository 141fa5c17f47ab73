"""What a surface measures, and a nucleus's shape, on 1 and 2 ranks; its facets may lie between cells of both."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
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

MEASURE = """
import json, sys
import numpy as np
from dolfinx import fem
from mpi4py import MPI
from balls import MIRRORED, ball
from cellmech.fem import jit
from cellmech.cell.shape import nucleus_shape
from cellmech.fem.curves import moments
from cellmech.fem.domain import build_domain
from cellmech.fem.outline import Outline
from cellmech.fem.surface import Surface
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.mesh.disc import DiscSpec

def flat(shape):
    return [number for value in shape.values() if value is not None for number in np.atleast_1d(value).tolist()]

found = {}
disc = build_domain(DiscSpec("full", size_um=2.0), MPI.COMM_WORLD)
space = jit.displacement_space(disc.mesh, 3)
X, u = space.tabulate_dof_coordinates()[:, :2], fem.Function(space)
u.x.array[:] = (X * [0.2, -0.1] + 0.02 * X[:, ::-1] ** 2).ravel()
outline = Outline(disc, space, "nucleus_outline")
found["outline"] = flat(nucleus_shape(outline, u, False, False, 7.0))
for shape in ("quarter", "full"):
    domain = ball(shape, 3.0, 10.0, 5.0)
    for order in (2, 3):
        space = jit.displacement_space(domain.mesh, order)
        X, u = space.tabulate_dof_coordinates(), fem.Function(space)
        bend = 1 + 0.02 * X[:, :1] ** 2 * (1 + 0.1 * np.sin(X[:, 2:]) ** 2) - 0.003 * X[:, 1:2]
        u.x.array[:] = (X * (bend * [1.1, 0.8, 1.0] - 1) + [0.0, 20.0, 0.0]).ravel()
        nucleus = Surface(domain, space, "nucleus_outline", MIRRORED[shape])
        found[f"{shape} {order} shape"] = flat(nucleus_shape(nucleus, u, shape == "quarter", False, 17.0))
        for name in ("nucleus_outline", "outer"):
            surface = Surface(domain, space, name, MIRRORED[shape])
            area, volume, centroid = surface.content(u)
            low, high = surface.box(u)
            obstacles = [Flat(low[1] + 0.2), Pillar(0.7, low[1] - 2.0, 1.0, 2.3)]
            patch = surface.contact_area(u, obstacles, 0.05)
            sections = [surface.section_moments(u, axis, 0.4) for axis in (0, 2)]
            numbers = [area, volume, *low, *high, *surface.pole(u, 1.0), surface.volume_below(u, low[1] + 1.0)]
            numbers += [patch.area_um2, patch.along_x_um, patch.along_z_um]
            numbers += [surface.max_depth(u, obstacles), centroid[1]]
            numbers += [s for m in sections for s in (m.length, m.area, m.centroid[1])]
            shadow = moments(surface.shadow(u))
            found[f"{shape} {order} {name}"] = [*map(float, numbers), shadow.length, shadow.area]
if MPI.COMM_WORLD.rank == 0:
    print(json.dumps(found))
"""


def measured(ranks):
    environment = dict(os.environ) | MPIRUN | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests")])}
    command = ["mpirun", "-n", str(ranks), sys.executable, "-m", "mpi4py", "-c", MEASURE]  # an error ends all ranks
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_surface_measures_are_the_same_on_two_ranks():
    serial, parallel = measured(1), measured(2)
    for case, numbers in serial.items():
        assert np.array(parallel[case]) == pytest.approx(np.array(numbers), rel=1e-12, abs=1e-12), case
