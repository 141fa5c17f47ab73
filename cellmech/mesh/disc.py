"""A disc and the fineness of its mesh: layers, sizes, contacts, and their rules."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from cellmech.errors import InputError
from cellmech.mesh.cell_shape import CellShape

Rule = tuple[str, str, object, bool]  # key, rule, value got, whether it holds


TABLE_1 = (("nucleoplasm", 4.9), ("lamina", 5.0), ("cytosol", 9.5), ("membrane", 10.0))
"""Layers from the inside out: name and outer radius [µm]."""


@dataclass(frozen=True)
class Grading:
    """Element size over a disc: sizes in units of `DiscSpec.size_um`, slopes of size over distance.

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


UNIFORM = Grading(outline=1.0, contact=1.0, core=1.0, far=1.0, rim=1.0, back=1.0)
"""Equal elements everywhere but across thin layers."""


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
        moves: what moves the mesh, where cell or nucleus is no circle or ball about the centre.

    Raises:
        InputError: a value breaks its rule.
    """

    shape: str = "half"
    centre: tuple[float, float] = (0.0, 9.5)
    interfaces: tuple[tuple[str, float], ...] = TABLE_1
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
    moves: CellShape | None = None

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
