"""Whether a body that a load lifts lets go of the obstacles that pull it.

Its equilibria end at a fold, of which Newton's method knows only that it finds no other. Just beyond, the body peels
and either comes off or stops at another equilibrium: implicit Euler steps against a drag on the outline lead there.
Their length means nothing, and follows Newton's method.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import Body
from cellmech.solver.energy_balance import Ledger
from cellmech.solver.newton import ROUGH, Solver
from cellmech.solver.rigid_modes import RigidModes
from cellmech.solver.state import State

NOTHING = 1e-6  # of the force scale: a pull that is none
MOST_STEPS = 60
GROWTH, CUT = 3.0, 0.25  # of a step that was solved, and of one that was not
STILL = 1e-4  # of the range, over a step that is as long as `RESTS`: the body has come to rest
RESTS = 1e3  # times the first step


def is_free(ledger: Ledger, amplitude: float, force_scale: float) -> bool:
    """True if the obstacles neither pull nor push, but for what Newton's tolerance leaves of their pull. Collective.

    Args:
        ledger: of the body as it is now.
        amplitude: of its load [-].
        force_scale: a force such as the weight [Pa µm or pN].
    """
    share = max((driver.share(amplitude) for driver in ledger.body.pulling), default=0.0)
    forces = np.array([ledger.pull(amplitude), ledger.contact_force(amplitude)])
    return bool(np.all(np.abs(forces) <= NOTHING * share * force_scale))


def lets_go(body: Body, u: np.ndarray, amplitude: float, force_scale: float, modes: RigidModes | None) -> bool:
    """Whether the body, from the displacement u, ends where no obstacle pulls or pushes it. Collective.

    Args:
        body: that nothing but its obstacles holds.
        u: displacement on this rank, ghosts included [µm], flat.
        amplitude: of the load that lifts it, kept [-].
        force_scale: a force such as the weight [Pa µm or pN].
        modes: rigid motions to take out.
    """
    slow = dataclasses.replace(body, drag=1.0)
    state = State(slow)
    state.u.x.array[:] = u
    state.update()
    state.rest()
    ledger, solver = Ledger(slow, state), Solver(slow, state, force_scale, ROUGH, modes)
    surface = fem.assemble_scalar(compile_form(slow.along(slow.domain.constant(1.0), ("outer",)), solver.comm))
    lift = np.linalg.norm(ledger.load_resultant()) * abs(slow.dead(amplitude))
    h = first = float(slow.reach_um * solver.comm.allreduce(surface) / lift)
    try:
        for _ in range(MOST_STEPS):
            state.ddt.set((1.0 / h, -1.0 / h, 0.0))
            start = state.u.x.array.copy()
            if not solver.solve(amplitude, leap=True).converged:
                state.u.x.array[:] = start
                h *= CUT
                continue
            if is_free(ledger, amplitude, force_scale):
                return True
            moved = solver.comm.allreduce(float(np.abs(state.u.x.array - start).max(initial=0.0)), op=MPI.MAX)
            if h > RESTS * first and moved < STILL * slow.reach_um:
                return False
            state.rest()
            h *= GROWTH
        return False
    finally:
        solver.close()
