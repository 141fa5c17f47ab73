"""The error of every number: what is refined, how the parts are separated, what is extrapolated."""

import math

import pytest

from cellmech.errors import InputError
from cellmech.results.accuracy import MESH_RATIO, PARTS, assess, bears_on, numbers, refinements
from cellmech.results.accuracy_report import error_trees, report, table_rows
from cellmech.scene.files import read_scene


def scene(**data):
    return read_scene(data, "test")


def result(shift=0.0, **more):
    """A result whose numbers are all moved by a share of their difference from rest."""
    q = 1.0 + shift
    region = {
        "sigma_mises_max_Pa": 5.0 * q,
        "J1_max": 2.0 + 0.004 * q,
        "J3_mean": 1.0 + 5e-5 * q,
        "J1_max_at_um": [0.0, 4.6],
        "J1_max_time_s": 9000.0,
        "area_um2": 100.0,
    }
    shares = {"J1": 100 * (2 + 0.004 * q) * 100 / 400}
    return {
        "nucleus": region,
        "membrane": None,
        "cell": region | {"area_um2": 400.0},
        "share_of_area_percent": shares,
        "shape_index": {"full": 1.0 - 0.01 * q},
        "lamina_pillar_distance_um": 5.0 * q,
        "nucleus_obstacle_distance_um": 4.0 * q,
        "contact": {"max_depth_um": 0.02 * q, "lift_um": None},
        "energy": {"stored": 3.0 * q, "balance_error": 1e-3 * (1 + 100 * shift)},
        "steps": 56,
        "scene": {"mesh": {"size_um": 0.6}},
        **more,
    }


def by_order(order, error=0.02):
    """The base and its two finer meshes, wrong by `error` in all, with this order."""
    base, finer, finest = (result(error / MESH_RATIO ** (order * level)) for level in range(3))
    return base, {"mesh-1": finer, "mesh-2": finest}


# What is refined


def test_each_refinement_changes_what_its_part_says_and_nothing_else():
    base = scene(mesh={"contact_size_um": 0.2}, flat=False, pillar=[{"x_um": 3.0, "half_width_um": 2.0}])
    found = {r.name: r for r in refinements(base)}
    assert list(found) == ["mesh-1", "mesh-2", "time", "smoothing", "penalty", "quadrature"]
    sizes = [base.mesh.size_um, *(found[f"mesh-{level}"].scene.mesh.size_um for level in (1, 2))]
    assert sizes[0] / sizes[1] == pytest.approx(math.sqrt(2), rel=1e-5)
    assert sizes[0] / sizes[2] == pytest.approx(2, rel=1e-5)
    assert found["mesh-2"].scene.mesh.contact_size_um == pytest.approx(0.1, rel=1e-5)
    assert found["mesh-2"].scene.mesh.thin_layers == base.mesh.thin_layers + 2
    assert found["time"].scene.time.rtol == pytest.approx(base.time.rtol / 10)
    assert found["smoothing"].scene.contact.smoothing_um == pytest.approx(base.contact.smoothing_um / 4)
    assert found["penalty"].scene.contact.penalty_Pa_per_um == 4 * base.contact.penalty_Pa_per_um
    assert found["quadrature"].scene.mesh.quadrature_degree > base.mesh.quadrature_degree
    assert found["quadrature"].scene.contact.quadrature_degree > base.contact.quadrature_degree
    for refinement in found.values():
        tables = {"mesh-1": {"mesh"}, "mesh-2": {"mesh"}, "time": {"time"}, "quadrature": {"mesh", "contact"}}
        changed = {key for key, value in refinement.scene if value != getattr(base, key)}
        assert changed == tables.get(refinement.name, {"contact"})
        assert refinement.scene.flat is None


@pytest.mark.parametrize(
    ("data", "missing"),
    [
        ({"time": {"history": False}}, {"time"}),
        ({"cell": {"fluid_lambda_Pa_s": 0, "fluid_mu_Pa_s": 0}}, {"time"}),
        ({"pillar": [], "flat": False, "load": {"factor": 0}}, {"smoothing", "penalty"}),
        ({"cell": {"inertia": True, "fluid_lambda_Pa_s": 0, "fluid_mu_Pa_s": 0}}, set()),
    ],
)
def test_parts_that_do_not_bear_on_a_scene_are_not_refined(data, missing):
    base = scene(**data)
    assert {*bears_on(base)} == {"mesh", "time", "quadrature", "smoothing", "penalty"} - missing
    assert {r.part for r in refinements(base)} == {*bears_on(base)}
    assert {r.part for r in refinements(base, ["mesh", "smoothing"])} == {"mesh", "smoothing"} - missing


def test_volume_contact_is_refined_in_its_own_width():
    found = {r.name: r.scene.contact for r in refinements(scene(contact={"form": "volume"}))}
    assert found["smoothing"].volume_width_um == pytest.approx(0.05 / 4)
    assert found["smoothing"].smoothing_um == scene().contact.smoothing_um


def test_scene_that_cannot_be_refined_is_refused_with_the_rule():
    with pytest.raises(InputError, match=r"refinement quadrature: mesh.quadrature_degree: must be a whole number"):
        refinements(scene(mesh={"quadrature_degree": 20}))


# What the differences say


