"""The tables of a scene file: names, units and ranges of the keys, with Table 1 of the paper as the default.

Here are the cell, its layers, and what is asked of the run; what the cell meets is in `substrate_parts`, what moves it
in `driver_parts`. Attributes are named like the TOML keys and keep the file's units (µm, Pa, s, kg/m3). Rules that tie
several keys together are in `rules`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, Self, TypeAlias, get_args

from pydantic import BaseModel, ConfigDict, model_validator

from cellmech.mechanics.laws import LAWS
from cellmech.scene.outline_points import centred
from cellmech.scene.value_types import Choice, Constants, Flag, Line, Number, Pair, Whole

if TYPE_CHECKING:
    Law: TypeAlias = str
else:
    Law = Literal[tuple(LAWS)]
LayerName = Literal["membrane", "cytosol", "lamina", "nucleoplasm"]
LAYER_NAMES: tuple[LayerName, ...] = get_args(LayerName)  # from the outside in

# The upper bounds lie far outside anything a cell can be; they keep products of inputs inside a double's range.
LARGEST_UM = 1e5
# Defaults of the elements by the displacement's order, of one accuracy (benchmarks/accuracy.py).
MOST_ACROSS = 8  # elements across a thin layer
SECOND_ORDER: dict[str, float] = {"size_um": 0.6, "thin_layers": 2}
IN_SPACE: dict[int, dict[str, float]] = {
    order: {"size_um": um, "thin_layers": 1} for order, um in ((1, 1.2), (2, 1.2), (3, 3.6))
}
Length = Annotated[float, Number("µm", above=0, most=LARGEST_UM)]
PLACE = Number("µm", least=-LARGEST_UM, most=LARGEST_UM)
Position = Annotated[float, PLACE]
Density = Annotated[float, Number("kg/m3", least=0, most=1e6)]
Modulus = Annotated[float, Number("Pa", above=0, most=1e12)]
Viscosity = Annotated[float, Number("Pa s", least=0, most=1e15)]
Fraction = Annotated[float, Number("(no unit)", least=0, most=1)]
Poisson = Annotated[
    float, Number(above=-1, most=0.4999, note="it must be < 0.5: the laws have no incompressible limit here")
]


class Table(BaseModel):
    """One table of the file: immutable, and a key it does not know is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Cell(Table):
    """The cell as a whole: position, density, law, fluid phase."""

    geometry: Annotated[Literal["plane", "axisymmetric", "3d"], Choice()] = "plane"
    """A cylinder on endless ridges (plane strain, the paper's), a ball on what is round about x = 0, or on anything."""
    shape: Annotated[Literal["half", "full", "quarter"], Choice()] = "half"
    """Half a cell, mirrored at x = 0, or all of it; in 3-D also a quarter, and the least that serves if left out."""
    radius_um: Length | None = None
    """Radius, instead of layer.membrane.outer_radius_um; the membrane keeps its thickness."""
    aspect: Annotated[float, Number("(no unit)", least=0.3, most=1)] = 1.0
    """Height over width before the load: of an ellipse of the circle's area, of an ellipsoid of the ball's volume."""
    gap_um: Position = 0.0
    """Vertical travel to first touch; without inertia the cell is moved there before it is solved."""
    centre_x_um: Position = 0.0
    """Where a full cell's centre lies along x."""
    centre_z_um: Position = 0.0
    """3-D: where the centre of a full or half cell lies along z."""
    density_kg_m3: Density = 1000.0
    """Of the cell."""
    medium_density_kg_m3: Density = 0.0
    """Of what surrounds it: buoyancy takes this part of the weight off."""
    poisson: Poisson = 0.45
    """Poisson's ratio of the solid in every layer that has none of its own; above 0.45 the pressure is solved for."""
    law: Annotated[Law, Choice()] = "neo-hookean"
    """Strain energy of the solid in every layer that has none of its own."""
    beta_over_mu: Annotated[float, Number("(no unit)", least=0, most=1e3)] = 2.5
    """Mooney-Rivlin and Yeoh: β/µ. The printed 2.5 makes α negative, which Yeoh pays for with its stability."""
    yeoh_reference: Annotated[Literal["stress-free", "printed"], Choice()] = "stress-free"
    """Yeoh: count I1 from rest, so that there is no stress, or from 0 as eq. 20 prints."""
    lame_lambda: Annotated[Literal["standard", "printed"], Choice()] = "standard"
    """λ from Young's modulus in the usual way, or as eq. 17 prints it, 1 + ν times as large."""
    constants: Annotated[dict[str, float], Constants()] | None = None
    """Constants of the laws in every layer that has none of its own: see the laws."""
    trace: Annotated[Literal["3d", "in-plane"], Choice()] = "3d"
    """Mooney-Rivlin and Yeoh: tr C of eqs 19 and 20 is that of the body, or of its plane, which is stressed at rest."""
    young_factor: Annotated[float, Number("(no unit)", above=0, most=1e6)] = 1.0
    """Every layer's Young's modulus is multiplied by it."""
    solid_exponent: Annotated[float, Number("(no unit)", least=0.1, most=10)] = 1.0
    """The solid's stress is multiplied by c_s to this power: 1 as in eq. 6, 2 where the share is taken twice."""
    fluid_lambda_Pa_s: Viscosity = 1000.0
    """Volumetric viscosity of the fluid."""
    fluid_mu_Pa_s: Viscosity = 5e-3
    """Shear viscosity of the fluid."""
    inertia: Annotated[bool, Flag()] = False
    """Whether mass resists acceleration; needed by a cell that falls."""
    layers: Annotated[Literal["conforming", "smeared"], Choice()] = "conforming"
    """Mesh the layers apart, or fade each into the next as the paper does."""
    smear_um: Length | None = None
    """Half-width of these fades; only with smeared layers, and needed there."""
    fade: Annotated[Literal["centred", "inside", "outside", "squared"], Choice()] = "centred"
    """Where they lie: over an interface, to one side, or as eqs 1 to 5 print them, in the square of the radius."""


