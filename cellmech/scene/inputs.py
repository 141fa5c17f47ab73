"""The tables of a scene, and what follows from them: radii, moduli, times; no rule of several keys is asked here.

Units are the file's (µm, Pa, s, kg/m3), as the names say; nothing is converted here.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from cellmech.mechanics.laws import Constant
from cellmech.mechanics.moduli import lame
from cellmech.scene.driver_parts import Actin, Adhesion, Load, Medium
from cellmech.scene.parts import LAYER_NAMES, Cell, Law, Layer, LayerName, Layers, Mesh, Nucleus, Output, Table, Time
from cellmech.scene.substrate_parts import Array, Contact, Flat, Pillar
from cellmech.scene.value_types import Choice, Line, Whole, broken

MIXED_ABOVE = 0.45  # Poisson's ratio; at 0.47 P2's largest pressure is off by 15 % on 800 cells (benchmarks/locking.py)


def _flat(value: object) -> object:
    """`flat = false` leaves the flat out."""
    if value is True or not isinstance(value, dict | Flat | bool | None):
        raise broken("must be a table, or false for none", "Write [flat] with y_um, or flat = false.")
    return None if value is False else value


def semi_axes(radius: float, aspect: float, solid: bool) -> tuple[float, float]:
    """Across and along y, of an ellipse of a circle's area, or an ellipsoid round about y of a ball's volume [µm]."""
    wide = radius * aspect ** (-1 / 3 if solid else -1 / 2)
    return wide, aspect * wide


class Inputs(Table):
    """The tables of a scene file, Table 1's values where nothing is written."""

    schema_: Annotated[int, Whole(1, 1)] = Field(default=1, alias="schema")
    """Version of the file format."""
    title: Annotated[str, Line()] = ""
    """For people: heads tables and figures."""
    cell: Cell = Cell()
    nucleus: Nucleus | None = None
    """Where it is no circle or ball about the cell's centre; none if left out."""
    layer: Layers = Layers()
    pillar: tuple[Pillar, ...] = (Pillar(),)
    """One table a pillar, Table 1's if there is none; `pillar = []` for no pillar. A half cell mirrors them."""
    array: Array | None = None
    """A lattice of pillars in the place of Table 1's, and beside those of [[pillar]]."""
    flat: Annotated[Flat | None, BeforeValidator(_flat)] = Flat()
    """The flat substrate; `flat = false` for none."""
    load: Load = Load()
    contact: Contact = Contact()
    adhesion: Adhesion | None = None
    """Adhesion to obstacles; none if the table is left out."""
    actin: tuple[Actin, ...] = ()
    """Contractile actin, one table a part; none if left out."""
    medium: Medium = Medium()
    time: Time = Time()
    mesh: Mesh = Mesh()
    output: Output = Output()
    stability: Annotated[Literal["stop", "warn"], Choice()] = "stop"
    """Where ellipticity is lost: stop there, or go on with states that depend on the mesh and are marked as such."""

    def layer_of(self, name: LayerName) -> Layer:
        """The layer of that name, as written: its law and poisson may be None."""
        layer: Layer = getattr(self.layer, name)
        return layer

    def layer_law(self, name: LayerName) -> Law:
        """The law of that layer, the cell's where it has none of its own."""
        return self.layer_of(name).law or self.cell.law

    def layer_poisson(self, name: LayerName) -> float:
        """Poisson's ratio of that layer, the cell's where it has none of its own [-]."""
        own = self.layer_of(name).poisson
        return self.cell.poisson if own is None else own

    def layer_young_Pa(self, name: LayerName) -> float:
        """Young's modulus of that layer's solid, with the cell's factor [Pa]."""
        return self.layer_of(name).young_Pa * self.cell.young_factor

    def constant(self, name: LayerName, constant: Constant) -> float:
        """A constant of that layer's law, the cell's where it has none of its own."""
        written = (self.cell.constants or {}) | (self.layer_of(name).constants or {})
        if constant.key in written:
            return written[constant.key]
        older: Any = getattr(self.cell, constant.cell_key) if constant.cell_key else constant.default
        return float(constant.words.get(older, older))

    def lame(self, name: LayerName) -> tuple[float, float]:
        """Lambda and mu of that layer's solid [Pa]."""
        printed = self.cell.lame_lambda == "printed"
        return lame(self.layer_young_Pa(name), self.layer_poisson(name), printed=printed)

    def layer_solid(self, name: LayerName) -> float:
        """The factor on that layer's solid stress, c_s to the cell's power [-]."""
        return float((1.0 - self.layer_of(name).fluid_fraction) ** self.cell.solid_exponent)

    def nearly_incompressible(self) -> tuple[LayerName, ...]:
        """Layers in which a displacement alone may lock, from the outermost in."""
        return tuple(name for name in LAYER_NAMES if self.layer_poisson(name) > MIXED_ABOVE)

    def without_solid(self) -> tuple[LayerName, ...]:
        """Layers that are all fluid, from the outermost in."""
        return tuple(name for name in LAYER_NAMES if self.layer_of(name).fluid_fraction == 1.0)

    def laws(self) -> tuple[Law, ...]:
        """The laws in use, without repetition, from the outermost layer in."""
        return tuple(dict.fromkeys(self.layer_law(name) for name in LAYER_NAMES))

    def outer_radius_um(self, name: LayerName) -> float:
        """Outer radius of that layer [µm]."""
        return self.layer_of(name).outer_radius_um

    def inner_radius_um(self, name: LayerName) -> float:
        """Inner radius of that layer, 0 for the nucleoplasm [µm]."""
        inside = LAYER_NAMES[LAYER_NAMES.index(name) + 1 :]
        return self.layer_of(inside[0]).outer_radius_um if inside else 0.0

    @property
    def mirrors(self) -> str:
        """The coordinates whose planes through 0 mirror what is modelled: none, x, or x and z."""
        return {"full": "", "half": "x", "quarter": "xz"}[self.cell.shape]

    @property
    def copies(self) -> int:
        """How many of what is modelled make the whole cell; a half disc turned about its axis is all of it."""
        return 1 if self.cell.geometry == "axisymmetric" else int(2 ** len(self.mirrors))

    @property
    def centre_um(self) -> tuple[float, ...]:
        """Where the centre is put across the vertical [µm]: x, in 3-D x and z."""
        return (self.cell.centre_x_um, self.cell.centre_z_um)[: 2 if self.cell.geometry == "3d" else 1]

    @property
    def radius_um(self) -> float:
        """Radius of the cell [µm]; of the circle or ball as large as it is."""
        return self.layer.membrane.outer_radius_um

    @property
    def semi_axes_um(self) -> tuple[float, float]:
        """Of the cell, across and along y [µm]: an ellipse as large as the circle, a spheroid as large as the ball."""
        return semi_axes(self.radius_um, self.cell.aspect, self.cell.geometry != "plane")

    @property
    def nucleus_radius_um(self) -> float:
        """Radius of the nucleus, lamina included [µm]."""
        return self.layer.lamina.outer_radius_um

    @property
    def adheres(self) -> bool:
        """True if adhesion holds the cell to what it touches."""
        return self.adhesion is not None and self.adhesion.work_uJ_m2 > 0

    @property
    def nucleus_offset_um(self) -> tuple[float, ...]:
        """Centre of the nucleus less the cell's [µm], along x and y, in 3-D along z too."""
        written = self.nucleus.centre_um if self.nucleus is not None else ()
        return written or (0.0,) * (3 if self.cell.geometry == "3d" else 2)

    @property
    def lopsided(self) -> bool:
        """True if the nucleus is not symmetric about the cell's vertical axis, as far as is known."""
        aside = self.nucleus_offset_um
        outline = self.nucleus is not None and self.nucleus.outline_um is not None
        return outline or any((aside[0], *aside[2:]))

    @property
    def drivers(self) -> tuple[tuple[str, Adhesion | Actin], ...]:
        """What pulls besides the weight, and is not nothing, each with its name in results."""
        adhesion = (("adhesion", self.adhesion),) if self.adhesion is not None and self.adheres else ()
        names = ["actin"] if len(self.actin) == 1 else [f"actin_{number}" for number in range(len(self.actin))]
        pulls = ((name, one) for name, one in zip(names, self.actin, strict=True) if one.pull_Pa or one.contraction)
        return (*adhesion, *pulls)

    @property
    def ramp_end_s(self) -> float:
        """Time from which the full load acts, 2 T_g without drivers [s]."""
        pulls: list[Load | Adhesion | Actin] = [one for _, one in self.drivers]
        pulls += [self.load] if self.has_weight or not pulls else []
        return max(one.start_s + 2.0 * one.half_ramp_s for one in pulls)

    @property
    def rest_s(self) -> float:
        """Time of constant load before fields are first written, 0 without one [s]."""
        return max(min((*self.output.times_s, self.time.end_s)) - self.ramp_end_s, 0.0)

    @property
    def relaxation_s(self) -> float:
        """The slowest layer's time to come to rest [s]: viscosity over stiffness, volumetric or in shear."""
        times = [0.0]
        for name in LAYER_NAMES:
            layer = self.layer_of(name)
            lmbda, mu = self.lame(name)
            solid, bulk, shear = self.layer_solid(name), self.cell.fluid_lambda_Pa_s, self.cell.fluid_mu_Pa_s
            for viscosity, modulus in ((bulk + 2 * shear, lmbda + 2 * mu), (shear, mu)):
                if layer.fluid_fraction * viscosity > 0:
                    times.append(layer.fluid_fraction * viscosity / (solid * modulus) if solid else math.inf)
        return max(times)

    @property
    def has_weight(self) -> bool:
        """True if any load is left after buoyancy."""
        lighter = self.cell.density_kg_m3 - self.cell.medium_density_kg_m3
        return lighter * self.load.gravity_m_s2 * self.load.factor != 0.0
