"""What the command line solves, serves, prints and leaves on disk, with a fake solver."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from cli import fake_case
from cli.programs import ENVIRONMENT, cases, end, program, tree

from cellmech.errors import InputError
from cellmech.results import archive
from cellmech.results.records import FLUSH_EVERY_S
from cellmech.runs.command import understand


def table(path):
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def result(name, study="my"):
    return json.loads(Path(f"results/{study}/{name}/result.json").read_text(encoding="utf-8"))


@pytest.fixture
def my(folder):
    """Write a study file of some named cases."""

    def write(*names, name="my.toml", **options):
        Path(name).write_text(cases(*names, **options), encoding="utf-8")

    return write


# What is chosen


def test_list_prints_one_name_a_line_and_writes_nothing(folder):
    Path("my.toml").write_text('[sweep]\n"cell.law" = ["yeoh", "neo-hookean"]\n"load.factor" = [1, 2.5]')
    outcome = program("my.toml", "--list")
    names = ["law=yeoh,factor=1", "law=yeoh,factor=2.5", "law=neo-hookean,factor=1", "law=neo-hookean,factor=2.5"]
    assert (outcome.status, outcome.out.splitlines(), outcome.err) == (0, names, "")
    assert sorted(tree(folder)) == ["my.toml"]


def test_json_is_all_that_scripts_need_and_all_of_standard_output(fake, my):
    my("a", "fails")
    outcome = fake("my.toml", "--json")
    (study,) = json.loads(outcome.out)["studies"]
    assert (outcome.status, study["study"], study["title"], study["out"]) == (1, "my", "Mine", "results/my")
    known = {name: result(name) for name in ("a", "fails")}
    for record in known.values():
        del record["content_hash"], record["files"]
    assert study["cases"] == known
    assert "fails: failed: " in outcome.err
    again = fake("my.toml", "--json")
    assert (json.loads(again.out), fake.solved) == (json.loads(outcome.out), ())


def test_json_lists_and_checks(fake, my):
    my("a", "b")
    assert json.loads(fake("my.toml", "--json", "--list").out) == {"cases": ["a", "b"]}
    checked = json.loads(fake("my.toml", "--json", "--check").out)["cases"]
    assert list(checked) == ["a", "b"]
    assert checked["a"].keys() == {"model", "cells", "dofs", "memory_MB", "estimated"}


def test_no_study_means_figure_2(folder):
    outcome = program("--list")
    assert outcome.out.split() == ["saint-venant", "neo-hookean", "mooney-rivlin", "yeoh"]
    Path("studies").mkdir()
    Path("studies/fig2.toml").write_text('[sweep]\n"cell.law" = ["yeoh"]')
    assert program("--list").out.split() == ["yeoh"]


def test_only_chooses_cases_in_the_order_of_the_study(fake, my):
    my("a", "b", "c")
    outcome = fake("my.toml", "--only", "c", "--only", "a")
    assert (outcome.status, fake.solved) == (0, ("a", "c"))
    assert [row["case"] for row in table("results/my/summary.csv")] == ["a", "c"]


def test_only_adds_to_what_is_solved_already(fake, my):
    my("a", "b", "c")
    fake("my.toml", "--only", "a")
    fake("my.toml", "--only", "c")
    assert fake.solved == ("c",)
    assert [row["case"] for row in table("results/my/summary.csv")] == ["a", "c"]


def test_fresh_solves_again_what_is_chosen_and_keeps_the_rest(fake, my):
    my("a", "b")
    fake("my.toml")
    fake("my.toml", "--fresh", "--only", "b")
    assert fake.solved == ("b",)
    assert [row["case"] for row in table("results/my/summary.csv")] == ["a", "b"]


def test_only_computes_a_case_as_the_whole_study_does(fake, folder):
    Path("my.toml").write_text('[sweep]\n"cell.law" = ["yeoh", "neo-hookean"]')  # the plan depends on both
    fake("my.toml", "--only", "yeoh")
    outcome = fake("my.toml")
    assert fake.solved == ("neo-hookean",)
    assert "already solved: yeoh" in outcome.out


@pytest.mark.parametrize(
    "arguments", [["--set", "load.factor=3", "time.end_s=40"], ["--set", "load.factor=3", "--set", "time.end_s=40"]]
)
def test_set_overrides_every_case(fake, folder, arguments):
    Path("my.toml").write_text('[sweep]\n"cell.law" = ["yeoh", "neo-hookean"]')
    fake(*arguments, "my.toml")
    scenes = [result(name)["scene"] for name in ("yeoh", "neo-hookean")]
    assert [(scene["load"]["factor"], scene["time"]["end_s"]) for scene in scenes] == [(3.0, 40.0)] * 2


@pytest.mark.parametrize("out", [[], ["--out", "here"]])
def test_several_studies_have_a_folder_each(fake, my, out):
    my("a", name="one.toml")
    my("a", "b", name="two.toml")
    outcome = fake("one.toml", "two.toml", *out)
    base = "here" if out else "results"
    assert fake.solved == ("a", "b")  # a is the same case in both
    assert [len(table(f"{base}/{name}/summary.csv")) for name in ("one", "two")] == [1, 2]
    assert "[2/2] two/b: solved" in outcome.out


def test_same_name_in_two_folders_is_refused(my):
    my("a")
    Path("sub").mkdir()
    my("b", name="sub/my.toml")
    with pytest.raises(InputError, match="must differ in name"):
        understand(["my.toml", "sub/my.toml"], ranks=1)


def test_check_says_what_is_modelled_and_writes_nothing(fake, my, folder):
    my("a", "b")
    outcome = fake("my.toml", "--check")
    assert outcome.status == 0
    assert "a: 1,234 triangles, 5,678 unknowns, about 90 MB\n  law: neo-hookean\n  layers: neo-hookean\n" in outcome.out
    assert fake.solved == ()
    assert sorted(tree(folder)) == ["my.toml"]


def test_check_of_a_mesh_that_fails_is_a_failure_and_no_bad_input(fake, my):
    my("mesh")
    outcome = fake("my.toml", "--check")
    assert (outcome.status, outcome.err) == (1, "cellmech: error: an element is turned inside out\n")


# What is served again


def test_second_run_serves_finished_cases(fake, my):
    my("a", "b")
    first = fake("my.toml")
    assert (first.status, fake.solved) == (0, ("a", "b"))
    files = tree(Path("results"))
    second = fake("my.toml")
    assert (second.status, fake.solved) == (0, ())
    assert "already solved: a, b" in second.out
    assert tree(Path("results")) == files


def test_summary_is_equal_byte_for_byte_when_all_is_solved_anew(fake, my):
    my("a", "b", "fails")
    fake("my.toml")
    before, wall = Path("results/my/summary.csv").read_bytes(), table("results/my/timings.csv")[0]["wall_s"]
    fake("my.toml", "--fresh")
    assert fake.solved == ("a", "b", "fails")
    assert Path("results/my/summary.csv").read_bytes() == before
    assert table("results/my/timings.csv")[0]["wall_s"] != wall


def test_changed_input_is_solved_anew_and_the_log_says_why(fake, my):
    my("a", "b")
    fake("my.toml")
    text = Path("my.toml").read_text()
    Path("my.toml").write_text(text.replace('"load.factor" = 2', '"load.factor" = 7'))
    fake("my.toml")
    assert fake.solved == ("b",)
    assert result("b")["contact"]["force_Pa_x_um"] == 15.5 * 7
    assert Path("results/my/b/run.log").read_text().startswith("result.json of an earlier run is of other inputs")


def test_case_that_gets_a_neighbour_is_not_solved_anew(fake, folder):
    Path("my.toml").write_text('[sweep]\n"cell.law" = ["yeoh"]')
    fake("my.toml")
    Path("my.toml").write_text('[sweep]\n"cell.law" = ["yeoh", "neo-hookean"]')
    fake("my.toml")
    assert fake.solved == ("neo-hookean",)


def test_changed_program_is_solved_anew(fake, my, monkeypatch):
    my("a")
    fake("my.toml")
    monkeypatch.setattr(archive, "source_hash", lambda: "another")
    fake("my.toml")
    assert fake.solved == ("a",)


def test_title_alone_changes_nothing(fake, my):
    my("a")
    fake("my.toml")
    my("a", title="Yours")
    assert "\nYours" in fake("my.toml").out
    assert fake.solved == ()


def test_physical_failure_is_served_as_one_and_tried_again_when_told(fake, my):
    my("a", "fails", "mesh")
    fake("my.toml")
    summary = Path("results/my/summary.csv").read_bytes()
    outcome = fake("my.toml")
    assert (outcome.status, fake.solved) == (1, ())
    assert (
        "already solved: a (--fresh solves them again)\nfailed before: fails, mesh (--fresh tries again)" in outcome.out
    )
    assert "fails failed: no equilibrium beyond t = 40 s" in outcome.out
    assert Path("results/my/summary.csv").read_bytes() == summary
    outcome = fake("my.toml", "--quiet", "--only", "fails")
    assert outcome.err == "cellmech: fails: failed before: no equilibrium beyond t = 40 s (--fresh tries again)\n"
    fake("my.toml", "--fresh", "--only", "fails")
    assert fake.solved == ("fails",)


def test_internal_error_is_tried_again(fake, my):
    my("a", "bug")
    fake("my.toml")
    assert fake("my.toml").status == 1
    assert fake.solved == ("bug",)
    log = Path("results/my/bug/run.log").read_text()
    assert log.startswith("an earlier run failed (internal error: ZeroDivisionError: one over nothing): tried again\n")


def test_status_is_of_the_chosen_cases_and_the_table_of_all(fake, my):
    my("a", "bug", "c")
    fake("my.toml", "--only", "bug")
    outcome = fake("my.toml", "--only", "a")
    assert (outcome.status, fake.solved) == (0, ("a",))
    assert [(row["case"], row["status"]) for row in table("results/my/summary.csv")] == [
        ("a", "solved"),
        ("bug", "failed"),
    ]
    assert outcome.out.endswith(
        "my: 1 of 2 cases solved, 1 not yet; summary.csv and a folder per case in results/my/\n"
    )


def test_fresh_forgets_the_chosen_results_before_anything_starts(fake, my, monkeypatch):
    my("a", "b", "c")
    fake("my.toml")
    for name in "abc":
        Path(f"results/my/{name}/checkpoint.npz").touch()
    left, before = [], fake_case.solve_case

    def solve_case(*arguments):
        left.append({str(path.parent.name) for path in Path("results/my").glob("*/[rc]*[nz]") if path.suffix != ".log"})
        return before(*arguments)

    monkeypatch.setattr(fake_case, "solve_case", solve_case)
    fake("my.toml", "--fresh", "--only", "a", "--only", "b")
    assert left == [{"c"}, {"a", "c"}]


@pytest.mark.parametrize("content", ['{"schema": 1, "status": "sol', "[1, 2]", '{"status": "solved"}', "\udcff", ""])
def test_damaged_or_foreign_result_is_solved_anew_and_named_in_the_log(fake, my, content):
    my("a")
    fake("my.toml")
    good = result("a")
    Path("results/my/a/result.json").write_bytes(content.encode(errors="surrogateescape"))
    assert fake("my.toml").status == 0
    assert fake.solved == ("a",)
    assert Path("results/my/a/run.log").read_text().startswith("result.json of an earlier run ")
    assert result("a")["nucleus"] == good["nucleus"]


# What goes wrong in a case


def test_failed_case_gives_status_1_and_the_others_go_on(fake, my):
    my("fails", "b")
    outcome = fake("my.toml")
    assert (outcome.status, fake.solved) == (1, ("fails", "b"))
    first, second = table("results/my/summary.csv")
    assert (first["status"], first["reason"]) == ("failed", "no equilibrium beyond t = 40 s")
    assert (second["status"], second["reason"]) == ("solved", "")
    assert "[1/2] fails: FAILED: no equilibrium beyond t = 40 s" in outcome.out
    assert "my: 1 of 2 cases solved" in outcome.out
    assert outcome.err == ""


def test_mesh_error_is_a_failure_of_its_case(fake, my):
    my("mesh", "b")
    assert fake("my.toml").status == 1
    assert (result("mesh")["status"], result("mesh")["reason"]) == ("failed", "an element is turned inside out")
    assert "Traceback" not in Path("results/my/mesh/run.log").read_text()
    assert result("b")["status"] == "solved"


def test_bug_is_a_failure_of_its_case_with_the_traceback_in_its_log(fake, my):
    my("bug", "b")
    outcome = fake("my.toml")
    reason = "internal error: ZeroDivisionError: one over nothing"
    assert (outcome.status, outcome.err) == (1, f"cellmech: bug: failed: {reason}\n")
    assert (result("bug")["status"], result("bug")["reason"]) == ("failed", reason)
    log = Path("results/my/bug/run.log").read_text()
    assert log.startswith("law neo-hookean on 1\n")
    assert "Traceback" in log and "in solve_case" in log
    assert result("b")["status"] == "solved"


def test_nan_never_gets_into_a_result(fake, my):
    my("nan")
    assert fake("my.toml").status == 1
    assert result("nan")["reason"] == "internal error: ValueError: contact.force_Pa_x_um must be finite, got nan"


def test_failure_leaves_no_result_of_other_inputs(fake, my):
    my("a")
    fake("my.toml")
    (Path("results/my/a") / "fields_0000.vtu").write_text("old")
    Path("my.toml").write_text(cases("a") + '"cell.law" = "yeoh"\n')
    before = fake_case.solve_case

    def stops(*arguments):
        assert not Path("results/my/a/result.json").exists()
        assert not Path("results/my/a/fields_0000.vtu").exists()
        assert not Path("results/my/summary.csv").exists()
        return before(*arguments)

    fake_case.solve_case = stops
    try:
        assert fake("my.toml").status == 0
    finally:
        fake_case.solve_case = before


# What is written and printed


def test_files_of_a_case(fake, my):
    my("a")
    fake("my.toml")
    assert sorted(tree(Path("results/my"))) == [
        ".lock", "a", "a/history.csv", "a/result.json", "a/run.log", "a/scene.toml", "columns.csv",
        "summary.csv", "timings.csv",
    ]  # fmt: skip
    assert [row["t_s"] for row in table("results/my/a/history.csv")] == ["10.0", "20.0", "30.0", "40.0", "50.0"]
    assert {key: result("a")[key] for key in ("schema", "case", "status", "reason")} == {
        "schema": 1, "case": "a", "status": "solved", "reason": "",
    }  # fmt: skip
    assert len(result("a")["input_hash"]) == len(result("a")["source_hash"]) == 64


def test_summary_has_swept_keys_and_scalars_but_nothing_of_the_machine(fake, my):
    my("a", "b")
    fake("my.toml")
    row = table("results/my/summary.csv")[1]
    assert list(row) == [
        "case", "load.factor", "status", "reason", "steps", "newton_iterations", "nucleus.J1_max",
        "nucleus.J1_max_at_um.x", "nucleus.J1_max_at_um.y", "nucleus.sigma_mises_max_Pa", "contact.force_Pa_x_um",
        "contact.max_depth_um",
    ]  # fmt: skip
    assert (row["case"], row["load.factor"], row["contact.max_depth_um"]) == ("b", "2", "")
    assert float(row["nucleus.J1_max"]) == 2.0 + 2 / 3
    assert list(table("results/my/timings.csv")[1])[:4] == ["case", "wall_s", "ranks", "memory_MB"]


def test_scene_beside_the_results_runs_again(fake, my):
    my("a", "b")
    fake("my.toml")
    fake("results/my/b/scene.toml", "--out", "again")
    again = json.loads(Path("again/scene/result.json").read_text())
    assert again["nucleus"] == result("b")["nucleus"]


def test_table_for_the_terminal(fake, my):
    my("a", "fails")
    lines = fake("my.toml").out.splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("case "))
    assert lines[head - 1] == "Mine: largest values in the nucleus at the end"
    assert lines[head].split() == [
        "case",
        "status",
        "sigma_mises_Pa",
        "J1",
        "J2",
        "J3",
        "penetration_um",
        "steps",
        "wall_s",
    ]
    assert lines[head + 1].split()[:-1] == ["a", "solved", "0.75", "2.33333", "-", "-", "-", "5"]
    assert lines[head + 3] == "fails failed: no equilibrium beyond t = 40 s"
    assert lines[-1] == "my: 1 of 2 cases solved; summary.csv and a folder per case in results/my/"


def test_quiet_prints_failures_and_one_line(fake, my):
    my("a", "fails")
    outcome = fake("my.toml", "--quiet")
    assert outcome.out == "my: 1 of 2 cases solved; summary.csv and a folder per case in results/my/\n"
    assert outcome.err == "cellmech: fails: failed: no equilibrium beyond t = 40 s\n"


def test_closed_pipe_does_not_stop_a_study(my):
    my("a", "b")
    code = (
        "import os, sys\nfrom cli import fake_case\nfrom cellmech.study import main\n"
        "read, write = os.pipe(); os.close(read); os.dup2(write, 1)\n"
        "sys.exit(main(['my.toml'], lambda: fake_case))"
    )
    outcome = program(program=("-c", f"import sys; sys.path.insert(0, {str(Path(__file__).parents[1])!r})\n{code}"))
    assert (outcome.status, outcome.err) == (0, "")
    assert len(table("results/my/summary.csv")) == 2


def test_reader_that_goes_away_does_not_stop_the_solver(folder):
    """`| head`: PETSc, once loaded, would take the signal of a closed pipe for a crash."""
    scene = "[mesh]\nsize_um = 5.0\n[time]\nhistory = false\n"
    Path("my.toml").write_text(scene + cases("a", "b").partition("\n")[2])
    read, write = os.pipe()
    study = subprocess.Popen(
        [sys.executable, "-m", "cellmech.study", "my.toml"],
        env=ENVIRONMENT,
        stdout=write,
        stderr=subprocess.PIPE,
        text=True,
    )
    os.close(write)
    os.close(read)
    outcome = end(study)
    assert (outcome.status, outcome.err) == (0, "")
    assert [row["status"] for row in table("results/my/summary.csv")] == ["solved", "solved"]


def test_history_is_on_disk_before_the_case_ends(fake, my, monkeypatch):
    my("a")
    assert FLUSH_EVERY_S < 10
    seen = []
    monkeypatch.setattr(fake_case.time, "sleep", lambda s: seen.append(table("results/my/a/history.csv")))
    fake("my.toml")
    assert [len(rows) for rows in seen] == [1] * 5  # the first at once, the next after a few seconds or at the end
