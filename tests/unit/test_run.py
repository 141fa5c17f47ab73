"""The time loop's own numbers: how fast the body still moves, when it lands, what counts as a large error."""

import numpy as np
import pytest
from problems import block, displacement_space, hold, wet

from cellmech.materials import mixtures
from cellmech.residual import Body
from cellmech.run import Run, Schedule


def creeping(end_s=2.0, **schedule):
    domain = block(bottom="outer")
    space = displacement_space(domain)
    material = wet(young=10.0, fluid_lambda=6.0, fluid_mu=3.0)
    bcs = (hold(space, domain, "left", 0), hold(space, domain, "outer", 1))
    body = Body(domain, mixtures(domain, {"solid": material}), space, bcs, tractions={"right": (2.0, 0.0)})
    return Run(body, Schedule(end_s, **schedule), 2.0)


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
    run, times = creeping(landings_s=(0.3, 1.1), rtol=1e-2), []
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
    run.largest = 5.0
    assert run.relative(error) == pytest.approx(1e-4, rel=1e-12)
