"""The Table 1 cell near incompressibility: solved, good on a coarse mesh, and mixed only where that is needed."""

import pytest
from mpi4py import MPI

from cellmech.cell.setup import Setup
from cellmech.results.records import CaseFolder
from cellmech.runs.case import mesh_plan, solve_case
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene

COARSE, FINE = 2.0, 1.0


def case_of(size=COARSE, **tables):
    tables["mesh"] = {"size_um": size} | tables.get("mesh", {})
    return Case("case", read_scene({"time": {"history": False}, **tables}, "test"))


def solved(path, *args, **tables):
    case = case_of(*args, **tables)
    folder = CaseFolder(path, MPI.COMM_SELF)
    result = solve_case(case, folder, MPI.COMM_SELF, mesh_plan(case.scene), lambda progress: None)
    folder.close()
    assert result["status"] == "solved", result["reason"]
    return result, (path / "run.log").read_text()


def numbers(result):
    rest = {"J1_max": 2.0, "J2_max": 2.0, "J3_max": 1.0}
    keys = ("sigma_mises_max_Pa", "pressure_max_Pa", "pressure_mean_Pa", *rest)
    return {f"{part}.{key}": result[part][key] - rest.get(key, 0.0) for part in ("nucleus", "lamina") for key in keys}


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    return solved(tmp_path_factory.mktemp("coarse"), cell={"poisson": 0.499})


def test_cell_at_nu_0499_is_solved_at_once_and_nearly_right_on_a_coarse_mesh(coarse, tmp_path):
    result, log = coarse
    assert "halved" not in log
    assert result["newton_iterations"] < 20
    fine = numbers(solved(tmp_path, FINE, cell={"poisson": 0.499})[0])
    off = {key: value / fine[key] - 1 for key, value in numbers(result).items()}
    maxima = {"nucleus.J1_max", "nucleus.J2_max"}  # at a point, and quadratic in the strain: the least accurate
    assert all(abs(e) < (0.08 if key in maxima else 0.02) for key, e in off.items()), off
    assert max(abs(e) for e in off.values()) > 1e-4


def test_volume_of_the_nucleus_goes_like_pressure_over_lambda(coarse, tmp_path):
    """J3 - 1 = 2 p/lambda, so that it falls as lambda grows while the pressure stays."""
    stiffer = numbers(solved(tmp_path, cell={"poisson": 0.4999})[0])
    softer = numbers(coarse[0])
    growth = (0.4999 / 1.4999 / 0.0002) / (0.499 / 1.499 / 0.002)  # of lambda at constant E
    assert stiffer["nucleus.pressure_max_Pa"] == pytest.approx(softer["nucleus.pressure_max_Pa"], rel=0.02)
    assert softer["nucleus.J3_max"] / stiffer["nucleus.J3_max"] == pytest.approx(growth, rel=0.02)


def test_full_cell_is_the_half_cell_twice(coarse, tmp_path):
    """The rigid motions are taken out of the mixed form too."""
    full, _ = solved(tmp_path, cell={"poisson": 0.499, "shape": "full"})
    half = numbers(coarse[0])
    for key, value in numbers(full).items():
        assert value == pytest.approx(half[key], rel=0.08 if "J" in key else 0.01), key
    assert full["contact"]["force_Pa_x_um"] == pytest.approx(coarse[0]["contact"]["force_Pa_x_um"], rel=1e-3)


def test_smeared_layers_are_solved_too(tmp_path):
    result, log = solved(tmp_path, cell={"poisson": 0.499, "layers": "smeared", "smear_um": 1.0})
    assert "an unknown of its own in membrane, cytosol, lamina, nucleoplasm" in log
    balance = result["contact"]["force_Pa_x_um"] / result["contact"]["weight_Pa_x_um"]
    assert balance == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("tables", "mixed"),
    [
        ({}, set()),
        ({"cell": {"poisson": 0.46}}, {"nucleoplasm", "lamina", "cytosol", "membrane"}),
        ({"layer": {"nucleoplasm": {"poisson": 0.49}}}, {"nucleoplasm"}),
        ({"layer": {"nucleoplasm": {"poisson": 0.49}}, "mesh": {"pressure": "none"}}, set()),
        ({"layer": {"nucleoplasm": {"poisson": 0.49}}, "mesh": {"order": 1}}, set()),
        ({"mesh": {"pressure": "mixed"}}, {"nucleoplasm", "lamina", "cytosol", "membrane"}),
    ],
    ids=["table 1", "all", "one layer", "refused", "linear", "asked for"],
)
def test_pressure_is_an_unknown_only_where_it_must_be(tables, mixed):
    case = case_of(**{**tables, "layer": {"lamina": {"young_Pa": 999.0}, **tables.get("layer", {})}})
    setup = Setup(case.scene, MPI.COMM_SELF, mesh_plan(case.scene))
    found = {name for m in setup.body.materials if m.mixed for name in m.names}
    apart = {name for name, _ in setup.interfaces}
    merged = {"nucleus": {"nucleoplasm", "lamina"}, "cytoplasm": {"cytosol", "membrane"}}
    assert set().union(*(merged.get(name, {name}) for name in found)) == mixed, apart
    nodes = len(setup.body.space.element.interpolation_points())
    assert nodes == (7 if mixed else 3 if tables.get("mesh", {}).get("order") == 1 else 10)
    assert (setup.body.pressure_space is not None) == bool(mixed)


def test_run_that_goes_on_has_the_pressure_of_its_displacement():
    case = case_of(cell={"poisson": 0.499})
    setup = Setup(case.scene, MPI.COMM_SELF, mesh_plan(case.scene))
    first, second = (setup.create_run(lambda line: None) for _ in range(2))
    first.run(lambda step: None)
    assert abs(first.state.p.x.array).max() > 1.0
    second.recall(first.memory())
    assert list(second.state.p.x.array) == list(first.state.p.x.array)
