"""Pictures as a run leaves them, from the command line, with a fake solver that leaves fields."""

from pathlib import Path

import pytest
from cli import fake_case
from cli.programs import cases
from plot_files import sag, write_fields

PVD = '<VTKFile><Collection><DataSet timestep="50" file="fields_0000.vtu"/></Collection></VTKFile>'


@pytest.fixture
def drawable(fake, monkeypatch):
    """The fake solver, which leaves fields."""
    solve = fake_case.solve_case

    def solve_case(case, folder, comm, plan, report):
        result = solve(case, folder, comm, plan, report)
        write_fields(folder.path / "fields_0000.vtu", sag)
        (folder.path / "fields.pvd").write_text(PVD)
        return result

    monkeypatch.setattr(fake_case, "solve_case", solve_case)
    return fake


def test_a_run_leaves_pictures_and_says_where(drawable):
    Path("my.toml").write_text(cases("a", "b"))
    outcome = drawable("my.toml")
    assert outcome.status == 0
    assert "my: pictures of 2 cases and a sheet of all in results/my/figures/\n" in outcome.out
    files = sorted(path.name for path in Path("results/my/figures").iterdir())
    assert files == ["shape-a.png", "shape-b.png", "sheet.png"]


def test_no_pictures_leaves_none_and_a_later_run_draws_them(drawable):
    Path("my.toml").write_text(cases("a"))
    assert "picture" not in drawable("my.toml", "--no-pictures").out
    assert not Path("results/my/figures").exists()
    outcome = drawable("my.toml", "--quiet")
    assert (outcome.status, outcome.err, drawable.solved) == (0, "", ())
    assert [path.name for path in Path("results/my/figures").iterdir()] == ["shape-a.png"]


def test_switching_pictures_off_in_the_file_solves_nothing_again(drawable):
    text = cases("a")
    Path("my.toml").write_text(text)
    drawable("my.toml", "--no-pictures")
    Path("my.toml").write_text(f"{text}\n")
    outcome = drawable("my.toml", "--set", "output.pictures=false")
    assert (outcome.status, drawable.solved, "picture" in outcome.out) == (0, (), False)
