"""No two texts of a figure lie on each other, nor beyond its edge, for one case and for many, slim pillars and wide."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from plot_files import write_named

from cellmech.figures.curves import draw_curves
from cellmech.figures.geometry_figure import draw_geometry
from cellmech.figures.maps import draw_maps
from cellmech.figures.outlines import draw_outlines
from cellmech.figures.panel import Panel
from cellmech.figures.results import StudyResult, read_all
from cellmech.figures.shape_figure import draw_case
from cellmech.figures.shapes import draw_shapes
from cellmech.figures.sheet import columns_of
from cellmech.figures.style import QUANTITIES, looks_of, styled, wrapped
from cellmech.results.result import load
from cellmech.scene.scene import Scene
from cellmech.scene.studies import load_study

Studies: TypeAlias = Callable[[int], StudyResult]
COUNTS = (1, 2, 4, 9, 25)
TOUCH = 1.5  # pixels that boxes of texts, which are larger than their ink, may share


def texts_of(figure: Figure) -> list[tuple[str, Bbox]]:
    """The texts that are seen, and their boxes [pixels]."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    hidden = {id(label) for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) for label in hidden_labels(axis)}
    found = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    return [(of.get_text(), of.get_window_extent(canvas.get_renderer())) for of in found if id(of) not in hidden]


def hidden_labels(axis: Axis) -> Iterator[Text]:
    """Of ticks beyond the axis, which are there but not drawn."""
    low, high = sorted(axis.get_view_interval())
    for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
        if not low <= tick.get_loc() <= high or not axis.axes.axison:
            yield from (tick.label1, tick.label2)


def clashes(figure: Figure) -> list[str]:
    found = texts_of(figure)
    edge = figure.bbox
    faults = [f"beyond the edge: {text!r}" for text, box in found if not inside(box, edge)]
    for (one, a), (other, b) in combinations(found, 2):
        across, up = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        if across > TOUCH and up > TOUCH:
            faults.append(f"{one!r} on {other!r}")
    return faults


def inside(box: Bbox, edge: Bbox) -> bool:
    return bool(box.x0 >= edge.x0 - 1 and box.x1 <= edge.x1 + 1 and box.y0 >= edge.y0 - 1 and box.y1 <= edge.y1 + 1)


@cache
def study_of(count: int, folder: Path) -> StudyResult:
    """A sweep of so many cases over two keys, read as a run has left it."""
    side = max(round(count**0.5), 1)
    rows, columns = (1, count) if side * side != count else (side, side)
    folder.mkdir()
    text = """title = "Pillars apart and stiff nuclei, to see whether a title as long as this one takes another line"
[[pillar]]
x_um = 5.0
half_width_um = 1.5
"""
    if count > 1:
        text += f"""[sweep]
"pillar.0.x_um" = {[5.0 + 0.25 * k for k in range(rows)]}
"layer.lamina.young_Pa" = {[300.0 + 75.5 * k for k in range(columns)]}
"""
    (folder / "my.toml").write_text(text)
    write_named(folder / "my", load_study(folder / "my.toml"))
    return read_all(folder / "my")


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], StudyResult]:
    """Studies by their number of cases, each written once."""
    folder = tmp_path_factory.mktemp("studies")
    return lambda count: study_of(count, folder / str(count))


DRAWN: dict[str, Callable[[StudyResult], Figure]] = {
    "shape": lambda study: draw_shapes(study, px_per_in=20),
    "magnified": lambda study: draw_shapes(study, magnify=True, px_per_in=20),
    "field": lambda study: draw_shapes(study, quantity="sigma_mises_Pa", px_per_in=20),
    "history": draw_curves,
    "outline": draw_outlines,
}


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("kind", DRAWN)
def test_no_text_lies_on_another(studies: Studies, kind: str, count: int) -> None:
    with styled():
        assert clashes(DRAWN[kind](studies(count))) == []


