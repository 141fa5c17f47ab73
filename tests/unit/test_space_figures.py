"""Pictures of cells in space, from made-up field files: sections, surfaces, what is seen from where."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from PIL import Image
from plot_files import RADII, sag, write_ball, write_case, write_quarter

from cellmech.errors import InputError
from cellmech.figures import film
from cellmech.figures.body import START, Body, Patch, read_body
from cellmech.figures.field_picture import draw_field, read_state
from cellmech.figures.film import make_turntable, write_film
from cellmech.figures.geometry_figure import draw_geometry
from cellmech.figures.paraview_files import whole, write_paraview
from cellmech.figures.reference import rest_of
from cellmech.figures.shape_figure import draw_case
from cellmech.figures.shapes import read_pose
from cellmech.figures.space import Paint, Stage, scale_of
from cellmech.figures.style import FADED, LAYER_COLOURS, QUANTITIES, SUBSTRATE, less_rest, rests
from cellmech.figures.substrate import behind, footprints, polygons
from cellmech.results.result import load, read_grid
from cellmech.results.vtu import packed, write_vtu
from cellmech.scene.scene import Scene

LATTICE = {"pillar": [], "array": {"profile": "square", "height_um": 5.0, "offset_um": [5.0, 5.0]}}


def lean(x: np.ndarray) -> np.ndarray:
    """A displacement [µm]: half as wide, and 2 down."""
    return x * [-0.5, 0.0, -0.5] + [0.0, -2.0, 0.0]


def quarter(path: Path, field: str | None = None) -> Body:
    write_quarter(path / "fields.vtu", lean)
    return read_body(path / "fields.vtu", Scene.model_validate({"cell": {"geometry": "3d"}}), field)


def texts(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.texts)


def areas(patch: Patch, part: str, plane: tuple[int, int]) -> np.ndarray:
    """Of its triangles, with their sense."""
    a, b, c = np.moveaxis(getattr(patch, part)[..., plane], 1, 0)
    return np.asarray((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


class TestBody:
    @pytest.mark.parametrize("axis", ["x", "z"])
    def test_the_section_of_a_quarter_is_the_whole_disc_by_layer(self, tmp_path: Path, axis: str) -> None:
        section = quarter(tmp_path).section(axis)
        plane = (1, 2) if axis == "x" else (0, 1)
        found = areas(section, "now", plane)
        for code in range(4):
            expected = 0.5 * np.pi * (RADII[code + 1] ** 2 - RADII[code] ** 2)  # of ellipses half as wide
            assert found[section.layer == code].sum() == pytest.approx(expected, rel=5e-3)
        assert np.all(found > -1e-12)

    def test_the_section_that_lay_in_a_plane_is_the_undeformed_disc(self, tmp_path: Path) -> None:
        section = quarter(tmp_path).section(part=START)
        assert areas(section, "start", (0, 1)).sum() == pytest.approx(100 * np.pi, rel=5e-3)
        np.testing.assert_allclose(section.now, lean(section.start) + section.start, atol=1e-9)

    def test_the_outline_of_the_nucleus_is_that_of_every_section(self, tmp_path: Path) -> None:
        body = quarter(tmp_path)  # of ellipses 5 wide and 10 tall, and of a circle 5 wide
        for axis, length in (("x", 24.221), ("z", 24.221), ("y", 5 * np.pi)):
            rim = body.section(axis).rim()
            assert np.linalg.norm(rim[:, 1] - rim[:, 0], axis=1).sum() == pytest.approx(length, rel=5e-3)

    def test_surfaces_enclose_what_is_inside_them(self, tmp_path: Path) -> None:
        body = quarter(tmp_path)
        for radius, layer in ((10.0, "membrane"), (5.0, "lamina")):
            a, b, c = np.moveaxis(body.surface(layer).whole("xz").now - [0.0, 7.5, 0.0], 1, 0)
            volume = np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6
            assert volume == pytest.approx(np.pi / 3 * radius**3, rel=2e-2)

    def test_fields_are_carried_to_sections(self, tmp_path: Path) -> None:
        section = quarter(tmp_path, "sigma_mises_Pa").section()
        np.testing.assert_allclose(np.log10(section.values), section.start[..., 1] / 10, atol=3e-2)

    def test_a_field_that_is_not_there_is_refused_with_those_that_are(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match=r"J7.*sigma_mises_Pa"):
            quarter(tmp_path, "J7")


class TestOtherFigures:
    def test_shapes_and_films_show_the_section_of_a_ball(self, tmp_path: Path) -> None:
        case = load(write_ball(tmp_path / "ball", lean))
        shape = read_pose(case).shape
        np.testing.assert_allclose([np.ptp(shape.reference[..., i]) for i in range(2)], 20.0, rtol=5e-3)
        t_s, file = case.last_fields()
        state = read_state(case, t_s, file, "sigma_mises_Pa", 1.0)
        np.testing.assert_allclose(np.ptp(state.points, axis=0), [10.0, 20.0], rtol=5e-3)

    def test_only_a_ball_turns_and_others_are_told_what_serves(self, tmp_path: Path) -> None:
        write_case(tmp_path / "yeoh", "yeoh", 0, sag)
        with pytest.raises(InputError, match=r"turntable.*shape"):
            make_turntable(load(tmp_path / "yeoh"), tmp_path / "turn.gif")

    def test_a_turntable_has_a_picture_of_every_side(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(film, "TURNS", 2)
        case = load(write_ball(tmp_path / "ball", np.zeros_like))
        assert make_turntable(case, tmp_path / "turn.gif") == 2
        with Image.open(tmp_path / "turn.gif") as picture:
            front = np.asarray(picture.convert("RGB"), dtype=int)
            picture.seek(1)
            back = np.asarray(picture.convert("RGB"), dtype=int)
        green = [
            np.mean((seen[..., 1] > seen[..., 0] + 40) & (seen[..., 1] > seen[..., 2] + 30)) for seen in (front, back)
        ]
        assert green[0] > 0.05 > 10 * green[1]  # the cytosol, but for its swatch in the legend

    def test_rest_values_are_those_of_each_geometry(self, tmp_path: Path) -> None:
        write_case(tmp_path / "yeoh", "yeoh", 0, sag)
        plane, ball = load(tmp_path / "yeoh"), load(write_ball(tmp_path / "ball", np.zeros_like))
        assert [plane.rest(name) for name in ("sigma_mises", "J1", "J2", "J3")] == [0.0, 2.0, 2.0, 1.0]
        assert [ball.rest(name) for name in ("sigma_mises", "J1", "J2", "J3")] == [0.0, 3.0, 3.0, 1.0]
        assert (rests([plane]), rests([ball])) == ("2, 2, 1", "3, 3, 1")
        assert rests([ball, plane]) == "2, 2, 1 in the plane, and 3, 3, 1 outside it"
        assert less_rest(QUANTITIES[1], [ball]) == " − 3"
        assert less_rest(QUANTITIES[1], [ball, plane]) == " − rest"
        assert rest_of("nucleus.J1_max", ball) == 3.0

    def test_the_first_geometry_of_a_ball_is_shown_from_the_side_and_from_above(self) -> None:
        scene = Scene.model_validate({"cell": {"geometry": "3d"}, **LATTICE})
        figure = draw_geometry(scene)
        side, above = figure.axes
        assert (side.get_ylabel(), above.get_ylabel()) == ("y [µm]", "z [µm]")
        assert above.get_ylim()[0] > above.get_ylim()[1]  # z downwards
        assert side.get_title(loc="left") == "section z = 0 µm"
        legend = [text.get_text() for text in figure.legends[0].get_texts()]
        assert legend[1].endswith("0.1 µm thick")
        assert legend[-1] == "pillars beside the section"

    def test_films_and_shapes_say_that_they_show_a_section_and_what_stands_beside_it(self, tmp_path: Path) -> None:
        case = load(write_ball(tmp_path / "ball", np.zeros_like, **LATTICE))
        figure = draw_field(case, "sigma_mises_Pa")
        assert "section z = 0 µm" in figure.axes[0].get_title()
        pale = [of for of in figure.axes[0].collections if to_rgba(FADED) in map(tuple, of.get_facecolor())]
        assert len(pale) == len(behind(case.scene)) > 0
        assert figure.axes[1].get_ylabel() == r"$\sigma_\mathrm{Mises}$ [Pa]"

    def test_films_outline_the_nucleus(self, tmp_path: Path) -> None:
        """Of a disc and of a ball's section; magnified as the cell is."""
        write_case(tmp_path / "yeoh", "yeoh", 0, sag)
        for folder, wide, tall in ((tmp_path / "yeoh", 10.1, 9.7), (write_ball(tmp_path / "ball", lean), 5.0, 10.0)):
            case = load(folder)
            for times in (1.0, 0.5):
                state = read_state(case, *case.last_fields(), "sigma_mises_Pa", times)
                spans = 10.0 + times * (np.array([wide, tall]) - 10.0)
                np.testing.assert_allclose(np.ptp(state.rim.reshape(-1, 2), axis=0), spans, rtol=5e-3)

    def test_what_stands_still_in_a_film_keeps_its_colour(self, tmp_path: Path) -> None:
        """A swatch, while most of the picture changes."""

        def frame(shade: float) -> Figure:
            figure = Figure(figsize=(3.0, 3.0))
            ramp = np.linspace(0.0, 1.0, 300)
            figure.add_axes((0, 0.1, 1, 0.8)).imshow(
                np.dstack([np.outer(ramp, ramp), ramp[:, None] + 0 * ramp, np.full((300, 300), shade)])
            )
            figure.patches.append(
                Rectangle((0.0, 0.0), 0.1, 0.1, fc=LAYER_COLOURS["lamina"], transform=figure.transFigure)
            )
            return figure

        write_film([frame(shade) for shade in (0.0, 0.5, 1.0)], tmp_path / "film.gif", 100, 100)
        swatch = to_rgba(LAYER_COLOURS["lamina"])[:3]
        with Image.open(tmp_path / "film.gif") as film:
            for index in range(3):
                film.seek(index)
                shown = np.asarray(film.convert("RGB"), dtype=int)
                np.testing.assert_allclose(shown[-5, 5] / 255, swatch, atol=0.03)
                assert shown[-5, -5].tolist() == [255, 255, 255]


