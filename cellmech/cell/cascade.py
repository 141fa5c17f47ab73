"""A first guess of a large case's equilibrium: that of the same case on a coarser mesh.

Newton's method takes some thirty iterations from the first touch to the end state, whatever the mesh, and some six from
a guess that is near: of a mesh eight times as large, most of the time is saved.
"""

from __future__ import annotations

from collections.abc import Callable

from mpi4py import MPI

from cellmech.cell.additions import Additions
from cellmech.cell.layering import MeshPlan
from cellmech.cell.setup import Setup
from cellmech.errors import CellmechError
from cellmech.fem import fenicsx
from cellmech.scene.parts import Mesh
from cellmech.solver.simulation import Run

UNKNOWNS = 12_000  # of the coarse mesh, roughly
WORTH = 4.0  # times as many unknowns, from which the guess is worth its mesh


def begin_near(setup: Setup, run: Run, plan: MeshPlan, additions: Additions, log: Callable[[str], None]) -> None:
    """Move a run's displacement to a first guess, if it is large and goes to its end state at once (collective).

    Every rank solves the coarse case by itself: no rank waits for another, and all find the same.
    """
    ratio = setup.dofs / UNKNOWNS
    if setup.kinematics.components < 3 or run.body.rate_dependent or run.schedule.load_steps or ratio < WORTH:
        return
    scene = setup.scene
    size = min(scene.mesh.size_um * (ratio ** (1 / 3)), scene.radius_um / 2)
    coarse_scene = scene.model_copy(update={"mesh": Mesh(order=2, size_um=size, thin_layers=1)})
    coarse = Setup(coarse_scene, MPI.COMM_SELF, plan, additions)
    first = coarse.create_run(lambda line: None)
    try:
        first.run(lambda step: None)
        places = setup.body.space.tabulate_dof_coordinates()
        run.u[:] = fenicsx.values_at(first.state.u, places).ravel()
        run.state.update()
        log(f"first guess: the equilibrium of {coarse.dofs} unknowns (mesh.size_um = {size:.3g})")
    except CellmechError as error:  # of the coarse mesh, which need not be this one's
        log(f"no first guess of a coarser mesh: {error}")
    finally:
        first.close()
