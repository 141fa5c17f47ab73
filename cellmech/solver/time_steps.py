"""Steps in time: variable-step BDF2 with error control."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cellmech.causes import Cause, Reason
from cellmech.errors import SolveError
from cellmech.solver import bdf
from cellmech.solver.load_steps import SMALLEST_LOAD_STEP, Equilibrium, follow
from cellmech.solver.moving import Moving
from cellmech.solver.newton import Outcome
from cellmech.solver.schedule import Step

FIRST_STEP = 1 / 50  # of the ramp; the error control then finds the right one
SMALLEST_STEP = 1e-10  # of the ramp, or the end time without one: below it a failing step is a failure of the physics
SMALLEST_ACCURATE = 1e-14  # the same where the solve succeeds and the error is what is too large: a body that falls
SMALLEST_LIFTED = 1e-6  # the same of a body that a load lifts off what it adheres to: what holds it has an end
CUT = 0.25  # of a step whose solve failed
RECOVERY = 1.3  # times it, with each accepted step, the largest step after one whose solve failed
PATIENT = 6  # failures in a row from which on a driven body's solve is given all its iterations: before, it may jump
GROWN = 4.0  # times a first step whose load is lost in round-off
PUT_ON = 1e-4  # of the end time: within this step a load that is there at once is put on
PARTS = 8  # in which it is, each on its way to the next square: contact sinks in, at first, as the root of the load


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

    def __init__(self, run: Moving) -> None:
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
            outcome = run.solve(run.body.amplitude(t), leap=bool(run.body.drivers) and failures < PATIENT)
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
        """Put on a load that is there at once, part by part, within one short step.

        Contact does not resist before it is pressed, so at the very start the displacement jumps: no step is so short
        that its error is small. This one's is not controlled; the history by which later steps are judged begins after.
        Work is booked along the way, which is no straight one.
        """
        run, rest = self.run, self.history.values[0]
        h = min(PUT_ON * run.schedule.end_s, run.schedule.next_landing(0.0))
        amplitude, a = run.body.amplitude(h), bdf.coefficients([h])
        run.state.ddt.set(a)
        here = start = Equilibrium(0.0, rest, at_rest=True)
        newton, part, booked = 0, 1, 0
        while booked < PARTS:
            here, outcome = self._further(here, (part / PARTS) ** 2 * amplitude, SMALLEST_LOAD_STEP * amplitude)
            newton += outcome.iterations
            if outcome.drowned and part < PARTS:
                here, part = start, PARTS  # the whole load may be more than round-off
                continue
            if outcome.reason is not None:
                run.u[:] = rest
                raise SolveError(run.no_way_on(outcome.reason, 0.0))
            run.ledger.add_step(here.amplitude, (part - booked) / PARTS * h)
            booked, part = part, part + 1
        run.log(f"the load is there at once: put on within {h:.3g} s")
        error = run.relative(run.u - rest)
        self.formula, self.wish, self.history = a, h, History(3, [run.u.copy()])
        return run.accept(h, h, replace(outcome, iterations=newton), error)

    def _further(self, start: Equilibrium, target: float, smallest: float) -> tuple[Equilibrium, Outcome]:
        """Follow the equilibrium to a load amplitude, with all obstacles that it comes to."""
        here, outcome = follow(self.run, start, target, smallest, leap=start.at_rest)
        while self.run.reaches_more():
            here, outcome = follow(self.run, start, target, smallest, leap=start.at_rest)
        return here, outcome

    def _move_history(self) -> None:
        if self.formula is not None:
            self.run.state.advance(self.formula, self.run.body.density is not None)
            self.formula = None

    def _shorter(self, h: float, smallest: float, reason: Reason) -> float:
        """A smaller step [s], unless it has become senseless; back to the last accepted displacement in any case."""
        run = self.run
        run.u[:] = self.history.values[0]
        if run.lifted(run.body.amplitude(run.t)):
            smallest = max(smallest, SMALLEST_LIFTED)
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
        """The numbers that, with the state, make the next steps those of an uninterrupted run."""
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
