"""Adhesion against Johnson, Kendall & Roberts, and the energy that it and contracting actin bring."""

import csv
import math
from contextlib import closing

import pytest
from mpi4py import MPI

from cellmech.results.records import CaseFolder
from cellmech.runs.case import mesh_plan, solve_case
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene

YOUNG, POISSON, WORK, RADIUS = 1000.0, 0.3, 2.0, 10.0
ONE_SOLID = {
    name: {"young_Pa": YOUNG, "fluid_fraction": 0.0} for name in ("membrane", "cytosol", "lamina", "nucleoplasm")
}


def solve(path, data):
    case = Case("case", read_scene(data, "test"))
    path.mkdir()
    with closing(CaseFolder(path, MPI.COMM_SELF)) as folder:
        result = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)
    assert result["status"] == "solved", result["reason"]
    return result


def sticking_ball(range_um, size_um):
    """A weightless ball of one material on a flat, held by adhesion alone."""
    return {
        "cell": {"geometry": "axisymmetric", "poisson": POISSON},
        "layer": ONE_SOLID,
        "pillar": [],
        "load": {"factor": 0.0},
        "contact": {"penalty_Pa_per_um": 1e5},
        "adhesion": {"work_uJ_m2": WORK, "range_um": range_um},
        "time": {"history": False},
        "mesh": {"contact_size_um": size_um},
    }


def pressed_radius():
    """Where the pressure of JKR's solution changes sign, without load [µm].

    p = p0 (1 - x^2)^(1/2) - p1 (1 - x^2)^(-1/2) at x = r/a, p0 = 2 a E*/(pi R), p1^2 = 2 w E*/(pi a),
    a^3 = 9 pi w R^2/(2 E*) (Johnson 1985, Contact Mechanics, 5.5).
    """
    modulus = YOUNG / (1 - POISSON**2)
    a = (4.5 * math.pi * WORK * RADIUS**2 / modulus) ** (1 / 3)
    p0, p1 = 2 * a * modulus / (math.pi * RADIUS), math.sqrt(2 * WORK * modulus / (math.pi * a))
    return a * math.sqrt(1 - p1 / p0)


def test_small_range_leads_to_johnson_kendall_and_roberts(tmp_path, ladder):
    """The pressed part of the contact; the misfit shrinks as the range does, here at Tabor's 0.6 and 0.9."""
    found, reference = [], pressed_radius()
    for range_um, size_um in ((0.05, 0.03), (0.03, 0.015)):
        result = solve(tmp_path / f"{range_um:g}", sticking_ball(range_um, size_um))
        found.append(result["contact"]["half_width_um"])
        ladder(f"JKR ball, range {range_um:g} µm", ours=found[-1], reference=reference, rel=0.06, unit="µm")
        assert result["contact"]["adhesion_pN"] > 0
        assert abs(result["contact"]["force_pN"]) < 1e-6 * result["contact"]["adhesion_pN"]
    nearer = (reference - found[1]) / (reference - found[0])
    assert 0.6 < nearer < 0.8
    ladder(
        "JKR ball, range to 0", ours=found[1] + 1.5 * (found[1] - found[0]), reference=reference, rel=0.01, unit="µm"
    )


def test_energy_of_adhesion_is_stored_dissipated_or_spent(tmp_path, ladder):
    """Table 1's ball on its pillar; under 1 µJ/m2 it spreads to a quarter of its radius without a jump."""
    data = {
        "cell": {"geometry": "axisymmetric"},
        "adhesion": {"work_uJ_m2": 1.0},
        "mesh": {"size_um": 4.8},
        "time": {"rtol": 3e-3},
    }
    result = solve(tmp_path / "spread", data)
    energy = result["energy"]
    given = energy["adhesion_work"] + energy["gravity_work"]
    assert given > energy["stored"] > 0.5 * given and energy["adhesion_work"] > 20.0
    assert energy["dissipated"] > 0
    ladder("adhesion: gap over its work", ours=energy["balance_error"] / energy["adhesion_work"], abs=2e-3)
    assert result["contact"]["force_pN"] == pytest.approx(result["contact"]["weight_pN"], rel=1e-5)


def test_energy_of_a_contraction_is_stored_dissipated_or_spent(tmp_path, ladder):
    """The part below the nucleus shortens by 0.3 and pulls it down; what it stores, the rest of the cell lends."""
    data = {
        "cell": {"geometry": "axisymmetric"},
        "actin": [{"where": "basal", "contraction": 0.3, "stiffness_factor": 10.0}],
        "mesh": {"size_um": 4.8},
        "time": {"rtol": 3e-3},
    }
    result = solve(tmp_path / "contracting", data)
    energy = result["energy"]
    assert energy["actin_work"] > 100.0 and energy["dissipated"] > 0
    ladder("contraction: gap over its work", ours=energy["balance_error"] / energy["actin_work"], abs=2e-4)
    assert result["contact"]["force_pN"] == pytest.approx(result["contact"]["weight_pN"], rel=1e-5)


def test_cell_sinks_as_stokes_says_and_comes_to_rest_on_the_pillar(tmp_path, ladder):
    """Without inertia: 6 pi eta R v is the weight until the pillar bears it; a gap of 1 µm and a medium of 100 Pa s."""
    data = {
        "cell": {"geometry": "axisymmetric", "gap_um": 1.0},
        "load": {"half_ramp_s": 0.0},
        "medium": {"viscosity_Pa_s": 100.0},
        "time": {"end_s": 4000.0, "rtol": 1e-2},
        "output": {"times_s": [200.0]},
        "mesh": {"size_um": 6.0},
    }
    result = solve(tmp_path / "sinking", data)
    with open(tmp_path / "sinking" / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    sinking = next(row for row in rows if float(row["t_s"]) == 200.0)
    weight = result["contact"]["weight_pN"]
    speed = weight / (6 * math.pi * 100.0 * RADIUS)
    ladder("Stokes's speed", ours=float(sinking["settled"]), reference=speed, rel=1e-4, unit="µm/s")
    assert float(sinking["contact.force_pN"]) == 0.0
    assert result["contact"]["lift_um"] == 0.0
    assert result["contact"]["force_pN"] == pytest.approx(weight, rel=0.02)
    energy = result["energy"]
    ladder("sinking: gap over the weight's work", ours=energy["balance_error"] / energy["gravity_work"], abs=1e-3)
