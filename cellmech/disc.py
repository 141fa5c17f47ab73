"""What a disc is and how finely it is meshed: layers, sizes, and the Gmsh script that follows from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from cellmech.errors import InputError
from cellmech.geo_script import GeoScript, Sector

THIN = 0.2  # of the outer radius: a layer below it is thin
LOOSE = 1.5  # size of the elements of a thin layer without structure, over its thickness
BOTTOM, SIDE, TOP = (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)

Rule = tuple[str, str, object, bool]  # key, rule, value got, whether it holds


@dataclass(frozen=True)
class Grading:
    """How the element size varies over a disc: sizes in units of `DiscSpec.size_um`, slopes of size over distance.

    Chosen by measurement on Table 1, where every reported number has to be within 1 % (`benchmarks/accuracy.py`). Four
    places decide. The membrane bends most at the edge of the contact and beside it, and only short edges along it
    resolve that; the cytosol above may be coarse. The strain beside the lamina varies along it. J2 peaks inside the
    nucleus, between its centre and the contact. And softer cells have their maxima at the membrane's side and at the
    back of the nucleus: the rim and the outline are nowhere much coarser than the layers are thick.

    Args:
        far: size far from all of these.
        rim, back: largest size along the rim and along the nucleus outline.
        contact, outline, core: size in the contact zone, along the nucleus outline where it faces the contact, and in
            the core of the nucleus.
        growth: away from the nucleus outline and from the core.
        fade: along the nucleus outline, away from the contact.
        deeper, along: away from the contact zone, into the cell and along the rim.
        zone, skin: radius and depth of the contact zone in units of the outer radius.
        inside: share of the zone's radius within which the contact edge does not lie; the size grows again there.
        core_at, core_radius: how far the core lies towards the contact, and its radius, in units of the nucleus's.
        elongation: most of a structured element across its layer; there strain is nearly linear.
        foot, ankle: size over the distance from a footprint's edge, and its slope into the cell (`Footprint`).
    """

    far: float = 1.28
    rim: float = 0.2
    back: float = 0.35
    contact: float = 0.056
    outline: float = 0.11
    core: float = 0.32
    growth: float = 0.55
    fade: float = 0.2
    deeper: float = 0.5
    along: float = 0.1
    zone: float = 0.33
    inside: float = 0.7
    skin: float = 0.06
    core_at: float = 0.32
    core_radius: float = 0.4
    elongation: float = 2.6
    foot: float = 0.2
    ankle: float = 0.3


@dataclass(frozen=True)
class Footprint:
    """A contact on a disc's outline, where the element size falls in proportion to the distance from its edge.

    Args:
        at: its middle, from the centre [µm].
        edges: least and largest half-width [µm].
        scale_um: over which the pressure changes at its edge; elements there are a share of it.
        fineness: of the elements, 1 for the grading's `foot`.
        least_um: of the elements.
    """

    at: tuple[float, float]
    edges: tuple[float, float]
    scale_um: float
    fineness: float = 1.0
    least_um: float = 0.0


@dataclass(frozen=True)
class DiscSpec:
    """A layered disc, or its right half, and how finely it is meshed; the defaults are Table 1.

    Lengths and coordinates are in µm.

    Args:
        shape: "half" (x >= centre) or "full" (the same mesh and its mirror image).
        centre: x, y of the centre.
        interfaces: layers that are meshed apart, from the inside out: name and outer radius.
        nucleus_radius_um: this circle is always an interface, the facet group "nucleus_outline".
        size_um: the element size that the others follow, as `grading` says.
        contact_size_um: size in the contact zone; None for the grading's.
        outline_size_um: size along the nucleus outline where it faces the contact; None for the grading's.
        order: 1 for straight triangles, 2 for curved ones.
        thin_layers: least number of elements across a thin layer.
        touch: points where contact begins; None for the bottom, () for no contact zone.
        contact_zone_um: how far the refined rim reaches from each of them; None for the grading's.
        footprints: contacts too narrow for the zones; the mesh follows each at any width.
        grading: how the size varies.

    Raises:
        InputError: a value breaks its rule.
    """

    shape: str = "half"
    centre: tuple[float, float] = (0.0, 9.5)
    interfaces: tuple[tuple[str, float], ...] = (
        ("nucleoplasm", 4.9),
        ("lamina", 5.0),
        ("cytosol", 9.5),
        ("membrane", 10.0),
    )
    nucleus_radius_um: float = 5.0
    size_um: float = 2.4
    contact_size_um: float | None = None
    outline_size_um: float | None = None
    order: int = 2
    thin_layers: int = 1
    touch: tuple[tuple[float, float], ...] | None = None
    contact_zone_um: float | None = None
    footprints: tuple[Footprint, ...] = ()
    grading: Grading = Grading()

    def __post_init__(self) -> None:
        lengths = ("size_um", "contact_size_um", "outline_size_um", "contact_zone_um")
        check(
            "DiscSpec",
            ("shape", 'must be "half" or "full"', self.shape, self.shape in ("half", "full")),
            *layer_rules(0.0, self.interfaces),
            *mesh_rules(self.order, {key: getattr(self, key) for key in lengths}),
            ("thin_layers", "must be an integer, 1 to 100", self.thin_layers, self.thin_layers in range(1, 101)),
        )
        inside = 0 < self.nucleus_radius_um < self.interfaces[-1][1]
        rule = "must lie between 0 and the outer radius [µm]"
        check("DiscSpec", ("nucleus_radius_um", rule, self.nucleus_radius_um, inside))

    def least_size_um(self, foot: Footprint) -> float:
        """Size of the elements at a footprint's edge [µm]."""
        return max(self.grading.foot / foot.fineness * foot.scale_um, foot.least_um)