@pytest.mark.parametrize("count", (4, 9, 25, 100))
def test_no_text_of_a_map_lies_on_another(studies: Studies, count: int) -> None:
    with styled():
        assert clashes(draw_maps(studies(count), {})) == []


def failing(study: StudyResult) -> StudyResult:
    """Every other case stopped, for a reason as long as they are; numbers of the others lie decades apart."""
    why = (
        "ellipticity is lost at t = 5805.49 s: margin -0.0147 at reference x = 0.0918, y = 2.54 um in the cytosol " * 3
    )
    cases = {}
    for k, (name, case) in enumerate(study.cases.items()):
        rests = {"sigma_mises_max_Pa": 0.0, "J1_max": 2.0, "J2_max": 2.0, "J3_max": 1.0}
        grown = {key: rest + 1e-4 * 1e6 ** (k / len(study.cases)) for key, rest in rests.items()}
        own = {"status": "failed", "reason": why, "t_s": 5761.7} if k % 2 else {}
        cases[name] = replace(case, result={**case.result, "nucleus": {**case.result["nucleus"], **grown}, **own})
    return replace(study, cases=cases)


@pytest.mark.parametrize("count", (4, 25, 100))
def test_no_text_of_a_map_with_failures_lies_on_another(studies: Studies, count: int) -> None:
    """Two by two cases, five by five, ten by ten; what failed is told well apart from the panels' headings."""
    with styled():
        figure = draw_maps(failing(studies(count)), {})
        assert clashes(figure) == []
    found = texts_of(figure)
    (told,) = (box for text, box in found if text.startswith("not complete"))
    heading = max(box.y1 for text, box in found if text.startswith("(a)"))
    assert told.y0 - heading > 0.05 * figure.dpi


@pytest.mark.parametrize("ends_s", [(600.0,), (17800.0,), (0.0,), (600.0, 10000.0, 17800.0), (9000.0, 9100.0, 9200.0)])
def test_text_of_full_weight_is_in_its_panel_and_off_the_curves(ends_s: tuple[float, ...]) -> None:
    times = np.linspace(0.0, 18000.0, 400)
    curves = {f"{end:g}": (times, np.clip(times / max(end, 1.0), 0.0, 1.0)) for end in ends_s}
    figure = Figure(figsize=(6.8, 3.4))
    with styled():
        place, q = figure.add_gridspec(1, 1)[0], QUANTITIES[1]
        panel = Panel(figure, place, q, curves, looks_of(list(curves)), {}, "", "")
        panel.draw("a")
        panel.mark_times(ends_s, "full weight")
        found = [box for text, box in texts_of(figure) if text == "full weight"]
        lines = [line for line in panel.main.lines if line.get_linestyle() == ":"]
    assert len(lines) == sum(end > 0 for end in ends_s)
    assert len(found) == {(0.0,): 0, (9000.0, 9100.0, 9200.0): 1}.get(ends_s, len(ends_s))
    assert all(inside(box, panel.main.bbox) for box in found)
    assert not any(a.overlaps(b) for a, b in combinations(found, 2))
    for t, values in curves.values():
        points = panel.main.transData.transform(np.column_stack([t, values]))
        assert not any(box.count_contains(points) for box in found)


@pytest.mark.parametrize("quantity", [None, "sigma_mises_Pa"])
def test_no_text_of_a_case_lies_on_another(studies: Studies, quantity: str | None) -> None:
    study = studies(4)
    with styled():
        assert clashes(draw_case(next(iter(study.cases.values())), quantity)) == []


def test_name_of_a_colour_bar_stands_clear_of_it(studies: Studies) -> None:
    """Its index hung into the bar."""
    with styled():
        figure = draw_shapes(studies(4), quantity="sigma_mises_Pa", px_per_in=20)
        (name,) = (box for text, box in texts_of(figure) if "Mises" in text and "[Pa]" in text)
    bar = next(axes for axes in figure.axes if axes.bbox.height < 0.2 * figure.dpi)
    assert name.y0 > bar.bbox.y1 + 1


