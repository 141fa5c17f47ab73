"""The size of a ball's mesh is known before it is made."""

import pytest
from mpi4py import MPI
from pytest import approx

from cellmech.cell.layering import mesh_plan
from cellmech.cell.placed import Placed
from cellmech.cell.setup import Setup
from cellmech.fem.domain import build_domain
from cellmech.mesh.ball import BallSpec
from cellmech.mesh.ball_size import expected_cells
from cellmech.runs.case import Case, describe_case
from cellmech.scene.files import read_scene
from cellmech.solver import room

LATTICE = {"pitch_um": 10.0, "width_um": 5.0, "height_um": 5.0, "profile": "square", "offset_um": [5.0, 5.0]}


def ball(size_um, **tables):
    data = {"cell": {"geometry": "3d"}, "mesh": {"size_um": size_um}, "time": {"history": False}, **tables}
    return read_scene(data, "test")


@pytest.mark.parametrize("lattice", [{}, {"pillar": [], "array": LATTICE}])
def test_size_is_expected_to_a_tenth(lattice):
    scene = ball(2.0, **lattice)
    plan = mesh_plan(scene)
    cells, unknowns, needed = Placed(scene, plan).expected_size()
    setup = Setup(scene, MPI.COMM_SELF, plan)
    assert cells == approx(setup.number_of_cells, rel=0.1)
    assert unknowns == approx(setup.dofs, rel=0.1)
    assert needed == approx(room.needed_bytes(setup.dofs, 3, multigrid=True), rel=0.12)


def test_half_and_full_balls_have_twice_and_four_times_the_elements():
    quarter, half, full = (expected_cells(BallSpec(shape=shape, size_um=3.0)) for shape in ("quarter", "half", "full"))
    assert (half / quarter, full / quarter) == approx((2, 4))
    mesh = build_domain(BallSpec(shape="half", size_um=3.0), MPI.COMM_SELF).mesh
    assert half == approx(mesh.topology.index_map(3).size_global, rel=0.25)


def test_disc_is_meshed_and_not_estimated():
    scene = read_scene({}, "test")
    assert Placed(scene, mesh_plan(scene)).expected_size() == (0, 0, 0.0)


def test_what_is_too_large_is_refused_and_described_without_a_mesh():
    """At 0.15 um some 10^7 tetrahedra and 2 10^8 unknowns."""
    scene = ball(0.15)
    with pytest.raises(MemoryError, match=r"unknowns need about .* GiB, .* are free. A mesh.size_um .* times as large"):
        Setup(scene, MPI.COMM_SELF, mesh_plan(scene))
    found = describe_case(Case("large", scene), MPI.COMM_SELF, mesh_plan(scene))
    assert found.estimated and found.dofs > 1e8
    assert found.model[-1].startswith("warning: memory: it takes about ")
