"""The words above the picture of one case: what is shown, what pulls, what became of nucleus and contact."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.figure import Figure

from cellmech.figures.style import FAULT_COLOUR, LAWS, SMALL, wrapped
from cellmech.results.result import Result
from cellmech.scene.driver_parts import Adhesion
from cellmech.scene.scene import Scene

TITLE_SIZE, TITLE_IN, LINE_IN = 15, 0.3, 0.22  # font size, heights of lines
KINDS = {"plane": "plane strain", "axisymmetric": "axisymmetric", "3d": "3-D"}


def caption_of(case: Result, t_s: float, width_in: float, label: str = "") -> tuple[list[str], list[str]]:
    """Lines no wider than so many inches: title; then the model, the state that is shown, what became of the cell.

    Args:
        case: the case.
        t_s: the time of the state [s].
        width_in: of a line [inches].
        label: what the case is called, instead of its name.
    """
    scene = case.scene
    laws = ", ".join(LAWS[law].label for law in scene.laws())
    state = f"t = {t_s:,.0f} s" if not case.failure else f"FAILED: last state, t = {t_s:,.0f} s"
    texts = [f"{KINDS[scene.cell.geometry]},  {laws},  load × {scene.load.factor:g},  {state}"]
    texts += [",  ".join(drivers_words(scene))] if scene.drivers else []
    texts += [nucleus_words(case), contact_words(case)]
    alone = case.folder.name == case.folder.parent.name  # a scene of its own, not one case of a study
    title = scene.title if scene.title and alone else ":  ".join(filter(None, (scene.title, label or case.name)))
    lines = [line for text in texts for line in wrapped(text, width_in, SMALL + 1)]
    return wrapped(title, width_in, TITLE_SIZE, "bold"), lines


def caption_in(title: Sequence[str], lines: Sequence[str]) -> float:
    """Height that a caption takes [inches]."""
    return 0.28 + TITLE_IN * len(title) + LINE_IN * len(lines)


def write_caption(figure: Figure, title: Sequence[str], lines: Sequence[str], case: Result) -> None:
    """The lines of `caption_of` at the top of a figure."""
    height = figure.get_figheight()
    for index, line in enumerate(title):
        figure.text(0.02, 1 - (0.36 + TITLE_IN * index) / height, line, fontsize=TITLE_SIZE, weight="bold")
    top = 0.36 + TITLE_IN * (len(title) - 1) + 0.27
    for index, line in enumerate(lines):
        colour = FAULT_COLOUR if case.failure and not index else "black"
        figure.text(0.02, 1 - (top + LINE_IN * index) / height, line, fontsize=SMALL + 1, color=colour)


def drivers_words(scene: Scene) -> list[str]:
    """What pulls besides the weight."""
    words = []
    for _, one in scene.drivers:
        if isinstance(one, Adhesion):
            words.append(f"adhesion {one.work_uJ_m2:g} µJ/m² within {one.range_um:g} µm")
        else:
            words.append(f"actin {one.where} {one.told}")
    return words


def nucleus_words(case: Result) -> str:
    """Strain and shape of the nucleus in one line, of what result.json has."""
    rest = case.rest("J1")
    mean, largest = (case.get(f"nucleus.J1_{of}") - rest for of in ("mean", "max"))
    stress = case.get("nucleus.sigma_mises_max_Pa")
    words = [f"σ up to {stress:.3g} Pa"] if math.isfinite(stress) else []
    words.append(f"J₁ − {rest:g} mean {_signed(mean, '.3g')}, largest {_signed(largest, '.3g')}")
    deep, aspect = (case.get(f"nucleus_shape.{key}") for key in ("indentation_um", "aspect"))
    if math.isfinite(deep):
        words.append(f"{abs(deep):.2f} µm {'below' if deep > 0 else 'above'} the pillar tops")
    if math.isfinite(aspect):
        words.append(f"height over width {aspect:.3f}")
    return "nucleus: " + ";  ".join(words)


def contact_words(case: Result) -> str:
    """Force of the contact and penetration; "" without one."""
    unit = "Pa µm" if case.scene.cell.geometry == "plane" else "pN"
    force = case.get("contact.force_Pa_x_um" if unit == "Pa µm" else "contact.force_pN")
    depth = case.get("contact.max_depth_um")
    words = [f"force {force:.3g} {unit}"] if math.isfinite(force) else []
    words += [f"penetration {depth:.2g} µm"] if math.isfinite(depth) else []
    return "contact: " + ";  ".join(words) if words else ""


def _signed(value: float, form: str) -> str:
    return format(value, form).replace("-", "−") if math.isfinite(value) else "–"
