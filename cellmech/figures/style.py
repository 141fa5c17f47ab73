"""Colours, names and rest values that the figures share, and the saving of a figure."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cellmech.surroundings import changed_environment

try:
    import matplotlib
except ValueError:  # MPLBACKEND names what is no backend; figures are files and need none
    for name in [name for name in sys.modules if name.startswith("matplotlib")]:
        del sys.modules[name]  # half loaded
    with changed_environment({"MPLBACKEND": None}):
        import matplotlib
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from cellmech.errors import InputError
from cellmech.figures.results import StudyResult
from cellmech.mechanics import laws
from cellmech.results.records import PARTIAL
from cellmech.results.result import Result

DPI = 200
PAPER = "Allena & Aubry 2022"
RC = {
    "font.family": "DejaVu Sans",
    "font.size": 11,
    "axes.titlesize": 12,
    "axes.labelsize": 11.5,
    "mathtext.default": "regular",
    "pdf.fonttype": 42,  # text stays text in the PDF
    "svg.fonttype": "none",
}
SMALL, TINY = 9.5, 8.5  # font sizes
MOST_NAMED = 4  # cases in a line of small print

LAYER_COLOURS = {  # the paper's, from the inside out; the index is the code in the field files
    "nucleoplasm": "#3a76c4",
    "lamina": "#f5921e",
    "cytosol": "#7cc47f",
    "membrane": "#d5312b",
}
SUBSTRATE = "#b9b9b9"
FADED = "#dcdcdc"  # the substrate where it is not drawn true
FAULT_COLOUR = "#a00000"


@dataclass(frozen=True)
class LawStyle:
    """Drawing style of a law: curves that coincide stay apart by width, dash and order (the thinnest on top)."""

    label: str
    colour: str
    width: float
    dash: tuple[float, tuple[float, ...]] | str
    order: float


LINES: dict[str, tuple[float, Any, float]] = {  # width, dash, order
    "saint-venant": (1.5, "-", 2.6),
    "neo-hookean": (6.0, "-", 2.1),
    "mooney-rivlin": (3.2, (0, (3.0, 1.8)), 2.3),
    "yeoh": (2.2, (0, (7, 1.5, 1.5, 1.5)), 2.5),
}
OTHER_LINE = (1.8, (0, (4, 2)), 2.55)
OTHER_COLOURS = "viridis"
LAWS = {name: LawStyle(law.label, law.colour, *LINES.get(name, OTHER_LINE)) for name, law in laws.LAWS.items()}


def looks_of(names: Sequence[str]) -> dict[str, LawStyle]:
    """How to draw the curves of cases: those that are laws as always, others in colours from dark to light."""
    others = [name for name in names if name not in LAWS]
    shades = matplotlib.colormaps[OTHER_COLOURS](np.linspace(0.0, 0.88, max(len(others), 1)))
    looks = {name: LawStyle(name, to_hex(shade), 1.8, "-", 2.5) for name, shade in zip(others, shades, strict=False)}
    return {name: LAWS.get(name) or looks[name] for name in names}


@dataclass(frozen=True)
class Quantity:
    """A reported quantity: its key in result files, its key among the paper's numbers, its rest value in the plane."""

    key: str
    paper_key: str
    rest: float
    unit: str
    symbol: str
    meaning: str

    @property
    def suffix(self) -> str:
        """The end of its keys in result files."""
        return f"_{self.unit}" if self.unit else ""


QUANTITIES = (
    Quantity("sigma_mises", "sigma", 0.0, "Pa", r"$\sigma_\mathrm{Mises}$", "von Mises stress (Cauchy)"),
    Quantity("J1", "J1", 2.0, "", "$J_1$", "stretch of fibres, tr C"),
    Quantity("J2", "J2", 2.0, "", "$J_2$", "shear and stretch, tr C²"),
    Quantity("J3", "J3", 1.0, "", "$J_3$", "change of surface, det C"),
)


def rests(cases: Iterable[Result]) -> str:
    """The values of J1, J2, J3 in these cases where nothing is deformed."""
    found = sorted({tuple(f"{case.rest(name):g}" for name in ("J1", "J2", "J3")) for case in cases})
    places = ("",) if len(found) == 1 else (" in the plane", " outside it")
    return ", and ".join(", ".join(values) + place for values, place in zip(found, places, strict=True))


def less_rest(quantity: Quantity, cases: Iterable[Result]) -> str:
    """What is taken off a quantity, to stand behind its name; "" where that is nothing."""
    found = {case.rest(quantity.key) for case in cases}
    value = f"{found.pop():g}" if len(found) == 1 else "rest"
    return f" − {value}" if quantity.rest else ""


def meaning_of(quantity: Quantity, cases: Iterable[Result]) -> str:
    """What a quantity means: what changes of a cell that is no cylinder is its volume."""
    planes = {case.scene.cell.geometry == "plane" for case in cases}
    return quantity.meaning.replace("surface", "volume") if planes == {False} else quantity.meaning


def field_label(name: str) -> str:
    """A scalar of the field files, for people, with its unit."""
    for quantity in QUANTITIES:
        if name == quantity.key + quantity.suffix:
            return quantity.symbol + (f" [{quantity.unit}]" if quantity.unit else "")
    return re.sub(r"_Pa$", " [Pa]", name).replace("_", " ")


