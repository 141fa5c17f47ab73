"""Films as animated GIFs: figures one after the other, and a cell in space that turns once about the vertical."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from cellmech.errors import InputError
from cellmech.figures.body import read_body
from cellmech.figures.caption import caption_in, caption_of, write_caption
from cellmech.figures.render import probe
from cellmech.figures.shape_figure import draw_stage, paint_of, write_legend
from cellmech.figures.space import AZIMUTH_DEG, Stage
from cellmech.results.records import PARTIAL
from cellmech.results.result import Result

ALIKE = 0xF8F8F8  # what two colours share that Pillow may take one for the other
SAMPLED, EXACT = 6, 64  # pictures from which a film's colours are taken, and how many of these stay as they are
FILM_IN, FILM_DPI, TURNS, TURN_MS = 6.4, 110, 36, 120  # of a turn: width, resolution, pictures, each shown so long


def write_film(figures: Iterable[Figure], path: Path, frame_ms: int, last_ms: int) -> int:
    """Write figures of one size as a film, whole or not at all; the number of its pictures is returned.

    Raises:
        InputError: when the file cannot be written.
    """
    pictures = []
    for figure in figures:
        figure.set_dpi(FILM_DPI)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy()))
    colours = _colours(pictures)
    pictures = [picture.quantize(palette=colours, dither=Image.Dither.NONE) for picture in pictures]
    times = [frame_ms] * (len(pictures) - 1) + [last_ms]
    partial = path.with_name(f"{PARTIAL}{os.getpid()}-{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        pictures[0].save(partial, format="GIF", save_all=True, append_images=pictures[1:], duration=times, loop=0)
        partial.replace(path)
    except OSError as error:
        raise InputError("--out", str(path), f"cannot be written ({error.strerror or error})") from None
    finally:
        partial.unlink(missing_ok=True)
    return len(pictures)


def _colours(pictures: list[Image.Image]) -> Image.Image:
    """An image whose palette serves all pictures: if each had its own, what stands still would change colour.

    The colours of the largest areas are in it as they are, such as white and those of a legend.
    """
    some = np.concatenate([np.asarray(of).reshape(-1, 3) for of in pictures[:: -(-len(pictures) // SAMPLED)]])
    packed, area = np.unique(some @ np.array([1 << 16, 1 << 8, 1]), return_counts=True)
    colours = np.stack([packed >> 16, packed >> 8, packed], axis=1).astype(np.uint8)
    order, like = np.argsort(-area), packed & ALIKE
    kept = order[np.sort(np.unique(like[order], return_index=True)[1])[:EXACT]]
    other = ~np.isin(like, like[kept])
    sheet = np.repeat(colours[other], np.ceil(np.sqrt(area[other])).astype(int), axis=0)
    shades: list[int] = []
    if len(sheet):
        mixed = Image.fromarray(sheet[None]).quantize(256 - EXACT, method=Image.Quantize.MEDIANCUT)
        shades = (mixed.getpalette() or [])[: 3 * (256 - EXACT)]
    found = Image.new("P", (1, 1))
    found.putpalette([*colours[kept].ravel().tolist(), *shades])
    return found


def make_turntable(case: Result, path: Path, quantity: str | None = None) -> int:
    """Write a film of a case's last state from all sides; the number of its pictures is returned.

    Args:
        case: a case in space.
        path: of the film.
        quantity: a scalar of its field files to colour by; None to colour the layers.

    Raises:
        InputError: for a case that is not in space, a field that is not there, a file that is broken or cannot be
            written.
        CellmechError: when pictures cannot be drawn on this machine.
    """
    if case.scene.cell.geometry != "3d":
        rule, hint = "must be 3d for a turntable", "The figure `shape` draws its section, and `movie` its way there."
        raise InputError(str(case.folder / "scene.toml"), "cell.geometry", rule, case.scene.cell.geometry, hint)
    t_s, file = case.last_fields()
    body = read_body(file, case.scene, quantity)
    probe()
    paint = paint_of(body, quantity)
    stage = Stage(body, case.scene, paint)
    title, lines = caption_of(case, t_s, FILM_IN - 0.3)

    def seen_from(azimuth_deg: float) -> Figure:
        height = 6.05 + caption_in(title, lines)
        figure = Figure(figsize=(FILM_IN, height), dpi=FILM_DPI)
        draw_stage(figure.add_axes((0.02, 0.58 / height, 0.96, 5.47 / height)), stage, azimuth_deg)
        write_caption(figure, title, lines, case)
        write_legend(figure, paint, quantity, sections=False)
        return figure

    angles = AZIMUTH_DEG + np.arange(TURNS) * 360.0 / TURNS
    return write_film(map(seen_from, angles.tolist()), path, TURN_MS, TURN_MS)
