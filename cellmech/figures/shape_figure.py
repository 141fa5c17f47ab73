"""The picture of one case: in space the cell cut open, its section and its view from above; else its section."""

from __future__ import annotations

import math
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch as Swatch

from cellmech.figures.body import Body, Patch, read_body
from cellmech.figures.render import Colour, View, picture, probe
from cellmech.figures.shapes import scale_bar
from cellmech.figures.sheet import UNDEFORMED
from cellmech.figures.space import AZIMUTH_DEG, Paint, Stage, scale_of
from cellmech.figures.style import FADED, FAULT_COLOUR, LAWS, LAYER_COLOURS, SMALL, SUBSTRATE
from cellmech.figures.substrate import behind, footprints, polygons
from cellmech.results.result import Result
from cellmech.scene.scene import Scene

PX_PER_IN = 220
WIDE_IN, ABOVE_IN, BELOW_IN = 7.3, 1.05, 0.75  # of the section alone
FIELD_COLOURS = "viridis"
PALE = "#f1b5b2"  # the cell's shadow
KINDS = {"plane": "plane strain", "axisymmetric": "axisymmetric", "3d": "3-D"}


def draw_case(case: Result, quantity: str | None = None) -> Figure:
    """Draw a case's last state, true to scale.

    Args:
        case: the case.
        quantity: a scalar of its field files to colour by; None to colour the layers.

    Raises:
        InputError: for a field that is not there, or a file that is missing or broken.
        CellmechError: when pictures cannot be drawn on this machine.
    """
    t_s, path = case.last_fields()
    body = read_body(path, case.scene, quantity)
    probe()
    paint = paint_of(body, quantity)
    section = body.section()
    if body.in_space:
        figure = Figure(figsize=(12.4, 8.3))
        draw_stage(figure.add_axes((0.01, 0.085, 0.585, 0.79)), Stage(body, case.scene, paint))
        _draw_section(figure.add_axes((0.62, 0.475, 0.37, 0.4)), section, body, case.scene, paint)
        _draw_from_above(figure.add_axes((0.62, 0.085, 0.37, 0.36)), body, case.scene)
    else:
        view = _section_view(section, case.scene)
        tall = WIDE_IN * (view[3] - view[2]) / (view[1] - view[0])
        figure = Figure(figsize=(WIDE_IN + 0.3, tall + ABOVE_IN + BELOW_IN))
        box = (0.15 / (WIDE_IN + 0.3), BELOW_IN, WIDE_IN / (WIDE_IN + 0.3), tall)
        height = figure.get_figheight()
        axes = figure.add_axes((box[0], box[1] / height, box[2], box[3] / height))
        _draw_section(axes, section, body, case.scene, paint)
    write_caption(figure, case, t_s)
    write_legend(figure, paint, quantity)
    return figure


def paint_of(body: Body, quantity: str | None) -> Paint:
    """The colours of a body's layers, or of the field that was read with it."""
    if quantity is None:
        return Paint()
    return Paint(scale_of(body.values, quantity), matplotlib.colormaps[FIELD_COLOURS])


def draw_stage(axes: Axes, stage: Stage, px_per_in: int = PX_PER_IN, azimuth_deg: float = AZIMUTH_DEG) -> None:
    """A cell in space from an azimuth, with a scale bar."""
    image = stage.image(round(px_per_in * _width_in(axes)), azimuth_deg)
    axes.imshow(image, extent=stage.view, interpolation="antialiased")
    axes.set_axis_off()
    axes.set_anchor("C")
    scale_bar(axes, stage.view, 1)


def _width_in(axes: Axes) -> float:
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    return float(axes.get_position().width * figure.get_figwidth())


def _draw_section(axes: Axes, section: Patch, body: Body, scene: Scene, paint: Paint) -> None:
    """The cell in the plane of x and y, and what it stands on."""
    corners, view = section.now[..., :2], _section_view(section, scene)
    parts: list[tuple[np.ndarray, Colour]] = [(of, FADED) for of in behind(scene)]
    parts += [(of, SUBSTRATE) for of in polygons(scene, view)]
    _show(axes, [*parts, (corners, paint(section))], view)
    circle = _circle()
    for radius in (scene.radius_um, scene.nucleus_radius_um):
        axes.plot(*(body.centre[:2] + radius * circle).T, **UNDEFORMED)
    _name(axes, "section; pillars beside it are pale" if body.in_space else "")


def _section_view(section: Patch, scene: Scene) -> View:
    both = np.concatenate([section.start, section.now])[..., :2]
    return _view(both.reshape(-1, 2), scene.radius_um, below=0.45)