def scalar(name: str) -> str:
    """The scalar of the field files that is meant by a name with or without its unit."""
    return f"{name}_Pa" if name in ("sigma_mises", "pressure") else name


@contextmanager
def styled() -> Iterator[None]:
    """The figures' fonts, whatever matplotlibrc says."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(RC)
        yield


def save(figure: Figure, out: Path, stem: str) -> list[Path]:
    """Write a figure as PNG and PDF, each one whole or not at all; equal figures give equal files.

    Raises:
        InputError: when the folder cannot be written to.
    """
    paths = []
    try:
        out.mkdir(parents=True, exist_ok=True)
        for kind, metadata in (("png", {"Software": None}), ("pdf", {"CreationDate": None})):
            path = out / f"{stem}.{kind}"
            part = out / f"{PARTIAL}{os.getpid()}-{stem}.{kind}"
            try:
                figure.savefig(part, dpi=DPI, metadata=metadata)
                part.replace(path)
            finally:
                part.unlink(missing_ok=True)
            paths.append(path)
    except OSError as error:
        raise InputError("--out", str(out), f"cannot be written to ({error.strerror or error})") from None
    return paths


def wrapped(text: str, width_in: float, size: float, weight: str = "normal") -> list[str]:
    """A text in lines that are no wider than so many inches, broken where two spaces stand, else between words.

    Args:
        text: as matplotlib takes it, with symbols between dollars.
        width_in: of a line [inches].
        size: of the font [points].
        weight: of the font.
    """
    font = FontProperties(family=RC["font.family"], size=size, weight=weight)

    def fits(line: str) -> bool:
        bare = re.sub(r"[${}_]|mathrm|\\\\", "", line)  # symbols as wide as their letters: typesetting takes long
        return float(text_to_path.get_text_width_height_descent(bare, font, False)[0]) <= 72 * width_in

    lines, here = [], ""
    for phrase in text.split("  "):  # these stay together if they can
        for word in [phrase] if fits(phrase) else phrase.split(" "):
            joined = f"{here}{' ' * (1 if word != phrase else 2)}{word}" if here else word
            if here and not fits(joined):
                lines.append(here)
                joined = word
            while "$" not in joined and not fits(joined):
                cut = max((n for n in range(1, len(joined)) if fits(joined[:n])), default=1)
                cut = joined.rfind(",", 0, cut) + 1 or cut
                lines.append(joined[:cut])
                joined = joined[cut:]
            here = joined
    return [*lines, here] if here else lines


def printed(value: float) -> str:
    """A number as the paper prints it: two digits after the point, three where it gives them."""
    return format(value, printed_form(value))


def printed_form(value: float) -> str:
    """The format of a number as the paper prints it."""
    return ".2f" if round(value, 2) == value else ".3f"


def text_width_in(text: str, size: float) -> float:
    """How wide a text is at a size in points [inches]; what is between $ is taken as it is written."""
    font = FontProperties(family=RC["font.family"], size=size)
    return float(text_to_path.get_text_width_height_descent(text.replace("$", ""), font, False)[0]) / 72


def spread(wanted: Sequence[float], gap: float, most: float = 1.0) -> list[float]:
    """Ascending positions at least `gap` apart and at most `most`, as near to the wanted ones as that allows.

    Args:
        wanted: ascending positions.
        gap: least distance of neighbours.
        most: upper bound of the last one.
    """
    groups: list[list[float]] = []  # [sum of (wanted - offset), count]
    for index, value in enumerate(wanted):
        groups.append([value - index * gap, 1])
        while len(groups) > 1 and groups[-2][0] / groups[-2][1] > groups[-1][0] / groups[-1][1]:
            total, count = groups.pop()
            groups[-1][0] += total
            groups[-1][1] += count
    starts = [total / count for total, count in groups for _ in range(int(count))]
    placed = [start + index * gap for index, start in enumerate(starts)]
    return [min(value, most - (len(placed) - 1 - index) * gap) for index, value in enumerate(placed)]


def provenance(study: StudyResult) -> str:
    """The origin of a figure's numbers, for its small print."""
    cases = list(study.cases.values())

    def version(of: str) -> str:
        return _span((case.result.get("versions") or {}).get(of, "?") for case in cases)

    order = _span(case.scene.mesh.order for case in cases)
    parts = [
        f"cellmech {version('cellmech')}, DOLFINx {version('dolfinx')}",
        f"{_span(map(_cells, cases))} elements of order {order}",
        f"step tolerance rtol {_span(f'{case.scene.time.rtol:g}' for case in cases)}",
        f"load factor {_span(f'{case.scene.load.factor:g}' for case in cases)}",
    ]
    if beyond := [name for name, case in study.cases.items() if case.beyond_ellipticity]:
        which = ", ".join(beyond) if len(beyond) <= MOST_NAMED else f"{len(beyond)} of {len(cases)} cases"
        parts.append(f"beyond the loss of ellipticity, so dependent on the mesh: {which}")
    sources = {str(case.result["source_hash"])[:10] for case in cases if case.result.get("source_hash")}
    return "   ·   ".join([*parts, *([f"sources {', '.join(sorted(sources))}"] if sources else [])])


def _cells(case: Result) -> str:
    number = case.get("mesh_cells")
    return "?" if number != number else f"{number:,.0f}"


def _span(values: Iterable[object]) -> str:
    """The value all share, or all of them."""
    return ", ".join(dict.fromkeys(str(value) for value in values))
