"""The two ways through time: BDF2 steps with error control, and load steps where nothing depends on rate."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from scipy.optimize import brentq

from cellmech.causes import Cause, Reason
from cellmech.errors import SolveError
from cellmech.mechanics.balance import Body
from cellmech.solver import bdf
from cellmech.solver.newton import Outcome
from cellmech.solver.schedule import Schedule, Step, Totals
from cellmech.solver.state import State

FIRST_STEP = 1 / 50  # of the ramp; the error control then finds the right one
SMALLEST_STEP = 1e-10  # of the ramp, or the end time without one: below it a failing step is a failure of the physics
SMALLEST_ACCURATE = 1e-14  # the same where the solve succeeds and the error is what is too large: a body that falls
CUT = 0.25  # of a step whose solve failed
RECOVERY = 1.3  # times it, with each accepted step, the largest step after one whose solve failed
GROWN = 4.0  # times a first step whose load is lost in round-off
SMALLEST_LOAD_STEP = 1e-4  # of the load that is sought: how closely the last equilibrium is followed
FIRST_LOAD = 1 / 8  # share of the load to begin with where no steps are prescribed and all of it at once is too much
PUT_ON = 1e-4  # of the end time: within this step a load that is there at once is put on
EASY = 8  # Newton iterations up to which a load step was small: the next one may be twice as large


class Run(Protocol):
    """What steps need of the body that goes through time (`cellmech.solver.simulation`)."""

    body: Body
    state: State
    schedule: Schedule
    totals: Totals
    t: float
    log: Callable[[str], None]

    @property
    def u(self) -> np.ndarray:
        """Displacement on this rank [µm], flat."""

    @property
    def jumps(self) -> bool:
        """Whether the displacement jumps at the start."""

    def solve(self, amplitude: float, rough: bool = False, leap: bool = False) -> Outcome:
        """Solve at a load amplitude [-], beginning near the present displacement."""

    def relative(self, error: np.ndarray, formula: tuple[float, float, float] | None = None) -> float:
        """An error over the largest displacement so far [-]."""

    def reaches_more(self) -> bool:
        """Whether the body has come to another obstacle, which then is in the problem."""

    def accept(self, t: float, h: float, outcome: Outcome, error: float | None) -> Step:
        """Book a step to the time t [s], h [s] long."""

    def no_way_on(self, reason: Reason, amplitude: float, t: float | None = None) -> Reason:
        """The reason of a failure with its place: the present time or t [s]."""


@dataclass
class History:
    """Accepted displacements, newest first, and the steps between them: what predictor and error estimate need."""

    depth: int
    values: list[np.ndarray] = field(default_factory=list)
    steps: list[float] = field(default_factory=list)

    def push(self, value: np.ndarray, step: float | None) -> None:
        """Add an accepted displacement [µm], reached by this step [s]."""
        self.values = [value.copy(), *self.values][: self.depth]
        if step is not None:
            self.steps = [step, *self.steps][: self.depth - 1]

    def predict(self, step: float) -> np.ndarray:
        """Polynomial extrapolation over a coming step [s]."""
        weights = bdf.extrapolation([step, *self.steps][: len(self.values)])
        return sum(w * v for w, v in zip(weights, self.values, strict=True))


class TimeSteps:
    """Variable-step BDF2: predict, solve, estimate the error, accept or roll back."""

    def __init__(self, run: Run) -> None:
        self.run, self.controller = run, bdf.Controller(run.schedule.rtol)
        self.history = History(depth=3)
        self.history.push(run.u, None)
        self.wish = FIRST_STEP * run.schedule.scale_s
        self.most = math.inf  # step [s] after one whose solve failed
        self.formula: tuple[float, float, float] | None = None  # of the last accepted step, until history moves

    def advance(self) -> Step:
        """Make one accepted step.

        Raises:
            SolveError: no way on; the state is the last accepted one.
        """
        run, failures = self.run, 0
        reason: Reason | None = None  # why a solve failed
        lost: Reason | None = None  # what round-off made of a shorter step
        self._move_history()
        if run.totals.steps == 0 and run.jumps:
            return self._put_on()
        while True:
            h, t = self._land(self.wish)
            steps = [h, *self.history.steps]
            a = bdf.coefficients(steps[:2])
            run.state.ddt.set(a)
            guess = self.history.predict(h)
            run.u[:] = guess if failures < 2 else self.history.values[0]
            outcome = run.solve(run.body.amplitude(t))
            if outcome.reason is not None:
                failures += 1
                run.totals.failed_solves += 1
                if outcome.drowned and not reason and t < run.schedule.next_landing(run.t):
                    run.log(f"t = {t:.6g} s: {outcome.reason}; the step is made longer")
                    lost, self.wish = outcome.reason, GROWN * h
                    run.u[:] = self.history.values[0]
                    continue
                reason, self.most = reason or outcome.reason, h / 2
                run.log(f"t = {t:.6g} s, step {h:.3g} s: {outcome.reason}; step cut")
                self.wish = self._shorter(0.0 if outcome.drowned else CUT * h, SMALLEST_STEP, reason)
                continue
            # A step that was cut may have come to a contact that sets in, of which the polynomial through the earlier,
            # longer steps knows nothing: its error is not the small part of the difference that is a smooth function's.
            no_longer = [min(step, h) for step in steps[:3]]
            error = run.relative(bdf.error_factor(no_longer) * (run.u - guess), a)
            if not self.controller.accepts(error):
                run.totals.rejected_steps += 1
                factor = min(self.controller.factor(error), 0.9)
                stays = lost or Cause.RESTLESS.reason()
                self.wish = self._shorter(0.0 if lost else h * factor, SMALLEST_ACCURATE, stays)
                continue
            if run.reaches_more():
                run.u[:] = self.history.values[0]
                continue
            self.formula, self.wish = a, min(h * self.controller.factor(error), self.most)
            self.most *= RECOVERY
            self.history.push(run.u, h)
            return run.accept(t, h, outcome, error)

    def _put_on(self) -> Step:
        """Put on a load that is there at once, bit by bit, within one short step.

        Contact does not resist before it is pressed, so at the very start the displacement jumps: no step is so short
        that its error is small. This one's is not controlled; the history by which later steps are judged begins after.
        """
        run, rest = self.run, Equilibrium(0.0, self.history.values[0], at_rest=True)
        h = min(PUT_ON * run.schedule.end_s, run.schedule.next_landing(0.0))
        amplitude, a = run.body.amplitude(h), bdf.coefficients([h])
        run.state.ddt.set(a)
        _, outcome = follow(run, rest, amplitude, SMALLEST_LOAD_STEP * amplitude, leap=True)
        if outcome.reason is not None:
            run.u[:] = rest.u
            raise SolveError(run.no_way_on(outcome.reason, 0.0))
        run.log(f"the load is there at once: put on within {h:.3g} s")
        error = run.relative(run.u - rest.u)
        self.formula, self.wish, self.history = a, h, History(3, [run.u.copy()])
        return run.accept(h, h, outcome, error)

    def _move_history(self) -> None:
        if self.formula is not None:
            self.run.state.advance(self.formula, self.run.body.density is not None)
            self.formula = None

    def _shorter(self, h: float, smallest: float, reason: Reason) -> float:
        """A smaller step [s], unless it has become senseless; back to the last accepted displacement in any case."""
        run = self.run
        run.u[:] = self.history.values[0]
        if h < smallest * run.schedule.scale_s:
            raise SolveError(run.no_way_on(reason, run.body.amplitude(run.t)))
        return h

    def _land(self, wish: float) -> tuple[float, float]:
        """The next step [s] and the time it leads to: at most `wish`, hitting the landings exactly."""
        target = self.run.schedule.next_landing(self.run.t)
        left = target - self.run.t
        if wish >= left * (1 - 1e-9):
            return left, target
        h = left / 2 if wish > left / 2 else wish
        return h, self.run.t + h

    def numbers(self) -> dict[str, Any]:
        """What, with the state, makes the next steps those of an uninterrupted run."""
        most = None if self.most == math.inf else self.most
        return {"wish": self.wish, "most": most, "steps": self.history.steps, "formula": self.formula}

    def fields(self) -> dict[str, np.ndarray]:
        """Displacements to keep besides those of the state: none."""
        return {}

    def recall(self, numbers: dict[str, Any], fields: dict[str, np.ndarray]) -> None:
        """Go on from there; the state has been recalled."""
        self.wish, self.formula = numbers["wish"], tuple(numbers["formula"])
        self.most = math.inf if numbers["most"] is None else numbers["most"]
        state, steps = self.run.state, list(numbers["steps"])
        state.ddt.set(self.formula)
        values = [f.x.array.copy() for f in (state.u, state.u_n, state.u_nn)]
        self.history = History(3, values[: len(steps) + 1], steps)


@dataclass(frozen=True)
class Equilibrium:
    """Of a body without memory, or at the end of a step: load amplitude [-], displacement [µm], whether it is at rest.

    The next one is sought from it as it is. A secant through two of them is a worse guess: a contact that grows is no
    smooth function of the load, and extrapolated depths are off by more than they change (benchmarks/README.md).
    """

    amplitude: float
    u: np.ndarray
    at_rest: bool = False


def follow(run: Run, start: Equilibrium, target: float, smallest: float, leap: bool) -> tuple[Equilibrium, Outcome]:
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

    def __init__(self, run: Run) -> None:
        self.run = run
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

    def _time_of(self, end: float) -> float:
        """When the load is that of the last equilibrium [s], between now and `end`; now where it is there at once."""
        run, here = self.run, self.last.amplitude
        now = run.body.amplitude(run.t)
        if run.body.amplitude(end) == here:
            return end
        return run.t if now >= here else float(brentq(lambda t: run.body.amplitude(t) - here, run.t, end))

    def _follow(self, start: Equilibrium, target: float) -> Outcome:
        leap = start.at_rest and not self.run.schedule.load_steps
        self.last, outcome = follow(self.run, start, target, SMALLEST_LOAD_STEP * target, leap)
        return outcome

    def numbers(self) -> dict[str, Any]:
        """What, with the state, makes the next steps those of an uninterrupted run."""
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
