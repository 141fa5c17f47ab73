"""The time loop's own numbers: how fast the body still moves, when it lands, what counts as a large error."""

from types import SimpleNamespace

import numpy as np
import pytest
from problems import block, displacement_space, hold, solid, wet

from cellmech.causes import Cause, Reason
from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.solver.load_steps import Equilibrium, LoadSteps, follow
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


def followed(run, memory=None, on_checkpoint=None):
    """The states of a run that, where it can, begins again from its first one, and goes on from a memory if given."""
    steps = []

    def on_step(step):
        if steps or not run.retrace():
            steps.append((step.t_s, step.amplitude, *run.u))

    if memory is not None:
        run.recall(memory)
    run.run(on_step, on_checkpoint)
    return steps


def test_skipped_ramp_can_be_followed_after_all_once():
    run = stretched(ramp_end_s=1.0, load_steps=0)
    steps = followed(run)
    assert steps == followed(stretched(ramp_end_s=1.0))  # as if load steps had been asked for
    assert [t for t, *_ in steps] == pytest.approx([k / 20 for k in range(1, 21)] + [2.0])
    assert (run.totals.steps, run.totals.rejected_steps) == (21, 1)
    assert not run.retrace()


def test_there_is_nothing_to_follow_where_no_ramp_was_skipped():
    for schedule in ({"ramp_end_s": 1.0}, {"load_steps": 0}):
        assert not stretched(**schedule).retrace()
    assert not creeping(ramp_end_s=1.0, load_steps=0).retrace()  # its steps follow the ramp in any case


def test_run_that_follows_the_ramp_after_all_goes_on_so_from_a_checkpoint():
    kept = []
    steps = followed(stretched(ramp_end_s=1.0, load_steps=0), on_checkpoint=kept.append)
    assert followed(stretched(ramp_end_s=1.0, load_steps=0), kept[0]) == steps[10:]


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


class Scripted:
    """Stands in for a run: a leap fails, and so does any exact or rough solve beyond `hard` in one step.

    From `floor` on something comes into reach; without it there is nothing a tenth further on.
    """

    def __init__(self, hard, floor=np.inf):
        self.hard, self.floor, self.calls, self.u = hard, floor, [], np.zeros(1)
        self.totals, self.log = Totals(), lambda line: None

    def reaches_more(self):
        reached = self.u[0] >= self.floor
        self.floor = np.inf if reached else self.floor
        return reached

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


@pytest.mark.parametrize(("amplitude", "begun"), [(0.25, 0.25), (0.5, 0.0), (0.75, 0.0)])
def test_run_begins_at_a_part_of_the_load_only_below_its_first_landing(amplitude, begun):
    """The load grows with time, to 0.5 at the first output: nothing is followed backwards from beyond that."""
    run = Scripted(hard=1.0)
    run.t, run.body = 0.0, SimpleNamespace(amplitude=lambda t: t)
    run.schedule = SimpleNamespace(next_load_step=lambda t: 0.5)
    steps = LoadSteps(run)
    run.u[:] = amplitude
    steps.begin_at(amplitude)
    assert (steps.last.amplitude, steps.last.u[0]) == (begun, begun)


def test_after_a_failure_equilibria_are_exact():
    run = Scripted(hard=0.3)
    here, outcome = follow(run, Equilibrium(0.0, np.zeros(1), at_rest=True), 1.0, 1e-4, leap=True)
    assert outcome.converged and here.amplitude == 1.0
    failed = run.calls.index((0.875, True, False))
    assert run.calls[failed + 1] == (0.375, False, False)  # where it was, now exactly
    assert not any(rough for _, rough, _ in run.calls[failed + 1 :])
    assert run.totals.failed_solves >= 1