class TestScale:
    def test_a_stress_is_told_apart_by_decades_and_a_strain_evenly(self) -> None:
        values = np.array([0.0, 0.1, 10.0])
        np.testing.assert_allclose(scale_of(values, "sigma_mises_Pa")(values), [0.0, 1 / 3, 1.0])
        even = np.append(np.linspace(0.0, 1.0, 101), 1000.0)  # one at a contact does not set the scale
        np.testing.assert_allclose(scale_of(even, "J1")([0.0, 0.505, 1.0, 1000.0]), [0.0, 0.5, 1.0, 1.0], atol=0.02)


class TestStage:
    def test_the_cut_faces_the_viewer_and_turns_away(self, tmp_path: Path) -> None:
        """Of what is seen in front the nucleus and the cytosol are much, from behind nothing."""
        case = load(write_ball(tmp_path / "ball", np.zeros_like))
        stage = Stage(read_body(case.last_fields()[1], case.scene), case.scene, Paint())

        def seen(image: np.ndarray, layer: str) -> float:
            colour = np.array([int(LAYER_COLOURS[layer][i : i + 2], 16) for i in (1, 3, 5)])
            shade = image / np.maximum(image.max(axis=-1, keepdims=True), 1)
            return float(np.mean(np.linalg.norm(shade - colour / colour.max(), axis=-1) < 0.1))

        front, back = stage.image(200), stage.image(200, 225.0)
        assert seen(front, "cytosol") > 0.05
        assert seen(front, "lamina") > 0.02
        assert seen(back, "cytosol") + seen(back, "lamina") < 1e-3
        assert seen(back, "membrane") > seen(front, "membrane") > 0.02

    def test_pillars_below_the_cell_and_whole_ones_beside_it_are_drawn(self, tmp_path: Path) -> None:
        case = load(write_ball(tmp_path / "ball", np.zeros_like, **LATTICE))
        ground = Stage(read_body(case.last_fields()[1], case.scene), case.scene, Paint()).ground
        assert [colour for _, colour in ground] == [SUBSTRATE] * 4 + [FADED]
        for surface, _ in ground[:4]:
            x0, x1, y0, y1, z0, z1 = surface.bounds
            sizes = sorted((abs(x0), abs(x1))) + sorted((abs(z0), abs(z1)))
            np.testing.assert_allclose([*sizes, y0, y1], [2.5, 7.5, 2.5, 7.5, -10.0, -5.0], atol=0.05)


