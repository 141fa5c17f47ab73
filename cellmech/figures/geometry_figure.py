"""Figure 1: the cell and its substrate before gravity acts, with the dimensions that the scene gives them."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from cellmech.cell.outlines import cell_outline, cell_shape, nucleus_outline, points_of
from cellmech.figures.style import FADED, LAYER_COLOURS, SMALL, SUBSTRATE, TINY
from cellmech.figures.substrate import behind, depth_um, footprints, outline_of, section_words
from cellmech.mechanics.obstacles import Pillar
from cellmech.scene.parts import LAYER_NAMES, LayerName
from cellmech.scene.placement import placement
from cellmech.scene.scene import Scene
from cellmech.scene.substrate import Upright, standing

ARROW: dict[str, Any] = dict(arrowstyle="<|-|>", color="black", lw=1.1, shrinkA=0, shrinkB=0, mutation_scale=11)
LABEL: dict[str, Any] = dict(boxstyle="round,pad=0.15", fc="white", ec="none", alpha=0.85)
View: TypeAlias = tuple[float, float, float, float]  # x and y limits [µm]
MAIN_IN = 6.36  # width of the drawing
INSIDE_IN = (1.0, 0.9)  # half the width of a pillar, and its height, from which on it holds the labels of its sizes
BESIDE_IN, PLACE_IN = 1.45, 2.0  # widths of labels beside it
NOTES = {
    "plane": "symmetry axis: the right half is computed, the left one mirrored",
    "axisymmetric": "the half that is computed is turned about this axis",
    "3d": "what is computed is mirrored at this plane",
}
PALE = 0.45  # opacity of the half that is mirrored


def draw_geometry(scene: Scene) -> Figure:
    """Draw a scene's cell, layers, pillars and flat at the start."""
    figure = Figure(figsize=(12.0, 8.4))
    main = figure.add_axes((0.065, 0.08, 0.53, 0.83), anchor="W")
    x, y, *_ = placement(scene).centre
    centre = (x, y)
    _draw_cell(main, scene, centre)
    view = _view(scene, centre)
    _draw_substrate(main, scene, view)
    main.set(xlim=view[:2], ylim=view[2:], xlabel="x [µm]", ylabel="y [µm]", aspect="equal")
    _radii(main, scene, centre)
    _substrate_sizes(main, scene, view)
    if "x" in scene.mirrors:
        main.axvline(0.0, color="black", lw=0.9, ls=(0, (8, 3, 1.5, 3)))
        note = NOTES[scene.cell.geometry]
        main.annotate(note, (0.0, view[3]), (0, 3), textcoords="offset points", fontsize=TINY, ha="center", va="bottom")
    if scene.cell.geometry == "3d":
        main.set_title(section_words(scene), fontsize=10.5, loc="left")
        _draw_from_above(figure.add_axes((0.675, 0.36, 0.305, 0.55)), scene, view[:2])
    else:
        if scene.nucleus is None:
            _zoom(main, scene, centre, "lamina", "t_l", 0.665)
        _zoom(main, scene, centre, "membrane", "t_m", 0.335)
    _legend(figure, scene)
    figure.text(0.065, 0.955, "Cell and substrate at t = 0 s", fontsize=15, weight="bold")
    return figure


def _draw_cell(axes: Axes, scene: Scene, centre: tuple[float, float]) -> None:
    """The layers, each over the one outside it; of a half cell the mirrored half paler."""
    halves = [((-90.0, 90.0), 1.0), ((90.0, 270.0), PALE)] if "x" in scene.mirrors else [((0.0, 360.0), 1.0)]
    for name in LAYER_NAMES:
        for angles, opacity in halves:
            part = centre + _layer(scene, name, angles)
            axes.fill(*part.T, fc=_mixed(LAYER_COLOURS[name], opacity), ec="none", lw=0, zorder=2)


def _layer(scene: Scene, name: LayerName, angles_deg: tuple[float, float], axes: str = "xy") -> np.ndarray:
    """Outside of a layer between two angles, and its middle beside a quarter, from the cell's centre [µm]."""
    outline = cell_outline(scene) if name in LAYER_NAMES[:2] else nucleus_outline(scene)
    shell = scene.radius_um if name in LAYER_NAMES[:2] else scene.nucleus_radius_um
    middle = np.array([outline.offset["xyz".index(axis)] for axis in axes])
    way = points_of(outline, angles_deg, axes) - middle
    found = middle + way * (1 - (shell - scene.outer_radius_um(name)) / np.linalg.norm(way, axis=1))[:, None]
    return np.vstack([found, middle]) if np.ptp(angles_deg) < 180 else found


