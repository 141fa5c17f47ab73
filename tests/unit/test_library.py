"""The package as a library: what `import cellmech` offers, and the examples of the documentation."""

from __future__ import annotations

import gc
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import cellmech
from cellmech.figures.field_picture import make_film
from cellmech.mechanics.laws import neo_hookean
from cellmech.mechanics.moduli import lame
from cellmech.mechanics.obstacles import Flat

ROOT = Path(__file__).resolve().parents[2]
BLOCKS = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "adding.md").read_text(), flags=re.DOTALL)
COARSE = {"size_um": 8.0}
END = {"history": False}


@pytest.fixture(scope="module")
def solved():
    return cellmech.solve(cellmech.Scene(mesh=COARSE, time=END))


@pytest.fixture(scope="module")
def example():
    """What the documentation's example number k leaves behind, with a coarse mesh; one k is run once."""
    found = {}

    def run(k):
        if k not in found:
            code, names = BLOCKS[k].replace('time={"history": False}', f"time={END}, mesh={COARSE}"), {}
            assert str(COARSE) in code and sum(bool(line.strip()) for line in code.splitlines()) < 20, code
            exec(compile(code, f"docs/adding.md, block {k}", "exec"), names)
            found[k] = names
        return found[k]

    return run


def test_import_has_no_side_effects_and_brings_nothing_along():
    code = "import sys, cellmech; print([m for m in ('mpi4py', 'dolfinx', 'numpy', 'matplotlib') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_every_name_of_the_package_is_there():
    assert set(cellmech.__all__) <= set(dir(cellmech))
    assert all(getattr(cellmech, name) is not None for name in cellmech.__all__)
    with pytest.raises(AttributeError, match="no attribute 'solver_of'"):
        _ = cellmech.solver_of


def test_folder_of_its_own_lives_as_long_as_the_result():
    result = cellmech.solve(cellmech.Scene(mesh=COARSE, time=END))
    folder = result.folder
    assert (folder / "fields.pvd").is_file()
    del result
    gc.collect()
    assert not folder.exists()


def test_solved_scene_is_read_and_not_solved_again(tmp_path, solved):
    (tmp_path / "my.toml").write_text("[mesh]\nsize_um = 8.0\n[time]\nhistory = false\n")
    steps = []
    first = cellmech.solve(tmp_path / "my.toml", tmp_path / "my", progress=steps.append)
    again = cellmech.solve(first.scene, tmp_path / "my", progress=steps.append)
    assert len(steps) == 1
    assert again.result == first.result == cellmech.load(tmp_path / "my").result
    assert first.number("lamina.J1_max") == solved.number("lamina.J1_max")


def test_case_without_solution_raises_or_says_why(tmp_path):
    slides = cellmech.Scene(mesh=COARSE, cell={"shape": "full", "centre_x_um": 3.0}, flat=False)
    with pytest.raises(cellmech.SolveError, match="slides: no equilibrium") as stop:
        cellmech.solve(slides)
    result = cellmech.solve(slides, tmp_path / "slides", check=False)
    assert "slides: no equilibrium" in result.failure
    assert stop.value.cause is result.cause is cellmech.Cause.SLIDES
    assert "cell.inertia" in result.cause.advice


def test_study_with_cases_is_no_scene(tmp_path):
    (tmp_path / "my.toml").write_text('[sweep]\n"load.factor" = [1, 2]\n')
    with pytest.raises(cellmech.InputError, match=r"my\.toml: sweep: must not stand in a scene"):
        cellmech.solve(tmp_path / "my.toml")


def test_folder_with_files_of_ones_own_is_refused_and_kept(tmp_path):
    (tmp_path / "fields.csv").write_text("mine")
    (tmp_path / "scene.toml").write_text("# mine\n")
    for folder in (tmp_path, str(tmp_path)):
        with pytest.raises(cellmech.InputError, match="folder: must be new, empty or of an earlier run"):
            cellmech.solve(tmp_path / "scene.toml", folder)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "fields.csv": "mine",
        "scene.toml": "# mine\n",
    }
    with pytest.raises(cellmech.InputError, match="folder: must name a folder"):
        cellmech.solve(cellmech.Scene(), "")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda: cellmech.Additions(materials={"laminax": 1}),
            r"materials\.laminax: must be named membrane",
        ),
        (
            lambda: cellmech.Additions(materials={"lamina": neo_hookean}),
            r"lamina: must be a cellmech\.Material",
        ),
        (
            lambda: cellmech.Additions(obstacles={"wall": 3}),
            r"wall: must have length_um, level_set, gradient",
        ),
        (
            lambda: cellmech.Additions(obstacles={"wall": OfTwoNumbers()}),
            r"obstacles\.wall: its level_set, gradient and distance must take a point, \(x, y\) as one vector",
        ),
        (
            lambda: cellmech.Additions(obstacles={"wall": WithADistanceOfTwoNumbers(0.0)}),
            r"obstacles\.wall: its level_set, gradient and distance must take a point, \(x, y\) as one vector",
        ),
        (lambda: cellmech.Additions(observables={"a.b": len}), r"observables: must be named by letters"),
        (lambda: cellmech.Additions(observables=[len]), r"observables: must be a dict"),
        (lambda: cellmech.Material(neo_hookean, {"k": 3.0}), r'Material: constants: must hold "mu"'),
        (lambda: cellmech.Material(neo_hookean, {"mu": 3.0}, 2.0), r"fluid_fraction: must be from 0 to 1; got 2\.0"),
        (lambda: cellmech.solve({"cell": {"lew": "yeoh"}}), r"scene: cell\.lew: unknown key"),
        (lambda: cellmech.solve(None), r"scene: must be a Scene, a dict of its tables, or a scene file"),
    ],
)
def test_what_is_wrong_is_refused_by_name(make, said):
    with pytest.raises(cellmech.InputError, match=said):
        make()


