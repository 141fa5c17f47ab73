"""Figures and tables from made-up result files: what is drawn where, in which colour, at which scale."""

from __future__ import annotations

import csv
import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import rgb_to_hsv, to_hex, to_rgb
from matplotlib.figure import Figure
from plot_files import CENTRE, LAWS, peaks, sag, write_ball, write_case, write_study

from cellmech.errors import CellmechError, InputError
from cellmech.figures import render as render
from cellmech.figures.curves import draw_curves
from cellmech.figures.geometry_figure import draw_geometry
from cellmech.figures.number_tables import fig2_table
from cellmech.figures.paper_plots import PAPER_NUMBERS
from cellmech.figures.results import StudyResult, read_study
from cellmech.figures.shape_figure import draw_case
from cellmech.figures.shapes import draw_shapes, magnification, read_pose
from cellmech.figures.style import LAWS as LOOKS
from cellmech.figures.style import LAYER_COLOURS, SUBSTRATE, printed, provenance, save, spread, styled
from cellmech.figures.substrate import band, outline_of, polygons, surface_at
from cellmech.results.result import Result, load
from cellmech.results.sealed import file_hashes, sealed
from cellmech.scene.scene import Scene

PAPER = tomllib.loads(PAPER_NUMBERS.read_text(encoding="utf-8"))["fig2"]
BARE = {"pillar": [], "flat": False, "load": {"factor": 0.0}}
RED, GREEN, ORANGE, BLUE = "#d5312b", "#3a9d45", "#f5921e", "#2f6fc4"


def lines(figure: Figure, start: str) -> dict[str, list[Any]]:
    """Lines by law whose tag starts so."""
    found: dict[str, list[Any]] = {}
    for axes in figure.axes:
        for line in axes.lines:
            if (line.get_gid() or "").startswith(start):
                found.setdefault(line.get_gid().removeprefix(start), []).append(line)
    return found


def texts(figure: Figure) -> str:
    parts = [text.get_text() for text in figure.texts]
    parts += [text.get_text() for axes in figure.axes for text in (*axes.texts, axes.title, axes.yaxis.label)]
    parts += [axes.get_title(loc="left") for axes in figure.axes]
    return "\n".join(parts)


