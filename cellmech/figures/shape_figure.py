"""The picture of one case: in space the cell cut open, its sections and its view from above; else its section."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch as Swatch

from cellmech.cell.outlines import cell_outline, nucleus_outline, points_of
from cellmech.figures.body import SUBDIVISIONS, Body, Patch, read_body
from cellmech.figures.caption import caption_in, caption_of, write_caption
from cellmech.figures.render import Colour, View, picture, probe
from cellmech.figures.shapes import FEW_PIECES, colour_bar, scale_bar
from cellmech.figures.sheet import UNDEFORMED
from cellmech.figures.space import AZIMUTH_DEG, FIELD_COLOURS, Paint, Stage, scale_of
from cellmech.figures.style import FADED, LAYER_COLOURS, SMALL, SUBSTRATE
from cellmech.figures.substrate import behind, footprints, polygons
from cellmech.results.result import Result
from cellmech.scene.scene import Scene

PX_PER_IN = 220
COARSE_PX_PER_IN = 150  # a resolution that shows no more than a few pieces of an element's edge
WIDE_IN, BELOW_IN = 7.3, 0.75  # of the section alone
FOOT: dict[str, Any] = dict(ec="#4d4d4d", lw=1.2)
PALE = "#f1b5b2"  # the cell's shadow


def draw_case(case: Result, quantity: str | None = None, px_per_in: int = PX_PER_IN, label: str = "") -> Figure:
    """Draw a case's last state, true to scale.

    Args:
        case: the case.
        quantity: a scalar of its field files to colour by; None to colour the layers.
        px_per_in: resolution.
        label: what the case is called, instead of its name.

    Raises:
        InputError: for a field that is not there, or a file that is missing or broken.
        CellmechError: when pictures cannot be drawn on this machine.
    """
    t_s, path = case.last_fields()
    body = read_body(path, case.scene, quantity, SUBDIVISIONS if px_per_in > COARSE_PX_PER_IN else FEW_PIECES)
    paint = paint_of(body, quantity)
    section = body.section()
    if body.in_space:
        probe()
        width, tall = 11.6, 9.4
    else:
        view, width = _section_view(section, case.scene), WIDE_IN + 0.3
        tall = WIDE_IN * (view[3] - view[2]) / (view[1] - view[0]) + BELOW_IN
    title, lines = caption_of(case, t_s, width - 0.4, label)
    figure = Figure(figsize=(width, tall + caption_in(title, lines)), dpi=px_per_in)
    height = figure.get_figheight()

    def place(left: float, low: float, wide: float, up: float) -> Axes:
        """Axes at a place [inches]."""
        return figure.add_axes((left / width, low / height, wide / width, up / height))

    if body.in_space:
        draw_stage(place(0.1, 0.72, 7.7, 8.6), Stage(body, case.scene, paint))
        _draw_section(place(8.0, 6.75, 3.45, 2.45), section, body, case.scene, paint)
        _draw_horizontal(place(8.0, 3.75, 3.45, 2.55), body, case.scene, paint)
        _draw_from_above(place(8.0, 0.72, 3.45, 2.55), body, case.scene)
    else:
        _draw_section(place(0.15, BELOW_IN, WIDE_IN, tall - BELOW_IN), section, body, case.scene, paint)
    write_caption(figure, title, lines, case)
    write_legend(figure, paint, quantity, feet=body.in_space)
    return figure


def paint_of(body: Body, quantity: str | None) -> Paint:
    """The colours of a body's layers, or of the field that was read with it."""
    if quantity is None:
        return Paint()
    return Paint(scale_of(body.values, quantity), matplotlib.colormaps[FIELD_COLOURS])


def draw_stage(axes: Axes, stage: Stage, azimuth_deg: float = AZIMUTH_DEG) -> None:
    """A cell in space from an azimuth, with a scale bar."""
    image = stage.image(_width_px(axes), azimuth_deg)
    axes.imshow(image, extent=stage.view, interpolation="antialiased")
    axes.set_axis_off()
    axes.set_anchor("C")
    scale_bar(axes, stage.view, 1, _width_in(axes))


def _width_in(axes: Axes) -> float:
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    return float(axes.get_position().width * figure.get_figwidth())


def _width_px(axes: Axes) -> int:
    return round(float(axes.get_figure().dpi) * _width_in(axes))


def _draw_section(axes: Axes, section: Patch, body: Body, scene: Scene, paint: Paint) -> None:
    """The cell in the plane of x and y, and what it stands on."""
    corners, view = section.now[..., :2], _section_view(section, scene)
    parts: list[tuple[np.ndarray, Colour]] = [(of, FADED) for of in behind(scene)]
    parts += [(of, SUBSTRATE) for of in polygons(scene, view)]
    _show(axes, [*parts, (corners, paint(section))], view)
    for outline in (cell_outline(scene), nucleus_outline(scene)):
        axes.plot(*(body.centre[:2] + points_of(outline)).T, **UNDEFORMED)
    if paint.norm is not None:
        draw_rim(axes, section)
    if body.in_space:
        _name(axes, f"section {_place(body, 'z')}" + (";\npillars beside it are pale" if behind(scene) else ""))


