"""Materials over the mesh: constants per named group of cells, or blended smoothly (eqs 1-13)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from cellmech.fem.domain import Domain
from cellmech.fem.jit import cellwise_space
from cellmech.mechanics.contraction import Contraction
from cellmech.mechanics.materials import Material, MaterialField
from cellmech.mechanics.stress import measure_of


def material_fields(
    domain: Domain,
    materials: Mapping[str, Material],
    blend: Mapping[str, ufl.core.expr.Expr] | None = None,
    contractions: Sequence[Contraction] = (),
) -> tuple[MaterialField, ...]:
    """Group the materials by law and form, and by what contracts in them.

    Args:
        domain: the mesh and its named groups.
        materials: material by group name (every group of the domain), or by blended layer when `blend` is given.
        blend: weight g_i of each material [-], UFL (eqs 8, 9: E = sum g_i E_i); all materials must share one law.
        contractions: parts that contract by an active strain.

    Raises:
        ValueError: a group without material, blended materials of different laws, a mixed material whose law has no
            volumetric measure, or one that contracts.
    """
    if contractions and any(m.mixed for m in materials.values()):
        raise ValueError("a mixed material cannot contract: its pressure knows of no active strain")
    for law in sorted({m.law for m in materials.values() if m.mixed}, key=lambda law: law.__name__):
        measure_of(law)
    if blend is not None:
        laws = {(m.law, m.mixed) for m in materials.values()}
        if len(laws) != 1:
            raise ValueError(f"blended layers need one law, all mixed or none, got {len(laws)}")
        return (_material_field(domain, tuple(domain.cells), materials, blend, tuple(contractions)),)
    missing = set(domain.cells) - set(materials)
    if missing:
        raise ValueError(f"no material for the groups {sorted(missing)}")
    by_law: dict[Any, list[str]] = {}
    for name in domain.cells:
        acting = tuple(one for one in contractions if one.sector.holds(name))
        by_law.setdefault((materials[name].law, materials[name].mixed, acting), []).append(name)
    return tuple(
        _material_field(domain, tuple(names), {n: materials[n] for n in names}, None, acting)
        for (_, _, acting), names in by_law.items()
    )


def _material_field(
    domain: Domain,
    names: tuple[str, ...],
    materials: Mapping[str, Material],
    blend: Any,
    contractions: tuple[Contraction, ...],
) -> MaterialField:
    members = {name: material.numbers() for name, material in materials.items()}
    keys = next(iter(members.values()))
    apart = len(members) > 1 and blend is None
    space: Any = cellwise_space(domain.mesh) if apart else None
    dofs = np.array([space.dofmap.cell_dofs(cell)[0] for cell in domain.cell_tags.indices if apart], np.int64)
    coefficients = {}
    for key in keys:
        values = {name: numbers[key] for name, numbers in members.items()}
        if apart:
            coefficients[key] = _piecewise(domain, space, dofs, values)
        elif len(set(values.values())) == 1:
            coefficients[key] = fem.Constant(domain.mesh, float(next(iter(values.values()))))
        else:
            coefficients[key] = sum(fem.Constant(domain.mesh, float(values[n])) * blend[n] for n in values)
    return MaterialField(
        names=names,
        law=next(iter(materials.values())).law,
        solid_fraction=coefficients.pop("solid_fraction"),
        viscosity_lambda=coefficients.pop("viscosity_lambda"),
        viscosity_mu=coefficients.pop("viscosity_mu"),
        rate_dependent=any(m.rate_dependent for m in materials.values()),
        mixed=next(iter(materials.values())).mixed,
        constants=coefficients,
        contractions=contractions,
    )


def _piecewise(domain: Domain, space: Any, dofs: np.ndarray, values: Mapping[str, float]) -> fem.Function:
    """A cell-wise constant function with the given value on each named group; `dofs` are those of the tagged cells."""
    function, tags = fem.Function(space), domain.cell_tags
    for name, value in values.items():
        function.x.array[dofs[tags.values == domain.cells[name]]] = value
    function.x.scatter_forward()
    return function
