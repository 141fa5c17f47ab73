"""The time loop: predict, solve, estimate the error, accept or roll back."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI
from scipy.optimize import brentq

from cellmech import bdf
from cellmech.contact import Obstacle
from cellmech.energy import Ledger
from cellmech.errors import SolveError
from cellmech.outline import Outline
from cellmech.residual import Body, State
from cellmech.snes import Outcome, RigidModes, Solver

FIRST_STEP = 1 / 50  # of the ramp; the error control then finds the right one
SMALLEST_STEP = 1e-10  # of the end time: below it a failing step is a failure of the physics
CUT = 0.25  # of a step whose solve failed
LOAD_STEPS = 20  # of a ramp when nothing depends on rate
TOUCHING = 1e-12  # load amplitude at which the resting body counts as just touching
SMALLEST_LOAD_STEP = 1e-4  # of full load: how closely the last equilibrium is followed


@dataclass(frozen=True)
class Step:
    """One accepted step.

    Args:
        t_s, dt_s: time reached and step [s].
        amplitude: load amplitude at that time [-].
        newton: Newton iterations.
        error_estimate: relative local error [-], None where nothing depends on rate.
    """

    t_s: float
    dt_s: float
    amplitude: float
    newton: int
    error_estimate: float | None


@dataclass
class Totals:
    """What a whole run took."""

    steps: int = 0
    rejected_steps: int = 0
    failed_solves: int = 0
    newton_iterations: int = 0
    factorisations: int = 0


@dataclass(frozen=True)
class Schedule:
    """When to stop and where to land on the way.

    Args:
        end_s: end [s].
        landings_s: times that are hit exactly: end of the ramp, output times.
        rtol: tolerated relative local error of a step [-].
        ramp_end_s: end of the load ramp [s]; 0 when the load is switched on at once.
    """

    end_s: float
    landings_s: tuple[float, ...] = ()
    rtol: float = 1e-3
    ramp_end_s: float = 0.0

    def next_landing(self, t: float) -> float:
        """The first landing time after t [s]."""
        return min([x for x in self.landings_s if x > t * (1 + 1e-12)] + [self.end_s])


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


class Run:
    """A body on its way through time.

    Args:
        body: the problem with the obstacles that are in reach at the start.
        schedule: end, landings, tolerance.
        force_scale: a force per depth such as the weight [Pa µm].
        out_of_reach: further obstacles; each enters the problem when the body comes to it.
        modes: makes the rigid modes to take out, if any.
        log: receives one line of text now and then.
    """

    def __init__(
        self,
        body: Body,
        schedule: Schedule,
        force_scale: float,
        out_of_reach: Sequence[Obstacle] = (),
        modes: RigidModes | None = None,
        log: Callable[[str], None] = lambda line: None,
    ) -> None:
        self.schedule, self.force_scale, self.modes, self.log = schedule, force_scale, modes, log
        self.out_of_reach = list(out_of_reach)
        self.state = State(body)
        self.comm: MPI.Comm = body.domain.mesh.comm
        self.totals, self.t = Totals(), 0.0
        self.outline = Outline(body.domain, body.space, "outer")
        self.largest = 0.0
        self.ledger = Ledger(body, self.state)
        if body.density is None and body.obstacles:
            self._touch()
        self._bind(body)
        self.ledger.begin(body.amplitude(0.0) if body.rate_dependent else 0.0)

    def _touch(self) -> None:
        """Translate the resting body until the first quadrature point of the contact would feel the obstacle.

        A curved edge touches between its quadrature points (some 1e-5 µm early); without this start the displacement
        would jump at the first load, however small.
        """
        self.body = self.ledger.body
        self.u[:] = self._rigid_guess(TOUCHING)
        self.state.rest()
        self.ledger.rest()

    def _bind(self, body: Body) -> None:
        self.body = body
        self.solver = Solver(body, self.state, self.force_scale, modes=self.modes)

    @property
    def u(self) -> np.ndarray:
        """Displacement on this rank, ghosts included [µm], flat."""
        return self.state.u.x.array

    def rate(self) -> float:
        """Largest nodal displacement rate over the last step [µm/s], 0 at constant load without memory."""
        amplitude = self.body.amplitude
        if not self.body.rate_dependent and amplitude(self.t - self.last_step_s) == amplitude(self.t):
            return 0.0
        return self._largest_node(self.u - self.state.u_n.x.array) / self.last_step_s

    def run(self, on_step: Callable[[Step], None]) -> None:
        """Go to the end, calling `on_step` after each accepted step.

        Raises:
            SolveError: no way on; `state.u` then is the last accepted displacement.
        """
        if self.body.rate_dependent:
            self._time_steps(on_step)
        else:
            self._load_steps(on_step)

    def _time_steps(self, on_step: Callable[[Step], None]) -> None:
        end, controller = self.schedule.end_s, bdf.Controller(self.schedule.rtol)
        history = History(depth=3)
        history.push(self.u, None)
        wish = FIRST_STEP * (self.schedule.ramp_end_s or end)
        failures = 0
        while self.t < end:
            h, t = self._land(wish)
            steps = [h, *history.steps]
            a = bdf.coefficients(steps[:2])
            self.state.ddt.set(a)
            guess = history.predict(h)
            self.u[:] = guess if failures < 2 else history.values[0]
            outcome = self._solve(self.body.amplitude(t))
            if not outcome.converged:
                failures += 1
                self.totals.failed_solves += 1
                self.log(f"t = {t:.6g} s, step {h:.3g} s: {outcome.reason}; step cut")
                self.u[:] = history.values[0]
                wish = self._shorter(CUT * h, outcome.reason)
                continue
            error = self._error(bdf.error_factor(steps[:3]) * (self.u - guess))
            if not controller.accepts(error):
                self.totals.rejected_steps += 1
                self.u[:] = history.values[0]
                wish = self._shorter(
                    h * min(controller.factor(error), 0.9), "the error of ever smaller steps stays large"
                )
                continue
            if self._reaches_more():
                self.u[:] = history.values[0]
                continue
            self._accept(t, h, outcome, error, on_step)
            self.state.advance(a, self.body.density is not None)
            history.push(self.u, h)
            failures = 0
            wish = h * controller.factor(error)

    def _shorter(self, h: float, reason: str) -> float:
        """A smaller step [s], unless it has become senseless."""
        if h < SMALLEST_STEP * self.schedule.end_s:
            raise SolveError(self._no_way_on(reason, self.body.amplitude(self.t)))
        return h

    def _land(self, wish: float) -> tuple[float, float]:
        """The next step [s] and the time it leads to: at most `wish`, hitting the landings exactly."""
        target = self.schedule.next_landing(self.t)
        left = target - self.t
        if wish >= left * (1 - 1e-9):
            return left, target
        h = left / 2 if wish > left / 2 else wish
        return h, self.t + h

    def _error(self, difference: np.ndarray) -> float:
        """Largest nodal length of an estimated error over the largest displacement so far [-]. Collective."""
        self._largest_now = max(self.largest, self._largest_node(self.u))
        return self._largest_node(difference) / max(self._largest_now, bdf.DISPLACEMENT_FLOOR_UM)

    def _largest_node(self, values: np.ndarray) -> float:
        """Largest length of a nodal vector over all ranks."""
        mine = float(np.sqrt(np.max(np.sum(values.reshape(-1, 2) ** 2, axis=1), initial=0.0)))
        return self.comm.allreduce(mine, op=MPI.MAX)

    def _solve(self, amplitude: float) -> Outcome:
        if self.totals.steps == 0 and self.body.density is None and self.body.obstacles:
            self.u[:] = self._rigid_guess(amplitude)
        outcome = self.solver.solve(amplitude)
        self.totals.newton_iterations += outcome.iterations
        self.totals.factorisations += outcome.factorisations
        return outcome

    def _rigid_guess(self, amplitude: float) -> np.ndarray:
        """The translation along the load that balances it with the contact: at first touch the tangent is singular."""
        load = amplitude * self.ledger.load_resultant()
        size = float(np.linalg.norm(load))
        if size == 0.0:
            return np.zeros_like(self.u)
        direction = load / size

        def imbalance(distance: float) -> float:
            self.u[:] = np.tile(distance * direction, len(self.u) // 2)
            return float(self.ledger.contact_force() @ direction) + size

        far = 1e-6
        while imbalance(far) > 0:
            far *= 2
            if far > 1.0:
                return np.zeros_like(self.u)
        near = self.body.contact.threshold_um if self.body.contact else 0.0  # a volume force acts before touch
        distance = brentq(imbalance, near, far, xtol=1e-15, rtol=1e-10)
        return np.tile(distance * direction, len(self.u) // 2)

    def _reaches_more(self) -> bool:
        """Whether the body has come to obstacles that were left out; they are put in. Collective."""
        if self.body.contact is None:
            return False
        threshold = self.body.contact.threshold_um
        reached = [o for o in self.out_of_reach if self.outline.max_depth(self.state.u, [o]) > threshold]
        if not reached:
            return False
        self.out_of_reach = [o for o in self.out_of_reach if o not in reached]
        self.log(f"t = {self.t:.6g} s: now in reach, put into the model: {', '.join(map(str, reached))}")
        body = dataclasses.replace(self.body, obstacles=(*self.body.obstacles, *reached))
        self.ledger.rebind(body, self.state)
        self._bind(body)
        return True

    def _accept(
        self, t: float, h: float, outcome: Outcome, error: float | None, on_step: Callable[[Step], None]
    ) -> None:
        self.t, self.last_step_s = t, h
        self.totals.steps += 1
        self.largest = self._largest_now if error is not None else self.largest
        amplitude = self.body.amplitude(t)
        self.ledger.add_step(amplitude)
        on_step(Step(t, h, amplitude, outcome.iterations, error))

    def _load_steps(self, on_step: Callable[[Step], None]) -> None:
        """Equilibria along the load; time only says how much of it acts."""
        ramp, end = self.schedule.ramp_end_s, self.schedule.end_s
        times = {t for t in (*self.schedule.landings_s, end) if t > 0}
        times |= {ramp * k / LOAD_STEPS for k in range(1, LOAD_STEPS + 1) if 0 < ramp * k / LOAD_STEPS < end}
        path = LoadPath(0.0, self.u.copy())
        for t in sorted(times):
            start, h = path, t - self.t
            path, outcome = self._follow(start, self.body.amplitude(t))
            while self._reaches_more():
                path, outcome = self._follow(start, self.body.amplitude(t))
            self._accept(t, h, outcome, None, on_step)
            self.state.rest()

    def _follow(self, path: LoadPath, target: float) -> tuple[LoadPath, Outcome]:
        """Follow the equilibrium to a load amplitude, halving the load step where a solve fails."""
        increment, iterations = target - path.amplitude, 0
        while True:
            reaches = abs(target - path.amplitude) <= abs(increment) * (1 + 1e-9)
            aim = target if reaches else path.amplitude + increment
            self.u[:] = path.predict(aim)
            outcome = self._solve(aim)
            iterations += outcome.iterations
            if outcome.converged:
                path = LoadPath(aim, self.u.copy(), path)
                if reaches:
                    return path, dataclasses.replace(outcome, iterations=iterations)
                continue
            self.totals.failed_solves += 1
            self.log(f"load amplitude {aim:.6g}: {outcome.reason}; load step halved")
            increment /= 2
            if abs(increment) < SMALLEST_LOAD_STEP:
                self.u[:] = path.u
                raise SolveError(self._no_way_on(outcome.reason, path.amplitude))

    def _no_way_on(self, reason: str, amplitude: float) -> str:
        return f"no equilibrium beyond t = {self.t:.6g} s, load amplitude {amplitude:.6g}: {reason}"
