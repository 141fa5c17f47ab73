"""Pulling an adhering body off: Johnson, Kendall & Roberts, Derjaguin, Muller & Toporov, and Maugis between them.

The load acts in the volume, where the references have it far away: for a contact of a seventh of the radius at most.
"""

import csv
import math
import re
from contextlib import closing

import pytest
from mpi4py import MPI
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

from cellmech.results.records import CaseFolder
from cellmech.runs.case import mesh_plan, solve_case
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene

YOUNG, POISSON, RADIUS = 1000.0, 0.3, 10.0
GRAVITY = 1000.0 * 9.81e-6  # weight of the unit of volume under load.factor = 1 [Pa/µm]
SETS_IN_S, LIFT_S = 8000.0, 10000.0  # adhesion is whole when the load begins; ramp of the load
LAYERS = {"membrane": 10.0, "cytosol": 7.5, "lamina": 5.0, "nucleoplasm": 2.5}  # none thin, of one material


def modulus(young=YOUNG):
    """E* = E/(1 - nu^2) [Pa]: the obstacle is rigid."""
    return young / (1 - POISSON**2)


def solve(path, data):
    case = Case("case", read_scene(data, "test"))
    path.mkdir()
    with closing(CaseFolder(path, MPI.COMM_SELF)) as folder:
        return solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)


def lifted(geometry, force, work, range_um, young=YOUNG, times=()):
    """A body of one material on a flat, held by adhesion, then lifted or pressed (force > 0) [pN or Pa µm]."""
    size = {"axisymmetric": 4 / 3 * math.pi * RADIUS**3, "plane": math.pi * RADIUS**2}[geometry]
    return {
        "cell": {"geometry": geometry, "poisson": POISSON},
        "layer": {
            name: {"young_Pa": young, "fluid_fraction": 0.0, "outer_radius_um": radius}
            for name, radius in LAYERS.items()
        },
        "pillar": [],
        "load": {"factor": force / (GRAVITY * size), "start_s": SETS_IN_S, "half_ramp_s": LIFT_S / 2},
        "contact": {"penalty_Pa_per_um": 1e5},
        "adhesion": {"work_uJ_m2": work, "range_um": range_um, "half_ramp_s": SETS_IN_S / 2},
        "time": {"history": False},
        "output": {"times_s": list(times)},
        "mesh": {"size_um": 5.0, "contact_size_um": range_um},
    }


def ramp_time(share):
    """When that share of the load acts [s] (eq. 25)."""
    s = brentq(lambda s: s**3 * (10 - 15 * s + 6 * s * s) - share, 0.0, 1.0, xtol=1e-15)
    return SETS_IN_S + s * LIFT_S


def pull_off(path, data):
    """The force at which it comes off [pN or Pa µm], from the last state that holds."""
    result = solve(path, data)
    assert (result["status"], result["cause"]) == ("failed", "comes-off"), result["reason"]
    force = next(value for key, value in result["contact"].items() if key in ("force_pN", "force_Pa_x_um"))
    assert force < 0
    return -force


def maugis(tabor):
    """Pull-off over pi w R of Maugis's ball [-], whose stress w/h0 acts up to the gap h0, at (R w^2/(E*^2 h0^3))^(1/3).

    Maugis 1992, eqs 6.15 to 6.18 in K = 4 E*/3: lambda = 2 (w/h0) (R/(pi w K^2))^(1/3), m the outer radius of the pull
    over that of the contact.
    """
    lam = 2 * tabor / (math.pi * (4 / 3) ** 2) ** (1 / 3)

    def force(log_a):
        a = math.exp(log_a)

        def gap_closes(m):
            root, angle = math.sqrt(m * m - 1), math.acos(1 / m)
            opening = lam * a * a / 2 * (root + (m * m - 2) * angle)
            return opening + 4 * lam**2 * a / 3 * (root * angle - m + 1) - 1

        m = brentq(gap_closes, 1.0, 1e6)
        return a**3 - lam * a * a * (math.sqrt(m * m - 1) + m * m * math.acos(1 / m))

    return -minimize_scalar(force, bounds=(-6.0, 1.0), method="bounded", options={"xatol": 1e-7}).fun


