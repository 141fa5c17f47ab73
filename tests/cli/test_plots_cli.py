"""python -m cellmech.plots as a user types it: files, messages, exit status."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from matplotlib.image import imread
from plot_files import LAWS, change, sag, write_case, write_named, write_study, write_sweep

from cellmech.figures.paper_plots import STUDIES
from cellmech.figures.plots import main
from cellmech.scene.studies import load_study

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


SWEEP = """title = "Mine"
[sweep]
"load.factor" = [1, 2]
"layer.lamina.young_Pa" = [300, 3000]
"""


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a sweep over two keys, beside its file."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "my.toml").write_text(SWEEP)
    return write_named(folder / "my", load_study(folder / "my.toml"))


@pytest.mark.parametrize("name", ["shape", "field sigma_mises", "field J1", "history", "map", "outline"])
def test_figures_are_named_by_what_they_show_and_need_no_study_file(swept: Path, tmp_path: Path, name: str) -> None:
    if name == "field J1":  # which the made-up files lack
        assert main([*name.split(), str(swept), "--out", str(tmp_path)]) == 2
        return
    assert main([*name.split(), str(swept), "--out", str(tmp_path)]) == 0
    assert is_figure(tmp_path, name.split()[0])


@pytest.mark.parametrize("name", ["shape", "field sigma_mises", "history", "outline"])
def test_one_case_is_drawn_alone(swept: Path, tmp_path: Path, name: str) -> None:
    case = min(path for path in swept.iterdir() if path.is_dir() and path.name != "figures")
    assert main([*name.split(), str(case), "--out", str(tmp_path), "--stem", "one"]) == 0
    assert is_figure(tmp_path, "one")


def test_geometry_is_drawn_of_a_study_file(swept: Path, tmp_path: Path) -> None:
    assert main(["geometry", str(swept.parent / "my.toml"), "--out", str(tmp_path)]) == 0
    assert is_figure(tmp_path, "geometry")


def test_pictures_draws_what_a_run_leaves(swept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["pictures", str(swept)]) == 0
    names = [Path(line).name for line in capsys.readouterr().out.splitlines()]
    assert names[0] == "sheet.png" and len(names) == 5
    assert all((swept / "figures" / name).is_file() for name in names)


def test_maps_are_drawn_from_a_sweep(tmp_path: Path) -> None:
    write_sweep(tmp_path / "study", load_study(STUDIES / "fig6.toml"), lambda index: {"J1_max": 2 + 1e-3 * index})
    assert main(["fig6", "--results", str(tmp_path / "study"), "--out", str(tmp_path / "out")]) == 0
    assert is_figure(tmp_path / "out", "fig6", 2500)


def test_a_map_with_a_failed_case_is_drawn_and_the_case_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = load_study(STUDIES / "fig4.toml")
    write_sweep(tmp_path / "study", study, lambda index: {})
    change(tmp_path / "study" / study.cases[-1].name, status="failed", reason="det F <= 0", t_s=5000.0)
    assert main(["fig4", "--results", str(tmp_path / "study"), "--out", str(tmp_path / "out")]) == 1
    assert is_figure(tmp_path / "out", "fig4", 2500)
    assert f"{study.cases[-1].name}: failed at 5,000 s (det F <= 0)" in capsys.readouterr().err


def test_deformed_cells_of_named_cases_are_drawn(tmp_path: Path) -> None:
    write_named(tmp_path / "study", load_study(STUDIES / "fig7.toml"))
    assert main(["fig7", "--results", str(tmp_path / "study"), "--out", str(tmp_path / "out")]) == 0
    assert is_figure(tmp_path / "out", "fig7")


def test_a_study_of_ones_own_is_drawn_under_its_own_name(tmp_path: Path) -> None:
    study = tmp_path / "heavy.toml"
    study.write_text('schema = 1\n[sweep]\n"load.factor" = [1.0, 20]\n')
    write_named(tmp_path / "heavy", load_study(study))
    where = ["--results", str(tmp_path / "heavy"), "--out", str(tmp_path / "out")]
    assert main(["fig5", "--study", str(study), "--stem", "heavy", *where]) == 0
    assert is_figure(tmp_path / "out", "heavy")


@pytest.mark.parametrize(
    ("table", "row"),
    [("table1", "| E_l "), ("table2", "| S2         | Saint-Venant "), ("table3", "| S3         | J1 ")],
)
def test_the_papers_tables_are_printed_and_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], table: str, row: str
) -> None:
    out = ["--out", str(tmp_path / "out")]
    if table == "table3":
        out += ["--results", str(write_named(tmp_path / "study", load_study(STUDIES / "table3.toml")))]
    assert main([table, *out]) == 0
    printed = capsys.readouterr().out
    assert row in printed
    assert (tmp_path / "out" / f"{table}.md").read_text() == printed
    assert (tmp_path / "out" / f"{table}.csv").read_text().count("\n") > 3


def test_table_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results, out = str(write_study(tmp_path / "study")), tmp_path / "out"
    assert main(["table-fig2", "--results", results, "--out", str(out)]) == 0
    assert "| Yeoh " in capsys.readouterr().out


@pytest.mark.parametrize("figure", ["fig2", "fig3", "table-fig2"])
def test_an_incomplete_study_is_drawn_and_what_lacks_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], figure: str
) -> None:
    results = write_study(tmp_path / "study", LAWS[:2])
    write_case(results / "yeoh", "yeoh", 3, sag, status="failed", reason="det F <= 0", t_s=1000.0)
    assert main([figure, "--results", str(results), "--out", str(tmp_path / "out")]) == 1
    if figure != "table-fig2":
        assert is_figure(tmp_path / "out", figure)
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "mooney-rivlin: not in this folder; yeoh: failed at 1,000 s (det F <= 0)" in message


@pytest.mark.parametrize("figure", ["fig2", "fig3", "fig4", "fig7", "table3", "table-fig2"])
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


def test_a_table_that_nobody_reads_is_saved(tmp_path: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "cellmech.plots", "table1", "--out", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "table1.md").exists()


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
    laws = write_study(tmp_path / "laws", LAWS[:1])
    sweep = write_sweep(tmp_path / "sweep", load_study(STUDIES / "fig4.toml"), lambda index: {})
    named = write_named(tmp_path / "named", load_study(STUDIES / "table3.toml"))
    results = dict.fromkeys(("fig2", "fig3", "table-fig2"), laws)
    results |= {"fig4": sweep, "table3": named, "fig1": None, "table1": None, "table2": None}
    where = {name: ["--results", str(folder)] if folder else [] for name, folder in results.items()}
    code = f"""
import sys
from cellmech.plots import main
for name, where in {where!r}.items():
    assert main([name, *where, "--out", {str(tmp_path)!r}]) in (0, 1)
assert not {{"dolfinx", "petsc4py", "mpi4py", "gmsh", "ufl"}} & sys.modules.keys(), sorted(sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=dict(os.environ), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
