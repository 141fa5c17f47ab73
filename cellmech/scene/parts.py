"""The tables of a scene file: names, units and ranges of the keys, with Table 1 of the paper as the default.

Attributes are named like the TOML keys and keep the file's units (µm, Pa, s, kg/m3). Rules that tie several
keys together are in `scene_rules`.
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
DEFAULT_PULL_PA = 100.0  # of actin
Length = Annotated[float, Number("µm", above=0, most=LARGEST_UM)]
PLACE = Number("µm", least=-LARGEST_UM, most=LARGEST_UM)
Position = Annotated[float, PLACE]
Density = Annotated[float, Number("kg/m3", least=0, most=1e6)]
Modulus = Annotated[float, Number("Pa", above=0, most=1e12)]
Viscosity = Annotated[float, Number("Pa s", least=0, most=1e15)]
Fraction = Annotated[float, Number("(no unit)", least=0, most=1)]
Exponent = Annotated[float, Number("(no unit)", least=2, most=50)]
Profile = Annotated[Literal["round", "square", "ridge"], Choice()]
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


class Load(Table):
    """Gravity and its ramp; half_ramp_s is T_g, and 0 switches the load on at once."""

    gravity_m_s2: Annotated[float, Number("m/s2", least=0, most=1e6)] = 9.81
    """Gravitational acceleration."""
    factor: Annotated[float, Number("(no unit)", least=-1e6, most=1e6)] = 1.0
    """The weight is multiplied by it, as in a centrifuge; below 0, with adhesion only, it lifts the cell."""
    start_s: Annotated[float, Number("s", least=0, most=1e12)] = 0.0
    """When it begins, if something else pulls before."""
    half_ramp_s: Annotated[float, Number("s", least=0, most=1e12)] = 5000.0
    """T_g: the load grows smoothly and is whole twice this time after its start; 0 puts it on at once."""


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


class Adhesion(Table):
    """Adhesion between the cell's surface and obstacles: a pull along their normal, within a range.

    1 µJ/m2 is 1 Pa µm. It is per reference area: what binds stays with the membrane that carries it.
    """

    work_uJ_m2: Annotated[float, Number("µJ/m2", least=0, most=1e6)] = 20.0
    """Work of adhesion: what it takes to part the surfaces, per area."""
    range_um: Length = 0.5
    """Gap across which it acts; the pull is largest at half of it."""
    on: tuple[Annotated[Literal["pillar", "flat"], Choice()], ...] = ("pillar", "flat")
    """What it adheres to."""
    above_um: Position | None = None
    """Level above which it does, for printed tops; everywhere if left out."""
    start_s: Annotated[float, Number("s", least=0, most=1e12)] = 0.0
    """When it begins."""
    half_ramp_s: Annotated[float, Number("s", least=0, most=1e12)] = 5000.0
    """It grows smoothly and is whole twice this time after its start; 0 puts it on at once."""


class Actin(Table):
    """Contractile actin in a part of the reference cell: an active stress, or an active strain (contraction)."""

    where: Annotated[Literal["cap", "basal", "cortex", "sector"], Choice()] = "cortex"
    """Above the nucleus, below it, all of the membrane, or what radii_um and angles_deg say."""
    direction: Annotated[Literal["tangential", "meridional", "radial", "x", "vertical"], Choice()] | None = None
    """Of the pull: along the surface every way or up and down, outwards, along x or y; by `where` if left out."""
    stress_Pa: Annotated[float, Number("Pa", least=-1e9, most=1e9)] | None = None
    """Active stress; positive contracts; 100 if contraction is left out, too."""
    contraction: Annotated[float, Number("(no unit)", above=0, most=0.95)] | None = None
    """Active strain instead: by how much of a length the solid shortens where nothing holds it."""
    stiffness_factor: Annotated[float, Number("(no unit)", above=0, most=1e6)] = 1.0
    """How many times as stiff as its layer the solid of a contracting part is, from the start."""
    radii_um: (
        Annotated[tuple[float, float], Pair(Number("µm", least=0, most=LARGEST_UM), "inner and outer", "[5.0, 6.0]")]
        | None
    ) = None
    """Inner and outer radius about the cell's centre."""
    angles_deg: (
        Annotated[tuple[float, float], Pair(Number("degrees", least=0, most=180), "from and to", "[0.0, 60.0]")] | None
    ) = None
    """From the top, 0, to the bottom, 180."""
    start_s: Annotated[float, Number("s", least=0, most=1e12)] = 0.0
    """When it begins."""
    half_ramp_s: Annotated[float, Number("s", least=0, most=1e12)] = 5000.0
    """It grows smoothly and is whole twice this time after its start; 0 puts it on at once."""

    @property
    def pull_Pa(self) -> float:
        """The active stress [Pa], 0 of what contracts by a strain."""
        left_out = 0.0 if self.contraction is not None else DEFAULT_PULL_PA
        return left_out if self.stress_Pa is None else self.stress_Pa

    @property
    def told(self) -> str:
        """How it pulls, for people."""
        if self.contraction is None:
            return f"{self.pull_Pa:g} Pa"
        stiffer = "" if self.stiffness_factor == 1.0 else f" and {self.stiffness_factor:g} times as stiff"
        return f"shorter by {self.contraction:g} where free{stiffer}"


class Medium(Table):
    """What surrounds the cell, besides its density (cell.medium_density_kg_m3)."""

    viscosity_Pa_s: Viscosity = 0.0
    """It drags on the moving surface, in all with Stokes' 6 π η R v on a rigid ball; water has 0.001."""


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