def _draw_from_above(axes: Axes, scene: Scene, sides: tuple[float, float]) -> None:
    """Cell, nucleus and the feet of the pillars, x to the right and z downwards; what is mirrored is paler."""
    x, _, z = placement(scene).centre
    half = (sides[1] - sides[0]) / 2
    solid = {"": (0.0, 360.0), "x": (-90.0, 90.0), "xz": (0.0, 90.0)}[scene.mirrors]
    names: tuple[LayerName, ...] = ("membrane", "lamina")
    for name in names:
        for angles, opacity in (((0.0, 360.0), PALE), (solid, 1.0)):
            part = np.array([x, z]) + _layer(scene, name, angles, "xz")
            axes.fill(*part.T, fc=_mixed(LAYER_COLOURS[name], opacity), ec="none", lw=0)
    for foot in footprints(scene, (x - half, x + half, z - half, z + half)):
        axes.fill(*foot.T, fc="none", ec="#4d4d4d", lw=1.2)
    axes.set(xlim=(x - half, x + half), ylim=(z + half, z - half), xlabel="x [µm]", ylabel="z [µm]", aspect="equal")
    axes.set_title("from above: cell, nucleus, feet of pillars", fontsize=10.5, loc="left")


def _mixed(colour: str, opacity: float) -> tuple[float, ...]:
    """The colour on white: overlapping patches would show through."""
    rgb = np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return tuple(opacity * rgb + 1 - opacity)


def _view(scene: Scene, centre: tuple[float, float]) -> View:
    """x and y limits [µm]: the cell, and the substrate beside and below it."""
    (wide, high), r = scene.semi_axes_um, scene.radius_um
    arches = [stand.arch for stand in standing(scene)]
    bottoms = [scene.flat.y_um] if scene.flat is not None else [arch.y_um for arch in arches] or [centre[1] - high]
    sides = [abs(arch.x_um - centre[0]) + arch.half_width_um for arch in arches]
    half = min(max([1.35 * wide, *(side + 0.35 * r for side in sides)]), 4 * r)
    low = max(min(bottoms), centre[1] - 6 * r) - 0.25 * r
    return centre[0] - half, centre[0] + half, low, centre[1] + 1.12 * high


def _draw_substrate(axes: Axes, scene: Scene, view: View) -> None:
    for one in standing(scene):
        outline = outline_of(one.arch, depth_um(scene))
        if len(outline):
            axes.fill(*outline.T, fc=SUBSTRATE, ec="#6d6d6d", lw=1.2, zorder=1)
        elif not isinstance(one.arch, Pillar):  # beside the plane of the section
            axes.fill(*outline_of(one.arch, one.arch.z_um).T, fc=FADED, ec="#9d9d9d", lw=0.8, zorder=0.5)
    if scene.flat is not None:
        low = view[2] - 1.0
        axes.add_patch(
            Rectangle(
                (view[0], low), view[1] - view[0], scene.flat.y_um - low, fc=SUBSTRATE, ec="#6d6d6d", lw=1.2, zorder=1.5
            )
        )


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], **more: Any) -> None:
    axes.annotate("", end, start, arrowprops=ARROW | more, zorder=5, annotation_clip=False)


def _length(value: float) -> str:
    return f"{_number(value)} µm"


def _number(value: float) -> str:
    return f"{value:g}".replace("-", "−")


