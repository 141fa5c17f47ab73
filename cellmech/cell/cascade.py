"""A first guess of a large case's equilibrium in space: that of the same case with fewer unknowns.

Newton's method takes some thirty iterations from the first touch to the end state, whatever the mesh, and some eight
from a guess that is near. A case of third order begins at the equilibrium of second order on its own mesh, and a large
one of second order at that of a coarser mesh. Where these find no way to the whole load, it begins at the last
equilibrium that they do find.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from mpi4py import MPI

from cellmech.cell.additions import Additions
from cellmech.cell.layering import MeshPlan
from cellmech.cell.setup import Setup
from cellmech.errors import CellmechError, SolveError
from cellmech.fem import fenicsx
from cellmech.scene.parts import Mesh
from cellmech.solver.load_steps import Guess, LoadSteps
from cellmech.solver.simulation import Simulation

UNKNOWNS = 12_000  # of the coarsest mesh, roughly
WORTH = 4.0  # times as many unknowns, from which a guess is worth its own solution
SMALLEST = 1 / 64  # of the load: a load step below it is worth none
ROUGHLY = 1e-4  # of the load that may be out of balance: less than another mesh changes, and than a verdict sees
FEWER = 0.5  # of the unknowns, above which it is none: thin layers and contacts may leave no coarser mesh


def begin_near(setup: Setup, run: Simulation, plan: MeshPlan, additions: Additions, log: Callable[[str], None]) -> None:
    """Move a run's displacement to a first guess, if it is large and goes to its end state at once (collective)."""
    ratio, stepping = setup.dofs / UNKNOWNS, run.stepping
    if setup.kinematics.components < 3 or run.schedule.load_steps or ratio < WORTH:
        return
    if not isinstance(stepping, LoadSteps):  # its path counts
        return
    mesh, comm = setup.scene.mesh, setup.comm
    if mesh.order == 3:
        before: Any = mesh.model_copy(update={"order": 2})
    else:  # every rank solves it by itself: no rank waits for another, and all find the same
        size = min(mesh.size_um * ratio ** (1 / 3), setup.scene.radius_um / 2)
        before, comm = Mesh(order=2, size_um=size, thin_layers=1), MPI.COMM_SELF
    whole = run.body.amplitude(run.schedule.end_s)
    try:
        with_fewer = Setup(setup.scene.model_copy(update={"mesh": before}), comm, plan, additions)
        if with_fewer.dofs > FEWER * setup.dofs:
            return
        first = with_fewer.create_run(lambda line: log(f"first guess: {line}"), ROUGHLY)
        try:
            begin_near(with_fewer, first, plan, additions, log)
            share = _go_far(first) / whole
            if share > 0.0:
                same = with_fewer.domain is setup.domain
                found = fenicsx.interpolated(first.state.u, run.body.space) if same else _carried_over(first, run)
        finally:
            first.close()
    except CellmechError as error:  # of the other mesh, which need not be this one's
        log(f"no first guess: {error}")
        return
    if share == 0.0:
        log(f"no first guess: {with_fewer.dofs} unknowns find no equilibrium")
        return
    stepping.begin_near(Guess(share * whole, found, SMALLEST * whole))
    kind = "second order" if mesh.order == 3 else f"mesh.size_um = {before.size_um:.3g}"
    load = "" if share == 1.0 else f" at {share:.4g} of the load"
    log(f"first guess: the equilibrium of {with_fewer.dofs} unknowns{load} ({kind})")


def _go_far(run: Simulation) -> float:
    """Bring a run to its end, or as far as large load steps lead; returns the load amplitude that acts then [-]."""
    assert isinstance(run.stepping, LoadSteps)
    run.stepping.smallest = SMALLEST
    try:
        run.run(lambda step: None)
    except SolveError as error:
        run.log(str(error))
    return run.stepping.last.amplitude


def _carried_over(first: Simulation, run: Simulation) -> np.ndarray:
    """The displacement of a run on one rank at the nodes of another [µm], ghosts included, flat."""
    return fenicsx.values_at(first.state.u, run.body.space.tabulate_dof_coordinates()).ravel()