def maugis_line(work, range_um):
    """Pull-off of the same stress w/h0 on a cylinder [Pa µm], h0 the range.

    On a < |x| < c, with nothing singular at a, such a stress pulls with 2 (w/h0) (c^2 - a^2)^(1/2), and the slope
    of the gap that it opens is 4 w/(pi E* h0) artanh(((x^2 - a^2)/(c^2 - a^2))^(1/2)): real and imaginary part of one
    function. At c the gap, Hertz's and this one, is h0 (as in Johnson & Greenwood 2008, J. Phys. D 41, 155315).
    """
    stress = work / range_um

    def force(log_a):
        a = math.exp(log_a)

        def gap_closes(m):
            root, wide = math.sqrt(m * m - 1), a * a * (m * m - 1)
            hertz = a * a / (2 * RADIUS) * (m * root - math.log(m + root))
            slope = quad(lambda t: math.atanh(t) * wide * t / math.sqrt(a * a + wide * t * t), 0.0, 1.0)[0]
            return hertz + 4 * stress / (math.pi * modulus()) * slope - range_um

        m = brentq(gap_closes, 1.0, 1e5)
        return math.pi * modulus() * a * a / (4 * RADIUS) - 2 * stress * a * math.sqrt(m * m - 1)

    return -minimize_scalar(force, bounds=(-6.0, 1.5), method="bounded", options={"xatol": 1e-7}).fun


def test_maugis_leads_from_derjaguin_to_johnson():
    """The reference itself: 2 and 3/2 at its ends."""
    assert maugis(1e-3) == pytest.approx(2.0, abs=2e-3)
    assert maugis(20.0) == pytest.approx(1.5, abs=2e-3)
    assert maugis_line(5.0, 0.01) == pytest.approx(barquins(5.0), rel=1e-3)


# Young's modulus [Pa], range [µm], largest elements [µm]; Tabor's number with the range as its length. A stiff ball is
# pulled as far as the range reaches, farther than its contact.
TABOR = {"0.007": (1e5, 0.2, 1.2), "0.32": (1000.0, 0.1, 5.0), "0.64": (1000.0, 0.05, 5.0)}


@pytest.mark.parametrize("number", TABOR)
def test_pull_off_of_a_ball_is_maugis_s(number, tmp_path, ladder):
    """A Dugdale stress w/range of the same range: the mean gap of the pull is range/2 in both."""
    young, range_um, size_um = TABOR[number]
    work = 2.0
    tabor = (RADIUS * work**2 / (modulus(young) ** 2 * range_um**3)) ** (1 / 3)
    assert tabor == pytest.approx(float(number), rel=0.1)
    unit = math.pi * work * RADIUS
    data = lifted("axisymmetric", -2.2 * unit, work, range_um, young)
    data["mesh"]["size_um"] = size_um
    found = pull_off(tmp_path / "ball", data) / unit
    ladder(f"ball comes off, Tabor {number}", ours=found, reference=maugis(tabor), rel=0.03, unit="pi w R")


def jkr_radius(force, work):
    """Radius of Johnson, Kendall & Roberts's contact under a force [µm]; negative forces pull."""
    pull = 3 * math.pi * work * RADIUS
    root = math.sqrt(2 * pull * force + pull**2)
    return (3 * RADIUS / (4 * modulus()) * (force + pull + root)) ** (1 / 3)


def pressed(a, work):
    """The part of a ball's contact of that radius in which it is pressed [µm].

    p = p0 (1 - x^2)^(1/2) - p1 (1 - x^2)^(-1/2) at x = r/a, p0 = 2 a E*/(pi R), p1^2 = 2 w E*/(pi a)
    (Johnson 1985, Contact Mechanics, 5.5).
    """
    p0, p1 = 2 * a * modulus() / (math.pi * RADIUS), math.sqrt(2 * work * modulus() / (math.pi * a))
    return a * math.sqrt(1 - p1 / p0)


