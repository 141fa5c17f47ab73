"""A body on its way through time: what is modelled, how far it is, and what it takes to go on after a stop."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from mpi4py import MPI

from cellmech.causes import Cause, Reason
from cellmech.fem.boundary import boundary
from cellmech.mechanics.balance import Body
from cellmech.mechanics.obstacles import Obstacle
from cellmech.solver.acceptance import Acceptance, Refused
from cellmech.solver.energy_balance import Ledger
from cellmech.solver.instants import CLOSEST
from cellmech.solver.load_steps import LoadSteps
from cellmech.solver.newton import TOLERANCE, Outcome, Solver
from cellmech.solver.release import is_free, lets_go
from cellmech.solver.rigid_modes import RigidModes
from cellmech.solver.schedule import SMALL, Memory, Schedule, Step, Totals
from cellmech.solver.settling import NEARLY, settle
from cellmech.solver.sizes import Sizes
from cellmech.solver.state import State
from cellmech.solver.time_steps import TimeSteps

TOUCHING = 1e-12  # load amplitude at which the resting body counts as just touching
MOVING_TOLERANCE = 1e-10  # of the solver with inertia: velocities carry what is left from step to step
EXACTLY = 1e-6  # share of the load by which contact misses it where Newton's method can do no better
A_LITTLE = 0.01  # of the amplitude at the end: so far beyond its last equilibrium a lifted body is let go
CHECKPOINT_STEPS = 10  # accepted steps between two checkpoints of a small problem
CHECKPOINT_WORK = 200_000  # steps times unknowns after which a larger one is due


class Simulation:
    """A body on its way through time.

    Args:
        body: the problem with the obstacles that are in reach at the start.
        schedule: end, landings, tolerance.
        force_scale: a force such as the weight [Pa µm or pN].
        out_of_reach: further obstacles; each enters the problem when the body comes to it.
        modes: makes the rigid modes to take out, if any.
        touching: whether the body, at rest, touches an obstacle, and does not fall onto it.
        log: receives one line of text now and then.
        tolerance: share of the load that may be out of balance [-]; the solver's own if None.
    """

    def __init__(
        self,
        body: Body,
        schedule: Schedule,
        force_scale: float,
        out_of_reach: Sequence[Obstacle] = (),
        modes: RigidModes | None = None,
        touching: bool = True,
        log: Callable[[str], None] = lambda line: None,
        tolerance: float | None = None,
    ) -> None:
        self.schedule, self.force_scale, self.modes, self.log = schedule, force_scale, modes, log
        self.tolerance = tolerance or (TOLERANCE if body.density is None else MOVING_TOLERANCE)
        self.out_of_reach = list(out_of_reach)
        self.acceptance: Acceptance | None = None  # what states count, besides being solved; all, without it
        self.state = State(body)
        self.comm: MPI.Comm = body.domain.mesh.comm
        self.components = body.space.dofmap.index_map_bs
        self.totals, self.t, self.last_step_s = Totals(), 0.0, 0.0
        self.outline = boundary(body.domain, body.space, "outer")
        self.reach_um = self.comm.allreduce(float(np.ptp(body.domain.mesh.geometry.x, axis=0).max()), op=MPI.MAX)
        self.sizes = Sizes(self.state, body.density is not None)
        self.ledger = Ledger(body, self.state)
        if touching and body.obstacles:
            self._touch(schedule.end_s if body.rate_dependent else 0.0)
        self._bind(body)
        self.ledger.begin(body.amplitude(0.0) if body.rate_dependent and not self.jumps else 0.0)
        self.stepping = TimeSteps(self) if body.rate_dependent else LoadSteps(self)
        unknowns = self.components * body.space.dofmap.index_map.size_global
        self.checkpoint_every = max(1, min(CHECKPOINT_STEPS, CHECKPOINT_WORK // unknowns))

    def _touch(self, end_s: float) -> None:
        """Translate the resting body until the first quadrature point of the contact would feel the obstacle.

        A curved edge touches between its quadrature points (some 1e-5 µm early); without this start the displacement
        would jump at the first load, however small. How far the load at the end [s] alone would press a rigid body in
        is no small displacement either.
        """
        self.body = self.ledger.body
        self._settle(TOUCHING)
        touching = self.u.copy()
        self._settle(self.body.amplitude(end_s))
        sunk = self.sizes.largest_node(self.u - touching)
        self.schedule = dataclasses.replace(self.schedule, small_um=max(self.schedule.small_um, SMALL * sunk))
        self.u[:] = touching
        self.state.rest()
        self.ledger.rest()

    def _bind(self, body: Body) -> None:
        self.body = body
        balance = partial(self._settle, nearly=EXACTLY) if self._settles else None
        self.solver = Solver(body, self.state, self.force_scale, self.tolerance, self.modes, balance)
        if self.solver.choice.reason:
            self.log(self.solver.choice.reason)

    @property
    def jumps(self) -> bool:
        """True if the displacement jumps at the start: a load that is there at once meets a contact without inertia."""
        body = self.body
        return not body.resisted and bool(body.obstacles) and body.amplitude(0.0) != 0.0

    @property
    def told(self) -> bool:
        """Whether the last accepted state is accurate beside itself, and not only beside what it leads to."""
        return max(self.sizes.so_far[:1], default=0.0) >= self.schedule.told_um

    @property
    def has_a_way(self) -> bool:
        """True if there are states between rest and the load: else what is over time is not known, such as work."""
        follows = self.schedule.ramp_end_s > 0 and self.schedule.load_steps > 0
        return self.body.rate_dependent or follows

    @property
    def u(self) -> np.ndarray:
        """Displacement on this rank, ghosts included [µm], flat."""
        return self.state.u.x.array

    def run(self, on_step: Callable[[Step], None], on_checkpoint: Callable[[Memory], None] | None = None) -> None:
        """Go to the end.

        Args:
            on_step: called after each accepted step, before history moves; and for a state that does not count where
                there is none before it that does, and it may be shown.
            on_checkpoint: called now and then after `on_step` with what `recall` takes. What a run computes does not
                depend on whether anybody listens.

        Raises:
            SolveError: no way on; `state.u` then is the last accepted displacement.
        """
        while self.t < self.schedule.end_s:
            try:
                step = self.stepping.advance()
            except Refused as refused:
                if self.totals.steps == 0 and refused.shown:
                    on_step(self._book())
                raise
            if self.t >= self.schedule.end_s:
                self.solver.restart()  # nothing is left to solve: what reads off the state may have its memory
            on_step(step)
            due = self.totals.steps % self.checkpoint_every == 0
            if due and 0 < self.t < self.schedule.end_s:  # at 0 it begins again
                self.solver.restart()  # as the solver of a run that goes on from here must
                if on_checkpoint is not None:
                    on_checkpoint(self.memory())

    def crossing(self) -> tuple[float, ...] | None:
        """A place where the body's boundary crosses itself [µm]; looked for where something pulls. Collective."""
        if not self.body.drivers:
            return None
        return self.outline.crossing(self.state.u, tuple(int(k) for k in np.flatnonzero(~self.state.free)))

    def rate(self) -> float:
        """Largest nodal displacement rate over the last step [µm/s], 0 at constant load without memory."""
        amplitude, before = self.body.amplitude, self.t - CLOSEST * self.schedule.end_s
        if not self.body.rate_dependent and amplitude(before) == amplitude(self.t):
            return 0.0
        return self.sizes.largest_node(self.u - self.state.u_n.x.array) / self.last_step_s

    def relative(self, error: np.ndarray, formula: tuple[float, float, float] | None = None) -> float:
        """An error [µm] over what it is measured by [-], see `Sizes.relative`. Collective."""
        return self.sizes.relative(error, self.schedule.small_um, formula)

    def solve(self, amplitude: float, rough: bool = False, leap: bool = False) -> Outcome:
        """Solve at a load amplitude, beginning near the present displacement, and count what it took."""
        if self._settles:
            self._settle(amplitude)
        outcome = self.solver.solve(amplitude, rough=rough, leap=leap)
        self.totals.newton_iterations += outcome.iterations
        self.totals.factorisations += outcome.factorisations
        self.totals.linear_iterations += outcome.linear_iterations
        return outcome

    @property
    def _settles(self) -> bool:
        """True if nothing but the obstacles holds the body against a translation."""
        return bool(self.body.obstacles) and not self.body.resisted

    def _settle(self, amplitude: float, nearly: float = NEARLY) -> None:
        """Move the displacement along the load to where the contact balances it, if that can be; else leave it.

        Without a load it is moved along the obstacles' pull.
        """
        state, load = self.state, self.body.dead(amplitude) * self.ledger.load_resultant()
        pull = self.ledger.pull(amplitude)
        towards = load if np.any(load) else np.where(state.free, pull, 0.0)  # a plane of symmetry bears the rest
        if not np.any(towards) or not np.all(state.free[towards != 0.0]):
            return
        direction = towards / np.linalg.norm(towards)
        borne, size = float(load @ direction), float(np.linalg.norm(load) + np.linalg.norm(pull))
        state.split()
        start = state.now.offset.value.copy()

        def move(distance: float) -> None:
            state.now.offset.value = start + distance * direction
            state.now.join()

        def imbalance(distance: float) -> float:
            move(distance)
            return float(self.ledger.contact_force(amplitude) @ direction) + borne

        move(settle(imbalance, size, self.reach_um, nearly) or 0.0)

    def reaches_more(self) -> bool:
        """True if the body has come to obstacles that were left out; they are put in. Collective."""
        if self.body.contact is None:
            return False
        reach = self.body.reach_um
        reached = [o for o in self.out_of_reach if self.outline.max_depth(self.state.u, [o]) > -reach]
        if reached:
            self.log(f"t = {self.t:.6g} s: now in reach, put into the model: {', '.join(map(str, reached))}")
            self._put_in(reached)
        return bool(reached)

    def close(self) -> None:
        """Free the solver's memory; the run cannot go on afterwards. Collective."""
        self.solver.close()

    def _put_in(self, reached: Sequence[Obstacle]) -> None:
        self.out_of_reach = [o for o in self.out_of_reach if o not in reached]
        body = dataclasses.replace(self.body, obstacles=(*self.body.obstacles, *reached))
        self.ledger.rebind(body, self.state)
        before = self.solver
        self._bind(body)
        before.close()

    def lost(self, t: float, amplitude: float) -> Reason | None:
        """Why the present displacement, an equilibrium on the way, is none to go on from. Collective."""
        if (come_off := self.come_off(t, amplitude)) is not None:
            return come_off
        if self._has_let_go(amplitude):
            return Cause.NONE_NEARBY.reason()
        return None if self.acceptance is None else self.acceptance.lost_on_the_way(t, amplitude)

    def _has_let_go(self, amplitude: float) -> bool:
        """True if nothing holds a body any more that obstacles pull: Newton's method went past where they do."""
        pulled = any(driver.share(amplitude) > 0 for driver in self.body.pulling)
        return pulled and is_free(self.ledger, amplitude, self.force_scale)

    def come_off(self, t: float, amplitude: float) -> Reason | None:
        """Why the present displacement does not count, if a load lifts the body off the obstacles. Collective."""
        off = self.lifted(amplitude) and is_free(self.ledger, amplitude, self.force_scale)
        return self._off(t, amplitude) if off else None

    def lifted(self, amplitude: float) -> bool:
        """True if the load pulls a body up that obstacles may hold."""
        return bool(self.body.pulling) and self.body.dead(amplitude) * float(self.ledger.load_resultant()[1]) > 0

    def _off(self, t: float, amplitude: float) -> Reason:
        return Cause.COMES_OFF.reason(t_s=t, share=self.body.dead(amplitude))

    def _comes_off(self, amplitude: float) -> bool:
        """True if a little more of a load that lifts the body, which finds no equilibrium, makes it let go."""
        end = self.body.amplitude(self.schedule.end_s)
        beyond = min(amplitude + A_LITTLE * end, end)
        if not self._settles or not self.lifted(beyond):
            return False
        return lets_go(self.body, self.u, beyond, self.force_scale, self.modes)

    def accept(self, t: float, h: float, outcome: Outcome, error: float | None) -> Step:
        """Take the present displacement as the state at time t [s], after a step h [s].

        Raises:
            Refused: it does not count; `state.u` is the last accepted displacement again, if there is one.
        """
        self._solved = Step(t, h, self.body.amplitude(t), outcome.iterations, error)
        self._rounded = outcome.rounded
        self.body.contract(self._solved.amplitude)  # the last that was tried may be another
        if self.acceptance is not None:
            try:
                self.acceptance.judge(t, self._solved.amplitude)
            except Refused:
                if self.totals.steps:
                    self.u[:] = self.state.u_n.x.array
                    self.totals.rejected_steps += 1
                raise
        return self._book()

    def _book(self) -> Step:
        """Put the state that has been solved into the books."""
        step = self._solved
        self.t, self.last_step_s = step.t_s, step.dt_s
        self.totals.steps += 1
        self.totals.rounded = max(self.totals.rounded, self._rounded)
        if step.error_estimate is not None:
            self.sizes.keep()
        self.ledger.add_step(step.amplitude, step.dt_s)
        return step

    def no_way_on(self, reason: Reason, amplitude: float, t: float | None = None) -> Reason:
        """The reason of a failure with its place: the present time or t [s]."""
        place = f"{self.t if t is None else t:.6g} s, load amplitude {amplitude:.6g}: {reason}"
        if reason.cause in (Cause.ELLIPTICITY, Cause.COMES_OFF):  # which say where themselves
            return reason
        drowned = reason.cause is Cause.ROUND_OFF
        if not drowned and self._comes_off(amplitude):
            return self._off(self.t if t is None else t, amplitude)
        text = f"the solver stops beyond t = {place}" if drowned else f"no equilibrium beyond t = {place}"
        return Reason(reason.cause, text)

    def memory(self) -> Memory:
        """All that decides how the run goes on after the last accepted step."""
        state = self.state.fields(self.body.density is not None)
        numbers = {
            "t": self.t,
            "last_step_s": self.last_step_s,
            "largest": self.sizes.so_far,
            "totals": dataclasses.asdict(self.totals),
            "load_steps": self.schedule.load_steps,
            "out_of_reach": [str(o) for o in self.out_of_reach],
            "ledger": self.ledger.numbers(),
            "stepping": self.stepping.numbers(),
            "offsets": self.state.offsets(),
        }
        fields = {name: f.x.array.copy() for name, f in state.items()} | self.ledger.fields() | self.stepping.fields()
        return Memory(numbers, fields)

    def recall(self, memory: Memory) -> None:
        """Go back to an accepted step of an earlier run of the same problem; call before `run`. Collective."""
        numbers, fields = memory.numbers, memory.fields
        if reached := [o for o in self.out_of_reach if str(o) not in numbers["out_of_reach"]]:
            self._put_in(reached)
        self.state.recall(numbers["offsets"], fields, self.body.density is not None)
        self.t, self.last_step_s, self.sizes.so_far = (numbers[key] for key in ("t", "last_step_s", "largest"))
        self.totals = Totals(**numbers["totals"])
        self.schedule = dataclasses.replace(self.schedule, load_steps=numbers["load_steps"])
        self.ledger.recall(numbers["ledger"], fields)
        self.stepping.recall(numbers["stepping"], fields)
