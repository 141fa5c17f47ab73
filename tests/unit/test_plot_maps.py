"""Figures 4 and 6 from made-up sweeps: which number stands in which cell, what is marked, what is hatched."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, to_hex
from matplotlib.figure import Figure
from plot_files import change, write_study, write_sweep

from cellmech.errors import InputError
from cellmech.figures.maps import COLOURS, draw_maps
from cellmech.figures.paper_plots import PAPER_NUMBERS, STUDIES
from cellmech.figures.results import StudyResult, read_planned, read_study
from cellmech.scene.studies import Study, load_study

PAPER = tomllib.loads(PAPER_NUMBERS.read_text(encoding="utf-8"))
FLUID, MODULI = (load_study(STUDIES / f"{stem}.toml") for stem in ("fig4", "fig6"))
LARGEST, SMALLEST = 13, 17  # of the made-up values: rows 2 and 3, columns 3 and 2
CORNER = FLUID.cases[-1].name  # fluid fractions 0.9 and 0.9


def made_up(index: int) -> dict[str, float]:
    """Distinct values, the largest and the smallest in the middle."""
    rise = {LARGEST: 40.0, SMALLEST: 4.0}.get(index, 10.0 + index)
    return {
        "sigma_mises_max_Pa": rise / 8,
        "J1_max": 2 + rise * 1e-4,
        "J2_max": 2 + rise * 1e-3,
        "J3_max": 1 + rise * 1e-5,
    }


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_sweep(tmp_path_factory.mktemp("sweep") / "fig4", FLUID, made_up)


@pytest.fixture(scope="module")
def figure(files: Path) -> Figure:
    """The sweep's map; tests only look at it."""
    return draw_maps(read(files), PAPER["fig4"])


@pytest.fixture
def folder(files: Path, tmp_path: Path) -> Path:
    """A copy of the sweep to spoil."""
    return Path(shutil.copytree(files, tmp_path / "fig4"))


def read(folder: Path) -> StudyResult:
    return read_planned(folder, FLUID)


def panels(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_title(loc="left").startswith("(")]


def cell_texts(axes: Axes) -> dict[tuple[int, int], str]:
    """Row and column -> what stands in the middle of the cell."""
    tagged = {(text.get_gid() or "").partition(":"): text.get_text() for text in axes.texts}
    return {tuple(map(int, at.split(","))): text for (tag, _, at), text in tagged.items() if tag == "cell"}


def place_of(axes: Axes, gid: str) -> tuple[int, int] | None:
    """Row and column of the cell in which a tagged frame or marker lies."""
    for artist in (*axes.patches, *axes.lines):
        if artist.get_gid() == gid:
            x, y = (
                artist.get_xydata()[0]
                if hasattr(artist, "get_xydata")
                else np.add(artist.get_xy(), (artist.get_width() / 2, artist.get_height() / 2))
            )
            return round(y), round(x)
    return None


def words(figure: Figure) -> str:
    return "\n".join(text.get_text() for owner in (figure, *figure.axes) for text in owner.texts)


