"""The outlines of cell and nucleus of several cases in one drawing, true to scale."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cellmech.cell.outlines import cell_outline, nucleus_outline, points_of
from cellmech.figures.body import SUBDIVISIONS, rim_of
from cellmech.figures.results import StudyResult
from cellmech.figures.shapes import FEW_PIECES, LARGE, case_name, read_pose, scale_bar, shared_words
from cellmech.figures.sheet import UNDEFORMED
from cellmech.figures.style import FAULT_COLOUR, SMALL, SUBSTRATE, TINY, looks_of, provenance, text_width_in, wrapped
from cellmech.figures.substrate import polygons

WIDE_IN, ROW_IN = 8.2, 0.24  # of the figure; of a row of the legend
CELL_LINE, NUCLEUS_LINE = 0.9, 1.8


def draw_outlines(study: StudyResult) -> Figure:
    """Draw the outlines at the last state of each case, in space of its section; the substrate if all have the same.

    Args:
        study: its cases.

    Raises:
        InputError: for a field file that is missing or broken.
    """
    cases = study.holding("fields.pvd")
    pieces = SUBDIVISIONS if len(cases) <= LARGE else FEW_PIECES
    poses = {name: read_pose(case, pieces=pieces) for name, case in cases.items()}
    looks = looks_of(list(cases))
    first = next(iter(poses.values()))
    points = np.concatenate([pose.shape.moved(pose.pivot).reshape(-1, 2) for pose in poses.values()])
    starts = np.concatenate([pose.shape.reference.reshape(-1, 2) for pose in poses.values()])
    low, high = np.minimum(points.min(0), starts.min(0)), np.maximum(points.max(0), starts.max(0))
    r = first.case.scene.radius_um
    substrates = {repr((case.scene.pillar, case.scene.array, case.scene.flat)) for case in cases.values()}
    starts_of = {
        (*pose.centre, repr(cell_outline(pose.case.scene)), repr(nucleus_outline(pose.case.scene)))
        for pose in poses.values()
    }
    below = 0.4 if len(substrates) == 1 else 0.15
    view = float(low[0] - 0.3 * r), float(high[0] + 0.3 * r), float(low[1] - below * r), float(high[1] + 0.1 * r)
    names = {name: case_name(study, name) for name in cases}
    longest = max(text_width_in(name, SMALL) for name in names.values())
    columns = max(int((WIDE_IN - 0.3) / (max(longest, 1.3) + 0.6)), 1)
    rows = math.ceil((len(cases) + 1) / columns)
    wide = WIDE_IN - 0.3
    tall = wide * (view[3] - view[2]) / (view[1] - view[0])
    title = wrapped(study.title or study.folder.name, wide, 15, "bold")
    words = ["outlines of cell (thin) and nucleus", *shared_words(poses.values())]
    words += ["substrates differ and are not drawn"] if len(substrates) > 1 else []
    lead = wrapped(",  ".join(words), wide, SMALL + 1)
    faults = wrapped(study.complaint(400), wide, SMALL)
    head = 0.2 + 0.31 * len(title) + 0.22 * len(lead) + ROW_IN * rows + 0.25
    foot = 0.42 + 0.19 * len(faults)
    height = head + tall + foot
    figure = Figure(figsize=(WIDE_IN, height))
    axes = figure.add_axes((0.15 / WIDE_IN, foot / height, wide / WIDE_IN, tall / height), xticks=[], yticks=[])
    axes.spines[:].set_color("#aaaaaa")
    if len(substrates) == 1:
        for ground in polygons(first.case.scene, view):
            axes.add_collection(PolyCollection(list(ground), facecolor=SUBSTRATE, edgecolor=SUBSTRATE, lw=0.8))
    for name, pose in poses.items():
        corners, layer = pose.shape.moved(pose.pivot), pose.shape.layer
        for outermost, width in (("membrane", CELL_LINE), ("lamina", NUCLEUS_LINE)):
            edges = list(rim_of(corners, layer, outermost))
            line = LineCollection(edges, color=looks[name].colour, lw=width, zorder=3, gid=f"{outermost}:{name}")
            axes.add_collection(line)
    if len(starts_of) == 1:
        for outline in (cell_outline(first.case.scene), nucleus_outline(first.case.scene)):
            axes.plot(*(first.centre + points_of(outline)).T, **UNDEFORMED)
    axes.set(xlim=view[:2], ylim=view[2:], aspect="equal")
    scale_bar(axes, view, 1, wide)
    handles = [Line2D([], [], color=looks[name].colour, lw=NUCLEUS_LINE, label=names[name]) for name in cases]
    handles += [Line2D([], [], label="undeformed", **UNDEFORMED)] if len(starts_of) == 1 else []
    y = height - 0.2
    for lines, size, step, weight in ((title, 15, 0.31, "bold"), (lead, SMALL + 1, 0.22, "normal")):
        for line in lines:
            figure.text(0.02, y / height, line, fontsize=size, weight=weight, va="top")
            y -= step
    look: dict[str, Any] = dict(loc="upper left", ncol=columns, frameon=False, fontsize=SMALL, columnspacing=1.2)
    figure.legend(handles=handles, bbox_to_anchor=(0.005, (y + 0.02) / height), **look)
    for row, line in enumerate(reversed(faults)):
        figure.text(0.02, (0.34 + 0.19 * row) / height, line, fontsize=SMALL, color=FAULT_COLOUR)
    origin = wrapped(provenance(study), wide, TINY)
    figure.text(0.02, 0.12 / height, origin[0] + " …" * (len(origin) > 1), fontsize=TINY, color="#555555")
    return figure
