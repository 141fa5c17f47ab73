"""The time loop's own numbers: how fast the body still moves, when it lands, what counts as a large error."""

from types import SimpleNamespace

import numpy as np
import pytest
from problems import block, displacement_space, hold, solid, wet

from cellmech.causes import Cause, Reason
from cellmech.errors import SolveError
from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.solver.load_steps import Equilibrium, Guess, LoadSteps, follow
from cellmech.solver.newton import Outcome
from cellmech.solver.schedule import Schedule, Totals
from cellmech.solver.simulation import Simulation


def creeping(end_s=2.0, **schedule):
    domain = block(bottom="outer")
    space = displacement_space(domain)
    material = wet(young=10.0, fluid_lambda=6.0, fluid_mu=3.0)
    bcs = (hold(space, domain, "left", 0), hold(space, domain, "outer", 1))
    body = Body(domain, material_fields(domain, {"solid": material}), space, bcs, tractions={"right": (2.0, 0.0)})
    return Simulation(body, Schedule(end_s, **schedule), 2.0)


def stretched(**schedule):
    domain = block(bottom="outer")
    space = displacement_space(domain)
    bcs = (hold(space, domain, "left", 0), hold(space, domain, "outer", 1))
    ramp = {"amplitude": lambda t: min(t, 1.0), "tractions": {"right": (2.0, 0.0)}}
    return Simulation(
        Body(domain, material_fields(domain, {"solid": solid()}), space, bcs, **ramp), Schedule(2.0, **schedule), 2.0
    )


def test_rate_is_the_largest_nodal_displacement_of_the_last_step_over_its_time():
    run, before, rates = creeping(), [0.0], []

    def on_step(step):
        move = np.linalg.norm((run.u - before[0]).reshape(-1, 2), axis=1).max()
        rates.append((run.rate(), move / step.dt_s))
        before[0] = run.u.copy()

    run.run(on_step)
    got, expected = np.array(rates).T
    np.testing.assert_allclose(got, expected, rtol=1e-12)
    assert expected.max() > 3 * expected[-1] > 0  # it comes to rest


def test_landings_are_hit_exactly():
    run, times = creeping(outputs_s=(0.3, 1.1), rtol=1e-2), []
    run.run(lambda step: times.append(step.t_s))
    assert {0.3, 1.1} < set(times) and times[-1] == 2.0
    assert np.all(np.diff(times) > 0)


def test_relative_error_is_of_the_largest_displacement_so_far():
    """Also after the body has gone back; tiny displacements are measured by 1e-3 um."""
    run = creeping()
    error = np.zeros_like(run.u)
    error[:2] = 3e-4, 4e-4
    assert run.relative(error) == pytest.approx(0.5, rel=1e-12)
    run.u[:2] = 0.3, 0.4
    assert run.relative(error) == pytest.approx(1e-3, rel=1e-12)
    run.sizes.so_far = [5.0, 0.0]
    assert run.relative(error) == pytest.approx(1e-4, rel=1e-12)


