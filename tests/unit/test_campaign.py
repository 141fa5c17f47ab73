"""The campaign's judges: each check sees its own fault in a doctored result, and none in the true one."""

import copy
import csv
import json
import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from cli.programs import ROOT

import cellmech
from cellmech.causes import Cause
from cellmech.scene.files import read_scene

sys.path.append(str(ROOT / "tools"))
import campaign_checks as checks
import campaign_verdicts as verdicts
from campaign_scenes import draw
from campaign_states import State, obstacle_depth, pressure, ramp, weight_per_area
from campaign_twins import changed_digits, differences, same_mesh, twin_of

OUTPUT_S, END_S = 9000.0, 18000.0
FULL = {
    "cell": {"shape": "full"},
    "mesh": {"order": 2, "size_um": 5.0},
    "time": {"end_s": END_S, "rtol": 1e-2},
    "output": {"times_s": [OUTPUT_S]},
}


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """A full cell on its pillar and flat, with a state on the way."""
    folder = tmp_path_factory.mktemp("campaign") / "case"
    cellmech.solve(FULL, folder)
    return folder


@pytest.fixture
def case(solved, tmp_path):
    """A copy of its files, to doctor."""
    for path in solved.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


SCENE = read_scene(copy.deepcopy(FULL), "full")


def found(folder, scene=SCENE):
    return {fault.check for fault in checks.judge(scene, folder)}


def rewrite_result(folder, change):
    result = json.loads((folder / "result.json").read_text())
    change(result)
    (folder / "result.json").write_text(json.dumps(result))