class TestFilesForParaView:
    def blocks(self, case: Path, out: Path) -> dict[str, Any]:
        assert write_paraview(load(case), out, "cell") == 1
        (listed,) = [Path(entry.attrib["file"]) for entry in ET.parse(out / "cell.pvd").iter("DataSet")]
        found = pyvista.read(out / listed)
        return {str(name): found[name] for name in found.keys()}

    def test_the_whole_ball_is_there_by_layer_where_it_is_now_and_its_pillars(self, tmp_path: Path) -> None:
        blocks = self.blocks(write_ball(tmp_path / "ball", lean, **LATTICE), tmp_path)
        assert list(blocks) == [*LAYER_COLOURS, "flat", "pillars"]
        quarter = pyvista.read(tmp_path / "ball" / "fields_0000.vtu").compute_cell_sizes()
        for code, name in enumerate(LAYER_COLOURS):
            volumes = blocks[name].compute_cell_sizes()["Volume"]
            expected = np.pi / 3 * (RADII[code + 1] ** 3 - RADII[code] ** 3)  # a quarter of the ball's: half as wide
            assert np.abs(volumes).sum() == pytest.approx(expected, rel=0.05)
            one = quarter["Volume"][quarter["layer"] == code]
            assert np.sum(volumes > 0) == 4 * np.sum(one > 0) > 0  # images keep the sense of what they show
        np.testing.assert_allclose(blocks["membrane"].bounds, [-5, 5, -2.5, 17.5, -5, 5], atol=1e-6)
        np.testing.assert_allclose(blocks["pillars"].bounds[2:4], [-10.0, -5.0], atol=0.1)
        across = np.unique(np.round(np.abs(blocks["pillars"].points[:, [0, 2]]) / 10 - 0.5))
        np.testing.assert_array_equal(across, [0.0, 1.0])  # in columns at 5 and 15

    def test_vectors_are_mirrored_and_numbers_are_not(self, tmp_path: Path) -> None:
        membrane = self.blocks(write_ball(tmp_path / "ball", lean), tmp_path)["membrane"]
        moved = membrane["displacement_um"]
        np.testing.assert_allclose(moved, lean(membrane.points - moved), atol=1e-6)
        np.testing.assert_allclose(
            np.log10(membrane["sigma_mises_Pa"]), (membrane.points - moved)[:, 1] / 10, atol=1e-6
        )

    def test_a_file_that_has_its_images_is_mirrored_no_further(self, tmp_path: Path) -> None:
        corners = np.array([[[0.1, 0.1, 0.1], [1, 0, 0], [0, 1, 0], [0, 0, 1]]])
        fields = {"displacement_um": lean(corners)}
        piece, blocks = packed(corners, fields, {"layer": np.zeros(1, dtype=np.int32)}, "xz")
        write_vtu(tmp_path / "fields.vtu", [piece], blocks)
        grid = read_grid(tmp_path / "fields.vtu")
        found = whole(grid, "xz")
        assert found.n_cells == 4
        moved = np.asarray(grid.points) + lean(np.asarray(grid.points))
        np.testing.assert_allclose(found.points, moved, atol=1e-6)

    def test_a_plane_cell_has_both_halves_and_the_section_of_its_substrate(self, tmp_path: Path) -> None:
        write_case(tmp_path / "yeoh", "yeoh", 0, sag)
        blocks = self.blocks(tmp_path / "yeoh", tmp_path)
        assert list(blocks) == [*LAYER_COLOURS, "flat", "pillars"]
        np.testing.assert_allclose(blocks["membrane"].bounds[:4], [-10.1, 10.1, -0.5, 18.9], atol=0.02)
        np.testing.assert_allclose(blocks["flat"].bounds, [-30, 30, -12.5, -10, 0, 0], atol=1e-6)
        np.testing.assert_allclose(blocks["pillars"].bounds, [-10, 10, -10, -0.5, 0, 0], atol=1e-6)