def size_expressions(spec: DiscSpec) -> list[str]:
    """Gmsh MathEval expressions in x and y whose least is the element size [µm] in the right half of a disc.

    Several short ones, because Gmsh reads no long ones.
    """
    grade = spec.grading
    x0, y0 = spec.centre
    rim = spec.interfaces[-1][1]
    far = grade.far * spec.size_um
    contact = spec.contact_size_um or grade.contact * spec.size_um
    outline = spec.outline_size_um or grade.outline * spec.size_um
    zone = spec.contact_zone_um or grade.zone * rim
    touch = ((x0, y0 - rim),) if spec.touch is None else spec.touch
    centre, nucleus = _distance(x0, y0), spec.nucleus_radius_um
    outwards = f"{grade.growth} * abs({centre} - {nucleus:.12g})"
    inwards = f"max(0, {(1 - grade.skin) * rim:.12g} - {centre})"
    back = grade.back * spec.size_um if touch else outline
    sizes = [
        f"{far:.12g}",
        f"{grade.rim * spec.size_um:.12g} + {grade.growth} * {inwards}",
        f"{back:.12g} + {outwards}",
    ]
    for x, y in touch:
        dx, dy = abs(x - x0), y - y0  # the left half is the mirror image of the right one
        away, reach = _distance(x0 + dx, y), math.hypot(dx, dy)
        edge = f"max(0, max({away} - {zone:.12g}, {grade.inside * zone:.12g} - {away}))"
        towards = grade.core_at * nucleus / reach
        beyond = f"{_distance(x0 + towards * dx, y0 + towards * dy)} - {grade.core_radius * nucleus:.12g}"
        sizes += [
            f"{contact:.12g} + {grade.along} * {edge} + {grade.deeper} * {inwards}",
            f"{outline:.12g} + {outwards} + {grade.fade} * max(0, {away} - {reach:.12g})",
            f"{grade.core * spec.size_um:.12g} + {grade.growth} * max(0, {beyond})",
        ]
    return sizes + [_footprint_size(spec, foot) for foot in spec.footprints]


def _footprint_size(spec: DiscSpec, foot: Footprint) -> str:
    """Size that a footprint asks for: the same number of elements across it, however narrow it is."""
    x0, y0 = spec.centre
    dx, dy = foot.at
    middle, spread = sum(foot.edges) / 2, (foot.edges[1] - foot.edges[0]) / 2
    share, least = spec.grading.foot / foot.fineness, spec.least_size_um(foot)
    edge = f"abs({_distance(x0 + abs(dx), y0 + dy)} - {middle:.9g}) - {spread:.9g}"
    into = f"max(0, {spec.interfaces[-1][1]:.12g} - {_distance(x0, y0)})"
    return f"max({least:.9g}, {share:.9g} * ({edge})) + {spec.grading.ankle} * {into}"


def disc_script(spec: DiscSpec) -> str:
    """Gmsh script of a disc; groups are its layers, "outer", "nucleus_outline" and, for the half, "axis"."""
    return disc_sectors(spec)[0].text()


def disc_sectors(spec: DiscSpec) -> tuple[GeoScript, list[Sector]]:
    """Script of a disc and its right sector, then, in a full disc, the left one."""
    script = GeoScript(spec.centre)
    radii = sorted({radius for _, radius in spec.interfaces} | {spec.nucleus_radius_um})
    across = [0, *(_elements_across(spec, *pair) for pair in pairwise(radii))]
    sectors = [script.sector(radii, (BOTTOM, SIDE, TOP), across, solid=True)]
    if spec.shape == "full":
        sectors.append(script.sector(radii, (BOTTOM, (-1.0, 0.0), TOP), across, solid=True))
        script.mirror(*sectors)
    layers: dict[str, list[int]] = {}
    for k, radius in enumerate(radii):
        name = next(name for name, outer in spec.interfaces if radius <= outer)
        layers.setdefault(name, []).extend(number for sector in sectors for number in sector.annuli[k].surfaces)
    for name, numbers in layers.items():
        script.group(2, name, numbers)
    for name, k in (("outer", -1), ("nucleus_outline", radii.index(spec.nucleus_radius_um))):
        script.group(1, name, [arc for sector in sectors for arc in sector.arcs[k]])
    if spec.shape == "half":
        script.group(1, "axis", [*sectors[0].start, *sectors[0].end])
    loose = [pair for pair, n in zip(pairwise(radii), across[1:], strict=True) if not n]
    script.sizes(
        size_expressions(spec) + [_loose_size(spec, *pair) for pair in loose if _is_thin(spec, *pair)], spec.order
    )
    return script, sectors