class TestCells:
    def test_every_cell_shows_its_cases_value_less_the_one_at_rest(self, figure: Figure) -> None:
        sigma, j1, j2, j3 = map(cell_texts, panels(figure))
        for index in range(25):
            at, values = divmod(index, 5), made_up(index)
            assert float(sigma[at]) == pytest.approx(values["sigma_mises_max_Pa"], abs=5e-4)
            assert float(j1[at]) == pytest.approx(1e3 * (values["J1_max"] - 2), abs=5e-4)
            assert float(j2[at]) == pytest.approx(1e3 * (values["J2_max"] - 2), abs=5e-3)
            assert float(j3[at]) == pytest.approx(1e6 * (values["J3_max"] - 1), abs=0.5)

    def test_the_unit_says_by_what_the_numbers_are_multiplied(self, figure: Figure) -> None:
        labels = [axes.get_ylabel() for axes in figure.axes if "largest" in axes.get_ylabel()]
        assert [label.partition("[")[2] for label in labels] == ["Pa]", "10⁻³]", "10⁻³]", "10⁻⁶]"]

    def test_rows_are_the_lamina_and_columns_the_nucleoplasm(self, figure: Figure) -> None:
        for axes in panels(figure):
            assert "lamina" in axes.get_ylabel() and "nucleoplasm" in axes.get_xlabel()
            for labels in (axes.get_xticklabels(), axes.get_yticklabels()):
                assert [label.get_text() for label in labels] == ["0.1", "0.3", "0.5", "0.7", "0.9"]

    def test_neighbours_that_differ_little_have_different_numbers(self, tmp_path: Path) -> None:
        def close(index: int) -> dict[str, float]:
            return {key: 1e-5 * index + (5 if key[0] == "s" else 2) for key in made_up(0)}

        write_sweep(tmp_path, FLUID, close)
        for axes in panels(draw_maps(read(tmp_path), PAPER["fig4"])):
            assert len(set(cell_texts(axes).values())) == 25

    def test_equal_values_can_be_drawn(self, tmp_path: Path) -> None:
        write_sweep(tmp_path, FLUID, lambda index: made_up(0))
        assert set(cell_texts(panels(draw_maps(read(tmp_path), {}))[0]).values()) == {"1.250"}

    def test_colour_grows_with_the_value_and_the_lightness_falls(self, figure: Figure) -> None:
        axes = panels(figure)[0]
        image = axes.images[0]
        drawn = np.asarray(image.get_array())
        assert np.argmax(drawn) == LARGEST and np.argmin(drawn) == SMALLEST
        assert image.get_cmap().name == COLOURS
        lightness = [np.dot(image.get_cmap()(share)[:3], (0.299, 0.587, 0.114)) for share in np.linspace(0, 1, 20)]
        assert np.all(np.diff(lightness) < 0)


class TestExtremes:
    def test_ours_are_framed_where_they_are(self, figure: Figure) -> None:
        for axes in panels(figure):
            assert place_of(axes, "here:max") == divmod(LARGEST, 5)
            assert place_of(axes, "here:min") == divmod(SMALLEST, 5)

    def test_the_papers_are_marked_where_it_prints_them(self, figure: Figure) -> None:
        sigma, j1, j2, j3 = panels(figure)
        assert place_of(sigma, "paper:max") == (0, 3)  # lamina 0.1, nucleoplasm 0.7
        assert {place_of(axes, "paper:max") for axes in (j1, j2, j3)} == {(3, 4)}
        assert place_of(sigma, "paper:min") is None
        assert {place_of(axes, "paper:min") for axes in (j1, j2)} == {(1, 0)}
        assert place_of(j3, "paper:min") == (4, 0)

    def test_those_of_the_moduli_too(self, tmp_path: Path) -> None:
        write_sweep(tmp_path, MODULI, made_up)
        sigma, j1, j2, j3 = panels(draw_maps(read_planned(tmp_path, MODULI), PAPER["fig6"]))
        assert place_of(sigma, "paper:max") == (2, 0)  # lamina 2000, nucleoplasm 10
        assert {place_of(axes, "paper:max") for axes in (j1, j2)} == {(0, 0)}
        assert place_of(j3, "paper:max") == (4, 0)
        assert {place_of(axes, "paper:min") for axes in (j1, j2)} == {(1, 4)}
        assert place_of(j3, "paper:min") == (0, 4)

    def test_printed_values_stand_there_as_printed_and_below_in_the_panels_unit(self, figure: Figure) -> None:
        found = words(figure)
        for text in ("paper 1.32", "paper 4.08", "paper 15.20", "paper 1.31"):
            assert text in found
        assert "4.000 here;  2,080 ($J_1$ = 4.08) in the paper" in found
        assert "0.400 here;  the value in the paper repeats its largest" in found
        assert "the paper names no smallest" in found


class TestDecades:
    """Values over more than a factor 20 have a logarithmic scale, and three digits each."""

    @pytest.mark.parametrize(("most", "logarithmic"), [(19.0, False), (21.0, True), (4e5, True)])
    def test_scale_is_logarithmic_where_values_span_decades(self, folder: Path, most: float, logarithmic: bool) -> None:
        for index, case in enumerate(FLUID.cases):
            value = most ** (index / 24)
            change(folder / case.name, nucleus=made_up(index) | {"sigma_mises_max_Pa": value})
        sigma = panels(draw_maps(read(folder), PAPER["fig4"]))[0]
        assert isinstance(sigma.images[0].norm, LogNorm) == logarithmic
        texts = cell_texts(sigma)
        if logarithmic:
            assert texts[0, 0] == "1.00"
            assert float(texts[2, 2].replace(",", "")) == pytest.approx(most ** (12 / 24), rel=5e-3)
            assert len(set(texts.values())) == 25

    def test_scale_is_linear_where_a_value_is_not_positive(self, folder: Path) -> None:
        for index, case in enumerate(FLUID.cases):
            change(folder / case.name, nucleus=made_up(index) | {"J1_max": 2.0 + (10.0**index - 1.0) * 1e-24})
        j1 = panels(draw_maps(read(folder), PAPER["fig4"]))[1]
        assert not isinstance(j1.images[0].norm, LogNorm)
        assert cell_texts(j1)[4, 4] == "1.00"  # over decades all the same