def test_obstacles_that_would_do_harm_are_refused(example):
    walls = example(1)["Walls"]
    for label, wall, said in (
        ("flat", walls(10.001), "the scene has an obstacle of this name"),
        ("walls", walls(9.0), "must not overlap the cell at the start, and does by 0.95 um"),
        ("walls", Flat45(), "must be symmetric about x = 0"),
    ):
        with pytest.raises(cellmech.InputError, match=said):
            cellmech.solve(cellmech.Scene(mesh=COARSE), additions=cellmech.Additions(obstacles={label: wall}))


class OfTwoNumbers:
    """An obstacle as they were written before they took a point."""

    length_um = 1.0

    def level_set(self, x, y):
        return x - y

    def gradient(self, x, y):
        return 1, -1


class WithADistanceOfTwoNumbers(Flat):
    """An obstacle whose distance is none of a point."""

    def distance(self, x, y):
        return y


class Flat45:
    """A slope far below."""

    length_um = 1e9

    def level_set(self, x):
        return x[0] - x[1] - 100.0

    def gradient(self, x):
        return 1 + 0 * x[0], -1 + 0 * x[1]


def test_observable_that_fails_is_named_and_fails_the_case(tmp_path):
    additions = cellmech.Additions(observables={"broken": lambda observer: 1 / 0})
    scene = cellmech.Scene(mesh=COARSE, time=END)
    with pytest.raises(cellmech.SolveError, match="the observable broken is no finite number \\(ZeroDivisionError"):
        cellmech.solve(scene, tmp_path / "a", additions=additions)
    assert "observable broken" in (tmp_path / "a" / "run.log").read_text()


def test_number_that_no_result_has_is_refused(solved):
    with pytest.raises(
        cellmech.InputError, match=r"lamina\.J1maxx: there is no such number\. Did you mean lamina\.J1_max"
    ):
        solved.number("lamina.J1maxx")


def test_reused_result_has_the_title_that_is_asked_for(tmp_path):
    scenes = [cellmech.Scene(title=title, mesh=COARSE, time=END) for title in ("one", "two")]
    steps = []
    results = [cellmech.solve(scene, tmp_path / "a", progress=steps.append) for scene in scenes]
    assert [result.scene.title for result in results] == ["one", "two"]
    assert len(steps) == 1


def test_plot_shows_the_field_and_names_those_that_there_are(solved):
    figure = solved.plot("J1", magnify=10)
    drawn = figure.axes[0].collections[-1].get_array()
    assert np.nanmax(drawn) == pytest.approx(max(solved.number(f"{r}.J1_max") for r in ("cell", "nucleus")), rel=1e-6)
    with pytest.raises(cellmech.InputError, match=r"J9: must be one of sigma_mises_Pa"):
        solved.plot("J9")
    for wrong in (0, float("nan"), "5"):
        with pytest.raises(cellmech.InputError, match="magnify: must be a number above 0"):
            solved.plot("J1", magnify=wrong)


def test_film_has_a_picture_for_each_time_on_one_scale(tmp_path, solved):
    scene = cellmech.Scene(mesh=COARSE, time={"history": False, "end_s": 10000}, output={"times_s": [4000, 7000]})
    result = cellmech.solve(scene)
    assert [t for t, _ in result.series()] == [4000, 7000, 10000]
    film = tmp_path / "films" / "j1.gif"
    assert make_film(result, film, "J1", magnify=10) == 3
    with Image.open(film) as pictures:
        assert pictures.n_frames == 3
        shown = []
        for k in range(3):
            pictures.seek(k)
            shown.append(np.asarray(pictures.convert("RGB"), dtype=float))
    scale = slice(int(0.84 * shown[0].shape[1]), None)  # the colour bar stays, the cell moves
    assert np.abs(shown[0] - shown[2])[:, scale].mean() < 1.0 < np.abs(shown[0] - shown[2]).mean()
    assert not list(film.parent.glob(".partial*"))


