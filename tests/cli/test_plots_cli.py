"""python -m cellmech.plots as a user types it: files, messages, exit status."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from matplotlib.image import imread
from plot_files import LAWS, sag, write_case, write_study

from cellmech.plots import main

ROOT = Path(__file__).resolve().parents[2]


def is_figure(folder: Path, stem: str, least_px: int = 1500) -> bool:
    """Both files are there and whole; the picture is large and not empty."""
    image = imread(folder / f"{stem}.png")
    pdf = (folder / f"{stem}.pdf").read_bytes()
    whole = pdf.startswith(b"%PDF") and pdf.rstrip().endswith(b"%%EOF")
    return whole and image.shape[1] >= least_px and image[..., :3].std() > 0.05


def test_fig1_draws_table_1_by_default(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fig1", "--out", str(tmp_path)]) == 0
    assert is_figure(tmp_path, "fig1")
    assert capsys.readouterr().out.split() == [str(tmp_path / "fig1.png"), str(tmp_path / "fig1.pdf")]


def test_fig1_draws_the_scene_of_a_file(tmp_path: Path) -> None:
    scene = tmp_path / "wide.toml"
    scene.write_text("schema = 1\n[[pillar]]\nx_um = 8.0\nhalf_width_um = 3.0\n")
    assert main(["fig1", "--scene", str(scene), "--out", str(tmp_path)]) == 0
    assert is_figure(tmp_path, "fig1")


def test_fig2_and_fig3_draw_a_study(tmp_path: Path) -> None:
    results, out = str(write_study(tmp_path / "study")), tmp_path / "out"
    assert main(["fig2", "--results", results, "--out", str(out)]) == 0
    assert main(["fig3", "--results", results, "--out", str(out)]) == 0
    assert is_figure(out, "fig2") and is_figure(out, "fig3", 2500)
    assert len(list(out.iterdir())) == 4


def test_table_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["table-fig2", "--results", str(write_study(tmp_path))]) == 0
    assert "| Yeoh " in capsys.readouterr().out


@pytest.mark.parametrize("figure", ["fig2", "fig3", "table-fig2"])
def test_an_incomplete_study_is_drawn_and_what_lacks_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], figure: str
) -> None:
    results = write_study(tmp_path / "study", LAWS[:2])
    write_case(results / "yeoh", "yeoh", 3, sag, status="failed", reason="det F <= 0", t_s=1000.0)
    out = [] if figure == "table-fig2" else ["--out", str(tmp_path / "out")]
    assert main([figure, "--results", str(results), *out]) == 1
    if out:
        assert is_figure(tmp_path / "out", figure)
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "mooney-rivlin: not in this folder; yeoh: failed at 1,000 s (det F <= 0)" in message


@pytest.mark.parametrize("figure", ["fig2", "fig3", "table-fig2"])
def test_results_that_are_not_there_are_bad_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], figure: str
) -> None:
    for folder in (tmp_path / "nowhere", tmp_path):
        assert main([figure, "--results", str(folder)]) == 2
        message = capsys.readouterr().err
        assert message.startswith(f"error: {folder}: ") and message.count("\n") == 1
        assert "make study" in message


def test_an_output_folder_that_cannot_be_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("in the way")
    assert main(["fig1", "--out", str(tmp_path / "file")]) == 2
    assert capsys.readouterr().err.startswith("error: --out: ")
    assert (tmp_path / "file").read_text() == "in the way"


def test_paper_numbers_that_lack_the_table_are_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paper = tmp_path / "paper.toml"
    paper.write_text("[fig4]\n")
    assert main(["fig2", "--results", str(write_study(tmp_path / "s")), "--paper", str(paper)]) == 2
    assert "paper.toml: fig2" in capsys.readouterr().err


def test_a_misspelt_scene_key_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text("schema = 1\n[cell]\npoison = 0.4\n")
    assert main(["fig1", "--scene", str(scene), "--out", str(tmp_path)]) == 2
    assert "cell.poisson" in capsys.readouterr().err


def test_every_figure_is_drawn_without_dolfinx(tmp_path: Path) -> None:
    results = str(write_study(tmp_path / "study", LAWS[:1]))
    code = f"""
import sys
from cellmech.plots import main
for name in ("fig1", "fig2", "fig3", "table-fig2"):
    where = [] if name == "fig1" else ["--results", {results!r}]
    assert main([name, *where, *([] if name == "table-fig2" else ["--out", {str(tmp_path)!r}])]) in (0, 1)
assert not {{"dolfinx", "petsc4py", "mpi4py", "gmsh", "ufl"}} & sys.modules.keys(), sorted(sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=dict(os.environ), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
