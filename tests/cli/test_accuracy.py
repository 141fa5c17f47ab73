"""--accuracy and [accuracy]: which runs it adds, what it leaves on disk, and that it goes on where it stopped."""

import json
from pathlib import Path

import pytest
from cli.programs import cases, tree
from locked_writes import locked_writes

from cellmech.runs import agenda

REFINED = ["mesh-1", "mesh-2", "time", "smoothing", "penalty", "quadrature"]


def runs(name):
    return [name, *(f"{name} [{refinement}]" for refinement in REFINED)]


def result(path):
    return json.loads(Path("results/my", path, "result.json").read_text(encoding="utf-8"))


def test_accuracy_solves_each_case_refined_and_writes_the_errors(fake, folder):
    Path("my.toml").write_text(cases("a"))
    outcome = fake("my.toml", "--accuracy")
    assert outcome.status == 0
    assert list(fake.solved) == runs("a")
    found = result("a")
    assert found["error"]["contact"]["force_Pa_x_um"] == 0.0  # the fake solver's numbers know no mesh
    assert found["accuracy"]["within_1_percent"] is True
    assert set(found["accuracy"]["parts"]) == {"mesh", "time", "quadrature", "smoothing", "penalty"}
    finer = result("a/accuracy/mesh-2")["scene"]["mesh"]["size_um"]
    assert finer == pytest.approx(found["scene"]["mesh"]["size_um"] / 2, rel=1e-5)
    assert "nucleus.J1_max" in Path("results/my/a/accuracy.csv").read_text()
    assert "scalars within 1 % of |q - q0|" in outcome.out
    summary = Path("results/my/summary.csv").read_text().splitlines()
    assert len(summary) == 2 and "error.nucleus.J1_max" in summary[0] and "accuracy." not in summary[0]


def test_as_many_elements_across_as_there_may_be_stay_so(fake, folder):
    Path("my.toml").write_text("[mesh]\nthin_layers = 7\n" + cases("a").partition("\n")[2])
    assert fake("my.toml", "--accuracy").status == 0
    assert [result(f"a/accuracy/mesh-{k}")["scene"]["mesh"]["thin_layers"] for k in (1, 2)] == [8, 8]


def test_errors_are_written_while_no_other_process_is_at_work_there(fake, folder, monkeypatch):
    met = locked_writes(agenda, monkeypatch)
    Path("my.toml").write_text(cases("a"))
    assert fake("my.toml", "--accuracy").status == 0
    assert met == ["result.json", "accuracy.csv"]


def test_accuracy_of_a_solved_case_solves_the_refinements_only_and_once(fake, folder):
    Path("my.toml").write_text(cases("a", "b"))
    fake("my.toml")
    fake("my.toml", "--accuracy", "--only", "a")
    assert list(fake.solved) == runs("a")[1:]
    before = tree(folder / "results")
    fake("my.toml", "--accuracy", "--only", "a")
    assert fake.solved == ()
    after = tree(folder / "results")
    assert {path for path in before if before[path] != after[path]} == set()
    fake("my.toml")
    assert "error" in result("a") and "error" not in result("b")


def test_study_asks_for_some_parts_by_a_table(fake, folder):
    Path("my.toml").write_text(cases("a") + '[accuracy]\nparts = ["time", "mesh"]\n')
    fake("my.toml")
    assert list(fake.solved) == [f"a{x}" for x in ("", " [mesh-1]", " [mesh-2]", " [time]")]
    assert set(result("a")["accuracy"]["parts"]) == {"mesh", "time"}


def test_refined_run_that_fails_is_told_of_and_costs_the_error_not_the_case(fake, folder, monkeypatch):
    from cli import fake_case

    plain = fake_case.solve_case

    def solve(case, *rest):
        if case.name == "a [mesh-2]":
            raise fake_case.MeshError("an element is turned inside out")
        return plain(case, *rest)

    monkeypatch.setattr(fake_case, "solve_case", solve)
    Path("my.toml").write_text(cases("a"))
    outcome = fake("my.toml", "--accuracy")
    assert outcome.status == 1
    assert "a [mesh-2]: FAILED: an element is turned inside out" in outcome.out
    assert "a refined run failed" in outcome.out
    assert result("a")["status"] == "solved" and result("a")["error"]["nucleus"]["J1_max"] is None
    monkeypatch.undo()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("accuracy = 3", "my.toml: accuracy: must be a table; got 3"),
        ("[accuracy]\nmesh = true", "my.toml: accuracy.mesh: unknown key"),
        ('[accuracy]\nparts = ["mash"]', "my.toml: accuracy.parts: must be a list of some of mesh, time"),
        ("[accuracy]\nparts = []", "my.toml: accuracy.parts: must be a list of some of mesh, time"),
        (
            "[accuracy]\n[mesh]\nquadrature_degree = 20",
            "accuracy, refinement quadrature: mesh.quadrature_degree",
        ),
    ],
)
def test_accuracy_that_makes_no_sense_is_refused(fake, folder, text, message):
    Path("my.toml").write_text(text)
    outcome = fake("my.toml")
    assert outcome.status == 2
    assert message in outcome.err
    assert not Path("results").exists()
