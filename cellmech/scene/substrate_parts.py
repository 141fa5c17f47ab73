"""The tables of what the cell meets: pillars, lattice, flat, and the contact with them."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import model_validator

from cellmech.scene.parts import LARGEST_UM, Length, Position, Table
from cellmech.scene.value_types import Choice, Number, Pair, Whole

Exponent = Annotated[float, Number("(no unit)", least=2, most=50)]
Profile = Annotated[Literal["round", "square", "ridge"], Choice()]


class Pillar(Table):
    """A micropillar: |(x - x_um)/half_width_um|^exponent + |(y - y_um)/height_um|^exponent <= 1."""

    x_um: Position = 0.0
    """Middle of the pillar."""
    y_um: Position = -10.0
    """Foot of the pillar."""
    z_um: Position = 0.0
    """3-D: middle of the pillar along z."""
    half_width_um: Length = 10.0
    """Half of its width at the foot."""
    width_um: Length | None = None
    """Its width at the foot, instead of half of it."""
    height_um: Length = 9.5
    """From foot to top."""
    exponent: Exponent = 4.0
    """How square it is: 2 is an ellipse, 4 the paper's, 20 nearly a box with sharp edges."""
    profile: Profile | None = None
    """3-D: its outline from above, round if left out; a ridge is endless along z, as all are in the plane."""

    @model_validator(mode="after")
    def _half_of_the_width(self) -> Self:
        if self.width_um is not None and "half_width_um" not in self.model_fields_set:  # a rule refuses both
            object.__setattr__(self, "half_width_um", self.width_um / 2)
            object.__setattr__(self, "width_um", None)
        return self


class Array(Table):
    """A lattice of equal pillars below the cell, in the place of Table 1's; in the plane a row of ridges."""

    lattice: Annotated[Literal["square", "hexagonal"], Choice()] = "square"
    """How they stand in 3-D: in columns along x and z, or each row half a pitch beside the next."""
    pitch_um: Length = 10.0
    """From middle to middle, along x."""
    profile: Profile | None = None
    """3-D: outline from above, round if left out; ridges stand in a row along x."""
    width_um: Length = 5.0
    """Width of each at the foot."""
    height_um: Length = 9.5
    """From foot to top."""
    exponent: Exponent = 4.0
    """How square they are, as a pillar's."""
    y_um: Position = -10.0
    """Foot of the pillars."""
    count: Annotated[int | Literal["fill"], Whole(1, 30, ("fill",))] = "fill"
    """How many along a side (in every other row of a hexagonal one less), or all that the cell might come to touch."""
    offset_um: Annotated[tuple[float, float], Pair(Number("µm", least=-LARGEST_UM, most=LARGEST_UM))] = (0.0, 0.0)
    """Place of the cell's centre beside a pillar's middle, along x and z: half the pitch twice is between four."""


class Flat(Table):
    """The flat substrate: everything below y_um."""

    y_um: Position = -10.0
    """Height of the flat."""


class Contact(Table):
    """Penalty contact: its form and its widths; its integrand has a kink, which asks for a high degree."""

    form: Annotated[Literal["surface", "conservative", "volume", "volume-printed"], Choice()] = "surface"
    """A pressure on the outline, conservative if along its own normal; or a force in the overlap, also as in eq. 27."""
    penalty_Pa_per_um: Annotated[float, Number("Pa/µm", above=0, most=1e12)] = 50.0
    """Pressure per depth: the stiffer, the less the cell sinks into the obstacle."""
    smoothing_um: Length = 1e-4
    """Depth over which the pressure of the surface forms sets in."""
    volume_width_um: Length = 0.05
    """Half-width over which the force of the volume forms sets in, from this far outside."""
    quadrature_degree: Annotated[int, Whole(2, 60)] = 9
    """Of the contact integrals."""

    @property
    def width_key(self) -> str:
        """The key of the width over which this form's force sets in."""
        return "smoothing_um" if self.on_surface else "volume_width_um"

    @property
    def on_surface(self) -> bool:
        """True if the force is a pressure on the outline."""
        return not self.form.startswith("volume")
