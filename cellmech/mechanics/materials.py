"""Material of a layer: a solid and a fluid that deform together (eqs 6-13)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import ufl

from cellmech.errors import InputError
from cellmech.mechanics.contraction import Contraction
from cellmech.mechanics.fluid import fluid_stress
from cellmech.mechanics.invariants import Invariants
from cellmech.mechanics.kinematics import Kinematics, dilatation_rate
from cellmech.mechanics.laws import Law
from cellmech.mechanics.stress import energy_and_stress, measure_of, mixed_energy_and_stress


@dataclass(frozen=True)
class Material:
    """A solid and a fluid that deform together, S = c_s S_s + c_f S_f (eqs 6, 7).

    Args:
        law: one of `cellmech.mechanics.laws.LAWS`, or any function of `(Invariants, **constants)`.
        constants: what the law needs, moduli in Pa; "mu", the shear modulus at rest, must be among them, since the
            material's stability is measured by it.
        fluid_fraction: c_f [-]; the solid's is 1 - c_f (eqs 10-13).
        fluid_lambda, fluid_mu: volumetric and shear viscosity [Pa s].
        solid_exponent: the solid's stress is multiplied by (1 - c_f) to this power [-]; eq. 6 has 1.
        mixed: whether the volumetric part is carried by a pressure of its own (`cellmech.solver.element_pressure`).
    """

    law: Law
    constants: Mapping[str, float] = field(default_factory=dict)
    fluid_fraction: float = 0.0
    fluid_lambda: float = 0.0
    fluid_mu: float = 0.0
    mixed: bool = False
    solid_exponent: float = 1.0

    def __post_init__(self) -> None:
        rules = {
            "law": (callable(self.law), "must be a function of (Invariants, **constants)"),
            "constants": ("mu" in self.constants, 'must hold "mu", the shear modulus at rest [Pa]'),
            "fluid_fraction": (0 <= self.fluid_fraction <= 1, "must be from 0 to 1"),
            "fluid_lambda": (self.fluid_lambda >= 0, "must be 0 or more [Pa s]"),
            "fluid_mu": (self.fluid_mu >= 0, "must be 0 or more [Pa s]"),
            "solid_exponent": (self.solid_exponent > 0, "must be more than 0"),
        }
        for key, (kept, rule) in rules.items():
            if not kept:
                raise InputError("Material", key, rule, getattr(self, key))

    @property
    def rate_dependent(self) -> bool:
        """True if the fluid carries any stress."""
        return self.fluid_fraction > 0 and (self.fluid_lambda > 0 or self.fluid_mu > 0)

    def numbers(self) -> dict[str, float]:
        """Every constant that may vary from group to group, mixture fractions applied to the viscosities."""
        return {
            **self.constants,
            "solid_fraction": (1.0 - self.fluid_fraction) ** self.solid_exponent,
            "viscosity_lambda": self.fluid_fraction * self.fluid_lambda,
            "viscosity_mu": self.fluid_fraction * self.fluid_mu,
        }


@dataclass(frozen=True)
class MaterialField:
    """A material over the mesh: the groups of cells that share one law, with its constants as UFL coefficients.

    Where parts contract by an active strain the solid is that of its law at the elastic strain, per volume at rest.
    """

    names: tuple[str, ...]
    law: Law
    constants: Mapping[str, Any]
    solid_fraction: Any
    viscosity_lambda: Any
    viscosity_mu: Any
    rate_dependent: bool
    mixed: bool = False
    contractions: tuple[Contraction, ...] = ()

    def solid(self, E, p=None):
        """c_s W and c_s S_s [Pa] at the 3-D strain E (eqs 6, 17-20); in the mixed form at the pressure p [Pa] too."""
        if self.mixed:
            W, S = mixed_energy_and_stress(self.law, E, p, **self.constants)
        elif self.contractions:
            strain = ufl.variable(E)
            W = self.law(Invariants(self.elastic(strain)), **self.constants)
            for one in self.contractions:
                W = one.weight * W
            S = ufl.diff(W, strain)
        else:
            W, S = energy_and_stress(self.law, E, **self.constants)
        return self.solid_fraction * W, self.solid_fraction * S

    def elastic(self, E):
        """The strain that the law feels at the 3-D strain E [-], shape (3, 3): E itself unless something contracts."""
        for one in self.contractions:
            E = one.elastic(E)
        return E

    def elastic_part(self, F):
        """The part of F that the law feels [-], F_e of F = F_e F_a, shape (3, 3)."""
        for one in self.contractions:
            F = F * one.inverse
        return F

    def volumetric(self, E):
        """The measure g of volume change that the law's lambda goes with [-] at the 3-D strain E."""
        return measure_of(self.law).of(Invariants(E))

    def strain(self, E, p, kinematics: Kinematics):
        """The strain to report [-] where the displacement has E: in the mixed form with the pressure's volume.

        There the volume of the displacement itself is right on the average over an element only, point by point as
        wrong as its gradient; that of the pressure, p/lambda, is of order 2 in the mesh size and nearer by lambda/mu.
        """
        if not self.mixed:
            return E
        change = p / self.constants["lmbda"] - self.volumetric(E)
        corrected = measure_of(self.law).changed(E, change, kinematics)
        solid = ufl.gt(self.solid_fraction, 0)  # fluid alone has no such pressure
        entries = [[ufl.conditional(solid, corrected[i, j], E[i, j]) for j in range(3)] for i in range(3)]
        return ufl.as_matrix(entries)

    def fluid(self, F, E_dot):
        """c_f S_f [Pa] (eqs 6, 23) at F and E_dot."""
        return fluid_stress(F, dilatation_rate(E_dot), self.viscosity_lambda, self.viscosity_mu)
