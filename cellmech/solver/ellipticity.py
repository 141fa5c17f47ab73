"""Material stability: is the solid strongly elliptic at every point, and if not, where and across which direction?

Strong ellipticity (the Legendre-Hadamard condition) asks of the moduli A = dP/dF of the solid part that

    a_i N_J A_iJkL a_k N_L > 0 for all directions N (reference) and a (deformed),

that is: the acoustic tensor Q_ik(N) = A_iJkL N_J N_L is positive definite for every N, so that no plane wave has an
imaginary speed. Where it fails, the deformation can localise in bands as thin as the mesh allows, and what is computed
beyond depends on the mesh. In plane strain N and a lie in the plane.

The margin is the smallest eigenvalue of Q(N) over all N, divided by c_s mu: 1 at rest, 0 where ellipticity is lost.
c_s cancels; points without solid (c_f = 1) have no margin. The fluid is left out: it slows a localisation down and does
not prevent it.

What the four laws can do in plane strain (mu = 1, k = J1 - 2, every N; `tests/unit/test_ellipticity.py`):

- Saint-Venant: is lost in compression. Under uniaxial strain s the compressive wave along it sees (3 s^2 - 1)
  (lambda + 2 mu)/2, zero at s = 1/sqrt(3) for any nu: the limit point of the one-dimensional law. Waves that shear see
  less: for nu = 0 an oblique one is lost at s = 2 - sqrt(2), for larger nu ever earlier (0.906 for nu = 0.45), and
  under equal compression all are at s^2 = (lambda + mu)/(lambda + 2 mu) (s = 0.953).
- neo-Hookean: Q = I + (1 + lambda (1 - ln J)) b b^T with b = F^-T N, so the margin is 1 in every state with
  ln J <= 1 + mu/lambda (J <= 3.04 for nu = 0.45), however compressed; it can be lost in larger expansion only.
- Mooney-Rivlin: the same with another function of J, which for the printed beta is positive for all J: margin 1.
- Yeoh: Q = (1 + 2 W_k) I + h(J) b b^T + 4 W_kk f f^T with f = F N, W_k = c (k - k^2/5)/2, W_kk = c (1 - 2 k/5)/2 and
  c = beta/mu - 1/2. For c > 0.357 it is lost in compression wherever 1 + 2 W_k < 0, in every mode alike.

Sources: Marsden & Hughes (1983), Mathematical Foundations of Elasticity, 3.4; Ogden (1984), Non-Linear Elastic
Deformations, 6.2.7; Knowles & Sternberg (1977), J. Elasticity 8, 329-379, for plane strain.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from cellmech.fem.domain import whole
from cellmech.fem.jit import PointValues
from cellmech.mechanics.balance import Body
from cellmech.mechanics.invariants import Invariants
from cellmech.mechanics.kinematics import Kinematics, deformation_gradient, green_lagrange
from cellmech.mechanics.materials import MaterialField
from cellmech.names import coordinates
from cellmech.solver.det_f import node_points, quadrature
from cellmech.solver.ellipticity_in_space import EllipticityInSpace, StabilityInSpace, margin_of
from cellmech.solver.waves import Waves, least_over_directions

GROWTH = 10.0  # of the largest strain, and …
INCREMENT = 0.05  # … addition to it, after which a state is looked at in any case
SHARE = 0.25  # of a margin; see StabilityWatch
AT_REST = (0.0, 1.0)  # largest strain of the state that a StabilityWatch has last looked at, and its margin
UNIFORM = 1e-9  # a margin nearer to 1 than this is that of the whole body: no place or direction is weaker


@dataclass(frozen=True)
class Stability:
    """The point of a state where the solid is nearest to losing ellipticity, or has lost it.

    Args:
        margin: least eigenvalue of the acoustic tensor over c_s mu [-]; None where there is no solid at all.
        at_um: reference place [µm]; None, as what follows, where the margin is that of rest everywhere.
        layer: name of the group of cells.
        angle_deg: of the normal N of the wave (of the band), in the reference, from x, 0 … 180; where something
            contracts by an active strain, in its state of rest.
        amplitude_deg: of the direction a in which points move, 0 … 180.
    """

    margin: float | None
    at_um: tuple[float, float] | None = None
    layer: str | None = None
    angle_deg: float | None = None
    amplitude_deg: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """For result.json."""
        return dataclasses.asdict(self)

    @property
    def lost(self) -> bool:
        """True if ellipticity is lost at some point."""
        return self.margin is not None and self.margin < 0

    def __str__(self) -> str:
        """Margin, place and directions in words."""
        if self.margin is None or self.at_um is None:
            return "margin 1 everywhere" if self.margin is not None else "no solid"
        return (
            f"margin {self.margin:.3g} at reference {coordinates(self.at_um)} um in the {self.layer} "
            f"(normal at {self.angle_deg:.0f} degrees, motion at {self.amplitude_deg:.0f})"
        )


class Ellipticity:
    """Looks for the least margin over the quadrature points and the nodes of every owned cell.

    Args:
        body: materials, mesh, quadrature.
        u: displacement [µm].
    """

    def __init__(self, body: Body, u: fem.Function) -> None:
        mesh = body.domain.mesh
        points = np.vstack([quadrature(mesh, body.bulk_degree)[0], node_points(body.space)])
        self._comm = mesh.comm
        place = PointValues(ufl.SpatialCoordinate(mesh), points, mesh.comm)
        self._layers = {number: whole(name) for name, number in body.domain.cells.items()}
        self._parts = []
        for material in body.materials:
            cells, groups = body.domain.own_of(material.names)
            share = fem.Constant(mesh, 1.0) * material.solid_fraction
            solid = PointValues(share, points, mesh.comm)(cells).ravel() > 0
            values = PointValues(moduli(u, material, body.kinematics), points, mesh.comm)
            self._parts.append((cells, values, solid, place(cells).reshape(-1, 2), np.repeat(groups, len(points))))

    def find(self) -> Stability:
        """The least margin of the current state, over all ranks. Collective."""
        found = [self._of_part(*part) for part in self._parts if np.any(part[2])]
        if self._comm.size > 1:
            found = [one for many in self._comm.allgather(found) for one in many]
        return min(found, key=margin_of, default=Stability(None))

    def _of_part(
        self, cells: np.ndarray, values: PointValues, solid: np.ndarray, place: np.ndarray, groups: np.ndarray
    ) -> Stability:
        waves = Waves(np.ascontiguousarray(values(cells).reshape(len(solid), -1)[solid].T))
        margin, angle = least_over_directions(waves)
        worst = int(np.argmin(margin))
        least, theta, k = float(margin[worst]), float(angle[worst]), np.flatnonzero(solid)[worst]
        if abs(least - 1) < UNIFORM:
            return Stability(least)
        x, y = place[k]
        q11, q12, q22 = waves[worst].tensor(theta)
        a = np.linalg.eigh([[q11, q12], [q12, q22]])[1][:, 0]
        directions = np.degrees([theta, np.arctan2(a[1], a[0])]) % 180.0
        return Stability(least, (float(x), float(y)), self._layers[int(groups[k])], *map(float, directions))


class Looks(Protocol):
    """What finds the least margin of a state."""

    def find(self) -> Stability | StabilityInSpace:
        """It. Collective."""


class StabilityWatch:
    """Looks at the states of a run as often as their margin could run out: a look costs a tenth of a time step.

    A state is looked at when, going on with its strain as it did so far, the margin would have lost `SHARE` of itself.

    Args:
        body: the problem.
        u: its displacement [µm].
    """

    def __init__(self, body: Body, u: fem.Function) -> None:
        mesh, E = body.domain.mesh, green_lagrange(u, body.kinematics)
        strains = [(E, body.domain.own_cells)]
        if body.contracting:
            strains = [(m.elastic(E), body.domain.own_of(m.names)[0]) for m in body.materials]
        planar = mesh.topology.dim == 2
        self._ellipticity: Looks = Ellipticity(body, u) if planar else EllipticityInSpace(body, u)
        points = node_points(body.space)
        self._squares = [(PointValues(ufl.inner(e, e), points, mesh.comm), cells) for e, cells in strains]
        self._comm = mesh.comm
        self.seen = AT_REST
        self._last: tuple[float, Stability | StabilityInSpace | None] = (-1.0, None)  # strain, and what was found there

    def look_if_due(self) -> Stability | StabilityInSpace | None:
        """The least margin of the current state; None while it cannot have come near to 0. Collective."""
        (strain, margin), now = self.seen, self._strain()
        if now <= strain:
            return None
        lost = (1 - margin) * (now / strain - 1) if strain else np.inf  # the margin is 1 at rest, where strain is 0
        due = now > GROWTH * strain or now > strain + INCREMENT or lost > SHARE * margin
        return self.look(now) if due else None

    def look(self, strain: float | None = None) -> Stability | StabilityInSpace:
        """The least margin of the current state. Collective."""
        now, (before, found) = self._strain() if strain is None else strain, self._last
        if found is None or now != before:  # the same to the last digit: the same state
            found = self._ellipticity.find()
            self._last = (now, found)
        self.seen = (now, 1.0 if found.margin is None else found.margin)
        return found

    def _strain(self) -> float:
        """Largest norm of the law's Green-Lagrange strain over the nodes of every element [-]."""
        largest = max(float(np.max(square(cells), initial=0.0)) for square, cells in self._squares)
        return self._comm.allreduce(math.sqrt(largest), op=MPI.MAX)