def draw_rim(axes: Axes, section: Patch, plane: tuple[int, int] = (0, 1), sign: float = 1.0) -> None:
    """The outline of the nucleus in a section, where layers have no colours of their own.

    Args:
        axes: to draw on.
        section: of the cell.
        plane: indices of the axes that run to the right and up.
        sign: -1 where the second runs down.
    """
    axes.add_collection(LineCollection(list(section.rim()[..., plane] * [1.0, sign]), color="black", lw=1.0))


def _place(body: Body, axis: str) -> str:
    level = round(body.level(axis), 2) + 0.0  # no -0
    return f"{axis} = {level:g} µm".replace("-", "−")


def _section_view(section: Patch, scene: Scene) -> View:
    both = np.concatenate([section.start, section.now])[..., :2]
    return _view(both.reshape(-1, 2), scene.radius_um, below=0.45)


def _draw_from_above(axes: Axes, body: Body, scene: Scene) -> None:
    """The shadows of cell and nucleus, z downwards, and the pillars' feet."""
    shadows = _shadows(body, scene)
    view = _view(shadows[0][0].reshape(-1, 2), scene.radius_um, below=0.1)
    _show(axes, shadows, view)
    _draw_feet(axes, scene, view)
    _name(axes, "from above: shadows of cell and nucleus")


def _draw_horizontal(axes: Axes, body: Body, scene: Scene, paint: Paint) -> None:
    """The section through the middle of the nucleus, z downwards, and the pillars' feet."""
    section = body.section("y")
    view = _view(_shadows(body, scene)[0][0].reshape(-1, 2), scene.radius_um, below=0.1)
    _show(axes, [(section.now[..., [0, 2]] * [1.0, -1.0], paint(section))], view)
    _draw_feet(axes, scene, view)
    if paint.norm is not None:
        draw_rim(axes, section, (0, 2), -1.0)
    _name(axes, f"section {_place(body, 'y')}, from above")


def _shadows(body: Body, scene: Scene) -> list[tuple[np.ndarray, Colour]]:
    """Of cell and nucleus, seen from above with z downwards."""
    shadows: list[tuple[np.ndarray, Colour]] = []
    for layer, colour in (("membrane", PALE), ("lamina", LAYER_COLOURS["lamina"])):
        patch = body.surface(layer).whole(body.mirrors)
        shadows.append((patch.now[..., [0, 2]] * [1.0, -1.0], colour))
    return shadows


def _draw_feet(axes: Axes, scene: Scene, view: View) -> None:
    for foot in footprints(scene, view):
        axes.fill(*(foot * [1.0, -1.0]).T, fc="none", **FOOT)


def _view(points: np.ndarray, radius_um: float, below: float) -> View:
    """Limits [µm] about a cell, and so many radii of what is below it."""
    (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
    return float(x0 - 0.5 * radius_um), float(x1 + 0.5 * radius_um), y0 - below * radius_um, y1 + 0.1 * radius_um


def _show(axes: Axes, parts: list[tuple[np.ndarray, Colour]], view: View) -> None:
    axes.imshow(picture(parts, view, _width_px(axes)), extent=view, interpolation="antialiased")
    axes.set(xlim=view[:2], ylim=view[2:], xticks=[], yticks=[])
    axes.spines[:].set_color("#aaaaaa")
    scale_bar(axes, view, 1, _width_in(axes))


def _name(axes: Axes, text: str) -> None:
    axes.set_title(text, fontsize=SMALL + 1, loc="left", pad=4)


def write_legend(figure: Figure, paint: Paint, quantity: str | None, sections: bool = True, feet: bool = False) -> None:
    """The layers' colours or the field's scale, and the substrate.

    Args:
        figure: to draw on.
        paint: what the cell is drawn with.
        quantity: the field, if it is one.
        sections: whether the inside of the nucleus is seen, and outlines before the load.
        feet: whether those of pillars are drawn.
    """
    handles: list[Any] = []
    if paint.norm is None:
        layers = list(LAYER_COLOURS.items())[not sections :]  # the first is the nucleoplasm
        handles += [Swatch(fc=colour, ec="none", label=name) for name, colour in layers]
    else:
        bar = figure.add_axes((0.02, 0.32 / figure.get_figheight(), 0.33, 0.12 / figure.get_figheight()))
        colour_bar(bar, paint, quantity or "")
    handles.append(Swatch(fc=SUBSTRATE, ec="none", label="substrate"))
    if feet:
        handles.append(Swatch(fc="none", label="feet of pillars", **FOOT))
    if sections:
        handles.append(Line2D([], [], label="undeformed outline", **UNDEFORMED))
    side, x = ("lower right", 0.99) if paint.norm else ("lower left", 0.01)
    look: dict[str, Any] = dict(frameon=False, fontsize=SMALL, columnspacing=1.2, handlelength=1.6)
    figure.legend(handles=handles, ncol=7, loc=side, bbox_to_anchor=(x, 0.005), **look)
