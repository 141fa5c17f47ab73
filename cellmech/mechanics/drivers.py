"""What pulls a cell besides its weight: adhesion to the obstacles, and contractile actin.

Each driver is one term of eq. 32, its virtual work on the body, with a strength of its own over time. A body without
drivers has none of these terms.

Adhesion (Derjaguin, Muller & Toporov 1975 and Maugis 1992 bracket it): between the gaps 0 and delta the surface is
pulled towards the obstacle, with the potential -w (1 - B(g/delta)), B the C2 step of eq. 25. So the work to separate a
surface is w, and pull and slope vanish at both ends. The potential is per reference area: what binds, molecules of the
membrane, stays with the piece of membrane that carries it, the force has a potential, and its tangent is symmetric. A
pull per deformed area would grow where the membrane is stretched, which is at the edge that peels.

Contractile actin: an active second Piola-Kirchhoff stress S_a = T (a0 x a0) in a part of the reference cell, added to
the mixture's, weighted by neither solid nor fluid fraction. What contracts by an active strain instead is in
`cellmech.mechanics.contraction`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import ufl

from cellmech.mechanics.contact import smooth_step, symbolic_depth_and_normal
from cellmech.mechanics.kinematics import deformation_gradient
from cellmech.mechanics.normal_law import pull_at
from cellmech.mechanics.obstacles import Obstacle
from cellmech.mechanics.sector import Sector


class Driver(Protocol):
    """A term that does work on the body, with a strength of its own."""

    @property
    def name(self) -> str:
        """In results and messages."""

    @property
    def share(self) -> Callable[[float], float]:
        """How much of it acts, as a function of the body's amplitude [-]."""

    @property
    def reach_um(self) -> float:
        """Gap to an obstacle across which it acts [µm]; 0 of what needs no obstacle."""

    def work(self, body: Any, u: Any, w: Any) -> ufl.Form | None:
        """Virtual work on the body at full strength [Pa µm or pN]; None where there is nothing to act on."""

    def scale(self, body: Any, w: Any) -> ufl.Form:
        """Virtual work of a force of its size, to measure residuals by."""


@dataclass(frozen=True)
class Adhesion:
    """Adhesion to the obstacles of a body.

    Args:
        share: of its strength that acts, as a function of the body's amplitude [-].
        work_Pa_um: work of adhesion w per reference area [Pa µm = µJ/m^2].
        range_um: gap delta beyond which nothing is pulled [µm].
        bare: obstacles that do not adhere.
        above_um: level above which they do [µm], printed tops; None for everywhere.
        name: in results.
    """

    share: Callable[[float], float]
    work_Pa_um: float
    range_um: float
    bare: tuple[Obstacle, ...] = ()
    above_um: float | None = None
    name: str = "adhesion"

    @property
    def reach_um(self) -> float:
        """See `Driver`."""
        return self.range_um

    def pull_at(self, d: float) -> float:
        """Pull at the depth d [Pa], as a number."""
        return pull_at(d, self.work_Pa_um, self.range_um)

    def potential(self, x: Any, obstacle: Obstacle) -> Any:
        """Potential of a piece of surface at x per reference area [Pa µm]: -w in touch, 0 beyond the range."""
        d, _ = symbolic_depth_and_normal(obstacle, x)
        half = self.range_um / 2
        near = smooth_step(d + half, half)
        if self.above_um is not None:
            near = near * smooth_step(x[1] - self.above_um, self.range_um)
        return -self.work_Pa_um * near

    def work(self, body: Any, u: Any, w: Any) -> ufl.Form | None:
        """See `Driver`: minus the potential's gradient, over the outline."""
        x = ufl.variable(ufl.SpatialCoordinate(body.domain.mesh) + u)
        pulls = [-ufl.diff(self.potential(x, one), x) for one in body.obstacles if one not in self.bare]
        if not pulls:
            return None
        return body.along(ufl.dot(sum(pulls[1:], pulls[0]), w), ("outer",), body.contact_degree)

    def scale(self, body: Any, w: Any) -> ufl.Form:
        """See `Driver`: the mean pull, over the outline."""
        return body.along(body.domain.constant(self.work_Pa_um / self.range_um) * w[1], ("outer",))


@dataclass(frozen=True)
class Actin:
    """Contractile actin in a part of the cell.

    Args:
        share: of its stress that acts, as a function of the body's amplitude [-].
        stress_Pa: active stress T [Pa], positive in tension.
        sector: where.
        direction: of a0, one of `DIRECTIONS`. "tangential" pulls in all directions of the tangent surface alike, as a
            cortex does: S_a = T (I - e_r x e_r); "meridional" in the one that leads from bottom to top. In the plane
            these two are the same.
        name: in results.
    """

    share: Callable[[float], float]
    stress_Pa: float
    sector: Sector
    direction: str = "tangential"
    name: str = "actin"
    reach_um: float = 0.0

    def stress(self, body: Any) -> Any:
        """S_a at full strength [Pa], shape (3, 3)."""
        X = ufl.SpatialCoordinate(body.domain.mesh)
        structure = self.sector.structure(X, self.direction, body.kinematics)
        return body.domain.constant(self.stress_Pa) * self.sector.inside(X) * structure

    def work(self, body: Any, u: Any, w: Any) -> ufl.Form | None:
        """See `Driver`: -int F S_a : grad w dV."""
        F = deformation_gradient(u, body.kinematics)
        return body.over(-ufl.inner(F * self.stress(body), body.kinematics.gradient(w)), self.sector.names)

    def scale(self, body: Any, w: Any) -> ufl.Form:
        """See `Driver`: what it does to the undeformed body."""
        return body.over(-ufl.inner(self.stress(body), body.kinematics.gradient(w)), self.sector.names)


@dataclass(frozen=True)
class Timeline:
    """Ramps that follow each other or go together, as one progress from 0 to 1 that they all depend on.

    With one ramp the progress is that ramp. With several it is their mean, which rises wherever one of them does: so
    what follows the load follows all of them, in the order in which they come.

    Args:
        ramps: of the weight and of each driver, functions of the time [s] that rise from 0 to 1.
        end_s: by when all are at rest [s].
    """

    ramps: Sequence[Callable[[float], float]]
    end_s: float

    def progress(self, t: float) -> float:
        """The mean of the ramps at a time [s]."""
        return sum(ramp(t) for ramp in self.ramps) / len(self.ramps)

    def time(self, progress: float) -> float:
        """The first time [s] at which the progress is reached."""
        early, late = 0.0, self.end_s
        if self.progress(0.0) >= progress:
            return 0.0
        if self.progress(late) <= progress:
            return late
        for _ in range(200):  # bisection: to the last digit of a double
            middle = 0.5 * (early + late)
            if not early < middle < late:
                break
            early, late = (middle, late) if self.progress(middle) < progress else (early, middle)
        return late

    def share(self, number: int) -> Callable[[float], float]:
        """How much of one ramp acts, as a function of the progress; of what is there at once, in proportion."""

        def share(progress: float) -> float:
            at_once = self.progress(0.0)
            if at_once > progress:
                return self.ramps[number](0.0) * progress / at_once
            return self.ramps[number](self.time(progress))

        return share