@pytest.mark.parametrize("shape", ["half", "full"])
@pytest.mark.parametrize("half_width", [0.5, 1.5, 4.0, 8.0])
@pytest.mark.parametrize("x", [0.0, 6.0, 11.0])
def test_no_text_of_a_geometry_lies_on_another(x: float, half_width: float, shape: str) -> None:
    if shape == "half" and 0.0 < x < half_width:
        x = half_width + 1.0
    data = {"cell": {"shape": shape}, "pillar": [{"x_um": x, "half_width_um": half_width}]}
    if shape == "full":
        data["pillar"] = [{"x_um": at, "half_width_um": half_width} for at in (-x - half_width - 1, x + half_width + 1)]
    with styled():
        assert clashes(draw_geometry(Scene.model_validate(data))) == []


def test_the_clashes_of_two_texts_are_seen() -> None:
    figure = Figure()
    figure.text(0.5, 0.5, "one")
    figure.text(0.51, 0.5, "two")
    figure.text(0.95, 0.1, "far too long")
    assert clashes(figure) == ["beyond the edge: 'far too long'", "'one' on 'two'"]


@pytest.mark.parametrize(("count", "columns"), [(1, 1), (2, 2), (4, 4), (5, 3), (7, 4), (9, 3), (25, 5), (64, 8)])
def test_panels_fill_their_rows(count: int, columns: int) -> None:
    assert columns_of(count) == columns


@pytest.mark.parametrize("count", COUNTS)
def test_panels_fill_the_width_of_their_sheet(studies: Studies, count: int) -> None:
    figure = draw_shapes(studies(count), px_per_in=20)
    places = [axes.get_position() for axes in figure.axes]
    assert min(place.x0 for place in places) * figure.get_figwidth() < 0.7
    assert (1 - max(place.x1 for place in places)) * figure.get_figwidth() < 0.3


class TestWrapped:
    def test_phrases_stay_together_where_they_can(self) -> None:
        assert wrapped("one two,  three four", 0.6, 10) == ["one two,", "three", "four"]
        assert wrapped("one two,  three four", 0.9, 10) == ["one two,", "three four"]

    def test_a_word_too_wide_is_cut_behind_a_comma_or_anywhere(self) -> None:
        assert wrapped("young=1000,height=5.5", 0.95, 10) == ["young=1000,", "height=5.5"]
        assert "".join(wrapped("a" * 100, 1.0, 10)) == "a" * 100

    def test_nothing_is_no_line(self) -> None:
        assert wrapped("", 1.0, 10) == []


def test_a_sheet_shares_one_scale_and_tells_the_stress_of_each(studies: Studies) -> None:
    study = studies(4)
    figure = draw_shapes(study, quantity="sigma_mises_Pa", px_per_in=20)
    labels = [text.get_text() for text in figure.texts]
    stresses = [case.get("nucleus.sigma_mises_max_Pa") for case in study.cases.values()]
    for stress in stresses:
        assert sum(f"up to {stress:.3g} Pa" in label.replace("\n", " ") for label in labels) == 1
    assert len(figure.axes) == 5  # with one scale


def test_a_sheet_says_of_how_many_cases_it_has_the_first(studies: Studies) -> None:
    texts = [text.get_text() for text in draw_shapes(studies(4), px_per_in=20, count=100).texts]
    assert "The first 64 of 100 cases." in texts


def test_the_largest_part_of_a_picture_is_cell_and_substrate(studies: Studies) -> None:
    """Not an empty canvas."""
    case = next(iter(studies(1).cases.values()))
    canvas = FigureCanvasAgg(draw_case(load(case.folder), "sigma_mises_Pa", 40))
    canvas.draw()
    image = np.asarray(canvas.buffer_rgba())[..., :3]
    assert np.mean(np.any(image < 250, axis=-1)) > 0.35
