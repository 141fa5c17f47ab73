"""Load steps, where nothing depends on rate: equilibria along the load, which time only makes larger."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from cellmech.causes import Cause, Reason
from cellmech.errors import SolveError
from cellmech.solver.moving import Moving
from cellmech.solver.newton import Outcome
from cellmech.solver.schedule import Step

SMALLEST_LOAD_STEP = 1e-4  # of the load that is sought: how closely the last equilibrium is followed
FIRST_LOAD = 1 / 8  # share of the load to begin with where no steps are prescribed and all of it at once is too much
EASY = 8  # Newton iterations up to which a load step was small: the next one may be twice as large


@dataclass(frozen=True)
class Equilibrium:
    """An equilibrium, on the way or at the end of a step: load amplitude [-], displacement [µm], whether at rest.

    The next one is sought from it as it is. A secant through two of them is a worse guess: a contact that grows is no
    smooth function of the load, and extrapolated depths are off by more than they change (benchmarks/README.md).
    """

    amplitude: float
    u: np.ndarray
    at_rest: bool = False


def follow(run: Moving, start: Equilibrium, target: float, smallest: float, leap: bool) -> tuple[Equilibrium, Outcome]:
    """Follow the equilibrium from `start` towards a load amplitude; returns the last one found, and what it took.

    A load step is halved where its solve fails, and doubled after an easy one. The outcome has not converged where that
    leads to steps below `smallest`; the run's displacement is then that of the equilibrium returned. On the way
    equilibria are rough until a solve fails.

    Args:
        run: its `solve` is used.
        start: where to begin.
        target: load amplitude [-].
        smallest: load step [-].
        leap: whether to try the whole way at once and then, if that is not easy, to begin with a small load step.
    """
    here, rough, increment, iterations, factorisations = start, True, target - start.amplitude, 0, 0
    if leap:
        outcome = run.solve(target, leap=True)
        if outcome.converged:
            return Equilibrium(target, run.u.copy()), outcome
        increment, iterations, factorisations = FIRST_LOAD * increment, outcome.iterations, outcome.factorisations
    while True:
        reaches = abs(target - here.amplitude) <= abs(increment) * (1 + 1e-9)
        aim = target if reaches else here.amplitude + increment
        run.u[:] = here.u
        outcome = run.solve(aim, rough=rough and not reaches)
        iterations, factorisations = iterations + outcome.iterations, factorisations + outcome.factorisations
        if outcome.converged:
            here = Equilibrium(aim, run.u.copy())
            increment *= 2 if outcome.iterations <= EASY else 1
            if not reaches:
                run.reaches_more()  # without what it has come to, there may be no way on
        else:
            run.totals.failed_solves += 1
            if outcome.drowned:  # no smaller load is larger beside what rounding leaves
                run.u[:] = here.u
                return here, dataclasses.replace(outcome, iterations=iterations, factorisations=factorisations)
            run.log(f"load amplitude {aim:.6g}: {outcome.reason}; load step halved")
            if rough and here is not start:
                run.u[:] = here.u
                exact = run.solve(here.amplitude)
                here = Equilibrium(here.amplitude, run.u.copy()) if exact.converged else start
            rough, increment = False, (aim - here.amplitude) / 2
        if (reaches and outcome.converged) or abs(increment) < smallest:
            run.u[:] = here.u
            return here, dataclasses.replace(outcome, iterations=iterations, factorisations=factorisations)


class LoadSteps:
    """Equilibria along the load; time only says how much of it acts."""

    def __init__(self, run: Moving) -> None:
        self.run, self.smallest = run, SMALLEST_LOAD_STEP
        self.last = Equilibrium(0.0, run.u.copy(), at_rest=True)
        self.stuck: Reason | None = None  # why there is no way on from the last equilibrium

    def advance(self) -> Step:
        """Go to the next time that is asked for.

        Raises:
            SolveError: no way on; the state is the last equilibrium.
        """
        run = self.run
        if self.stuck is not None:
            raise SolveError(self.stuck)
        if run.totals.steps:
            run.state.rest()
        t, start = run.schedule.next_load_step(run.t), self.last
        outcome = self._follow(start, run.body.amplitude(t))
        while run.reaches_more():
            outcome = self._follow(start, run.body.amplitude(t))
        t = self._time_of(t)
        if outcome.reason is not None:
            self.stuck = run.no_way_on(outcome.reason, self.last.amplitude, t)
            if t <= run.t:
                raise SolveError(self.stuck)
        return run.accept(t, t - run.t, outcome, None)

    def begin_at(self, amplitude: float) -> None:
        """Take the displacement for nearly an equilibrium at a load amplitude [-], if the first landing is beyond."""
        run = self.run
        if amplitude < run.body.amplitude(run.schedule.next_load_step(run.t)):
            self.last = Equilibrium(amplitude, run.u.copy())

    def _time_of(self, end: float) -> float:
        """Time at which the load is the last equilibrium's [s], between now and `end`; now if it is there at once."""
        run, here = self.run, self.last.amplitude
        now = run.body.amplitude(run.t)
        if run.body.amplitude(end) == here:
            return end
        return run.t if now >= here else float(brentq(lambda t: run.body.amplitude(t) - here, run.t, end))

    def _follow(self, start: Equilibrium, target: float) -> Outcome:
        leap = start.at_rest and not self.run.schedule.load_steps
        self.last, outcome = follow(self.run, start, target, self.smallest * target, leap)
        return outcome

    def numbers(self) -> dict[str, Any]:
        """The numbers that, with the state, make the next steps those of an uninterrupted run."""
        stuck = None if self.stuck is None else (self.stuck.cause.value, self.stuck.text)
        return {"amplitude": self.last.amplitude, "at_rest": self.last.at_rest, "stuck": stuck}

    def fields(self) -> dict[str, np.ndarray]:
        """Displacements to keep besides those of the state: none."""
        return {}

    def recall(self, numbers: dict[str, Any], fields: dict[str, np.ndarray]) -> None:
        """Go on from there; the state has been recalled."""
        self.last = Equilibrium(numbers["amplitude"], self.run.u.copy(), numbers["at_rest"])
        stuck = numbers["stuck"]
        self.stuck = None if stuck is None else Reason(Cause.named(stuck[0]), stuck[1])