def test_contact_of_a_pulled_and_a_pressed_ball_is_johnson_kendall_and_roberts_s(tmp_path, ladder):
    """Pressed radius over that without load: the finite range, Tabor's 0.64, takes the same share of both."""
    work, range_um, unit = 2.0, 0.05, math.pi * 2.0 * RADIUS
    found = {}
    for sign, shares in ((-1.0, (0.4, 0.8)), (2.0, (0.5, 1.0))):
        times = [SETS_IN_S, *(ramp_time(share) for share in shares if share < 1.0)]
        data = lifted("axisymmetric", sign * unit, work, range_um, times=times)
        assert solve(tmp_path / f"{sign:g}", data)["status"] == "solved"
        with open(tmp_path / f"{sign:g}" / "history.csv", newline="") as file:
            rows = {float(row["t_s"]): float(row["contact.half_width_um"]) for row in csv.DictReader(file)}
        found |= {sign * share: rows[ramp_time(share) if share < 1.0 else 18000.0] for share in shares}
        found[0.0] = rows[SETS_IN_S]
    for load, radius in found.items():
        reference = pressed(jkr_radius(load * unit, work), work)
        if load:
            ours, reference = radius / found[0.0], reference / pressed(jkr_radius(0.0, work), work)
            ladder(f"JKR ball, radius under {load:g} pi w R", ours=ours, reference=reference, rel=0.02, unit="a(0)")
        else:
            ladder("JKR ball, radius without load", ours=radius, reference=reference, rel=0.08, unit="µm")


def barquins(work):
    """Pull-off of the cylinder at range 0 [Pa µm], 3 (pi E* w^2 R/16)^(1/3).

    F = pi E* a^2/(4 R) - (2 pi E* a w)^(1/2): Hertz's line contact less a flat punch whose K^2/(2 E*) is w (Barquins
    1988, J. Adhesion 26, 1; Chaudhury et al. 1996, J. Appl. Phys. 80, 30). dF/da = 0 gives a^3 = 2 R^2 w/(pi E*).
    """
    a = (2 * RADIUS**2 * work / (math.pi * modulus())) ** (1 / 3)
    least = math.pi * modulus() * a**2 / (4 * RADIUS) - math.sqrt(2 * math.pi * modulus() * a * work)
    assert -least == pytest.approx(3 * (math.pi * modulus() * work**2 * RADIUS / 16) ** (1 / 3))
    return -least


def test_pull_off_of_a_cylinder_leads_to_barquins_s(tmp_path, ladder):
    """At a range of 0.1 µm the Dugdale stress of that range, 5 % below the limit."""
    work, range_um = 5.0, 0.1
    found = pull_off(tmp_path / "cylinder", lifted("plane", -1.25 * barquins(work), work, range_um))
    ladder(
        "cylinder comes off, range 0.1 µm", ours=found, reference=maugis_line(work, range_um), rel=0.02, unit="Pa um"
    )
    ladder("cylinder comes off, JKR's limit", ours=found, reference=barquins(work), rel=0.08, unit="Pa um")


ELASTIC = {"history": False, "end_s": 14000.0}
TABLE_1 = {
    "cylinder": {"cell": {"geometry": "plane"}, "time": ELASTIC},
    "ball": {"cell": {"geometry": "axisymmetric"}, "time": ELASTIC},
    "ball in a medium": {
        "cell": {"geometry": "axisymmetric"},
        "medium": {"viscosity_Pa_s": 100.0},
        "time": {"end_s": 14000.0, "rtol": 1e-2},
    },
}


@pytest.mark.parametrize("which", TABLE_1)
def test_cell_that_is_lifted_too_far_is_said_to_come_off(which, tmp_path):
    """Table 1's cell on its pillar under minus six times its weight: no failure of the solver, no cell in the air."""
    data = TABLE_1[which] | {
        "adhesion": {"work_uJ_m2": 1.0, "half_ramp_s": 2000.0},
        "load": {"factor": -6.0, "start_s": 4000.0, "half_ramp_s": 4000.0},
        "mesh": {"size_um": 4.8},
    }
    result = solve(tmp_path / "lifted", data)
    assert (result["status"], result["cause"]) == ("failed", "comes-off")
    assert "the lift exceeds what adhesion holds at t = " in result["reason"]
    assert "in the last state, which is saved" in result["reason"]
    assert 4000.0 < result["t_s"] < 12000.0 and (tmp_path / "lifted" / "fields.pvd").exists()
    force, weight, pull = (
        next(value for key, value in result["contact"].items() if re.match(f"{name}_(pN|Pa_x_um)$", key))
        for name in ("force", "weight", "adhesion")
    )
    assert weight < 0 < pull
    if "medium" not in which:
        assert force == pytest.approx(weight, rel=1e-4)
