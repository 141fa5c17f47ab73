"""The tables of what moves the cell: its weight, adhesion, contractile actin, and the medium that drags on it."""

from __future__ import annotations

from typing import Annotated, Literal

from cellmech.scene.parts import LARGEST_UM, Length, Position, Table, Viscosity
from cellmech.scene.value_types import Choice, Number, Pair

DEFAULT_PULL_PA = 100.0  # of actin


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
