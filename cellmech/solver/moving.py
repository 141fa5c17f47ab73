"""The body that goes through time, as steps need it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from cellmech.causes import Reason
from cellmech.mechanics.balance import Body
from cellmech.solver.energy_balance import Ledger
from cellmech.solver.newton import Outcome
from cellmech.solver.schedule import Schedule, Step, Totals
from cellmech.solver.state import State


class Moving(Protocol):
    """A body that goes through time, as its steps need it (`cellmech.solver.simulation.Simulation`)."""

    body: Body
    state: State
    ledger: Ledger
    schedule: Schedule
    totals: Totals
    t: float
    log: Callable[[str], None]

    @property
    def u(self) -> np.ndarray:
        """Displacement on this rank [µm], flat."""

    @property
    def jumps(self) -> bool:
        """True if the displacement jumps at the start."""

    def lifted(self, amplitude: float) -> bool:
        """True if the load lifts the body off what it adheres to: beyond a fold no solve succeeds, and all cost."""

    def solve(self, amplitude: float, rough: bool = False, leap: bool = False) -> Outcome:
        """Solve at a load amplitude [-], beginning near the present displacement."""

    def relative(self, error: np.ndarray, formula: tuple[float, float, float] | None = None) -> float:
        """An error over the largest displacement so far [-]."""

    def reaches_more(self) -> bool:
        """True if the body has come to another obstacle, which then is in the problem."""

    def lost(self, t: float, amplitude: float) -> Reason | None:
        """Why an equilibrium on the way, at the time t [s], is none to go on from: the material is unstable."""

    def accept(self, t: float, h: float, outcome: Outcome, error: float | None) -> Step:
        """Book a step to the time t [s], h [s] long."""

    def no_way_on(self, reason: Reason, amplitude: float, t: float | None = None) -> Reason:
        """The reason of a failure with its place: the present time or t [s]."""
