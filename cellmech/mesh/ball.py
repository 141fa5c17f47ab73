"""What a ball is and how finely it is meshed: layers, sizes, contacts, and their rules."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cellmech.mesh.cell_shape import CellShape
from cellmech.mesh.disc import TABLE_1, Grading, check, layer_rules, mesh_rules
from cellmech.mesh.sizes import Zone

SYMMETRIC = {"quarter": ("x", "z"), "half": ("x",), "full": ()}  # planes that bound a shape
BALL = Grading(
    far=1.0, rim=0.5, back=0.5, contact=0.2, outline=0.09, core=0.3, fade=0.4, along=0.25, zone=0.33, elongation=8.0
)
"""Chosen on Table 1's ball with elements of third order. Strains of nucleus and lamina are largest halfway up the lower
half of the lamina, and need a fine outline there most of all; two elements across thin layers, or smaller ones in the
contact, bring little for what they cost.
"""


@dataclass(frozen=True)
class BallSpec:
    """A layered ball, its half or its quarter, and how finely it is meshed; the defaults are Table 1.

    Lengths and coordinates are in µm, y is up.

    Args:
        shape: "quarter" (x and z >= centre), "half" (x >= centre) or "full": the quarter's mesh and its mirror images.
        centre: x, y, z of the centre.
        interfaces: layers that are meshed apart, from the inside out: name and outer radius.
        nucleus_radius_um: this sphere is always an interface, the facet group "nucleus_outline".
        size_um: the element size that the others follow, as `grading` says.
        outline_size_um: size along the nucleus outline where it faces a contact; None for the grading's.
        order: 1 for straight tetrahedra, 2 for curved ones.
        thin_layers: least number of elements across a thin layer.
        zones: where contact begins; None for the bottom, () for nowhere.
        grading: how the size varies.
        moves: what moves the mesh, where cell or nucleus is no circle or ball about the centre.

    Raises:
        InputError: a value breaks its rule.
    """

    shape: str = "quarter"
    centre: tuple[float, float, float] = (0.0, 9.5, 0.0)
    interfaces: tuple[tuple[str, float], ...] = TABLE_1
    nucleus_radius_um: float = 5.0
    size_um: float = 2.4
    outline_size_um: float | None = None
    order: int = 2
    thin_layers: int = 1
    zones: tuple[Zone, ...] | None = None
    grading: Grading = BALL
    moves: CellShape | None = None

    def __post_init__(self) -> None:
        lengths = {"size_um": self.size_um, "outline_size_um": self.outline_size_um}
        where = "BallSpec"
        check(
            where,
            ("shape", 'must be "quarter", "half" or "full"', self.shape, self.shape in SYMMETRIC),
            *layer_rules(0.0, self.interfaces),
            *mesh_rules(self.order, lengths),
            ("thin_layers", "must be an integer, 1 to 100", self.thin_layers, self.thin_layers in range(1, 101)),
        )
        inside = 0 < self.nucleus_radius_um < self.interfaces[-1][1]
        rule = "must lie between 0 and the outer radius [µm]"
        check(where, ("nucleus_radius_um", rule, self.nucleus_radius_um, inside))
        for zone in self.zones or ():
            apart = len(zone.at) == 3 and 0 < math.dist(zone.at, self.centre) < math.inf
            sized = all(um is None or 0 < um < math.inf for um in zone[1:])
            check(
                where,
                ("zones", "a zone must lie at x, y, z apart from the centre [µm]", zone.at, apart),
                ("zones", "sizes and radii must be positive [µm]", zone[1:], sized),
            )

    def layer_at(self, radius_um: float) -> str:
        """Name of the layer at a distance from the centre [µm]."""
        return next(name for name, outer in self.interfaces if radius_um <= outer)