def rewrite_history(folder, change):
    with open(folder / "history.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    change(rows)
    with open(folder / "history.csv", "w", newline="") as stream:
        table = csv.DictWriter(stream, rows[0])
        table.writeheader()
        table.writerows(rows)


def rewrite_fields(folder, change):
    """The last field file with another displacement: a function of positions and displacements."""
    import pyvista

    path = checks.read_series(folder / "fields.pvd")[-1][1]
    grid = pyvista.read(path)
    grid["displacement_um"] = change(np.array(grid.points), np.array(grid["displacement_um"]))
    grid.save(path)


def test_true_result_passes(case):
    assert checks.judge(SCENE, case) == []


def test_forces_of_the_fields_are_the_solvers(solved):
    """To twelve digits: the same integral by other means."""
    result = json.loads((solved / "result.json").read_text())
    forces = State(SCENE, checks.read_series(solved / "fields.pvd")[-1][1]).forces()
    assert forces.up == pytest.approx(result["contact"]["force_Pa_x_um"], rel=1e-11)


def scale(row, key, by):
    row[key] = repr(float(row[key]) * by)


def history_of_another(key, by, k=5):
    return lambda folder: rewrite_history(folder, lambda rows: scale(rows[k], key, by))


def shifted(x=0.0, y=0.0):
    return lambda folder: rewrite_fields(folder, lambda points, u: u + np.array([x, y, 0.0]))


def turned(angle):
    """The whole cell turned about its middle."""

    def turn(points, u):
        at = points + u - [0.0, 9.0, 0.0]
        return u + np.column_stack([-angle * at[:, 1], angle * at[:, 0], 0 * at[:, 0]])

    return lambda folder: rewrite_fields(folder, turn)


def bent(points, u):
    """Pressed further down on one side, less on the other: the force stays, its moment does not."""
    side = np.tanh(points[:, 0])
    u[:, 1] -= 0.004 * side
    return u


def flung(points, u):
    """Its top far away, its foot where it was."""
    u[points[:, 1] > 18.0] += [30.0, 0.0, 0.0]
    return u


def unbalance(rows):
    """As much missing in the balance as is taken off the stored energy: the parts still add up."""
    missing = 0.03 * float(rows[-1]["energy.gravity_work"])
    rows[-1]["energy.balance_error"] = repr(missing)
    rows[-1]["energy.stored"] = repr(float(rows[-1]["energy.stored"]) - missing)


DOCTORED = {
    "finite": lambda folder: rewrite_result(folder, lambda result: result["contact"].update(force_Pa_x_um=math.nan)),
    "finite in history": history_of_another("cell.J1_max", math.inf),
    "times, end": lambda folder: rewrite_result(folder, lambda result: result.update(t_s=END_S * (1 - 1e-12))),
    "times, output": lambda folder: (folder / "fields.pvd").write_text(
        (folder / "fields.pvd").read_text().replace(repr(OUTPUT_S), repr(OUTPUT_S * (1 + 1e-12)))
    ),
    "times, file": lambda folder: (folder / "fields_0000.vtu").unlink(),
    "times, order": lambda folder: rewrite_history(folder, lambda rows: rows.insert(3, dict(rows[5]))),
    "weight": history_of_another("contact.weight_Pa_x_um", 1.01),
    "history balance": history_of_another("contact.force_Pa_x_um", 1.002, k=0),
    "energy, sum": history_of_another("energy.stored", 0.9, k=-1),
    "energy, out of balance": lambda folder: rewrite_history(folder, unbalance),
    "det F": history_of_another("cell.det_F_min", -1.0),
    "reported, force": lambda folder: (
        history_of_another("contact.force_Pa_x_um", 1.002, k=-1)(folder),
        rewrite_result(folder, lambda r: r["contact"].update(force_Pa_x_um=1.002 * r["contact"]["force_Pa_x_um"])),
    ),
    "reported, result": lambda folder: rewrite_result(folder, lambda r: r["contact"].update(max_depth_um=0.02)),
    "reported, depth": lambda folder: (
        history_of_another("contact.max_depth_um", 1.2, k=-1)(folder),
        rewrite_result(folder, lambda r: r["contact"].update(max_depth_um=1.2 * r["contact"]["max_depth_um"])),
    ),
    "reported, pressure": history_of_another("contact.max_pressure_Pa", 1.2, k=-1),
    "reported, width": history_of_another("contact.half_width_um", 0.9, k=-1),
    "reported, width too large": history_of_another("contact.half_width_um", 1.1, k=-1),
    "balance": shifted(y=-1e-4),
    "sideways": shifted(x=0.5),
    "moment": lambda folder: rewrite_fields(folder, bent),
    "depth": shifted(y=1.0),
    "moved": lambda folder: rewrite_fields(folder, flung),
}


@pytest.mark.parametrize("doctored", DOCTORED)
def test_judge_sees_what_is_wrong(case, doctored):
    DOCTORED[doctored](case)
    assert doctored.split(",")[0].removesuffix(" in history") in found(case)


def test_judge_sees_a_solved_case_without_steps(case):
    (case / "history.csv").unlink()
    assert "history" in found(case)


def test_judge_sees_field_files_that_are_not_finite_or_inside_out(solved):
    state = State(SCENE, checks.read_series(solved / "fields.pvd")[-1][1])
    rows = checks.read_history(solved / "history.csv")
    state.det_F = state.det_F * -1.0
    assert "det F" in {fault.check for fault in checks.state_is_right(SCENE, state, END_S, None, rows)}
    state.arrays["J1"] = state.arrays["J1"] * np.nan
    assert {fault.check for fault in checks.state_is_right(SCENE, state, END_S, None, rows)} == {"finite"}


def test_judge_sees_a_mesh_that_misses_the_contact_unless_the_program_says_so(solved):
    """A cell as it was meshed, lowered by so little that only the bulges of its edges between the points touch."""
    state = State(SCENE, checks.read_series(solved / "fields.pvd")[-1][1])
    row = checks.read_history(solved / "history.csv")[-1]
    assert list(checks.reports_fit(SCENE, state, END_S, None, [row])) == []
    state.u = np.zeros_like(state.u)
    state.x = state.X - [0.0, 1e-6]
    points, fine = state.forces(), state.forces(fine=True)
    assert fine.up > 1.1 * points.up
    told = {"force_Pa_x_um": points.up, "max_depth_um": fine.depth_um, "half_width_um": state.touching_um() / 2}
    told["max_pressure_Pa"] = float(pressure(SCENE, np.array(fine.depth_um)))
    row |= {f"contact.{key}": value for key, value in told.items()}
    assert {fault.check for fault in checks.reports_fit(SCENE, state, END_S, None, [row])} == {"contact mesh"}
    result = {"contact": told, "model": {"warnings": {"contact": "the mesh is too coarse for it"}}}
    assert list(checks.reports_fit(SCENE, state, END_S, result, [row])) == []


def test_judge_measures_a_contact_narrower_than_the_points_of_an_edge(solved):
    """A circle on a flat, 2e-8 um deep: sqrt(2 R d) to each side. One point that bears the load is no fault of it."""
    state = State(SCENE, checks.read_series(solved / "fields.pvd")[-1][1])
    scene = SCENE.model_copy(update={"pillar": (), "flat": SCENE.flat.model_copy(update={"y_um": -10.0})})
    depth, middle = 2e-8, 1.2345
    s = np.linspace(0.0, 1.0, 5)
    x = middle - 0.4 + s  # an edge 1 um long
    state.scene = scene
    state.outline = lambda: np.stack([x, -10.0 - depth + (x - middle) ** 2 / 20.0], axis=-1)[None]
    half_um = math.sqrt(20.0 * depth)
    assert half_um < 1 / 512
    assert state.touching_um() == pytest.approx(2 * half_um, rel=1e-3)
    assert list(checks.width_fits(scene, state, half_um, depth)) == []
    for wrong in (0.9, 1.1):
        assert [fault.check for fault in checks.width_fits(scene, state, wrong * half_um, depth)] == ["reported"]


def falling(gap_um=100.0, **load):
    return read_scene({"cell": {"inertia": True, "gap_um": gap_um}, "load": {"half_ramp_s": 0.0, **load}}, "falls")


class Fallen:
    """A state that has come down by so much."""

    def __init__(self, way_um):
        self.way_um = way_um

    def fall(self):
        return self.way_um


@pytest.mark.parametrize(("share", "faults"), [(1.0, 0), (1 + 2e-4, 1), (1 - 2e-4, 1)])
def test_free_fall_is_half_g_t_squared(share, faults):
    scene, t_s = falling(), 4e-3
    way = 0.5 * 9.81e6 * t_s**2
    assert checks.free_fall(scene, t_s) == pytest.approx(way, rel=1e-14)
    assert len(list(checks.falls_freely(scene, Fallen(way * share), t_s))) == faults


def test_free_fall_ends_at_the_obstacle():
    assert list(checks.falls_freely(falling(gap_um=10.0), Fallen(0.0), 4e-3)) == []


def test_free_fall_under_a_ramp_is_twice_the_integral_of_its_force():
    """s(2 T) from the step's own double integral: the mean of a symmetric ramp is a half, and its moment 2/7."""
    scene = falling(half_ramp_s=1e-3)
    t, dt = np.linspace(0, 2e-3, 200_001, retstep=True)
    velocity = np.cumsum([9.81e6 * ramp(scene, float(at)) for at in t]) * dt
    assert checks.free_fall(scene, 2e-3) == pytest.approx(float(np.sum(velocity) * dt), rel=1e-4)


def test_depth_is_exact_for_a_flat_and_signed_for_a_pillar():
    x = np.array([[0.0, -1.0], [0.0, 1.0]])
    depth, normal = obstacle_depth((0.0,), x)
    assert depth.tolist() == [1.0, -1.0] and normal.tolist() == [[0.0, 1.0], [0.0, 1.0]]
    depth, normal = obstacle_depth((0.0, -10.0, 10.0, 9.5, 4.0), np.array([[0.0, -0.6], [0.0, -0.4]]))
    assert depth == pytest.approx([0.1, -0.1], rel=0.03) and normal[:, 1].tolist() == [1.0, 1.0]


def test_load_is_that_of_table_1():
    scene = read_scene({}, "table 1")
    assert weight_per_area(scene) * math.pi * 100 == pytest.approx(3.0819, rel=1e-4)
    assert [ramp(scene, t) for t in (0.0, 5000.0, 10_000.0, 20_000.0)] == [0.0, 0.5, 1.0, 1.0]


# Verdicts.

TWIN_PILLARS = [{"x_um": -7.0, "half_width_um": 3.0}, {"x_um": 7.0, "half_width_um": 3.0, "height_um": 9.499}]
ROUND = {"x_um": 0.0, "half_width_um": 3.0, "exponent": 2.0}
NO_WAY, ROUND_OFF, SLIDES = Cause.NO_CONVERGENCE, Cause.ROUND_OFF, Cause.SLIDES
STIFF = {name: {"young_Pa": 1e10} for name in ("membrane", "cytosol", "lamina", "nucleoplasm")}
VERDICTS = {
    "half cell does not slide": ({}, SLIDES, "verdict SUSPECT"),
    "nearly equal pillars": ({"cell": {"shape": "full"}, "pillar": TWIN_PILLARS}, SLIDES, "verdict SUSPECT"),
    "one pillar beside the middle": (
        {"cell": {"shape": "full"}, "pillar": [{"x_um": 6.0, "half_width_um": 3.0}]},
        SLIDES,
        "verdict supported",
    ),
    "symmetric top": ({"cell": {"shape": "full"}}, SLIDES, "verdict SUSPECT"),
    "a little off the middle of a round top": (
        {"cell": {"shape": "full", "centre_x_um": 2.6e-3}, "pillar": [ROUND]},
        SLIDES,
        "verdict supported",
    ),
    "a rounding's width off it": (
        {"cell": {"shape": "full", "centre_x_um": 1e-6}, "pillar": [ROUND]},
        SLIDES,
        "verdict SUSPECT",
    ),
    "small load": ({"load": {"factor": 0.1}}, NO_WAY, "verdict SUSPECT"),
    "load that crushes": ({"load": {"factor": 1000.0}}, NO_WAY, "verdict supported"),
    "penalty that lets it through": ({"contact": {"penalty_Pa_per_um": 0.01}}, NO_WAY, "verdict supported"),
    "bead": ({"layer": STIFF, "load": {"factor": 0.01}}, NO_WAY, "verdict SUSPECT"),
    "bead, named": ({"layer": STIFF, "load": {"factor": 0.01}}, ROUND_OFF, "round-off named"),
    "round-off that is none": ({}, ROUND_OFF, "verdict SUSPECT"),
    "program": ({}, Cause.INTERNAL, "crash"),
    "fall": ({"cell": {"inertia": True, "gap_um": 10.0}}, NO_WAY, "verdict SUSPECT"),
    "fall of a law that gives in early": (
        {"cell": {"inertia": True, "gap_um": 10.0, "law": "saint-venant"}},
        NO_WAY,
        "verdict supported",
    ),
    "mesh": (
        {"cell": {"shape": "full"}},
        Cause.TOO_COARSE,
        "verdict supported",
    ),
    "hard fall": ({"cell": {"inertia": True, "gap_um": 1e5}, "load": {"factor": 100.0}}, NO_WAY, "verdict supported"),
}


@pytest.mark.parametrize("name", VERDICTS)
def test_verdict_is_what_statics_says(name):
    data, cause, expected = VERDICTS[name]
    assert verdicts.verdict(read_scene(copy.deepcopy(data), name), cause) == expected


# Scenes.


def test_scenes_are_the_same_again():
    assert draw(7, 42).data == draw(7, 42).data
    assert draw(7, 42).data != draw(8, 42).data


def test_scenes_span_what_the_campaign_claims():
    drawn = [draw(1, number) for number in range(400)]
    scenes = [one.scene for one in drawn]

    def decades(values):
        values = [value for value in values if value > 0]
        return math.log10(min(values)), math.log10(max(values))

    low, high = decades(scene.load.factor for scene in scenes)
    assert low < -11 and high > 2
    low, high = decades(scene.radius_um for scene in scenes)
    assert low < -1 and high > 2.7
    low, high = decades(layer["young_Pa"] for one in drawn for layer in one.data["layer"].values())
    assert low < 0.3 and high > 9.7
    low, high = decades(scene.time.end_s for scene in scenes)
    assert low < -5.5 and high > 5.5
    assert {len(scene.pillar) for scene in scenes} == {0, 1, 2, 3, 4}
    assert {scene.cell.law for scene in scenes} == {"saint-venant", "neo-hookean", "mooney-rivlin", "yeoh"}
    assert {scene.contact.form for scene in scenes} == {"surface", "volume", "volume-printed"}
    for tag, least in (("nearly equal", 40), ("off centre", 20), ("events side by side", 40), ("inertia", 20)):
        assert sum(tag in " ".join(one.tags) for one in drawn) >= least
    assert {one.extra for one in drawn} == {"", "twin", "end state", "killed", "ranks"}


@pytest.mark.parametrize("number", range(60, 66))
def test_twin_has_the_strains_of_its_scene(number):
    """By the campaign's own estimates, which know of every input that the scaling touches."""
    drawn = draw(1, number)
    found = twin_of(drawn)
    if found is None:
        assert drawn.scene.cell.inertia
        return
    data, stress, length = found
    twin, end = read_scene(data, "twin"), drawn.scene.time.end_s
    assert twin.time.end_s == end or (stress == 1.0 and length == 1.0)
    assert verdicts.strain(twin, twin.time.end_s) == pytest.approx(verdicts.strain(drawn.scene, end), rel=1e-12)
    assert verdicts.stress(twin, twin.time.end_s) == pytest.approx(
        stress * verdicts.stress(drawn.scene, end), rel=1e-12
    )
    assert verdicts.settles(twin, twin.time.end_s) == pytest.approx(
        length * verdicts.settles(drawn.scene, end), rel=1e-12
    )


def test_differences_are_seen_and_scaled(solved):
    one = json.loads((solved / "result.json").read_text())
    other = copy.deepcopy(one)
    assert list(differences(one, other, 1e-6)) == []
    other["nucleus"]["sigma_mises_max_Pa"] *= 1 + 1e-5
    assert [text.split(":")[0] for text in differences(one, other, 1e-6)] == ["nucleus.sigma_mises_max_Pa"]
    other = copy.deepcopy(one)
    other["cell"]["J1_max"] += 1e-5 * (other["cell"]["J1_max"] - 2)  # an error counts from rest
    assert [text.split(":")[0] for text in differences(one, other, 1e-6)] == ["cell.J1_max"]
    assert len(list(differences(one, copy.deepcopy(one), 1e-6, stress=2.0))) >= 6
    other = copy.deepcopy(one)
    one["energy"]["stored"], other["energy"]["stored"] = 1.7e-30, 0.9e-30  # of strains of 1e-17, in free fall
    assert list(differences(one, other, 1e-6)) == []
    other["energy"]["stored"] = 1e-16
    assert [text.split(":")[0] for text in differences(one, other, 1e-6)] == ["energy.stored"]


def test_mesh_of_as_many_elements_is_another_where_their_shapes_differ(solved):
    one = json.loads((solved / "result.json").read_text())
    other = copy.deepcopy(one)
    other["mesh_quality"]["min_edge_um"] *= 16.0
    other["mesh_quality"]["mean_shape_quality"] *= 1 + 1e-13
    assert same_mesh(one, other)
    other["mesh_quality"]["mean_shape_quality"] *= 1 + 6e-7
    assert not same_mesh(one, other) and one["mesh_cells"] == other["mesh_cells"]


def test_changed_digits_are_seen_but_for_costs(solved):
    one = json.loads((solved / "result.json").read_text())
    other = copy.deepcopy(one) | {"wall_s": 1.0}
    assert list(changed_digits(one, other)) == []
    other["energy"]["stored"] = math.nextafter(one["energy"]["stored"], 1.0)
    assert [text.split(":")[0] for text in changed_digits(one, other)] == ["energy.stored"]


def test_rounding_of_stored_positions_counts_beside_a_depth_of_their_size():
    """Nothing beside depths that carry a load; a thousandth where a depth has five digits left."""
    state = SimpleNamespace(X=np.array([[0.0, 29.4]]), u=np.zeros((1, 2)))
    assert checks.rounding_share(state, 1e-4) < 1e-8
    assert 5e-4 < checks.rounding_share(state, 2.4e-10) < 2e-3
    assert checks.rounding_share(state, -1.0) == 0.0
