"""A state that is reported is in balance with the load of its own moment, however small, stiff or late that is."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from cellmech.causes import Cause
from cellmech.cell.layering import mesh_plan
from cellmech.cell.setup import Setup
from cellmech.errors import SolveError
from cellmech.results.records import CaseFolder
from cellmech.runs.case import solve_case
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene
from cellmech.scene.parts import LAYER_NAMES
from cellmech.solver import time_steps
from cellmech.solver.newton import BALANCED
from cellmech.solver.resolution import doubts

COARSE = {"size_um": 6.0}


def scene_of(**tables):
    return read_scene({"mesh": COARSE, **tables}, "test")


def run_of(scene, log=lambda line: None):
    return Setup(scene, MPI.COMM_SELF, mesh_plan(scene)).create_run(log)


def steps_of(run):
    """Of each step: time [s], Newton iterations, and the contact's force over the load then [-]."""
    steps = []

    def on_step(step):
        load = -run.ledger.load_resultant()[1] * step.amplitude
        steps.append((step.t_s, step.newton, run.ledger.contact_force()[1] / load))

    run.run(on_step)
    run.close()
    return np.array(steps)


def all_layers(**values):
    return {"layer": {name: dict(values) for name in LAYER_NAMES}}


STIFF = all_layers(young_Pa=3e9, fluid_fraction=0.0)
SMALL_LOADS = {
    "first second of a ramp of hours": {"time": {"end_s": 1.0}},
    "the same, end state alone": {"time": {"end_s": 1.0, "history": False}},
    "a billionth of the weight": {"load": {"factor": 1e-9}},
    "at once, a billionth, full cell": {"cell": {"shape": "full"}, "load": {"factor": 1e-9, "half_ramp_s": 0.0}},
    "early output": {"output": {"times_s": [1.0, 2.0]}, "time": {"end_s": 10.0}},
    "force in the volume": {"contact": {"form": "volume"}, "load": {"half_ramp_s": 1.0}, "time": {"end_s": 0.05}},
    "beads": {**STIFF, "time": {"end_s": 100.0}},
    "ramp of a microsecond": {"load": {"half_ramp_s": 5e-7}, "time": {"end_s": 1e-3}},
    "viscosity of 1e10 Pa s": {"cell": {"fluid_lambda_Pa_s": 1e10}, "time": {"end_s": 1e3}},
    "stiff lamina": {"layer": {"lamina": {"young_Pa": 1e9}}, "time": {"end_s": 5000.0}},
}


@pytest.mark.parametrize("tables", SMALL_LOADS.values(), ids=SMALL_LOADS)
def test_every_step_balances_the_load_of_its_moment(tables):
    """Before, steps of 0 iterations were accepted below 1e-10 of the weight, and the cell flew 1.4 mm up."""
    run = run_of(scene_of(**tables))
    steps = steps_of(run)
    np.testing.assert_allclose(steps[:, 2], 1.0, rtol=1e-3)
    assert np.abs(run.u).max() < 1.0


def test_round_off_at_nodes_leaves_their_sum_in_balance():
    """A stiff, viscous membrane on a soft contact: the tangent, rounded, hardly knows the contact."""
    young = {"membrane": 6.05e9, "cytosol": 6.77e5, "lamina": 9.22, "nucleoplasm": 2790.0}
    fluid = {"membrane": 0.3, "cytosol": 0.0, "lamina": 0.9, "nucleoplasm": 0.0}
    tables = {
        "mesh": {"size_um": 5.0},
        "layer": {name: {"young_Pa": young[name], "fluid_fraction": fluid[name]} for name in LAYER_NAMES},
        "pillar": [{"x_um": 5.135, "half_width_um": 3.7228749999999997, "exponent": 8.0}],
        "flat": False,
        "contact": {"penalty_Pa_per_um": 0.0749},
        "load": {"factor": 6.26e-6, "half_ramp_s": 8.613199999999999},
        "time": {"end_s": 0.353},
        "output": {"times_s": [0.31752349999999996]},
    }
    run = run_of(scene_of(**tables))
    np.testing.assert_allclose(steps_of(run)[:, 2], 1.0, rtol=2e-6)
    assert 1e-6 < run.totals.rounded <= BALANCED
    assert "round-off keeps forces of" in doubts(run, None)["round-off"]


def test_state_that_meets_the_tolerance_has_no_doubt_of_round_off():
    run = run_of(scene_of(time={"history": False}))
    steps_of(run)
    assert run.totals.rounded == 0.0
    assert "round-off" not in doubts(run, None)


