"""Which times of a run are one: the rule that outputs, ramp, load steps and end share."""

import pytest

from cellmech.solver.instants import CLOSEST, apart, distinct
from cellmech.solver.schedule import Schedule

END = 18000.0


def test_times_of_the_program_give_way_to_those_wanted():
    near = 10000.000001
    assert distinct((near,), (10000.0,), END) == (near, END)
    assert distinct((near,), (9000.0,), END) == (9000.0, near, END)
    assert distinct((), (17999.9999995,), END) == (END,)


def test_limit_itself_is_apart():
    """Also where the sum of both is rounded."""
    for k in range(1, 50):
        earlier = 0.37 * k
        assert apart(earlier, earlier + CLOSEST * END, END)
        assert not apart(earlier, earlier + 0.99 * CLOSEST * END, END)


@pytest.mark.parametrize("output", [499.9999999999, 500.0, 500.0000000001])
def test_every_output_is_landed_on_exactly_and_none_is_lost(output):
    schedule = Schedule(END, (output,), ramp_end_s=10000.0)
    t, steps = 0.0, []
    while t < END:
        t = schedule.next_load_step(t)
        steps.append(t)
    assert output in steps and 10000.0 in steps and steps[-1] == END
    assert len(steps) == 21
    assert schedule.next_landing(0.0) == output


def test_ramp_that_is_skipped_has_no_landing():
    assert Schedule(END, ramp_end_s=10000.0, load_steps=0).landings_s == (END,)