def _is_thin(spec: DiscSpec, inner: float, outer: float) -> bool:
    """Whether a layer would have a structure but for the footprints."""
    return bool(spec.footprints) and _elements_across(replace(spec, footprints=()), inner, outer) > 0


def _loose_size(spec: DiscSpec, inner: float, outer: float) -> str:
    """Size that an unstructured thin layer asks for, so that its triangles are not flat."""
    away = f"max(0, abs({_distance(*spec.centre)} - {(inner + outer) / 2:.12g}) - {(outer - inner) / 2:.12g})"
    return f"{LOOSE * (outer - inner):.12g} + {spec.grading.growth} * {away}"


def _elements_across(spec: DiscSpec, inner: float, outer: float) -> int:
    """Elements across a structured annulus, 0 for one whose elements are small enough to need no structure.

    Nor has one structure in which a footprint asks for more elements, all around, than triangles as large as the layer
    is thick would be.
    """
    angle = np.linspace(-np.pi / 2, np.pi / 2, 361)
    middle = (inner + outer) / 2
    size = _sizes_at(spec, middle * np.cos(angle), middle * np.sin(angle))
    least = spec.thin_layers if outer - inner < THIN * spec.interfaces[-1][1] else 1
    if size.max() * least <= outer - inner:
        return 0
    across = max(least, math.ceil((outer - inner) / (spec.grading.elongation * size.min())))
    along = np.pi * outer / (LOOSE * (outer - inner))
    return (
        0 if spec.footprints and across > least and across * np.sum(np.pi / 360 * middle / size) > 2 * along else across
    )


def _sizes_at(spec: DiscSpec, dx: np.ndarray, dy: np.ndarray) -> np.ndarray:
    """Element sizes [µm] at points that lie dx, dy from the centre, in the right half."""
    names = {"min": np.minimum, "max": np.maximum, "abs": np.abs, "sqrt": np.sqrt}
    names |= {"x": spec.centre[0] + dx, "y": spec.centre[1] + dy}
    # The very text that Gmsh gets, so that the two cannot disagree.
    texts = (text.replace("^", "**") for text in size_expressions(spec))
    sizes: np.ndarray = np.min([eval(text, {"__builtins__": {}}, names) * np.ones_like(dx) for text in texts], axis=0)
    return sizes


def resolves(spec: DiscSpec, foot: Footprint) -> bool:
    """Whether the elements are small enough for a footprint wherever its edges may lie."""
    rim, start = spec.interfaces[-1][1], math.atan2(foot.at[1], abs(foot.at[0]))
    angle = start + np.array([side * edge / rim for edge in foot.edges for side in (-1.0, 1.0)])
    size = _sizes_at(spec, np.abs(rim * np.cos(angle)), rim * np.sin(angle))
    return bool(np.all(size <= spec.grading.foot / foot.fineness * foot.scale_um))


def _distance(x: float, y: float) -> str:
    return f"sqrt((x - ({x:.12g}))^2 + (y - ({y:.12g}))^2)"


def layer_rules(inner: float, interfaces: Sequence[tuple[str, float]]) -> list[Rule]:
    """Rules of layers that begin at an inner radius [µm]."""
    radii = [inner, *(radius for _, radius in interfaces)]
    grows = len(radii) > 1 and 0 <= inner and all(a < b < math.inf for a, b in pairwise(radii))
    named = all(name and name.isprintable() and '"' not in name for name, _ in interfaces)
    return [
        ("interfaces", "radii must grow from the inside out [µm]", interfaces, grows),
        ("interfaces", "every layer needs a name, without quotes", interfaces, named),
    ]


def mesh_rules(order: int, lengths: dict[str, float | None]) -> list[Rule]:
    """Rules of the element order and of lengths [µm], None where a default is taken."""
    return [
        ("order", "must be 1 or 2", order, order in (1, 2)),
        *((key, "must be positive [µm]", um, um is None or 0 < um < math.inf) for key, um in lengths.items()),
    ]


def check(where: str, *rules: Rule) -> None:
    """Raise an InputError for the first rule that is broken."""
    for key, rule, got, holds in rules:
        if not holds:
            raise InputError(where, key, rule, got)