class Nucleus(Table):
    """The nucleus as a whole, where it is no circle or ball of the lamina's radius about the cell's centre."""

    radius_um: Length | None = None
    """Radius, instead of layer.lamina.outer_radius_um; the lamina keeps its thickness."""
    centre_um: tuple[Position, ...] = ()
    """Of the nucleus beside the cell's centre: along x and y, in 3-D along z too."""
    aspect: Annotated[float, Number("(no unit)", least=0.2, most=5)] = 1.0
    """Height over width: of an ellipse of the circle's area, or an ellipsoid round about y of the ball's volume."""
    outline_csv: Annotated[str, Line()] | None = None
    """File beside the scene's, a measured outline's points in µm: from the side x and y; 3-D: from above, x and z."""
    outline_um: tuple[Annotated[tuple[float, float], Pair(PLACE, "x and y, in 3-D x and z")], ...] | None = None
    """Such points themselves, as scene.toml has them; they are moved to have their centroid at (0, 0)."""

    @model_validator(mode="after")
    def _about_its_centroid(self) -> Self:
        if self.outline_um is not None:
            object.__setattr__(self, "outline_um", centred(self.outline_um))
        return self


class Layer(Table):
    """One layer of the cell; `law` and `poisson` are the cell's where they are None."""

    young_Pa: Modulus
    """Young's modulus of the solid."""
    fluid_fraction: Fraction = 0.5
    """Share of the fluid in the stress; the solid has the rest."""
    outer_radius_um: Length
    """Where the layer ends; it begins where the next one inside ends."""
    thickness_um: Length | None = None
    """Of membrane or lamina, instead of the outer radius of what is inside it."""
    law: Annotated[Law, Choice()] | None = None
    """Strain energy of the solid; the cell's if left out."""
    poisson: Poisson | None = None
    """Poisson's ratio of the solid; the cell's if left out."""
    constants: Annotated[dict[str, float], Constants()] | None = None
    """Constants of its law; the cell's if left out."""


class Membrane(Layer):
    """Outermost layer; its radius is the cell's."""

    young_Pa: Modulus = 100.0
    outer_radius_um: Length = 10.0


