"""Work of the load = stored + dissipated + done against the contact + kinetic.

A quasi-static state is in equilibrium at every step, so that only the integration of the works over time leaves a gap:
third order in the step. Kinetic energy by BDF2 is of second order.
"""

import csv
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from problems import block, displacement_space, hold, march, solid, wet

from cellmech.fem.coefficients import material_fields
from cellmech.mechanics.balance import Body
from cellmech.mechanics.contact import Contact
from cellmech.mechanics.obstacles import Flat, Pillar
from cellmech.results.records import CaseFolder
from cellmech.runs.case import mesh_plan, solve_case
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene
from cellmech.solver.energy_balance import Ledger
from cellmech.solver.schedule import Schedule
from cellmech.solver.simulation import Simulation
from cellmech.solver.state import State

GRAVITY, END = 3.0, 2.0  # Pa/µm, s


def ramp(t):
    s = min(t / END, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def pressed_block(obstacle, young=20.0):
    """A wet block that gravity presses on an obstacle until it is some 10 % flatter."""
    domain = block(nx=2, ny=2, bottom="outer")
    space = displacement_space(domain)
    material = wet(young=young, poisson=0.3, fluid_fraction=0.5, fluid_lambda=5.0, fluid_mu=2.0)
    return Body(
        domain,
        material_fields(domain, {"solid": material}),
        space,
        (hold(space, domain, "left", 0),),
        (0.0, -GRAVITY),
        contact=Contact(kappa=20.0, width=0.05),
        obstacles=(obstacle,),
        amplitude=ramp,
    )


def books(body, n):
    """The ledger after n equal steps."""
    state = State(body)
    ledger = Ledger(body, state)
    ledger.begin(0.0)
    state.u.x.array[1::2] = -1e-3  # a first guess in contact, where the tangent is regular
    march(body, GRAVITY, np.full(n, END / n), lambda t: ledger.add_step(body.amplitude(t), END / n), state)
    return ledger


def gap(ledger):
    return ledger.load_work - ledger.stored() - ledger.dissipated - ledger.contact_work


@pytest.mark.parametrize("obstacle", [Flat(0.0), Pillar(0.0, -1.0, 1.5, 1.0, 2.0)], ids=["flat", "round"])
def test_energy_balance_closes_at_third_order_in_the_step(obstacle, ladder):
    """The load stops at half its ramp: from rest to rest the leading terms cancel, and the order would be 4."""
    body = replace(pressed_block(obstacle), amplitude=lambda t: ramp(t / 2))
    ledgers = [books(body, n) for n in (10, 20, 40)]
    gaps = np.array([abs(gap(ledger)) for ledger in ledgers])
    last = ledgers[-1]
    for part in (last.stored(), last.dissipated, last.contact_work):
        assert part > 0.1 * last.load_work
    case = f"energy balance, pressed on a {type(obstacle).__name__.lower()}"
    ladder(f"{case}: gap over the work of gravity", ours=gaps[-1] / last.load_work, abs=1e-4)
    ladder.order(f"{case}: gap in the step", gaps, 3.0, 0.15)


def test_energy_balance_of_a_run_under_error_control_closes(ladder):
    """Through the time loop: the rows a result prints."""
    body = pressed_block(Flat(0.0))
    run = Simulation(body, Schedule(END, rtol=1e-4, ramp_end_s=END), GRAVITY)
    run.run(lambda step: None)
    ledger = run.ledger
    assert min(ledger.stored(), ledger.dissipated, ledger.contact_work) > 0.1 * ledger.load_work
    case = "energy balance, under error control: gap over the work of gravity"
    ladder(case, ours=gap(ledger) / ledger.load_work, abs=1e-3)


def test_work_against_a_penalty_is_the_integral_of_pressure_over_depth(ladder):
    """A stiff block pressed flat: contact work -> length x int p dd at the end."""
    body = pressed_block(Flat(0.0), young=1e5)
    ledger = books(body, 20)
    kappa, s, load = 20.0, 0.05, GRAVITY
    d = load / kappa + s / 2
    expected = kappa * (d**2 / 2 - s * d / 2 + s**2 / 6)
    ladder("contact work: int p dd", ours=ledger.contact_work, reference=expected, rel=5e-3, unit="Pa µm²")


def test_free_fall_has_order_2_in_position_and_turns_work_into_kinetic_energy(ladder):
    """Inertia alone: a load growing like t gives u = -(f/rho) t^3/6."""
    density, errors, gaps = 2.0, [], []
    domain = block()
    body = Body(
        domain,
        material_fields(domain, {"solid": solid()}),
        displacement_space(domain),
        body_force=(0.0, -GRAVITY),
        amplitude=lambda t: t,
        density=density,
    )
    for n in (20, 40, 80):
        state = State(body)
        ledger = Ledger(body, state)
        ledger.begin(0.0)
        kinetic = []

        def book(t, ledger=ledger, h=END / n, kinetic=kinetic):
            ledger.add_step(t, h)
            kinetic.append(ledger.kinetic())

        march(body, GRAVITY, np.full(n, END / n), book, state)
        exact = -GRAVITY / density * END**3 / 6
        errors.append(np.abs(state.u.x.array[1::2] / exact - 1).max())
        gaps.append(abs(ledger.load_work - ledger.stored() - kinetic[-1]) / ledger.load_work)
        assert np.abs(state.u.x.array[0::2]).max() < 1e-12
        assert kinetic[-1] == pytest.approx(density / 2 * (GRAVITY / density * END**2 / 2) ** 2, rel=5 / n**2)
    ladder.order("inertia, growing load: position", errors, 2.0, 0.15)
    ladder.order("inertia, growing load: energy balance", gaps, 2.0, 0.15)


def test_every_row_of_a_falling_cell_has_its_kinetic_energy(tmp_path, ladder):
    """Free fall from rest at full weight: all the work of gravity is in the motion, m v^2 / 2 with v = g t."""
    end_s = 1e-3
    data = {
        "mesh": {"size_um": 5.0},
        "cell": {"inertia": True},
        "pillar": [],
        "flat": False,
        "load": {"half_ramp_s": 0.0},
        "time": {"end_s": end_s},
    }
    case = Case("case", read_scene(data, "test"))
    folder = CaseFolder(tmp_path, MPI.COMM_SELF)
    energy = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)["energy"]
    folder.close()
    with open(tmp_path / "history.csv", newline="") as stream:
        rows = [{key: float(value) for key, value in row.items() if value} for row in csv.DictReader(stream)]
    mass = 1e-9 * np.pi * 10.0**2  # Pa s^2 um^-2 times the disc's area: per um of depth
    for row in rows[2:]:  # the first steps are of first order
        assert row["energy.kinetic"] == pytest.approx(mass * (9.81e6 * row["t_s"]) ** 2 / 2, rel=0.05)
    case = "inertia, falling cell at its end: kinetic energy"
    ladder(case, ours=energy["kinetic"], reference=mass * (9.81e6 * end_s) ** 2 / 2, rel=2e-3, unit="Pa µm²")
    ladder(
        "inertia, falling cell: gap over the work of gravity",
        ours=energy["balance_error"] / energy["gravity_work"],
        abs=1e-3,
    )


def test_works_of_a_load_that_is_there_at_once_are_those_of_a_ramp(tmp_path, ladder):
    """Of a cell with next to no viscosity, whose way does not depend on the time it takes."""

    def energies(half_ramp_s, rtol):
        tables = {
            "cell": {"fluid_lambda_Pa_s": 1e-5, "fluid_mu_Pa_s": 1e-5},
            "mesh": {"order": 2, "size_um": 5.0},
            "contact": {"penalty_Pa_per_um": 2.0},
            "load": {"half_ramp_s": half_ramp_s},
            "time": {"end_s": 100.0, "rtol": rtol},
        }
        case = Case("case", read_scene(tables, "test"))
        folder = CaseFolder(tmp_path / str(half_ramp_s), MPI.COMM_SELF)
        result = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)
        folder.close()
        return result["energy"]

    once, ramped = energies(0.0, 1e-2), energies(25.0, 1e-3)
    for key in ("gravity_work", "contact_work", "stored"):
        ladder(f"load at once, {key}", ours=once[key], reference=ramped[key], rel=2e-3, unit="Pa µm²")
    assert abs(once["balance_error"]) < 1e-4 * once["gravity_work"]
