"""Bad input as a new user would make it: exit status 2, one message from one rank, nothing written."""

from pathlib import Path

import pytest
from cli.programs import program, tree

BAD = {
    "misspelt key": ("[cell]\nyoung_pa = 3", [], ["my.toml: cell.young_pa: unknown key", "young_Pa"]),
    "negative modulus": ("[layer.lamina]\nyoung_Pa = -5", [], ["layer.lamina.young_Pa", "> 0", "Pa", "got -5"]),
    "radii out of order": ("[layer.lamina]\nouter_radius_um = 4.0", [], ["outer_radius_um", "µm", "4"]),
    "poisson 0.5": ("[cell]\npoisson = 0.5", [], ["cell.poisson", "< 0.5", "got 0.5"]),
    "unknown law": ('[cell]\nlaw = "neo-hokean"', [], ["cell.law", "'neo-hokean'", "Did you mean 'neo-hookean'?"]),
    "overlapping cell": ("[cell]\ngap_um = -1.0", [], ["cell.gap_um", "overlap pillar.0 by 1 µm", "got -1"]),
    "overlapping pillars": ("[[pillar]]\nx_um = 0\n[[pillar]]\nx_um = 5\n", [], ["pillar.0.x_um", "must not overlap"]),
    "no TOML": ("[cell", [], ["my.toml: is no valid TOML"]),
    "bad case of many": ('[sweep]\n"cell.law" = ["yeoh", "jeoh"]', [], ["case 'jeoh': cell.law", "got 'jeoh'"]),
    "bad --set": ("", ["--set", "load.factr=2"], ["--set: load.factr: unknown key", "load.factor"]),
    "--set without value": ("", ["--set", "load.factor"], ["--set: must be KEY=VALUE; got 'load.factor'"]),
    "unknown case": ('[sweep]\n"cell.law" = ["yeoh"]', ["--only", "yeo"], ["--only", "'yeo'", "Did you mean yeoh?"]),
    "unknown option": ("", ["--bogus"], ["unrecognized arguments: --bogus", "--help"]),
    "too many ranks": ("", ["--ranks-per-case", "2"], ["--ranks-per-case", "number of MPI ranks, 1; got 2"]),
    "no rank": ("", ["--ranks-per-case", "0"], ["--ranks-per-case", "from 1 to", "got 0"]),
    "rank no number": ("", ["--ranks-per-case", "two"], ["--ranks-per-case", "'two'"]),
    "shard": ("", ["--shard", "3/2"], ["--shard: must be I/N", "got '3/2'", "--shard 2/3"]),
    "missing file": ("", ["other.toml"], ["other.toml: there is no such file"]),
    "results below a file": ("", ["--out", "my.toml/here"], ["--out", "must be a folder", "my.toml/here"]),
    "results on a file": ("", ["--out", "my.toml"], ["--out", "must be a folder", "my.toml"]),
    # root hears "a folder that can be made and written to", who may not write there "writable"
    "unwritable folder": ("", ["--out", "/proc/cellmech"], ["--out: must be", "writ", "/proc/cellmech"]),
    "no name for the results": ("", ["--out", ""], ["--out: must name a folder"]),
    "same name twice": ("", ["sub/my.toml"], ["sub/my.toml", "must differ in name from my.toml"]),
}


def refused(outcome, *words, times=1):
    assert outcome.status == 2
    assert outcome.out == ""
    assert outcome.err.count("cellmech: error: ") == times
    message = next(line for line in outcome.err.splitlines() if line.startswith("cellmech: error: "))
    assert [word for word in words if word not in message] == []
    assert "Traceback" not in outcome.err
    return message


@pytest.fixture
def earlier(folder):
    """What a run before has left, at the default place."""
    (folder / "results/my/my").mkdir(parents=True)
    for name in ("summary.csv", "my/result.json", "my/run.log"):
        (folder / "results/my" / name).write_text("precious")
    (folder / "sub").mkdir()
    (folder / "sub/my.toml").write_text("")
    return folder


@pytest.mark.parametrize(("text", "arguments", "words"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_refused_with_one_message_and_nothing_is_written(earlier, text, arguments, words):
    Path("my.toml").write_text(text, encoding="utf-8")
    before = tree(earlier)
    outcome = program("my.toml", *arguments)
    assert len(outcome.err.splitlines()) == 1
    refused(outcome, *words)
    assert tree(earlier) == before


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["negative modulus", "unknown option", "unwritable folder"])
def test_bad_input_is_refused_by_one_rank_for_all(earlier, kind):
    text, arguments, words = BAD[kind]
    Path("my.toml").write_text(text, encoding="utf-8")
    before = tree(earlier)
    refused(program("my.toml", *arguments, ranks=2), *words)
    assert tree(earlier) == before


def test_first_bad_file_of_several_is_named_and_no_folder_is_left(folder):
    Path("good.toml").write_text("")
    Path("bad.toml").write_text("[time]\nend_s = 0")
    refused(program("good.toml", "bad.toml", "--out", "deep/er"), "bad.toml: time.end_s", "got 0")
    assert sorted(tree(folder)) == ["bad.toml", "good.toml"]


def test_folder_made_for_one_study_goes_again_when_the_next_cannot_be_written(folder):
    for name in ("one.toml", "two.toml"):
        Path(name).write_text("")
    Path("out").mkdir()
    Path("out/two").symlink_to("/proc")  # looks writable to root, and is not
    refused(program("one.toml", "two.toml", "--out", "out"), "--out", "out/two")
    assert not Path("out/one").exists()


def test_folder_in_the_place_of_a_table_is_refused(folder):
    Path("my.toml").write_text("")
    Path("out/summary.csv").mkdir(parents=True)
    refused(program("my.toml", "--out", "out"), "--out", "out/summary.csv")


def test_case_folder_that_is_a_file_is_refused(folder):
    Path("my.toml").write_text("")
    Path("out").mkdir()
    Path("out/my").write_text("precious")
    refused(program("my.toml", "--out", "out"), "--out", "out/my")
    assert Path("out/my").read_text() == "precious"


def test_check_of_bad_input_is_refused_before_anything_is_loaded(folder):
    Path("my.toml").write_text("[cell]\npoisson = 0.5")
    code = (
        "import sys\nfrom cellmech.study import main\nstatus = main(['my.toml', '--check'])\n"
        "print('dolfinx' in sys.modules, 'rich' in sys.modules)\nsys.exit(status)"
    )
    outcome = program(program=("-c", code))
    assert (outcome.status, outcome.out) == (2, "False False\n")