class Cytosol(Layer):
    """Between membrane and nucleus."""

    young_Pa: Modulus = 10.0
    outer_radius_um: Length = 9.5


class Lamina(Layer):
    """Shell of the nucleus; its radius is the nucleus's."""

    young_Pa: Modulus = 1000.0
    outer_radius_um: Length = 5.0


class Nucleoplasm(Layer):
    """Inside of the nucleus, a full disc."""

    young_Pa: Modulus = 10.0
    outer_radius_um: Length = 4.9


class Layers(Table):
    """The four layers, from the outside in."""

    membrane: Membrane = Membrane()
    cytosol: Cytosol = Cytosol()
    lamina: Lamina = Lamina()
    nucleoplasm: Nucleoplasm = Nucleoplasm()


class Time(Table):
    """Length of the run and tolerance of the step control.

    `history = false` asks for the end state only: the load is followed to its value there by elastic equilibria,
    without the fluid, which carries no stress once it has come to rest. "auto" asks for it where the fluid does come to
    rest under a constant load, and for the whole history elsewhere; a scene has the one or the other.
    """

    end_s: Annotated[float, Number("s", above=0, most=1e12)] = 18000.0
    """How long the cell is followed."""
    rtol: Annotated[float, Number("(no unit)", least=1e-10, most=0.5)] = 1e-3
    """Largest error of a time step, relative to the largest displacement so far."""
    history: Annotated[bool | Literal["auto"], Flag(("auto",))] = True
    """Compute the way to the end, or the end state only, or let the program tell which is needed."""


class Mesh(Table):
    """Element sizes and the order of the displacement.

    `contact_size_um` is the size at the contact zone, chosen by the mesh module where it is None; `thin_layers`
    the number of elements across each thin layer. `quadrature_degree` is that of the bulk terms. The defaults are those
    of third order; below it elements are a quarter as large, and two lie across a thin layer.
    `pressure` makes the pressure an unknown of its own: "auto" in nearly incompressible layers, "mixed" in all, "none"
    in none. Such a scene, and one with a layer that is all fluid, is of second order unless it says otherwise.
    """

    size_um: Length = 2.4
    """Size of the elements away from interfaces and contact; 0.6 for second and first order, in 3-D 1.2, and 3.6."""
    contact_size_um: Length | None = None
    """Size at the contact; if left out, chosen by the program, which follows narrow contacts."""
    thin_layers: Annotated[int, Whole(1, MOST_ACROSS)] = 1
    """Elements across membrane and lamina; 2 for second and first order."""
    grading: Annotated[Literal["fitted", "uniform"], Choice()] = "fitted"
    """Small elements where a cell's numbers need them, or equal ones everywhere, as the paper's mesh may have been."""
    fade_rings: Annotated[int, Whole(0, 8)] = 4
    """Smeared layers: rings of elements in half a fade; with 0 the mesh knows nothing of fades, as the paper's."""
    order: Annotated[int, Whole(1, 3)] = 3
    """Of the displacement's polynomials; 2 where a layer is nearly incompressible or all fluid."""
    quadrature_degree: Annotated[int, Whole(1, 20)] = 4
    """Of the integrals over the volume."""
    pressure: Annotated[Literal["auto", "none", "mixed"], Choice()] = "auto"
    """Where the pressure is an unknown of its own: in nearly incompressible layers, nowhere or everywhere."""

    @model_validator(mode="before")
    @classmethod
    def _sizes_of_order(cls, data: object) -> object:
        return {**SECOND_ORDER, **data} if isinstance(data, dict) and data.get("order") in (1, 2) else data


class Output(Table):
    """What is written besides the numbers: fields and pictures."""

    times_s: tuple[Annotated[float, Number("s", above=0, most=1e12)], ...] = ()
    """Times at which field files are written besides the end, rising."""
    whole_cell: bool = True
    """Whether field files have the whole cell; false leaves the mirror images of what was computed out."""
    pictures: bool = True
    """Whether a run leaves a picture of the case; it bears on no number, and changing it solves nothing again."""
