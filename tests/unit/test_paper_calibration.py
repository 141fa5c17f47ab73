"""The fits of open inputs, on models whose answer is known."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI

from cellmech.errors import SolveError
from cellmech.results.records import CaseFolder
from cellmech.scene.studies import load_study
from studies.paper import calibration
from studies.paper.__main__ import main
from studies.paper.calibration import (
    BRACKET,
    DIGITS,
    KINDS,
    LIMIT,
    LOAD,
    MAXIMA,
    SMEAR,
    SMEARED,
    TO_ALL,
    TO_STRAINS,
    TOGETHER,
    Fit,
    fit,
    fit_all,
    largest_load,
)
from studies.paper.calibration_tables import (
    calibration_csv,
    calibration_markdown,
    chosen,
    fit_reading,
    limit_study,
)
from studies.paper.misfit import LOST
from studies.paper.ours import STUDIES
from studies.paper.printed import read_paper

PRINTED = {
    law: read_paper().table("fig2")[law].values for law in ("saint-venant", "neo-hookean", "mooney-rivlin", "yeoh")
}
NOTHING = dict.fromkeys(MAXIMA, math.nan)
LARGEST = 3.46


class Model:
    """The printed strains of each law at a load of its own, stress that smearing lessens; Saint-Venant collapses."""

    def __init__(self, loads: Mapping[str, float], width_um: float = 0.4) -> None:
        self.loads, self.width_um, self.asked = loads, width_um, [{}]

    def __call__(self, settings: Mapping[str, Any]) -> Mapping[str, float]:
        self.asked.append(dict(settings))
        law, load, width = settings["cell.law"], settings[LOAD], settings.get(SMEAR, 0.0)
        if law == "saint-venant" and load > LARGEST:
            return NOTHING
        printed, share = PRINTED[law], load / self.loads[law]
        rests = {"J1": 2.0, "J2": 2.0, "J3": 1.0}
        strains = {q: rest + (printed[q] - rest) * share ** (1.5 if q == "J2" else 1.0) for q, rest in rests.items()}
        return strains | {"sigma": printed["sigma"] * share * math.exp(3 * (self.width_um - width))}


LOADS = {"saint-venant": 40.0, "neo-hookean": 19.0, "mooney-rivlin": 28.0, "yeoh": 22.0}


@pytest.fixture
def model() -> Model:
    return Model(LOADS)


@pytest.fixture
def fits(model: Model) -> list[Fit]:
    return fit_all(read_paper(), model, MPI.COMM_SELF, lambda line: None)


@pytest.mark.parametrize("load", [2.0, 19.0, 50.0])
def test_fit_finds_the_load_that_gives_the_printed_strains(load: float) -> None:
    model = Model({"neo-hookean": load})
    found = fit(["neo-hookean"], TO_STRAINS, PRINTED, model)
    assert found.values[LOAD] == pytest.approx(load, rel=2e-3)
    assert found.misfit("neo-hookean") < 5e-3
    assert found.ratios["neo-hookean"]["sigma"] == pytest.approx(
        math.exp(1.2), rel=1e-2
    )  # no target, told all the same
    assert found.runs == len(model.asked) - 1 <= 2 * calibration.EVALUATIONS


def test_fit_finds_load_and_smearing_together(model: Model) -> None:
    found = fit(["yeoh"], SMEARED, PRINTED, model)
    assert found.values == pytest.approx({LOAD: 22.0, SMEAR: 0.4}, rel=1e-2)
    assert model.asked[-1]["cell.layers"] == "smeared"


def test_fit_of_numbers_that_exclude_each_other_is_their_geometric_mean() -> None:
    model = Model({"neo-hookean": 19.0})
    found = fit(["neo-hookean"], TO_ALL, PRINTED, model)
    # residuals a + 1.2, a, 1.5 a, a with a = ln(load / 19): least squares at a = -1.2 / (3 + 1.5²)
    assert found.values[LOAD] == pytest.approx(19 * math.exp(-1.2 / 5.25), rel=1e-2)
    assert found.misfit("neo-hookean") > 0.3


def test_fit_of_several_laws_has_one_load_between_theirs(model: Model) -> None:
    found = fit(["neo-hookean", "mooney-rivlin"], TOGETHER, PRINTED, model)
    assert found.values[LOAD] == pytest.approx(math.sqrt(19 * 28), rel=5e-3)
    assert set(found.ratios) == {"neo-hookean", "mooney-rivlin"} and found.runs == len(model.asked) - 1


def test_fit_stays_below_a_bound_beyond_which_there_is_no_solution(model: Model) -> None:
    found = fit(["saint-venant"], TO_ALL, PRINTED, model, most_load=LARGEST)
    assert 0.97 * LARGEST < found.values[LOAD] <= LARGEST
    assert all(math.isfinite(ratio) for ratio in found.ratios["saint-venant"].values())
    assert max(asked.get(LOAD, 0) for asked in model.asked) <= LARGEST


def test_fit_without_any_solution_says_so() -> None:
    found = fit(["yeoh"], TO_STRAINS, PRINTED, lambda settings: NOTHING)
    assert found.misfit("yeoh") == pytest.approx(LOST) and math.isnan(found.ratios["yeoh"]["J1"])


def test_largest_load_is_found_by_bisection(model: Model) -> None:
    load, runs = largest_load("saint-venant", model, *BRACKET)
    assert LARGEST / (1 + DIGITS) <= load <= LARGEST and runs == len(model.asked) - 1 <= 8


@pytest.mark.parametrize("bracket", [(1.0, 2.0), (4.0, 9.0)])
def test_largest_load_outside_of_its_bracket_is_refused(model: Model, bracket: tuple[float, float]) -> None:
    with pytest.raises(SolveError, match="is not between"):
        largest_load("saint-venant", model, *bracket)


def test_every_fit_is_there_in_order(fits: list[Fit], model: Model) -> None:
    assert [KINDS.index(one.kind) for one in fits] == sorted(KINDS.index(one.kind) for one in fits)
    laws = {kind.name: [law for one in fits if one.kind == kind for law in one.ratios] for kind in KINDS}
    three = ["neo-hookean", "mooney-rivlin", "yeoh"]
    assert laws[TO_STRAINS.name] == laws[TOGETHER.name] == three and laws[LIMIT.name] == ["saint-venant"]
    assert laws[TO_ALL.name] == laws[SMEARED.name] == ["saint-venant", *three]


def test_study_of_the_largest_load_is_valid_and_named_as_such(fits: list[Fit], tmp_path: Path) -> None:
    text = limit_study(fits, "default mesh")
    (tmp_path / "limit.toml").write_text(text, encoding="utf-8")
    assert max(map(len, text.splitlines())) <= 120 and "not the paper's input" in text
    (case,) = load_study(tmp_path / "limit.toml").cases
    assert case.scene.cell.law == "saint-venant" and 3.42 < case.scene.load.factor <= LARGEST
    assert not case.scene.time.history


def test_committed_study_is_that_of_the_program() -> None:
    assert "python -m studies.paper calibrate" in (STUDIES / "saint-venant-limit.toml").read_text(encoding="utf-8")
    (case,) = load_study(STUDIES / "saint-venant-limit.toml").cases
    assert case.scene.cell.law == "saint-venant" and BRACKET[0] <= case.scene.load.factor < BRACKET[1]


def test_laws_whose_fit_stays_far_off_are_not_told_as_fitted() -> None:
    far = Model(LOADS | {"yeoh": 500.0})
    fits = fit_all(read_paper(), far, MPI.COMM_SELF, lambda line: None)
    assert list(chosen(fits)) == ["neo-hookean", "mooney-rivlin"]
    assert not any(line.startswith("Yeoh: load") for line in fit_reading(fits))


def test_reading_and_table_agree_with_the_fits(fits: list[Fit]) -> None:
    text = "\n".join(fit_reading(fits))
    assert "neo-Hookean: load × 19 " in text and "Saint-Venant: no equilibrium beyond load × 3.4" in text
    records = list(csv.DictReader(calibration_csv(fits).splitlines()))
    assert len(records) == sum(len(one.ratios) for one in fits)
    assert float(records[0]["load.factor"]) == fits[0].values[LOAD] and records[0]["law"] == "neo-hookean"
    page = calibration_markdown(fits, "mesh of mesh.size_um=1")
    assert text.splitlines()[0] in page and "Computed on the mesh of mesh.size_um=1." in page


def test_end_state_that_fails_closes_its_files(monkeypatch: pytest.MonkeyPatch) -> None:
    closed, close = [], CaseFolder.close

    def noted(folder: CaseFolder) -> None:
        closed.append(folder)
        close(folder)

    def solve(*arguments: object, **more: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cellmech.runs.library.solve_case", solve)
    monkeypatch.setattr(CaseFolder, "close", noted)
    with pytest.raises(OSError, match="No space left"):
        calibration.end_state({"mesh.size_um": 8.0})
    assert len(closed) == 1


def test_command_writes_table_and_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, model: Model, capsys: pytest.CaptureFixture[str]
) -> None:
    def solve(settings: Mapping[str, Any], overrides: list[str]) -> Mapping[str, float]:
        assert overrides == ["mesh.size_um=2"]
        return model(settings)

    stand_in: Callable[..., Mapping[str, float]] = solve
    monkeypatch.setattr(calibration, "end_state", stand_in)
    arguments = ["calibrate", "--out", str(tmp_path), "--studies", str(tmp_path), "--set", "mesh.size_um=2"]
    assert main(arguments) == 0
    assert {path.name for path in tmp_path.iterdir()} == {
        "calibration.md",
        "calibration.csv",
        "saint-venant-limit.toml",
    }
    assert "load, to J1 and J2, yeoh" in capsys.readouterr().out
