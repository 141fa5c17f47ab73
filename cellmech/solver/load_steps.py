"""Load steps, where nothing depends on rate: equilibria along the load, which time only makes larger."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import brentq

from cellmech.causes import Cause, Reason
from cellmech.errors import SolveError
from cellmech.solver.moving import Moving
from cellmech.solver.newton import Outcome
from cellmech.solver.schedule import Step

SMALLEST_LOAD_STEP = 1e-4  # of the load that is sought: how closely the last equilibrium is followed
LOSS = 1 / 64  # of the load that is sought: how closely the loss of ellipticity on the way is told
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


@dataclass(frozen=True)
class Guess:
    """Nearly an equilibrium, found elsewhere.

    Args:
        amplitude: of its load [-].
        u: displacement [µm].
        onward: load step to go on with [-].
    """

    amplitude: float
    u: np.ndarray
    onward: float


def follow(
    run: Moving,
    start: Equilibrium,
    target: float,
    smallest: float,
    leap: bool,
    judge: Callable[[float], Reason | None] = lambda amplitude: None,
    guess: Guess | None = None,
) -> tuple[Equilibrium, Outcome]:
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
        judge: says why the equilibrium at a load amplitude, just found on the way, is none to go on from.
        guess: of the first equilibrium on the way.
    """
    here, rough, increment, iterations, factorisations = start, True, target - start.amplitude, 0, 0
    unstable, fault = np.inf, None  # the least load amplitude that the judge is known to refuse, and why
    if guess is not None:
        increment = guess.amplitude - start.amplitude
    elif leap and run.body.pulling:  # in a leap it may come past where it is pulled, or to another equilibrium
        increment *= FIRST_LOAD
    elif leap:
        outcome = run.solve(target, leap=True)
        if outcome.converged and judge(target) is None:
            return Equilibrium(target, run.u.copy()), outcome
        increment, iterations, factorisations = FIRST_LOAD * increment, outcome.iterations, outcome.factorisations
    while True:
        reaches = abs(target - here.amplitude) <= abs(increment) * (1 + 1e-9)
        aim = target if reaches else here.amplitude + increment
        run.u[:] = here.u if guess is None else guess.u
        outcome = run.solve(aim, rough=rough and not reaches, leap=run.lifted(aim))
        iterations, factorisations = iterations + outcome.iterations, factorisations + outcome.factorisations
        if outcome.converged and (refusal := judge(aim)) is not None:
            unstable, fault, smallest = abs(aim), refusal, max(smallest, LOSS * abs(target) / 2)
            outcome = dataclasses.replace(outcome, reason=fault)
        if outcome.converged:
            here = Equilibrium(aim, run.u.copy())
            if guess is not None:
                increment = guess.onward
            elif outcome.iterations <= EASY:
                increment = float(np.copysign(min(2 * abs(increment), (unstable - abs(aim)) / 2), increment))
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
        guess = None
        arrived = reaches and outcome.converged
        if arrived or abs(increment) < smallest:
            run.u[:] = here.u
            reason = None if arrived else outcome.reason or fault
            return here, dataclasses.replace(
                outcome, reason=reason, iterations=iterations, factorisations=factorisations
            )


class LoadSteps:
    """Equilibria along the load; time only says how much of it acts."""

    def __init__(self, run: Moving) -> None:
        self.run, self.smallest = run, SMALLEST_LOAD_STEP
        self.last = Equilibrium(0.0, run.u.copy(), at_rest=True)
        self.guess: Guess | None = None  # of the first equilibrium on the way
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
        outcome = self._follow(start, t)
        while run.reaches_more():
            outcome = self._follow(start, t)
        t = self._time_of(self.last.amplitude, t)
        if outcome.reason is not None:
            self.stuck = run.no_way_on(outcome.reason, self.last.amplitude, t)
            if t <= run.t:
                raise SolveError(self.stuck)
        return run.accept(t, t - run.t, outcome, None)

    def begin_near(self, guess: Guess) -> None:
        """Begin with a guess of an equilibrium; it is the first on the way if the first landing is beyond its load."""
        run = self.run
        run.u[:] = guess.u
        run.state.update()
        if guess.amplitude < run.body.amplitude(run.schedule.next_load_step(run.t)):
            self.guess = guess

    def _time_of(self, amplitude: float, end: float) -> float:
        """Time at which this load acts [s], between now and `end`; now if it is there at once."""
        run = self.run
        if run.body.amplitude(end) == amplitude:
            return end
        now = run.body.amplitude(run.t)
        return run.t if now >= amplitude else float(brentq(lambda t: run.body.amplitude(t) - amplitude, run.t, end))

    def _follow(self, start: Equilibrium, t: float) -> Outcome:
        run, target = self.run, self.run.body.amplitude(t)
        leap = start.at_rest and not run.schedule.load_steps
        guess, self.guess = self.guess, None
        self.last, outcome = follow(run, start, target, self.smallest * target, leap, partial(self._lost, t), guess)
        return outcome

    def _lost(self, end: float, amplitude: float) -> Reason | None:
        """Why there is no way on from an equilibrium before the time `end` [s]; a load there at once has no before."""
        run = self.run
        return run.lost(self._time_of(amplitude, end), amplitude) if run.body.amplitude(run.t) < amplitude else None

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