@pytest.mark.parametrize("order", [1.5, 2.0, 3.0])
def test_extrapolation_finds_the_limit_where_the_meshes_show_an_order(order):
    base, refined = by_order(order)
    row = assess(base, refined, ["mesh"])["nucleus.J1_max"]
    assert row.order == pytest.approx(order, rel=1e-6)
    assert row.extrapolated == pytest.approx(2.004, rel=1e-12)
    assert row.error == pytest.approx(0.02 * 0.004, rel=1e-6)
    assert row.share(row.error) == pytest.approx(0.02 / 1.02, rel=1e-6)


@pytest.mark.parametrize("order", [0.3, 5.0])
def test_implausible_order_is_not_extrapolated_and_the_error_not_underrated(order):
    base, refined = by_order(order)
    row = assess(base, refined, ["mesh"])["nucleus.sigma_mises_max_Pa"]
    assert row.order is None and row.extrapolated is None
    values = [r["nucleus"]["sigma_mises_max_Pa"] for r in (base, *refined.values())]
    assert row.error == pytest.approx(abs(values[0] - values[2]) + abs(values[1] - values[2]))


def test_change_of_sign_between_meshes_is_not_extrapolated():
    row = assess(result(), {"mesh-1": result(0.01), "mesh-2": result(0.005)}, ["mesh"])["energy.stored"]
    assert row.order is None
    assert row.error == pytest.approx(3.0 * (0.005 + 0.005))


def test_parts_are_separate_and_the_penalty_is_no_part_of_the_error():
    refined = {
        **by_order(2.0, 0.0)[1],
        "time": result(0.001),
        "quadrature": result(0.002),
        "smoothing": result(0.003),
        "penalty": result(0.5),
    }
    row = assess(result(), refined, [*PARTS, "penalty"])["nucleus.sigma_mises_max_Pa"]
    expected = {
        "mesh": 0.0,
        "time": 5 * 0.001 / (1 - 10 ** (-2 / 3)),
        "quadrature": 5 * 0.002,
        "smoothing": 5 * 0.003 * 4 / 3,
        "penalty": 5 * 0.5,
    }
    assert dict(row.parts) == pytest.approx(expected)
    assert row.error == pytest.approx(sum(expected[part] for part in PARTS))


def test_numbers_are_those_with_an_error():
    found = numbers(result())
    assert {"nucleus.J1_max", "contact.max_depth_um", "energy.stored"} <= found.keys()
    assert {"lamina_pillar_distance_um", "nucleus_obstacle_distance_um"} <= found.keys()
    for key in found:
        assert not key.startswith(("membrane", "scene", "steps"))
        assert "balance_error" not in key and "_at_um" not in key and "time_s" not in key and "lift" not in key


def test_relative_errors_are_on_the_difference_from_rest():
    refined = {"quadrature": result(0.01)}
    rows = assess(result(), refined, ["quadrature"])
    for key in ("nucleus.sigma_mises_max_Pa", "nucleus.J1_max", "share_of_area_percent.J1", "shape_index.full"):
        assert rows[key].share(rows[key].error) == pytest.approx(0.01, rel=1e-6), key


def test_small_strains_have_an_absolute_bound():
    """J3 is within 1e-4 of rest there: 1e-6 holds, not 1 %."""
    for shift, within in ((0.015, True), (0.025, False)):
        row = assess(result(), {"quadrature": result(shift)}, ["quadrature"])["nucleus.J3_mean"]
        assert row.allowed == 1e-6
        assert row.within is within
    row = assess(result(), {"quadrature": result(0.015)}, ["quadrature"])["nucleus.J1_max"]
    assert not row.within


def test_failed_refinement_leaves_its_part_and_the_error_unknown():
    rows = assess(result(), {"mesh-1": result(), "mesh-2": None, "quadrature": result()}, ["mesh", "quadrature"])
    row = rows["nucleus.J1_max"]
    assert row.parts == {"mesh": None, "quadrature": 0.0}
    assert row.error is None and not row.within
    assert "a refined run failed" in report(rows)[0]


def test_trees_have_the_names_of_the_result():
    base, refined = by_order(2.0)
    trees = error_trees(assess(base, refined, ["mesh"]))
    assert trees["error"]["nucleus"]["J1_max"] == pytest.approx(0.02 * 0.004)
    assert trees["error"]["lamina_pillar_distance_um"] == pytest.approx(0.1)
    assert trees["accuracy"]["parts"]["mesh"]["contact"]["max_depth_um"] == pytest.approx(0.0004)
    assert trees["accuracy"]["order"]["energy"]["stored"] == pytest.approx(2.0)
    assert trees["accuracy"]["within_1_percent"] is False
    assert "nucleus.J1_max" in trees["accuracy"]["beyond_1_percent"]


def test_table_and_report_name_the_worst_first():
    rows = assess(result(), {"quadrature": result(0.02, energy={"stored": 3.3})}, ["quadrature"])
    assert report(rows)[1].startswith("  energy.stored 3: error 0.3 = 10 % (quadrature 10)")
    cells = {row["scalar"]: row for row in table_rows(rows)}
    assert cells["energy.stored"]["error_percent"] == 10.0
    assert cells["energy.stored"]["quadrature_percent"] == 10.0
    assert cells["nucleus.J3_mean"]["within_1_percent"] is True