class TestSubstrate:
    def test_a_section_between_pillars_has_them_behind_it(self) -> None:
        scene = Scene.model_validate({"cell": {"geometry": "3d"}, **LATTICE})
        view = (-15.0, 15.0, -12.0, 20.0)
        assert len(polygons(scene, view)) == 1  # the flat
        assert {round(float(of[..., 0].mean()), 3) for of in behind(scene)} >= {-5.0, 5.0}

    def test_feet_are_as_wide_as_the_pillars(self) -> None:
        scene = Scene.model_validate({"cell": {"geometry": "3d"}, **LATTICE})
        spans = {tuple(np.ptp(foot, axis=0).round(6)) for foot in footprints(scene, (-15, 15, -15, 15))}
        assert spans == {(5.0, 5.0)}


class TestFigure:
    def test_a_ball_has_four_panels_and_says_what_became_of_the_nucleus(self, tmp_path: Path) -> None:
        figure = draw_case(load(write_ball(tmp_path / "ball", np.zeros_like)))
        names = [axes.get_title(loc="left") for axes in figure.axes]
        assert names == [
            "",
            "section z = 0 µm",
            "section y = 9.5 µm, from above",
            "from above: shadows of cell and nucleus",
        ]
        found = texts(figure)
        strains, shape = "J₁ − 3 mean 0.25, largest 0.5", "4.50 µm above the pillar tops;  height over width 0.960"
        for part in ("3-D", "t = 18,000 s", strains, shape):
            assert part in found
        for axes in figure.axes:  # true to scale, with a bar of 5 µm
            assert axes.get_aspect() == 1
            (bar,) = [line for line in axes.lines if len(line.get_xdata()) == 2]
            assert np.ptp(bar.get_xdata()) == pytest.approx(5.0)

    def test_a_plane_cell_is_its_section(self, tmp_path: Path) -> None:
        write_case(tmp_path / "yeoh", "yeoh", 0, sag)
        figure = draw_case(load(tmp_path / "yeoh"))
        assert len(figure.axes) == 1
        assert "plane strain" in texts(figure)
        assert "J₁ − 2" in texts(figure)