class TestFaults:
    def test_failed_and_missing_cases_are_hatched_and_named(self, folder: Path) -> None:
        change(folder / CORNER, status="failed", reason="det F <= 0", t_s=1234.0)
        shutil.rmtree(folder / FLUID.cases[7].name)
        figure = draw_maps(read(folder), PAPER["fig4"])
        for axes in panels(figure):
            texts = cell_texts(axes)
            assert texts[4, 4] == "failed at\n1,234 s"
            assert texts[1, 2] == "no result"
            hatched = {(round(p.get_y() + 0.5), round(p.get_x() + 0.5)) for p in axes.patches if p.get_hatch()}
            assert hatched == {(4, 4), (1, 2)}
            assert np.isnan(np.ma.filled(axes.images[0].get_array(), np.nan)[4, 4])
        assert f"{FLUID.cases[7].name}: not in this folder" in words(figure).replace("\n", " ")

    def test_a_failed_case_is_no_extreme(self, folder: Path) -> None:
        change(folder / FLUID.cases[LARGEST].name, status="failed", reason="det F <= 0")
        for axes in panels(draw_maps(read(folder), PAPER["fig4"])):
            assert place_of(axes, "here:max") == (4, 4)

    def test_a_value_that_is_null_is_no_value(self, folder: Path) -> None:
        change(folder / CORNER, nucleus=made_up(24) | {"J1_max": None})
        sigma, j1, *_ = map(cell_texts, panels(draw_maps(read(folder), PAPER["fig4"])))
        assert j1[4, 4] == "no value"
        assert float(sigma[4, 4]) == pytest.approx(34 / 8)

    def test_a_case_solved_with_other_inputs_is_missing(self, folder: Path) -> None:
        scene = folder / CORNER / "scene.toml"
        scene.write_text((folder / FLUID.cases[0].name / "scene.toml").read_text())
        study = read(folder)
        assert "layer.lamina.fluid_fraction = 0.1" in study.missing[CORNER]
        assert cell_texts(panels(draw_maps(study, PAPER["fig4"]))[0])[4, 4] == "no result"

    def test_a_sweep_of_failures_alone_is_drawn(self, folder: Path) -> None:
        for case in FLUID.cases:
            change(folder / case.name, status="failed", reason="det F <= 0", t_s=1.0)
        assert "no case was solved" in words(draw_maps(read(folder), PAPER["fig4"]))

    @pytest.mark.parametrize("text_colour", ["black", "white"])
    def test_numbers_are_dark_on_light_and_light_on_dark(self, figure: Figure, text_colour: str) -> None:
        axes = panels(figure)[0]
        at = divmod({"black": SMALLEST, "white": LARGEST}[text_colour], 5)
        text = next(text for text in axes.texts if text.get_gid() == f"cell:{at[0]},{at[1]}")
        assert to_hex(text.get_color()) == to_hex(text_colour)


@pytest.mark.parametrize(
    "make",
    [
        lambda folder: read_study(write_study(folder, ("yeoh",)), ("yeoh",)),
        lambda folder: read_planned(write_study(folder), load_study(STUDIES / "fig2.toml")),
    ],
)
def test_a_study_that_does_not_vary_two_keys_has_no_map(tmp_path: Path, make: Callable[[Path], Any]) -> None:
    with pytest.raises(InputError, match="two keys"):
        draw_maps(make(tmp_path), PAPER["fig4"])


def test_a_sweep_over_something_else_than_numbers_has_no_map(tmp_path: Path) -> None:
    file = tmp_path / "laws.toml"
    file.write_text('schema = 1\n[sweep]\n"cell.law" = ["yeoh", "neo-hookean"]\n"load.factor" = [1, 2]\n')
    study: Study = load_study(file)
    write_sweep(tmp_path / "laws", study, made_up)
    with pytest.raises(InputError, match=r"cell\.law"):
        draw_maps(read_planned(tmp_path / "laws", study), {})