def _draw_from_above(axes: Axes, body: Body, scene: Scene) -> None:
    """The shadows of cell and nucleus, z downwards, and the pillars' feet."""
    spheres = ((scene.radius_um, "membrane", PALE), (scene.nucleus_radius_um, "lamina", LAYER_COLOURS["lamina"]))
    shadows: list[tuple[np.ndarray, Colour]] = []
    for radius, layer, colour in spheres:
        patch = body.surface(radius, layer).whole(body.mirrors)
        shadows.append((patch.now[..., [0, 2]] * [1.0, -1.0], colour))
    view = _view(shadows[0][0].reshape(-1, 2), scene.radius_um, below=0.1)
    _show(axes, shadows, view)
    for foot in footprints(scene, view):
        axes.fill(*(foot * [1.0, -1.0]).T, fc="none", ec="#4d4d4d", lw=1.2)
    _name(axes, "from above: shadows of nucleus and cell, feet of pillars")


def _circle() -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, 361)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _view(points: np.ndarray, radius_um: float, below: float) -> View:
    """Limits [µm] about a cell, and so many radii of what is below it."""
    (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
    return float(x0 - 0.5 * radius_um), float(x1 + 0.5 * radius_um), y0 - below * radius_um, y1 + 0.1 * radius_um


def _show(axes: Axes, parts: list[tuple[np.ndarray, Colour]], view: View) -> None:
    axes.imshow(picture(parts, view, round(PX_PER_IN * _width_in(axes))), extent=view, interpolation="antialiased")
    axes.set(xlim=view[:2], ylim=view[2:], xticks=[], yticks=[])
    axes.spines[:].set_color("#aaaaaa")
    scale_bar(axes, view, 1)


def _name(axes: Axes, text: str) -> None:
    axes.set_title(text, fontsize=SMALL + 1, loc="left", pad=4)


def write_caption(figure: Figure, case: Result, t_s: float) -> None:
    """What the case is, the state that is shown, and what became of the nucleus."""
    height, scene = figure.get_figheight(), case.scene
    laws = ", ".join(LAWS[law].label for law in scene.laws())
    state = f"t = {t_s:,.0f} s" if not case.failure else f"FAILED: last state, t = {t_s:,.0f} s"
    lines = [
        f"{KINDS[scene.cell.geometry]},  {laws},  load × {scene.load.factor:g},  {state}",
        nucleus_words(case),
    ]
    figure.text(0.02, 1 - 0.36 / height, scene.title or case.name, fontsize=15, weight="bold")
    for index, line in enumerate(lines):
        colour = FAULT_COLOUR if case.failure and not index else "black"
        figure.text(0.02, 1 - (0.64 + 0.25 * index) / height, line, fontsize=SMALL + 1, color=colour)


def nucleus_words(case: Result) -> str:
    """Strain and shape of the nucleus in one line, of what result.json has."""
    rest = case.rest("J1")
    mean, largest = (case.get(f"nucleus.J1_{of}") - rest for of in ("mean", "max"))
    words = [f"J₁ − {rest:g}:  mean {_signed(mean, '.3g')},  largest {_signed(largest, '.3g')}"]
    deep, aspect = (case.get(f"nucleus_shape.{key}") for key in ("indentation_um", "aspect"))
    if math.isfinite(deep):
        words.append(f"{abs(deep):.2f} µm {'below' if deep > 0 else 'above'} the pillar tops")
    if math.isfinite(aspect):
        words.append(f"height over width {aspect:.3f}")
    return "nucleus:  " + ";  ".join(words)


def _signed(value: float, form: str) -> str:
    return format(value, form).replace("-", "−") if math.isfinite(value) else "–"


def write_legend(figure: Figure, paint: Paint, quantity: str | None, outlines: bool = True) -> None:
    """The layers' colours or the field's scale, the substrate and, if drawn, the outlines before the load."""
    handles: list[Any] = []
    if paint.norm is None:
        handles += [Swatch(fc=colour, ec="none", label=name) for name, colour in LAYER_COLOURS.items()]
    else:
        bar = figure.add_axes((0.02, 0.32 / figure.get_figheight(), 0.33, 0.12 / figure.get_figheight()))
        figure.colorbar(ScalarMappable(paint.norm, paint.colours), cax=bar, orientation="horizontal", extend="min")
        bar.tick_params(labelsize=SMALL - 1, pad=1)
        bar.set_title(quantity or "", fontsize=SMALL, pad=2)
    handles.append(Swatch(fc=SUBSTRATE, ec="none", label="substrate"))
    if outlines:
        handles.append(Line2D([], [], label="undeformed outline", **UNDEFORMED))
    side, x = ("lower right", 0.99) if paint.norm else ("lower left", 0.01)
    look: dict[str, Any] = dict(frameon=False, fontsize=SMALL, columnspacing=1.2, handlelength=1.6)
    figure.legend(handles=handles, ncol=6, loc=side, bbox_to_anchor=(x, 0.005), **look)
