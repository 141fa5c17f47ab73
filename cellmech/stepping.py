"""The two ways through time: BDF2 steps with error control, and load steps where nothing depends on rate."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from cellmech import bdf
from cellmech.errors import SolveError

if TYPE_CHECKING:
    from cellmech.run import Run, Step
    from cellmech.snes import Outcome

FIRST_STEP = 1 / 50  # of the ramp; the error control then finds the right one
SMALLEST_STEP = 1e-10  # of the end time: below it a failing step is a failure of the physics
CUT = 0.25  # of a step whose solve failed
SMALLEST_LOAD_STEP = 1e-4  # of full load: how closely the last equilibrium is followed
FIRST_LOAD = 1 / 8  # share of the load to begin with where no steps are prescribed
EASY = 8  # Newton iterations up to which a load step was small: the next one may be twice as large


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
        self.wish = FIRST_STEP * (run.schedule.ramp_end_s or run.schedule.end_s)
        self.formula: tuple[float, float, float] | None = None  # of the last accepted step, until history moves

    def advance(self) -> Step:
        """Make one accepted step.

        Raises:
            SolveError: no way on; the state is the last accepted one.
        """
        run, failures = self.run, 0
        self._move_history()
        while True:
            h, t = self._land(self.wish)
            steps = [h, *self.history.steps]
            a = bdf.coefficients(steps[:2])
            run.state.ddt.set(a)
            guess = self.history.predict(h)
            run.u[:] = guess if failures < 2 else self.history.values[0]
            outcome = run.solve(run.body.amplitude(t), from_rest=run.totals.steps == 0)
            if not outcome.converged:
                failures += 1
                run.totals.failed_solves += 1
                run.log(f"t = {t:.6g} s, step {h:.3g} s: {outcome.reason}; step cut")
                self.wish = self._shorter(CUT * h, outcome.reason)
                continue
            error = run.relative(bdf.error_factor(steps[:3]) * (run.u - guess))
            if not self.controller.accepts(error):
                run.totals.rejected_steps += 1
                factor = min(self.controller.factor(error), 0.9)
                self.wish = self._shorter(h * factor, "the error of ever smaller steps stays large")
                continue
            if run.reaches_more():
                run.u[:] = self.history.values[0]
                continue
            self.formula, self.wish = a, h * self.controller.factor(error)
            self.history.push(run.u, h)
            return run.accept(t, h, outcome, error)

    def _move_history(self) -> None:
        if self.formula is not None:
            self.run.state.advance(self.formula, self.run.body.density is not None)
            self.formula = None

    def _shorter(self, h: float, reason: str) -> float:
        """A smaller step [s], unless it has become senseless; back to the last accepted displacement in any case."""
        run = self.run
        run.u[:] = self.history.values[0]
        if h < SMALLEST_STEP * run.schedule.end_s:
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
        return {"wish": self.wish, "steps": self.history.steps, "formula": self.formula}

    def fields(self) -> dict[str, np.ndarray]:
        """Displacements to keep besides those of the state: none."""
        return {}

    def recall(self, numbers: dict[str, Any], fields: dict[str, np.ndarray]) -> None:
        """Go on from there; the state has been recalled."""
        self.wish, self.formula = numbers["wish"], tuple(numbers["formula"])
        state, steps = self.run.state, list(numbers["steps"])
        state.ddt.set(self.formula)
        values = [f.x.array.copy() for f in (state.u, state.u_n, state.u_nn)]
        self.history = History(3, values[: len(steps) + 1], steps)


@dataclass(frozen=True)
class LoadPath:
    """The last equilibrium of a body without memory, and the one before it."""

    amplitude: float
    u: np.ndarray
    before: LoadPath | None = None

    def __post_init__(self) -> None:
        """Keep one predecessor, not the whole chain."""
        if self.before is not None:
            object.__setattr__(self, "before", dataclasses.replace(self.before, before=None))

    def predict(self, amplitude: float) -> np.ndarray:
        """Displacement at a load amplitude by the secant through both [µm]."""
        if self.before is None or self.amplitude == self.before.amplitude:
            return self.u
        share = (amplitude - self.amplitude) / (self.amplitude - self.before.amplitude)
        return self.u + share * (self.u - self.before.u)


class LoadSteps:
    """Equilibria along the load; time only says how much of it acts."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.path = LoadPath(0.0, run.u.copy())

    def advance(self) -> Step:
        """Go to the next time that is asked for.

        Raises:
            SolveError: no way on; the state is the last equilibrium.
        """
        run = self.run
        if run.totals.steps:
            run.state.rest()
        t, start = run.schedule.next_load_step(run.t), self.path
        self.path, outcome = self._follow(start, run.body.amplitude(t))
        while run.reaches_more():
            self.path, outcome = self._follow(start, run.body.amplitude(t))
        return run.accept(t, t - run.t, outcome, None)

    def _follow(self, path: LoadPath, target: float) -> tuple[LoadPath, Outcome]:
        """Follow the equilibrium to a load amplitude; a load step is halved where its solve fails, and grows again."""
        run, increment, iterations = self.run, target - path.amplitude, 0
        if path.before is None and not run.schedule.load_steps:
            increment *= FIRST_LOAD
        while True:
            reaches = abs(target - path.amplitude) <= abs(increment) * (1 + 1e-9)
            aim = target if reaches else path.amplitude + increment
            run.u[:] = path.predict(aim)
            outcome = run.solve(aim, from_rest=path.before is None)
            iterations += outcome.iterations
            if outcome.converged:
                path = LoadPath(aim, run.u.copy(), path)
                if reaches:
                    return path, dataclasses.replace(outcome, iterations=iterations)
                increment *= 2 if outcome.iterations <= EASY else 1
                continue
            run.totals.failed_solves += 1
            run.log(f"load amplitude {aim:.6g}: {outcome.reason}; load step halved")
            increment = (aim - path.amplitude) / 2
            if abs(increment) < SMALLEST_LOAD_STEP:
                run.u[:] = path.u
                raise SolveError(run.no_way_on(outcome.reason, path.amplitude))

    def numbers(self) -> dict[str, Any]:
        """What, with the state, makes the next steps those of an uninterrupted run."""
        before = self.path.before
        return {"amplitude": self.path.amplitude, "before": None if before is None else before.amplitude}

    def fields(self) -> dict[str, np.ndarray]:
        """Displacements to keep besides those of the state [µm]."""
        return {} if self.path.before is None else {"path_before": self.path.before.u}

    def recall(self, numbers: dict[str, Any], fields: dict[str, np.ndarray]) -> None:
        """Go on from there; the state has been recalled."""
        before = None if numbers["before"] is None else LoadPath(numbers["before"], fields["path_before"])
        self.path = LoadPath(numbers["amplitude"], self.run.u.copy(), before)