def yeoh_bounds(beta_over_mu: float) -> tuple[float | None, float | None]:
    """J1 [-] below which, in compression of any kind, and beyond which, at J = 1, the Yeoh law loses ellipticity.

    With c = beta/mu - 1/2 the waves along a principal direction, points moving across it, see 1 + c (k - k^2/5) in
    every state, k = J1 - 2: the first bound, exact. At J = 1 the weakest sees 1 + 3 c k - c k^2 where the volume is
    stiff: the second. With softer volumes it is lost somewhat earlier, for beta/mu = 2.5 never below J1 = 4.98.

    Returns:
        Both bounds; None where there is none: in compression for beta/mu < 0.857, in stretch for 0.0556 … 0.5.
    """
    c = beta_over_mu - 0.5
    below = 4.5 - math.sqrt(6.25 + 5 / c) if c > 5 / 14 else None
    beyond = 3.5 + math.copysign(math.sqrt(2.25 + 1 / c), c) if c > 0 or c < -4 / 9 else None
    return below, beyond


def moduli(u: fem.Function, material: MaterialField, kinematics: Kinematics) -> Any:
    """F, S and dS/dE of the solid, the last two over mu of the point [-], as a UFL vector of length 4 + 3 + 6.

    F is (F11, F12, F21, F22), where something contracts the elastic part of it, as E is. W is taken as a function of
    E11, E12, E22, which waves in the plane change: S is then (S11, 2 S12, S22), and dS/dE the upper triangle of W's
    Hessian, row by row.
    """
    E = material.elastic(green_lagrange(u, kinematics))
    e = [ufl.variable(E[0, 0]), ufl.variable(E[0, 1]), ufl.variable(E[1, 1])]
    plane = ufl.as_matrix([[e[0], e[1], 0.0], [e[1], e[2], 0.0], [0.0, 0.0, E[2, 2]]])
    W = material.law(Invariants(plane), **material.constants)
    S = [ufl.diff(W, e[k]) for k in range(3)]
    C = [ufl.diff(S[k], e[m]) for k in range(3) for m in range(k, 3)]
    F, mu = material.elastic_part(deformation_gradient(u, kinematics)), material.constants["mu"]
    return ufl.as_vector([F[0, 0], F[0, 1], F[1, 0], F[1, 1], *(value / mu for value in (*S, *C))])
