"""Element sizes of discs and balls, as expressions that Gmsh and NumPy read alike."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from cellmech.mesh.disc import Grading


class Graded(Protocol):
    """A body of layers around a centre whose element sizes follow a grading; lengths in µm."""

    @property
    def centre(self) -> tuple[float, ...]: ...  # noqa: D102
    @property
    def interfaces(self) -> tuple[tuple[str, float], ...]: ...  # noqa: D102
    @property
    def nucleus_radius_um(self) -> float: ...  # noqa: D102
    @property
    def size_um(self) -> float: ...  # noqa: D102
    @property
    def outline_size_um(self) -> float | None: ...  # noqa: D102
    @property
    def grading(self) -> Grading: ...  # noqa: D102


class Zone(NamedTuple):
    """A patch of the surface where contact begins.

    Args:
        at: its middle [µm].
        size_um: of the elements in it; None for the grading's.
        radius_um: how far it reaches; None for the grading's.
    """

    at: tuple[float, ...]
    size_um: float | None = None
    radius_um: float | None = None


def graded_sizes(spec: Graded, zones: Iterable[Zone]) -> list[str]:
    """MathEval expressions in the coordinates whose least is the element size [µm].

    They hold where no horizontal coordinate is less than the centre's; elsewhere the mesh is a mirror image. Several
    short ones, because Gmsh reads no long ones.
    """
    grade, middle = spec.grading, spec.centre
    rim, nucleus = spec.interfaces[-1][1], spec.nucleus_radius_um
    zones = list(zones)
    outline = spec.outline_size_um or grade.outline * spec.size_um
    back = grade.back * spec.size_um if zones else outline
    centre = distance(*middle)
    outwards = f"{grade.growth} * abs({centre} - {nucleus:.12g})"
    inwards = f"max(0, {(1 - grade.skin) * rim:.12g} - {centre})"
    sizes = [
        f"{grade.far * spec.size_um:.12g}",
        f"{grade.rim * spec.size_um:.12g} + {grade.growth} * {inwards}",
        f"{back:.12g} + {outwards}",
    ]
    for zone in zones:
        contact = zone.size_um or grade.contact * spec.size_um
        radius = zone.radius_um or grade.zone * rim
        offset = [a - c if k == 1 else abs(a - c) for k, (a, c) in enumerate(zip(zone.at, middle, strict=True))]
        away, reach = distance(*_along(middle, 1.0, offset)), math.hypot(*offset)
        edge = f"max(0, max({away} - {radius:.12g}, {grade.inside * radius:.12g} - {away}))"
        core = distance(*_along(middle, grade.core_at * nucleus / reach, offset))
        sizes += [
            f"{contact:.12g} + {grade.along} * {edge} + {grade.deeper} * {inwards}",
            f"{outline:.12g} + {outwards} + {grade.fade} * max(0, {away} - {reach:.12g})",
            f"{grade.core * spec.size_um:.12g} + {grade.growth} * max(0, {core} - {grade.core_radius * nucleus:.12g})",
        ]
    return sizes


def sizes_at(expressions: Iterable[str], centre: Sequence[float], *offsets: np.ndarray) -> np.ndarray:
    """Element sizes [µm] at points that lie so far from the centre along each coordinate."""
    names = {"min": np.minimum, "max": np.maximum, "abs": np.abs, "sqrt": np.sqrt}
    names |= {name: c + d for name, c, d in zip("xyz", centre, offsets, strict=False)}
    # The very text that Gmsh gets, so that the two cannot disagree.
    texts = (text.replace("^", "**") for text in expressions)
    sizes: np.ndarray = np.min([eval(t, {"__builtins__": {}}, names) * np.ones_like(offsets[0]) for t in texts], axis=0)
    return sizes


def distance(*point: float) -> str:
    """The expression of the distance from a point."""
    return f"sqrt({' + '.join(f'({name} - ({at:.12g}))^2' for name, at in zip('xyz', point, strict=False))})"


def _along(centre: Sequence[float], share: float, offset: Sequence[float]) -> list[float]:
    return [c + share * d for c, d in zip(centre, offset, strict=True)]