def _radii(axes: Axes, scene: Scene, centre: tuple[float, float]) -> None:
    """r_c, of a flattened cell half its width and height, and r_n from the centre, and the centre's place."""
    axes.plot(*centre, "o", ms=4, color="black", zorder=6)
    text = f"centre ({_number(centre[0])}, {_number(round(centre[1], 3))}) µm"
    _say(axes, text, centre, (-6, -9), ha="right", va="top", fontsize=SMALL, bbox=LABEL)
    # the label of r_c stands in the cytosol, that of r_n outside the nucleus: neither covers a thin layer
    beside, wide, high = (7, -4), *(float(f"{half:.4g}") for half in scene.semi_axes_um)
    radii = [("r_c", scene.radius_um, 62, 0.62, beside)]
    if scene.cell.aspect != 1.0:
        radii = [("a_c", wide, 180, 0.95, (0, 9)), ("b_c", high, 90, 0.72, beside)]
    if scene.nucleus is None:
        radii.append(("r_n", scene.nucleus_radius_um, -38, 1.0, beside))
    for symbol, radius, angle, share, offset in radii:
        dx, dy = radius * math.cos(math.radians(angle)), radius * math.sin(math.radians(angle))
        _arrow(axes, centre, (centre[0] + dx, centre[1] + dy), arrowstyle="-|>")
        at = (centre[0] + share * dx, centre[1] + share * dy)
        _say(axes, f"${symbol}$ = {_length(radius)}", at, offset, va="center")


def _substrate_sizes(axes: Axes, scene: Scene, view: View) -> None:
    """Sizes of the pillar nearest to the cell, y_flat, the gap."""
    left = True  # of the pillar's place is free for y_flat
    if arches := [one.arch for one in standing(scene)]:
        middle = (view[0] + view[1]) / 2
        first = min(arches, key=lambda arch: (round(abs(arch.x_um - middle), 9), -arch.x_um))
        _pillar_sizes(axes, first, view, middle + 0.8 * scene.radius_um)
        left = first.x_um >= middle
    if scene.flat is not None:
        at, offset, side = (view[0], 6, "left") if left else (view[1], -6, "right")
        text = f"$y_{{flat}}$ = {_length(scene.flat.y_um)}"
        _say(axes, text, (at, scene.flat.y_um), (offset, -4), ha=side, va="top")
    if scene.cell.gap_um:
        text = f"gap to first touch = {_length(scene.cell.gap_um)}"
        _say(axes, text, (view[1], view[3]), (-6, -6), ha="right", va="top", fontsize=SMALL)


def _pillar_sizes(axes: Axes, pillar: Upright, view: View, clear: float) -> None:
    """w_mp, h_mp and the place of a pillar; beside it where it is too slim to hold them."""
    x, y, w, h = pillar.x_um, pillar.y_um, pillar.half_width_um, pillar.height_um
    inch = (view[1] - view[0]) / MAIN_IN  # [µm]
    across = y + 0.3 * h
    wide = w > INSIDE_IN[0] * inch and (h > INSIDE_IN[1] * inch or w > 1.3 * INSIDE_IN[0] * inch)
    size = f"$w_{{mp}}$ = {_length(w)}"
    if wide:
        up, side = x - 0.35 * w, "center"
        at = (up, y + 0.68 * h)
        _say(axes, size, (x + 0.5 * w, across), (0, 5), ha="center")
        _say(axes, "half the width", (x + 0.5 * w, across), (0, -5), ha="center", va="top", fontsize=SMALL)
    elif x + w + BESIDE_IN * inch > view[1] and x - w > clear:  # far from the cell: above it
        middle, top = min(x, view[1] - 0.7 * inch), y + h
        up, at, side = x - w - 0.12 * inch, (middle, top + 0.58 * inch), "center"
        _say(axes, size, (middle, top + 0.3 * inch), (0, 0), ha=side, va="center")
        _say(axes, "half the width", (middle, top + 0.12 * inch), (0, 0), ha=side, va="center", fontsize=SMALL)
    else:
        right = x + w + BESIDE_IN * inch < view[1]
        out, side = (1, "left") if right else (-1, "right")
        up = x + out * (w + 0.12 * inch)
        at = (up + out * 0.08 * inch, max(y + (0.75 if right else 0.55) * h, across + 0.4 * inch))
        look: dict[str, Any] = dict(ha=side, bbox=LABEL)
        _say(axes, size, (up, across), (6 * out, 1), va="bottom", **look)
        _say(axes, "half the width", (up, across), (6 * out, -3), va="top", fontsize=SMALL, **look)
    _arrow(axes, (x, across), (x + w, across))
    _arrow(axes, (up, y), (up, y + h))
    _say(axes, f"$h_{{mp}}$ = {_length(h)}", at, (0, 0), ha=side, va="center", bbox=LABEL)
    axes.plot([x], [y], "+", ms=9, mew=1.4, color="black", zorder=6)
    text = f"$(x_{{mp}}, y_{{mp}})$ = ({_number(x)}, {_number(y)}) µm"
    room = x + PLACE_IN * inch < view[1]
    _say(axes, text, (x, y), (7 if room else -7, -4), ha="left" if room else "right", va="top", fontsize=SMALL)


