"""Acceptance of a solved state: the material determines it, and nothing but contact holds it.

Asked before a step is booked. Newton and the stepping have seen to its being solved, accurate and not inside out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from cellmech.causes import Cause, Reason
from cellmech.errors import SolveError
from cellmech.names import coordinates
from cellmech.solver.ellipticity import Stability, StabilityWatch
from cellmech.solver.ellipticity_in_space import StabilityInSpace
from cellmech.solver.energy_balance import Ledger

MISSED = 0.02  # share of the contact's force that the points at which it is integrated may miss unsaid
SLIDING = 1e-3  # share of the weight that may push sideways, or turn at the radius: an unsymmetric mesh, not a slope


class Refused(SolveError):
    """A solved state that does not count.

    Args:
        reason: why.
        shown: whether it is reported all the same where no state before it is.
        found: how the material's stability was found wanting, if that is why.
    """

    def __init__(self, reason: Reason, shown: bool = False, found: Stability | StabilityInSpace | None = None) -> None:
        super().__init__(reason)
        self.shown, self.found = shown, found


class Judged(Protocol):
    """A body that goes through time, as its judge needs it."""

    ledger: Ledger
    modes: Any
    reach_um: float
    log: Callable[[str], None]

    def crossing(self) -> tuple[float, ...] | None:
        """A place where the body crosses itself [µm], if that is looked for and found."""

    def come_off(self, t: float, amplitude: float) -> Reason | None:
        """Why the state at the time t [s] does not count, if a load lifts the body off the obstacles."""


class Acceptance:
    """Judges the states of a run.

    Args:
        run: the run.
        watch: looks for the loss of ellipticity.
        end_s: of the run; the last state is always looked at [s].
        goes_on: whether states beyond the loss of ellipticity count; they are marked then.
        missed: share of the contact's force that the mesh misses [-], of the present state; collective.
        upright: whether a moment that only the constraint on the mean rotation bears is none of the body's faults.
    """

    def __init__(
        self,
        run: Judged,
        watch: StabilityWatch,
        end_s: float,
        goes_on: bool,
        missed: Callable[[], float],
        upright: bool = False,
    ) -> None:
        self.run, self.watch, self.end_s, self.goes_on, self.missed = run, watch, end_s, goes_on, missed
        self.upright = upright
        self.beyond: dict[str, float] = {}  # since when ellipticity has been lost, in a case that goes on nevertheless
        self.doubt = ""  # what is said of states beyond it
        self.stability: Stability | StabilityInSpace | None = None  # of the last state that was looked at

    def judge(self, t: float, amplitude: float) -> None:
        """Raise `Refused` for a state at the time t [s] that does not count. Collective."""
        if (come_off := self.run.come_off(t, amplitude)) is not None:
            raise Refused(come_off)
        found = None if self.beyond and t < self.end_s else self._look(t)
        if found is not None and found.lost:
            lost = Cause.ELLIPTICITY.reason(t_s=t, amplitude=amplitude, found=found)
            if not self.goes_on:
                raise Refused(lost, shown=True, found=found)
            if not self.beyond:
                self.beyond = {"since_s": t, "load_amplitude": amplitude}
                self.doubt = f'{lost}; this state is beyond, as stability = "warn" asks for'
                self.run.log(f"warning: ellipticity: {self.doubt}")
        if (place := self.run.crossing()) is not None:
            raise Refused(Cause.SELF_CONTACT.reason(where=coordinates(place)))
        if self.run.modes is not None and (fault := self.held(amplitude)):
            raise Refused(fault)
        self.stability = found or self.stability

    def lost_on_the_way(self, t: float, amplitude: float) -> Reason | None:
        """Why an equilibrium at the time t [s] is none to go on from, if it is not; before `judge`. Collective."""
        if self.goes_on:
            return None
        before, found = self.watch.seen, self._look(t)
        if found is None or not found.lost:
            return None
        self.watch.seen = before  # the next state that is looked at is one of a smaller load
        return Cause.ELLIPTICITY.reason(t_s=t, amplitude=amplitude, found=found)

    def _look(self, t: float) -> Stability | StabilityInSpace | None:
        """The state's least margin, if it is the last state or could be beyond."""
        return self.watch.look() if t >= self.end_s else self.watch.look_if_due()

    def held(self, amplitude: float) -> Reason | None:
        """The fault of a state in which only the constraint on a rigid mode holds the body, as no contact could.

        None where nothing is. Collective.
        """
        ledger, radius_um = self.run.ledger, self.run.reach_um / 2
        weight = abs(ledger.load_resultant()[1] * ledger.body.dead(amplitude))
        weight += float(np.linalg.norm(ledger.pull(amplitude)))  # what adhesion alone holds has no weight
        across = np.delete(ledger.contact_force(amplitude) * ledger.state.free, 1)
        push = float(across[0]) if len(across) == 1 else float(np.linalg.norm(across))
        moment = ledger.moment(amplitude)
        force, energy = ledger.body.kinematics.force_unit, ledger.body.kinematics.energy_unit
        if abs(push) > SLIDING * weight:
            cause, told = Cause.SLIDES, f"the obstacles push sideways with {push:.3g} {force}"
        elif abs(moment) > SLIDING * weight * radius_um and not self.upright:
            arm = f"{abs(moment / weight):.2g} um times the load"
            cause, told = Cause.TURNS, f"the obstacles turn it with {moment:.3g} {energy}, {arm}"
        else:
            return None
        unseen = self.missed()
        if unseen <= MISSED:
            return cause.reason(told=told)
        return Cause.TOO_COARSE.reason(way=cause.value, told=told, unseen_percent=100 * unseen)

    def memory(self) -> dict[str, Any]:
        """All that a run that goes on later needs, as JSON can hold it."""
        return {"seen": self.watch.seen, "beyond": self.beyond, "doubt": self.doubt}

    def recall(self, memory: dict[str, Any]) -> None:
        """Go on from what `memory` returned."""
        self.watch.seen, self.beyond, self.doubt = tuple(memory["seen"]), memory["beyond"], memory["doubt"]