def area(triangles: np.ndarray) -> float:
    """Signed."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    return float(np.sum((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2)


class TestCurves:
    def test_each_panel_has_the_four_laws_in_the_papers_colours(self, tmp_path: Path) -> None:
        found = lines(draw_curves(read_study(write_study(tmp_path), LAWS), PAPER), "law:")
        colours = {law: {to_hex(line.get_color()) for line in of} for law, of in found.items()}
        assert colours == {"saint-venant": {RED}, "neo-hookean": {GREEN}, "mooney-rivlin": {ORANGE}, "yeoh": {BLUE}}
        assert all(len(of) == 4 for of in found.values())

    def test_curves_are_the_history_less_the_rest_value(self, tmp_path: Path) -> None:
        found = lines(draw_curves(read_study(write_study(tmp_path), LAWS), PAPER), "law:")
        for index, law in enumerate(LAWS):
            ends = [line.get_ydata()[-1] for line in found[law]]
            expected = np.array(list(peaks(index).values())) - [0, 2, 2, 1]
            np.testing.assert_allclose(ends, expected, rtol=1e-12)
            np.testing.assert_allclose(found[law][0].get_xdata()[[0, -1]], [0.0, 18000.0])

    def test_the_papers_strains_stand_in_strips_of_their_own_scale(self, tmp_path: Path) -> None:
        figure = draw_curves(read_study(write_study(tmp_path), LAWS), PAPER)
        figure.canvas.draw()
        assert len(figure.axes) == 7  # the paper's stresses lie within the range of ours
        for law, marks in lines(figure, "paper:").items():
            values = []
            for mark in marks:
                axes = mark.axes
                y = axes.transData.inverted().transform(mark.get_transform().transform(mark.get_xydata()))[0, 1]
                values.append(y)
            expected = [PAPER[law][key] - rest for key, rest in (("sigma", 0), ("J1", 2), ("J2", 2), ("J3", 1))]
            np.testing.assert_allclose(values, expected, rtol=1e-9)

    def test_our_curves_fill_their_axes(self, tmp_path: Path) -> None:
        figure = draw_curves(read_study(write_study(tmp_path), LAWS), PAPER)
        for of in lines(figure, "law:").values():
            for line in of:
                low, high = line.axes.get_ylim()
                assert (line.get_ydata()[-1] - low) / (high - low) > 0.5

    def test_the_papers_numbers_are_labelled_as_printed(self, tmp_path: Path) -> None:
        found = texts(draw_curves(read_study(write_study(tmp_path), LAWS), PAPER))
        for label in ("2.30 Saint-Venant", "1.032 neo-Hookean", "5.44 Mooney–Rivlin", "1.08 Yeoh", "paper: $J_1$"):
            assert label in found

    def test_missing_and_failed_cases_are_named(self, tmp_path: Path) -> None:
        write_study(tmp_path, LAWS[:2])
        write_case(tmp_path / "yeoh", "yeoh", 3, sag, status="failed", reason="det F <= 0", t_s=1000.0)
        figure = draw_curves(read_study(tmp_path, LAWS), PAPER)
        assert set(lines(figure, "law:")) == {"saint-venant", "neo-hookean", "yeoh"}
        assert "mooney-rivlin: not in this folder" in texts(figure)
        assert "yeoh: failed at 1,000 s (det F <= 0)" in texts(figure)

    def test_a_case_that_failed_before_its_first_step_is_left_out(self, tmp_path: Path) -> None:
        write_study(tmp_path, LAWS[:3])
        write_case(tmp_path / "yeoh", "yeoh", 3, sag, status="failed", reason="slides: no equilibrium", t_s=0.0)
        (tmp_path / "yeoh" / "history.csv").unlink()
        assert set(lines(draw_curves(read_study(tmp_path, LAWS), PAPER), "law:")) == set(LAWS[:3])

    def test_provenance_is_in_the_small_print(self, tmp_path: Path) -> None:
        found = texts(draw_curves(read_study(write_study(tmp_path), LAWS), PAPER))
        for part in ("cellmech 0.1.0", "1,230 elements", "rtol 0.001", "load factor 1", "sources 0123456789"):
            assert part in found


class TestSpread:
    @pytest.mark.parametrize("wanted", [[0.1, 0.5, 0.9], [0.5, 0.5, 0.5], [0.0, 0.02, 0.03, 0.9], [0.99, 1.0]])
    def test_labels_keep_their_order_and_distance(self, wanted: list[float]) -> None:
        placed = spread(wanted, 0.1)
        assert np.all(np.diff(placed) >= 0.1 - 1e-12)
        assert placed[-1] <= 1.0

    def test_labels_with_room_stay_where_they_are(self) -> None:
        assert spread([0.1, 0.3, 0.6], 0.1) == pytest.approx([0.1, 0.3, 0.6])

    def test_labels_at_one_place_are_centred_on_it(self) -> None:
        assert spread([0.5, 0.5, 0.5], 0.1) == pytest.approx([0.4, 0.5, 0.6])


@pytest.mark.parametrize(("value", "text"), [(2.3, "2.30"), (1.032, "1.032"), (0.86, "0.86"), (5.0, "5.00")])
def test_printed_numbers_keep_the_papers_digits(value: float, text: str) -> None:
    assert printed(value) == text


class TestResults:
    def test_no_case_at_all_is_refused_and_says_what_is_there(self, tmp_path: Path) -> None:
        write_case(tmp_path / "S1", "yeoh", 0, sag)
        with pytest.raises(InputError, match=r"saint-venant, neo-hookean.*'S1'"):
            read_study(tmp_path, LAWS)

    def test_a_case_without_result_is_not_finished(self, tmp_path: Path) -> None:
        write_study(tmp_path, LAWS[:2])
        (tmp_path / "neo-hookean" / "result.json").unlink()
        assert read_study(tmp_path, LAWS[:2]).missing == {"neo-hookean": "not finished (no result.json)"}

    @pytest.mark.parametrize("content", ["", "{", "[]", "[" * 100_000, '{"status": "solved", "files": [1]}'])
    def test_a_broken_result_names_its_file(self, tmp_path: Path, content: str) -> None:
        write_study(tmp_path, LAWS[:1])
        (tmp_path / LAWS[0] / "result.json").write_text(content)
        with pytest.raises(InputError, match=r"saint-venant/result\.json"):
            read_study(tmp_path, LAWS)

    def test_a_damaged_result_is_refused(self, tmp_path: Path) -> None:
        folder = write_study(tmp_path, LAWS[:1]) / LAWS[0]
        result = json.loads((folder / "result.json").read_text())
        text = sealed({**result, "files": file_hashes([folder / "history.csv"])})
        (folder / "result.json").write_text(text.replace('"t_s": 1', '"t_s": 2'))
        with pytest.raises(InputError, match=r"result\.json: is damaged"):
            load(folder)
        (folder / "result.json").write_text(text)
        assert load(folder).result["files"]
        (folder / "history.csv").write_text("t_s\n1.0\n")
        with pytest.raises(InputError, match=r"saint-venant: history\.csv is damaged"):
            load(folder)

    def test_null_and_absent_numbers_are_nan_and_a_text_is_refused(self, tmp_path: Path) -> None:
        case = load(write_study(tmp_path, LAWS[:1]) / LAWS[0])
        assert np.isnan([case.get("share_of_area_percent.J3"), case.get("lamina.J1_max")]).all()
        with pytest.raises(InputError, match="status"):
            case.get("status")

    def test_history_reads_empty_fields_as_nan_and_refuses_others(self, tmp_path: Path) -> None:
        case = load(write_study(tmp_path, LAWS[:1]) / LAWS[0])
        assert np.isnan(case.history("empty")["empty"]).all()
        with pytest.raises(InputError, match="no such column"):
            case.history("t_h")
        (case.folder / "history.csv").write_text("t_s\n1.0\nsoon\n")
        with pytest.raises(InputError, match="numbers only"):
            case.history("t_s")

    def test_the_last_field_file_counts(self, tmp_path: Path) -> None:
        case = load(write_study(tmp_path, LAWS[:1]) / LAWS[0])
        rows = '<DataSet timestep="500.0" file="fields_0000.vtu"/><DataSet timestep="70.0" file="other.vtu"/>'
        (case.folder / "fields.pvd").write_text(f"<VTKFile><Collection>{rows}</Collection></VTKFile>")
        assert case.last_fields() == (500.0, case.folder / "fields_0000.vtu")

    @pytest.mark.parametrize("content", ["", "<VTKFile/>", '<V><DataSet timestep="1" file="gone.vtu"/></V>'])
    def test_a_broken_list_of_fields_is_refused(self, tmp_path: Path, content: str) -> None:
        case = load(write_study(tmp_path, LAWS[:1]) / LAWS[0])
        (case.folder / "fields.pvd").write_text(content)
        with pytest.raises(InputError, match=r"fields\.pvd"):
            case.last_fields()


class TestGeometry:
    def test_dimensions_of_table_1_are_labelled_with_units(self) -> None:
        found = texts(draw_geometry(Scene()))
        for label in ("$r_c$ = 10 µm", "$r_n$ = 5 µm", "$t_m$ = 0.5 µm", "$t_l$ = 0.1 µm", "$w_{mp}$ = 10 µm"):
            assert label in found
        for label in ("half the width", "$h_{mp}$ = 9.5 µm", "$y_{flat}$ = −10 µm", "centre (0, 9.5) µm"):
            assert label in found

    def test_dimensions_follow_the_scene(self) -> None:
        data = {"cell": {"shape": "full", "gap_um": 2.0}, "layer": {"lamina": {"outer_radius_um": 5.2}}}
        found = texts(draw_geometry(Scene.model_validate(data)))
        for label in ("$r_n$ = 5.2 µm", "$t_l$ = 0.3 µm", "centre (0, 11.5) µm", "gap to first touch = 2 µm"):
            assert label in found

    def test_a_scene_without_substrate_can_be_drawn(self) -> None:
        found = texts(draw_geometry(Scene.model_validate(BARE)))
        assert "w_{mp}" not in found
        assert "y_{flat}" not in found

    def test_the_picture_shows_the_papers_colours_where_the_layers_are(self) -> None:
        with styled():
            figure = draw_geometry(Scene())
            canvas = FigureCanvasAgg(figure)
            canvas.draw()
            image = np.asarray(canvas.buffer_rgba())
            for name, place in {"nucleoplasm": (2.0, 12), "cytosol": (5, 5), "membrane": (6.877, 2.726)}.items():
                x, y = figure.axes[0].transData.transform(place)
                pixel = image[image.shape[0] - 1 - round(y), round(x), :3] / 255
                assert to_hex(pixel) == LAYER_COLOURS[name]


def test_layer_colours_are_the_papers_hues() -> None:
    degrees = {"membrane": 0, "lamina": 30, "cytosol": 120, "nucleoplasm": 215}  # red, orange, green, blue
    assert list(LAYER_COLOURS) == ["nucleoplasm", "lamina", "cytosol", "membrane"]  # the codes in field files
    for name, hue in degrees.items():
        assert 360 * rgb_to_hsv(to_rgb(LAYER_COLOURS[name]))[0] == pytest.approx(hue, abs=8), name


class TestSubstrate:
    def test_outline_lies_on_the_superellipse(self) -> None:
        arch = next(iter(polygons_arch(Scene())))
        x, y = outline_of(arch).T
        np.testing.assert_allclose((x / 10) ** 4 + ((y + 10) / 9.5) ** 4, 1.0, rtol=1e-12)

    def test_surface_is_the_pillar_and_beside_it_the_flat(self) -> None:
        heights = surface_at(Scene(), np.array([-12.0, 0.0, 5.0, 10.0]))
        np.testing.assert_allclose(heights, [-10.0, -0.5, -10 + 9.5 * (1 - 0.5**4) ** 0.25, -10.0])

    def test_surface_of_nothing_is_infinitely_low(self) -> None:
        assert np.all(surface_at(Scene.model_validate(BARE), np.zeros(2)) == -np.inf)

    def test_polygons_fill_pillar_and_flat(self) -> None:
        pillar, flat = polygons(Scene(), (-15.0, 15.0, -12.0, 20.0))
        # |x/a|^4 + |y/b|^4 = 1 encloses 4 a b Γ(5/4)²/Γ(3/2)
        assert area(pillar) == pytest.approx(4 * 95.0 * 0.9064024770554771**2 / 0.886226925452758, rel=1e-4)
        assert area(flat) == pytest.approx(60.0)

    def test_band_stops_at_its_bottom(self) -> None:
        assert area(band(np.array([0.0, 1.0, 2.0]), np.array([1.0, 1.0, -np.inf]), 0.0)) == pytest.approx(1.5)


def polygons_arch(scene: Scene) -> list[Any]:
    from cellmech.scene.substrate import standing

    return [one.arch for one in standing(scene)]


class TestShapes:
    def test_a_half_cell_is_completed_by_its_mirror_image(self, tmp_path: Path) -> None:
        case = load(write_study(tmp_path, LAWS[:1]) / LAWS[0])
        shape = read_pose(case).shape
        x, u = shape.reference.reshape(-1, 2), shape.displacement.reshape(-1, 2)
        assert x[:, 0].min() == pytest.approx(-10.0)
        np.testing.assert_allclose(u, sag(x), atol=1e-12)
        for code, (inner, outer) in enumerate(((0, 4.9), (4.9, 5), (5, 9.5), (9.5, 10))):
            exact = np.pi * (outer**2 - inner**2)
            assert area(shape.reference[shape.layer == code]) == pytest.approx(exact, rel=2e-3)

    def test_a_full_cell_is_drawn_as_it_is(self, tmp_path: Path) -> None:
        write_case(tmp_path / "yeoh", "yeoh", 0, sag, half=False)
        shape = read_pose(load(tmp_path / "yeoh")).shape
        assert area(shape.reference) == pytest.approx(100 * np.pi, rel=1e-3)

    def test_displacements_are_magnified_about_the_lowest_point(self, tmp_path: Path) -> None:
        def sunk(x: np.ndarray) -> np.ndarray:
            return sag(x) + np.array([0.0, -0.3])

        write_study(tmp_path, LAWS[:1], sunk)
        pose = read_pose(load(tmp_path / LAWS[0]))
        np.testing.assert_allclose(pose.pivot, [0.0, -0.3], atol=1e-12)
        moved = pose.shape.moved(pose.pivot, 5).reshape(-1, 2)
        top, bottom = moved[np.argmax(moved[:, 1])], moved[np.argmin(moved[:, 1])]
        np.testing.assert_allclose([bottom[1], top[1]], [-0.5 - 0.3, 19.5 - 0.3 - 5 * 0.6], atol=1e-9)

    def test_small_shape_changes_are_magnified_and_visible_ones_are_not(self, tmp_path: Path) -> None:
        for number, (size, factor) in enumerate(((1.0, 5), (0.1, 50), (4.0, 1), (0.0, 1))):
            write_study(tmp_path / str(number), LAWS[:1], lambda x, size=size: size * sag(x))
            assert magnification([read_pose(load(tmp_path / str(number) / LAWS[0]))]) == factor

    def test_no_factor_turns_an_element_over(self, tmp_path: Path) -> None:
        def thinned(x: np.ndarray) -> np.ndarray:
            """The membrane 15 % thinner: 6.7 times that leaves nothing of it."""
            r = np.linalg.norm(x - CENTRE, axis=-1, keepdims=True)
            return -0.15 * np.maximum(r - 9.5, 0.0) * (x - CENTRE) / np.maximum(r, 1.0)

        write_study(tmp_path, LAWS[:1], thinned)
        assert magnification([read_pose(load(tmp_path / LAWS[0]))]) == 5

    def test_the_picture_has_the_layers_colours_in_place(self, tmp_path: Path) -> None:
        pose = read_pose(load(write_study(tmp_path, LAWS[:1], np.zeros_like) / LAWS[0]))
        view = (-13.0, 13.0, -6.0, 20.0)
        cell = (pose.shape.moved(pose.pivot), render.by_layer(pose.shape.layer))
        image = render.picture([*((of, SUBSTRATE) for of in polygons(Scene(), view)), cell], view, 520)
        assert image.shape == (520, 520, 3)
        places = {"nucleoplasm": (-3.0, 9.5), "lamina": (4.95, 9.5), "cytosol": (-7.0, 9.5), "membrane": (9.75, 9.5)}
        expected = {name: (LAYER_COLOURS[name], at) for name, at in places.items()}
        for name, (colour, (x, y)) in (
            expected | {"pillar": (SUBSTRATE, (0, -3)), "air": ("#ffffff", (12, 15))}
        ).items():
            column, row = int((x + 13) / 26 * 520), int((20 - y) / 26 * 520)
            found = image[row, column].astype(int)
            tolerance = 60 if name == "lamina" else 1  # two pixels wide
            assert np.all(np.abs(found - [int(colour[i : i + 2], 16) for i in (1, 3, 5)]) <= tolerance), name

    def test_a_field_file_of_something_else_is_refused(self, tmp_path: Path) -> None:
        case = load(write_study(tmp_path, LAWS[:1]) / LAWS[0])
        (case.folder / "fields_0000.vtu").write_text("<VTKFile/>")
        with pytest.raises(InputError, match=r"fields_0000\.vtu"):
            read_pose(case)

    @pytest.mark.parametrize(
        ("probe", "why"),
        [("import os; os.kill(os.getpid(), 11)", "signal 11"), ("raise RuntimeError('bad X server')", "bad X server")],
    )
    def test_a_machine_that_cannot_draw_is_told_what_to_install(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, probe: str, why: str
    ) -> None:
        monkeypatch.setattr(render, "PROBE", probe)
        with pytest.raises(CellmechError, match=rf"{why}.*libegl1"):
            draw_case(load(write_ball(tmp_path / "ball", np.zeros_like)))

    def test_magnified_cells_stand_without_substrate(self, tmp_path: Path) -> None:
        figure = draw_shapes(read_study(write_study(tmp_path, LAWS[:2]), LAWS[:2]), magnify=True, px_per_in=50)
        grey = [int(SUBSTRATE[i : i + 2], 16) for i in (1, 3, 5)]
        shares = [np.mean(np.all(np.asarray(axes.images[0].get_array()) == grey, axis=-1)) for axes in figure.axes]
        assert [share > 0.05 for share in shares] == [True, False, True, False]
        assert shares[1] == shares[3] == 0.0


class TestTable:
    def test_numbers_stand_beside_the_papers_with_both_ratios(self, tmp_path: Path) -> None:
        table = fig2_table(read_study(write_study(tmp_path), LAWS), PAPER).markdown()
        row = next(row for row in cells(table) if row[:2] == ["neo-Hookean", "J1"])
        assert row == ["neo-Hookean", "J1", "2.00600", "10,000", "2.44", f"{2.006 / 2.44:.3f}", f"{0.006 / 0.44:.4f}"]

    def test_the_papers_mean_follows_from_its_share(self, tmp_path: Path) -> None:
        table = fig2_table(read_study(write_study(tmp_path), LAWS), PAPER).markdown()
        row = [row for row in cells(table) if row[:2] == ["Mooney–Rivlin", "J1"]][1]
        mean = 2.007 / 2
        ratios = [f"{mean / 2.24:.3f}", f"{(mean - 2) / 0.24:.4f}"]
        assert row[2:] == [f"{mean:.5f}", "2.24", *ratios, "50.00", "56"]

    def test_what_is_not_printed_or_null_is_a_dash(self, tmp_path: Path) -> None:
        table = fig2_table(read_study(write_study(tmp_path), LAWS), PAPER).markdown()
        row = [row for row in cells(table) if row[:2] == ["neo-Hookean", "J3"]][1]
        assert row[3:] == ["–"] * 5

    def test_columns_are_aligned(self, tmp_path: Path) -> None:
        table = fig2_table(read_study(write_study(tmp_path), LAWS), PAPER).markdown()
        for block in table.split("\n\n"):
            assert len({len(row) for row in block.splitlines() if row.startswith("|")}) <= 1


def cells(table: str) -> list[list[str]]:
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in table.splitlines() if row.startswith("| ")]


def test_paper_numbers_are_those_of_section_3_1() -> None:
    assert set(PAPER) == set(LAWS) < set(LOOKS)
    assert PAPER["mooney-rivlin"] | PAPER["neo-hookean"] == {
        **{"sigma": 1.032, "J1": 2.44, "J2": 4.27, "J3": 1.15},
        **{"share_J1": 56, "share_J2": 81, "share_J3": 23},
    }


def test_equal_figures_give_equal_files(tmp_path: Path) -> None:
    study = read_study(write_study(tmp_path / "study", LAWS[:1]), LAWS)
    with styled():
        first = [path.read_bytes() for path in save(draw_curves(study, PAPER), tmp_path / "a", "fig2")]
        again = [path.read_bytes() for path in save(draw_curves(study, PAPER), tmp_path / "b", "fig2")]
    assert first == again
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == ["fig2.pdf", "fig2.png"]


def test_made_up_histories_have_the_columns_of_the_contract(tmp_path: Path) -> None:
    write_study(tmp_path, LAWS[:1])
    with open(tmp_path / LAWS[0] / "history.csv", newline="") as stream:
        columns = next(csv.reader(stream))
    assert {"t_s", "nucleus.sigma_mises_max_Pa", "nucleus.J1_max", "nucleus.J2_max", "nucleus.J3_max"} <= set(columns)


@pytest.mark.parametrize(
    ("beyond", "told"), [(0, None), (2, "on the mesh: case 0, case 1"), (9, "on the mesh: 9 of 12 cases")]
)
def test_small_print_says_which_cases_are_beyond_ellipticity(beyond: int, told: str | None) -> None:
    """By name, or how many where the line would not hold their names."""
    since = {True: {"beyond_ellipticity": {"since_s": 5.0}}, False: {"beyond_ellipticity": {"since_s": None}}}
    cases = {f"case {k}": Result(f"case {k}", Path(), Scene(), since[k < beyond]) for k in range(12)}
    text = provenance(StudyResult(Path(), cases))
    assert told in text if told else "ellipticity" not in text