def test_small_load_strains_in_proportion():
    """Strains of an end state at 1e-9 of the weight: displacements less the sinking are those of 1e-8, over ten."""
    deformed = []
    for factor in (1e-8, 1e-9):
        run = run_of(scene_of(load={"factor": factor}, time={"history": False}))
        steps_of(run)
        deformed.append(np.abs(run.state.now.part.x.array).max())
    assert deformed[0] / deformed[1] == pytest.approx(10.0, rel=0.1)  # contact grows with the load


@pytest.mark.parametrize("young_Pa", [1e8, 3e9, 1e10])
def test_stiff_bead_sinks_in_as_a_rigid_disc(young_Pa):
    """A parabola on a penalty of kappa: depth (3 W/(4 kappa sqrt(2 R)))^(2/3), the pillar's top being nearly flat."""
    scene = scene_of(
        **all_layers(young_Pa=young_Pa, fluid_fraction=0.0), time={"history": False}, mesh={"size_um": 3.4}
    )
    run = run_of(scene)
    steps = steps_of(run)
    depth = run.outline.max_depth(run.state.u, run.body.obstacles)
    weight, kappa, radius = -2 * run.ledger.load_resultant()[1], 50.0, 10.0
    expected = (3 * weight / (4 * kappa * np.sqrt(2 * radius))) ** (2 / 3)
    assert depth == pytest.approx(expected, rel=0.01)
    assert len(steps) == 1 and steps[0, 1] <= 3
    assert np.abs(run.state.now.part.x.array).max() < 1e-6  # strains are not made of the way it sinks


def test_load_below_round_off_is_named_and_not_physics():
    """1e-20 of a weight on fluid that a step of a microsecond makes as hard as stone."""
    run = run_of(scene_of(load={"half_ramp_s": 1e6}, time={"end_s": 1e-6}))
    with pytest.raises(SolveError, match=r"^the solver stops .*round-off keeps forces .* times the load"):
        run.run(lambda step: None)
    assert run.totals.newton_iterations < 60
    run.close()


TIMES = {
    "plain": {},
    "ramp ends just before the end": {"load": {"half_ramp_s": 8999.9999995}},
    "output just after the ramp": {"output": {"times_s": [10000.000001]}},
    "output just before the ramp's end": {"output": {"times_s": [9999.9999999, 12000.0]}},
    "outputs at the ramp's parts": {"output": {"times_s": [499.9999999999, 1000.0000000001]}},
}


@pytest.mark.parametrize("fluid", [True, False], ids=["time steps", "load steps"])
def test_times_side_by_side_lead_to_the_same_end(fluid, tmp_path):
    """All requested times are written, and the end values are those without them."""
    cell = {} if fluid else {"fluid_lambda_Pa_s": 0.0, "fluid_mu_Pa_s": 0.0}
    base = {"mesh": COARSE | {"order": 1}, "time": {"rtol": 1e-2}, "cell": cell}
    ends = []
    for name, tables in TIMES.items():
        scene = scene_of(**base, **tables)
        folder = CaseFolder(tmp_path / name.replace("'", ""), MPI.COMM_SELF, "k")
        result = solve_case(Case("case", scene), folder, MPI.COMM_SELF, mesh_plan(scene), lambda progress: None)
        folder.finish(result)
        folder.close()
        assert result["status"] == "solved", f"{name}: {result['reason']}"
        pvd = (folder.path / "fields.pvd").read_text()
        assert all(f'timestep="{t!r}"' in pvd for t in (*scene.output.times_s, scene.time.end_s)), name
        ends.append(result["nucleus"]["sigma_mises_max_Pa"])
    np.testing.assert_allclose(ends, ends[0], rtol=1e-3)


def test_output_before_a_load_that_is_there_at_once_is_put_on_is_hit():
    scene = scene_of(load={"half_ramp_s": 0.0}, output={"times_s": [0.1]}, time={"end_s": 1e4, "rtol": 1e-2})
    assert 0.1 in steps_of(run_of(scene))[:, 0]


def test_part_of_a_load_at_once_that_round_off_hides_is_passed_over(monkeypatch):
    follow, asked = time_steps.follow, []

    def drowned_at_the_second(run, start, target, *rest, **named):
        asked.append(target)
        here, outcome = follow(run, start, target, *rest, **named)
        lost = Cause.ROUND_OFF.reason(force=1.0, load=1.0, unit="Pa um", remedy="")
        return here, replace(outcome, reason=lost) if len(asked) == 2 else outcome

    monkeypatch.setattr(time_steps, "follow", drowned_at_the_second)
    run = run_of(scene_of(load={"half_ramp_s": 0.0}))
    assert run.stepping.advance().amplitude == 1.0
    assert asked == [1 / 64, 4 / 64, 1.0]
    assert run.ledger.contact_force()[1] == pytest.approx(-run.ledger.load_resultant()[1], rel=1e-6)
