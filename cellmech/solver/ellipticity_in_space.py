"""Strong ellipticity against waves in all directions of space, also those that a plane or a turned body cannot show.

The states of a plane, or of a body turned about an axis, are computed among such states only: a wave out of the plane
cannot grow in them, however slow. In a real body it can. So the loss found here stops no run in a plane: a warning says
that the state is not stable in space. Laws are functions of the invariants, so the solid is isotropic.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from cellmech.fem.domain import whole
from cellmech.fem.jit import PointValues
from cellmech.mechanics.balance import Body
from cellmech.mechanics.invariants import GivenInvariants, Invariants
from cellmech.mechanics.kinematics import Kinematics, deformation_gradient, green_lagrange
from cellmech.mechanics.materials import MaterialField
from cellmech.names import coordinates
from cellmech.solver.det_f import node_points, quadrature
from cellmech.solver.principal import entries_of, principal_values, symmetric
from cellmech.solver.waves_in_space import SpaceWaves

UNIFORM = 1e-9  # a margin nearer to 1 than this is that of rest: no place or direction is weaker
AT_ONCE = 2000  # elements whose points are looked at together


@dataclass(frozen=True)
class StabilityInSpace:
    """The point of a state where the solid is nearest to losing ellipticity to any wave, or has lost it.

    Args:
        margin: least eigenvalue of the acoustic tensor over c_s mu [-]; None where there is no solid at all.
        at_um: reference place [µm]; None, as what follows, where the margin is that of rest everywhere.
        layer: name of the group of cells.
        normal: of the wave, in the reference, or where something contracts in its state of rest, shape (3,) [-].
        motion: direction in which points move, shape (3,) [-].
    """

    margin: float | None
    at_um: tuple[float, ...] | None = None
    layer: str | None = None
    normal: tuple[float, ...] | None = None
    motion: tuple[float, ...] | None = None

    @property
    def lost(self) -> bool:
        """Whether ellipticity is lost at some point."""
        return self.margin is not None and self.margin < 0

    def as_dict(self) -> dict[str, Any]:
        """For result.json."""
        return dataclasses.asdict(self)

    def __str__(self) -> str:
        """Margin, place and directions in words."""
        if self.at_um is None or self.normal is None or self.motion is None:
            return "margin 1 everywhere" if self.margin is not None else "no solid"
        normal, motion = (", ".join(f"{c:.2g}" for c in vector) for vector in (self.normal, self.motion))
        place = f"{coordinates(self.at_um)} um in the {self.layer}"
        return f"margin {self.margin:.3g} at reference {place} (normal {normal}, motion {motion})"


class EllipticityInSpace:
    """Looks for the least margin over the quadrature points and the nodes of every owned cell.

    Args:
        body: materials, mesh, quadrature.
        u: displacement [µm].
    """

    def __init__(self, body: Body, u: fem.Function) -> None:
        mesh = body.domain.mesh
        self._comm = mesh.comm
        self._points = np.vstack([quadrature(mesh, body.bulk_degree)[0], node_points(body.space)])
        self._layers = {number: whole(name) for name, number in body.domain.cells.items()}
        self._parts = []
        for material in body.materials:
            F = material.elastic_part(deformation_gradient(u, body.kinematics))
            place = ufl.as_vector([*ufl.SpatialCoordinate(mesh), *(F[i, j] for i in range(3) for j in range(3))])
            at = PointValues(place, self._points, mesh.comm)
            moduli = PointValues(isotropic_moduli(u, material, body.kinematics), self._points, mesh.comm)
            share = PointValues(fem.Constant(mesh, 1.0) * material.solid_fraction, self._points, mesh.comm)
            self._parts.append((*body.domain.own_of(material.names), moduli, share, at))

    def find(self) -> StabilityInSpace:
        """The least margin of the present state, over all ranks. Collective."""
        found: list[StabilityInSpace] = []
        for part in self._parts:
            self._of_part(found, *part)
        together = [one for many in self._comm.allgather(found) for one in many]
        return min(together, key=margin_of, default=StabilityInSpace(None))

    def _of_part(
        self,
        found: list[StabilityInSpace],
        cells: np.ndarray,
        groups: np.ndarray,
        moduli: PointValues,
        share: PointValues,
        place: PointValues,
    ) -> None:
        """Add the least of some of this rank's cells of one material at a time to what was found before."""
        for some in np.array_split(np.arange(len(cells)), -(-len(cells) // AT_ONCE) or 1):
            solid = np.flatnonzero(share(cells[some]).ravel() > 0)
            if not len(solid):
                continue
            values = moduli(cells[some]).reshape(-1, moduli.value_size)
            of_solid = values[solid].T
            known = min((margin_of(one) for one in found), default=np.inf)
            margins, _ = SpaceWaves.of(principal_values(values[solid, :6]), of_solid[6:9], of_solid[9:]).least(known)
            worst = int(np.argmin(margins))
            if abs(margins[worst] - 1) < UNIFORM:
                found.append(StabilityInSpace(float(margins[worst])))
                continue
            cell, point = divmod(int(solid[worst]), len(self._points))
            at = place(cells[some][cell : cell + 1])[0, point]
            found.append(_told(at, self._layers[int(groups[some][cell])], values[solid[worst]]))


def margin_of(one: Any) -> float:
    """Margin of a `Stability` or a `StabilityInSpace`, infinite where there is no solid [-]."""
    return np.inf if one.margin is None else one.margin


def _told(at: np.ndarray, layer: str, values: np.ndarray) -> StabilityInSpace:
    """Of one point, in the axes of the mesh; `at` is the place and F, row by row."""
    F = at[-9:].reshape(3, 3)
    e, axes = np.linalg.eigh(symmetric(values[:6]))
    waves = SpaceWaves.of(e[:, None], values[6:9, None], values[9:, None])
    (margin,), direction = waves.least()
    direction = direction[:, 0]
    across = np.linalg.eigh(waves.tensor(direction[:, None])[0])[1][:, 0]
    turned = F @ axes
    motion = (turned / np.linalg.norm(turned, axis=0)) @ across
    normal = axes @ direction
    directions = (np.copysign(1.0, v[np.argmax(np.abs(v))]) * v for v in (normal, motion))
    place, normal, motion = (tuple(map(float, values)) for values in (at[:-9], *directions))
    return StabilityInSpace(float(margin), place, layer, normal, motion)


def isotropic_moduli(u: fem.Function, material: MaterialField, kinematics: Kinematics) -> Any:
    """E, W's derivatives by t = tr E, q = tr E^2, d = det E, and by tt, tq, td, qq, qd, dd, over mu [-].

    A UFL vector of length 6 + 3 + 6, E, the elastic strain, as `principal.ENTRIES`.
    """
    E, mu = material.elastic(green_lagrange(u, kinematics)), material.constants["mu"]
    invariants = Invariants(E)
    of = [ufl.variable(value) for value in (invariants.trace, invariants.square, invariants.third)]
    W = material.law(GivenInvariants(E, *of), **material.constants)
    first = [ufl.diff(W, one) for one in of]
    second = [ufl.diff(first[a], of[b]) for a in range(3) for b in range(a, 3)]
    return ufl.as_vector([*entries_of(E), *(value / mu for value in (*first, *second))])