def _say(axes: Axes, text: str, at: tuple[float, float], offset: tuple[float, float], **look: Any) -> None:
    """A label at a place of the drawing, shifted by an offset in points."""
    axes.annotate(text, at, offset, textcoords="offset points", zorder=6, **({"fontsize": 11.5} | look))


def _zoom(main: Axes, scene: Scene, centre: tuple[float, float], name: LayerName, symbol: str, bottom: float) -> None:
    """A magnified look at a thin layer where it crosses the height of the centre, with its thickness."""
    figure, box = main.figure, (0.665, bottom, 0.31, 0.235)
    wider = scene.semi_axes_um[0] - scene.radius_um if name in LAYER_NAMES[:2] else 0.0
    outer, inner = scene.outer_radius_um(name) + wider, scene.inner_radius_um(name) + wider
    thickness, middle = outer - inner, centre[0] + (outer + inner) / 2
    width = 4.0 * thickness
    height = width * box[3] / box[2] * figure.get_figheight() / figure.get_figwidth()
    axes = figure.add_axes(box)
    _draw_cell(axes, scene, centre)
    low = centre[1] - height / 2
    axes.set(xlim=(middle - width / 2, middle + width / 2), ylim=(low, low + height), yticks=[])
    axes.tick_params(labelsize=TINY)
    axes.set_xlabel("x [µm]", fontsize=TINY, labelpad=1)
    main.apply_aspect()
    times = (main.get_xlim()[1] - main.get_xlim()[0]) / main.get_position().width * box[2] / width
    axes.set_title(f"{name}, {_rounded(times)} times larger", fontsize=10.5, loc="left")
    _arrow(axes, (centre[0] + inner, centre[1]), (centre[0] + outer, centre[1]))
    _say(axes, f"${symbol}$ = {_length(round(thickness, 9))}", (middle, centre[1]), (0, 10), ha="center", bbox=LABEL)
    index = LAYER_NAMES.index(name)
    for side, text in ((-1, LAYER_NAMES[index + 1]), (1, LAYER_NAMES[index - 1] if index else "outside")):
        at = (middle + side * 0.31 * width, low)
        _say(axes, text, at, (0, 18), ha="center", fontsize=SMALL, bbox=LABEL)
    w, h = (max(0.03 * scene.radius_um, size) for size in (width, height))
    main.add_patch(Rectangle((middle - w / 2, centre[1] - h / 2), w, h, fc="none", ec="black", lw=1, zorder=7))
    line = dict(arrowstyle="-", color="black", lw=0.8, shrinkA=0, shrinkB=0)
    ends: dict[str, Any] = dict(xy=(0.0, 0.5), xycoords=axes.transAxes, xytext=(middle + w / 2, centre[1]))
    main.annotate("", **ends, textcoords="data", arrowprops=line, zorder=7)


def _rounded(times: float) -> str:
    return f"{times:.2g}" if times < 100 else f"{round(times, -1):,.0f}"


def _legend(figure: Figure, scene: Scene) -> None:
    """The layers from the inside out, with their stiffness and fluid fraction."""
    handles = []
    for name in reversed(LAYER_NAMES):
        layer = scene.layer_of(name)
        text = f"{name}:  E = {layer.young_Pa:,g} Pa,  fluid fraction {layer.fluid_fraction:g}"
        shell = scene.inner_radius_um(name) > 0.0 and (name != "cytosol" or cell_shape(scene) is None)
        if scene.cell.geometry == "3d" and shell:  # else a zoom shows it
            text += f",  {_length(round(scene.outer_radius_um(name) - scene.inner_radius_um(name), 9))} thick"
        handles.append(Patch(fc=LAYER_COLOURS[name], ec="none", label=text))
    handles.append(Patch(fc=SUBSTRATE, ec="#6d6d6d", label="substrate: micropillar and flat (rigid)"))
    if behind(scene):
        handles.append(Patch(fc=FADED, ec="#9d9d9d", label="pillars beside the section"))
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.645, 0.045), frameon=False, fontsize=9)