def test_film_needs_several_times(tmp_path, solved):
    with pytest.raises(cellmech.InputError, match=r"fields\.pvd: must list several times for a film"):
        make_film(solved, tmp_path / "j1.gif", "J1")


@pytest.mark.parametrize(
    ("key", "near"),
    [
        ("nucleus.J1_mx", "nucleus.J1_max"),
        ("J1_max", "nucleus.J1_max"),
        ("lamina.sigma_max", "lamina.sigma_mises_max_Pa"),
        ("contact.depth_um", "contact.max_depth_um"),
        ("nucelus.J1_max", "nucleus.J1_max"),
    ],
)
def test_wrong_number_suggests_the_nearest(solved, key, near):
    with pytest.raises(cellmech.InputError, match="there is no such number") as refused:
        solved.number(key)
    assert near in refused.value.hint


def test_history_without_names_has_every_column(solved):
    found = solved.history()
    assert {"t_s", "nucleus.J1_max", "contact.max_depth_um"} <= found.keys()
    assert found["t_s"].shape == found["nucleus.J1_max"].shape == solved.history("t_s")["t_s"].shape


def test_result_in_short_is_one_line(solved):
    text = repr(solved)
    assert len(text) < 200 and "\n" not in text
    assert text.startswith(f"<Result {solved.name!r}: solved at t = ") and str(solved.folder) in text
    assert f"lamina.sigma_mises_max_Pa = {solved.number('lamina.sigma_mises_max_Pa'):.5g}" in text


def test_plot_shows_itself_in_a_notebook(solved):
    picture = solved.plot("J1")
    assert picture._repr_png_().startswith(b"\x89PNG") and len(picture._repr_png_()) > 10_000
    assert picture.axes


def test_notebook_shows_a_table_of_the_regions(solved):
    shown = solved._repr_html_()
    assert f"{solved.number('lamina.sigma_mises_max_Pa'):.6g}" in shown
    assert shown.count("<tr>") == 7


def test_law_of_ones_own_stiffens_and_reduces_to_the_built_in(example, solved):
    names = example(0)
    lmbda, mu = lame(1000.0, 0.45)
    constants = {"lmbda": lmbda, "mu": mu}
    same = {
        "neo-Hookean": cellmech.Material(neo_hookean, constants, 0.5),
        "Gent without limit": cellmech.Material(names["gent"], {**constants, "limit": 1e9}, 0.5),
    }
    for name, material in same.items():
        result = cellmech.solve(
            cellmech.Scene(mesh=COARSE, time=END), additions=cellmech.Additions(materials={"lamina": material})
        )
        ours, known = (r.number("lamina.J1_max") - 2 for r in (result, solved))
        assert ours == pytest.approx(known, rel=1e-6), name
    stiff = names["stiffening"]
    assert 0 < stiff.number("lamina.J1_max") - 2 < 0.99 * (solved.number("lamina.J1_max") - 2)
    assert "material of lamina" in stiff.result["model"]["modelled"]["gent (not the scene's)"]


def test_obstacle_of_ones_own_bears_what_leans_on_it(example):
    names = example(1)
    free = cellmech.solve(names["scene"])
    held = names["channel"]
    widths = [r.fields().points[:, 0] + r.fields().point_data["displacement_um"][:, 0] for r in (free, held)]

    assert widths[0].max() > 10.1
    assert widths[1].max() < 10.02
    assert "contact" in held.result["model"]["modelled"]["walls"]


def test_number_of_ones_own_stands_in_result_and_history(example):
    sinking = example(2)["sinking"]
    sunk = sinking.number("own.sunk_um")
    assert sunk == pytest.approx(-sinking.fields().point_data["displacement_um"][:, 1].min(), rel=1e-6)
    assert sinking.history("own.sunk_um")["own.sunk_um"].tolist() == [sunk]


@pytest.mark.parametrize("tables", [{}, {"actin": ({"where": "basal", "stress_Pa": 5.0},)}], ids=["nothing", "actin"])
def test_full_cell_without_weight_is_solved_and_not_turned(tables):
    """There is no load to take a moment about; warnings are errors here."""
    scene = cellmech.Scene(mesh=COARSE, cell={"shape": "full"}, load={"factor": 0.0}, time={"history": False}, **tables)
    result = cellmech.solve(scene)
    assert abs(result.number("contact.lateral_force_Pa_x_um")) < 1e-9
    assert (result.number("nucleus.J1_max") - 2 > 0.01) == bool(tables)
