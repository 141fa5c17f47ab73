"""The tables of a scene file: names, units and ranges of the keys, with Table 1 of the paper as the default.

Attributes are named like the TOML keys and keep the file's units (µm, Pa, s, kg/m3). Rules that tie several
keys together are in `scene_rules`.
"""

from __future__ import annotations

from typing import Annotated, Literal, get_args

from pydantic import BaseModel, ConfigDict, model_validator

from cellmech.fields import Choice, Flag, Number, Whole

Law = Literal["saint-venant", "neo-hookean", "mooney-rivlin", "yeoh"]
LayerName = Literal["membrane", "cytosol", "lamina", "nucleoplasm"]
LAYER_NAMES: tuple[LayerName, ...] = get_args(LayerName)  # from the outside in

# The upper bounds lie far outside anything a cell can be; they keep products of inputs inside a double's range.
LARGEST_UM = 1e5
# Defaults of the elements by the displacement's order, of one accuracy (benchmarks/accuracy.py).
SECOND_ORDER: dict[str, float] = {"size_um": 0.6, "thin_layers": 2}
Length = Annotated[float, Number("µm", above=0, most=LARGEST_UM)]
Position = Annotated[float, Number("µm", least=-LARGEST_UM, most=LARGEST_UM)]
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

    shape: Annotated[Literal["half", "full"], Choice()] = "half"
    gap_um: Position = 0.0
    centre_x_um: Position = 0.0
    density_kg_m3: Density = 1000.0
    medium_density_kg_m3: Density = 0.0
    poisson: Poisson = 0.45
    law: Annotated[Law, Choice()] = "neo-hookean"
    beta_over_mu: Annotated[float, Number("(no unit)", least=0, most=1e3)] = 2.5
    yeoh_reference: Annotated[Literal["stress-free", "printed"], Choice()] = "stress-free"
    lame_lambda: Annotated[Literal["standard", "printed"], Choice()] = "standard"
    fluid_lambda_Pa_s: Viscosity = 1000.0
    fluid_mu_Pa_s: Viscosity = 5e-3
    inertia: Annotated[bool, Flag()] = False
    layers: Annotated[Literal["conforming", "smeared"], Choice()] = "conforming"
    smear_um: Length | None = None


class Layer(Table):
    """One layer of the cell; `law` and `poisson` are the cell's where they are None."""

    young_Pa: Modulus
    fluid_fraction: Fraction = 0.5
    outer_radius_um: Length
    law: Annotated[Law, Choice()] | None = None
    poisson: Poisson | None = None


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
    y_um: Position = -10.0
    half_width_um: Length = 10.0
    height_um: Length = 9.5
    exponent: Annotated[float, Number("(no unit)", least=2, most=50)] = 4.0


class Flat(Table):
    """The flat substrate: everything below y_um."""

    y_um: Position = -10.0


class Load(Table):
    """Gravity and its ramp; half_ramp_s is T_g, and 0 switches the load on at once."""

    gravity_m_s2: Annotated[float, Number("m/s2", least=0, most=1e6)] = 9.81
    factor: Annotated[float, Number("(no unit)", least=0, most=1e6)] = 1.0
    half_ramp_s: Annotated[float, Number("s", least=0, most=1e12)] = 5000.0


class Contact(Table):
    """Penalty contact: its form and its widths; its integrand has a kink, which asks for a high degree."""

    form: Annotated[Literal["surface", "volume", "volume-printed"], Choice()] = "surface"
    penalty_Pa_per_um: Annotated[float, Number("Pa/µm", above=0, most=1e12)] = 50.0
    smoothing_um: Length = 1e-4
    volume_width_um: Length = 0.05
    quadrature_degree: Annotated[int, Whole(2, 60)] = 9


class Time(Table):
    """Length of the run and tolerance of the step control.

    `history = false` asks for the end state only: the load is followed to its value there by elastic equilibria,
    without the fluid, which carries no stress once it has come to rest. "auto" asks for it where the fluid does come to
    rest under a constant load, and for the whole history elsewhere; a scene has the one or the other.
    """

    end_s: Annotated[float, Number("s", above=0, most=1e12)] = 18000.0
    rtol: Annotated[float, Number("(no unit)", least=1e-10, most=0.5)] = 1e-3
    history: Annotated[bool | Literal["auto"], Flag(("auto",))] = True


class Mesh(Table):
    """Element sizes and the order of the displacement.

    `contact_size_um` is the size at the contact zone, chosen by the mesh module where it is None; `thin_layers`
    the number of elements across each thin layer. `quadrature_degree` is that of the bulk terms. The defaults are those
    of third order; below it elements are a quarter as large, and two lie across a thin layer.
    `pressure` makes the pressure an unknown of its own: "auto" in nearly incompressible layers, "mixed" in all, "none"
    in none. Such a scene, and one with a layer that is all fluid, is of second order unless it says otherwise.
    """

    size_um: Length = 2.4
    contact_size_um: Length | None = None
    thin_layers: Annotated[int, Whole(1, 8)] = 1
    order: Annotated[int, Whole(1, 3)] = 3
    quadrature_degree: Annotated[int, Whole(1, 20)] = 4
    pressure: Annotated[Literal["auto", "none", "mixed"], Choice()] = "auto"

    @model_validator(mode="before")
    @classmethod
    def _sizes_of_order(cls, data: object) -> object:
        return {**SECOND_ORDER, **data} if isinstance(data, dict) and data.get("order") in (1, 2) else data


class Output(Table):
    """Times [s] at which fields are written besides the end."""

    times_s: tuple[Annotated[float, Number("s", above=0, most=1e12)], ...] = ()