def test_error_of_a_deformation_is_not_measured_by_the_way_of_a_fall():
    """With inertia an error that deforms counts beside the deformation; one that translates beside the way."""
    run = creeping()
    run.sizes.inertia = True
    way = np.tile([0.0, -100.0], len(run.u) // 2)
    run.u[:] = way
    run.u[:2] += 0.3, 0.4
    lump = np.zeros_like(run.u)
    lump[:2] = 3e-3, 4e-3
    assert run.relative(lump) == pytest.approx(1e-2, rel=1e-6)
    assert run.relative(way / 100) == pytest.approx(1e-2, rel=0.01)


UNSTABLE = Reason(Cause.ELLIPTICITY, "a band")


class Scripted:
    """Stands in for a run: a leap fails, and so does any exact or rough solve beyond `hard` in one step.

    From `floor` on something comes into reach; without it there is nothing a tenth further on.
    """

    def __init__(self, hard, floor=np.inf):
        self.hard, self.floor, self.calls, self.u = hard, floor, [], np.zeros(1)
        self.body = SimpleNamespace(pulling=())
        self.bears = np.inf  # up to here the material is stable
        self.totals, self.log = Totals(), lambda line: None

    def reaches_more(self):
        reached = self.u[0] >= self.floor
        self.floor = np.inf if reached else self.floor
        return reached

    def lifted(self, amplitude):
        return False

    def lost(self, t, amplitude):
        return UNSTABLE if amplitude > self.bears else None

    def solve(self, amplitude, rough=False, leap=False):
        self.calls.append((amplitude, rough, leap))
        found = not leap and amplitude - self.u[0] <= self.hard and amplitude < self.floor + 0.1
        self.u[:] = amplitude if found else np.nan
        return Outcome(3, 1, 0.0, None if found else Reason(Cause.NO_CONVERGENCE, "too far"))


def test_way_to_a_load_is_rough_and_its_end_exact():
    run = Scripted(hard=1.0)
    here, outcome = follow(run, Equilibrium(0.0, np.zeros(1), at_rest=True), 1.0, 1e-4, leap=True)
    assert run.calls == [
        (1.0, False, True),
        (0.125, True, False),
        (0.375, True, False),
        (0.875, True, False),
        (1.0, False, False),
    ]
    assert outcome.converged and here.amplitude == 1.0 and outcome.iterations == 15


def test_what_is_reached_on_the_way_is_put_in_there():
    """Without the floor that a cell comes to between its pillars there may be no equilibrium under the whole load."""
    run = Scripted(hard=1.0, floor=0.8)
    here, outcome = follow(run, Equilibrium(0.0, np.zeros(1), at_rest=True), 1.0, 1e-4, leap=True)
    assert outcome.converged and here.amplitude == 1.0
    assert run.totals.failed_solves == 0


def load_steps(run, first=0.5):
    """Load steps of a load that grows as time does, to a first landing."""
    run.t, run.body = 0.0, SimpleNamespace(amplitude=lambda t: t, pulling=())
    run.schedule = SimpleNamespace(next_load_step=lambda t: first, load_steps=0)
    run.state = SimpleNamespace(update=lambda: None, rest=lambda: None)
    run.no_way_on = lambda reason, amplitude, t: Reason(reason.cause, f"{amplitude}: {reason}")
    run.accept = lambda t, h, outcome, error: (t, h)
    return LoadSteps(run)


@pytest.mark.parametrize(("amplitude", "begun"), [(0.25, True), (0.5, False), (0.75, False)])
def test_run_begins_at_a_part_of_the_load_only_below_its_first_landing(amplitude, begun):
    """The load grows with time, to 0.5 at the first output: nothing is followed backwards from beyond that."""
    run = Scripted(hard=1.0)
    steps = load_steps(run)
    steps.begin_near(Guess(amplitude, np.array([amplitude]), 0.03125))
    assert run.u[0] == amplitude
    steps.advance()
    assert run.calls[0] == ((amplitude, True, False) if begun else (0.5, False, True))
    if begun:  # it goes on as carefully as the guess was made, and ever faster
        assert [one for one, *_ in run.calls] == [0.25, 0.28125, 0.34375, 0.46875, 0.5]


def test_guess_that_is_none_of_this_mesh_is_left_for_the_way_from_rest():
    run = Scripted(hard=0.2)
    run.solve(0.0)
    here, outcome = follow(
        run, Equilibrium(0.0, np.zeros(1)), 0.5, 1e-4, leap=True, guess=Guess(0.4, np.array([0.1]), 0.01)
    )
    assert outcome.converged and here.amplitude == 0.5
    assert [one for one, *_ in run.calls[1:3]] == [0.4, 0.2]


def test_load_is_followed_to_where_the_material_becomes_unstable():
    """To a 64th of it, at no cost where the material is stable; the state there is booked, and nothing beyond."""
    run = Scripted(hard=1.0)
    run.bears = 0.7
    steps = load_steps(run, first=1.0)
    t, _ = steps.advance()
    assert steps.stuck.cause is Cause.ELLIPTICITY
    assert 0.7 - 1 / 64 <= steps.last.amplitude <= 0.7
    assert t == pytest.approx(steps.last.amplitude) and run.u[0] == steps.last.amplitude
    assert len(run.calls) <= 13
    run.totals.steps = 1
    with pytest.raises(SolveError, match="a band"):
        steps.advance()


def test_leap_to_an_unstable_state_is_none():
    run = Scripted(hard=1.0)
    run.solve = lambda amplitude, rough=False, leap=False: Scripted.solve(run, amplitude, rough)
    here, outcome = follow(
        run, Equilibrium(0.0, np.zeros(1)), 1.0, 1e-4, leap=True, judge=lambda a: None if a < 0.1 else UNSTABLE
    )
    assert 0.1 - 1 / 64 <= here.amplitude < 0.1 and outcome.reason == UNSTABLE


def test_after_a_failure_equilibria_are_exact():
    run = Scripted(hard=0.3)
    here, outcome = follow(run, Equilibrium(0.0, np.zeros(1), at_rest=True), 1.0, 1e-4, leap=True)
    assert outcome.converged and here.amplitude == 1.0
    failed = run.calls.index((0.875, True, False))
    assert run.calls[failed + 1] == (0.375, False, False)  # where it was, now exactly
    assert not any(rough for _, rough, _ in run.calls[failed + 1 :])
    assert run.totals.failed_solves >= 1
