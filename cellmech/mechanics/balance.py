"""Equilibrium of the deforming body: eq. 32 as a weak form, with only the terms that are asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import ufl

from cellmech.mechanics.contact import Contact
from cellmech.mechanics.contraction import Contraction
from cellmech.mechanics.drivers import Driver
from cellmech.mechanics.kinematics import PLANE_STRAIN, Kinematics, deformation_gradient, green_lagrange
from cellmech.mechanics.materials import MaterialField
from cellmech.mechanics.obstacles import Obstacle

BULK_DEGREE = 4  # quadrature degree of the bulk terms
CONTACT_DEGREE = 9  # of the contact terms, whose integrand has a kink inside an element


class Motion(Protocol):
    """A body's state, as the terms of eq. 32 need it."""

    u: Any
    now: Any

    @property
    def p(self) -> Any:
        """Pressure of the mixed materials [Pa]."""

    def strain_rate(self) -> Any:
        """dE/dt [1/s]."""

    def velocity(self) -> Any:
        """du/dt [µm/s]."""

    def acceleration(self) -> Any:
        """d^2u/dt^2 [µm/s^2]."""


@dataclass(frozen=True)
class Body:
    """A mechanical problem, free of any scene: what moves, what it is made of, what acts on it.

    Args:
        domain: `mesh`, and the measures `dx`, `ds` and the `constant` of forms on it (`cellmech.fem.domain.Domain`).
        materials: of the cells (`cellmech.fem.coefficients.material_fields`).
        bcs: homogeneous or fixed Dirichlet conditions on the displacement, built on `space`.
        body_force: dead force per reference volume at full load [Pa/µm], shape (2,), numbers or a UFL vector field.
        tractions: dead traction per reference area at full load [Pa] by name of the facet group, each as `body_force`.
        contact: how obstacles push, None without any.
        obstacles: the obstacles that are modelled.
        density: [Pa s^2/µm^2] when inertia is modelled, None for a quasi-static body.
        amplitude: load factor as a function of time [s], 0 … 1; with drivers, the progress of all (`Timeline`).
        dead: share of the dead loads that acts at an amplitude [-]; all of it without drivers.
        drivers: what pulls besides the dead loads.
        drag: traction against the outline's velocity [Pa s/µm], None without a medium that resists.
        bulk_degree, contact_degree: quadrature degrees.
        pressure_space: discontinuous functions for the pressure of mixed materials, if there are any.
        kinematics: what the mesh means in space.
        shells: thin layers among the groups of cells, each with its stiffness over that of the softest group [-]: what
            the linear solver should know, which changes no solution.
    """

    domain: Any
    materials: tuple[MaterialField, ...]
    space: Any
    bcs: tuple[Any, ...] = ()
    body_force: Any = (0.0, 0.0)
    tractions: dict[str, Any] | None = None
    contact: Contact | None = None
    obstacles: tuple[Obstacle, ...] = ()
    density: float | None = None
    amplitude: Callable[[float], float] = lambda t: 1.0
    dead: Callable[[float], float] = lambda amplitude: amplitude
    drivers: tuple[Driver, ...] = ()
    drag: float | None = None
    bulk_degree: int = BULK_DEGREE
    contact_degree: int = CONTACT_DEGREE
    pressure_space: Any = None
    kinematics: Kinematics = PLANE_STRAIN
    shells: Mapping[str, float] = field(default_factory=dict)

    @property
    def rate_dependent(self) -> bool:
        """True if any stress depends on rate, or inertia is modelled: whether time is more than a load parameter."""
        return self.resisted or any(m.rate_dependent for m in self.materials)

    @property
    def resisted(self) -> bool:
        """True if inertia or a medium resists a translation."""
        return self.density is not None or self.drag is not None

    @property
    def pulling(self) -> tuple[Driver, ...]:
        """The drivers by which obstacles pull the body across a gap."""
        return tuple(driver for driver in self.drivers if driver.reach_um > 0)

    @property
    def contracting(self) -> tuple[Contraction, ...]:
        """The drivers that act through the material."""
        return tuple(driver for driver in self.drivers if isinstance(driver, Contraction))

    def contract(self, amplitude: float) -> None:
        """Bring the active strains to what they are at an amplitude [-]: stresses and energies are of now."""
        for driver in self.contracting:
            driver.now.value = driver.at(amplitude)

    @property
    def reach_um(self) -> float:
        """Gap to an obstacle across which it acts on the body [µm]; negative for a depth."""
        contact = -self.contact.threshold_um if self.contact is not None else 0.0
        return max([contact, *(driver.reach_um for driver in self.drivers)])

    @property
    def symmetric(self) -> bool:
        """True if the tangent is symmetric because contact has a potential and nothing depends on rate."""
        return self.contact is not None and self.contact.symmetric and not any(m.rate_dependent for m in self.materials)

    def over(self, integrand: Any, names: Sequence[str] | None = None, degree: int | None = None) -> ufl.Form:
        """An integral in space over named groups of cells, all by default."""
        return self._weighed(integrand) * self.domain.dx(degree or self.bulk_degree, names)

    def along(self, integrand: Any, names: Sequence[str], degree: int | None = None) -> ufl.Form:
        """An integral in space over named groups of facets on the boundary."""
        return self._weighed(integrand) * self.domain.ds(degree or self.bulk_degree, names)

    def _weighed(self, integrand: Any) -> Any:
        return integrand * self.kinematics.weight(ufl.SpatialCoordinate(self.domain.mesh))


def stored_energy(body: Body, state: Motion) -> ufl.Form:
    """Sum of c_s W over the body [Pa µm^2]."""
    E = green_lagrange(state.u, body.kinematics)
    return sum(body.over(m.solid(E, state.p)[0], m.names) for m in body.materials)


def contraction_power(body: Body, state: Motion, driver: Contraction, q: Any) -> ufl.Form:
    """dW/de of the stored energy, weighted by q [Pa µm^2]: the power of a contraction e is this times de/dt."""
    E, e = green_lagrange(state.u, body.kinematics), ufl.variable(driver.now)
    varied = replace(driver, now=e)
    terms = []
    for m in body.materials:
        if driver in m.contractions:
            contractions = tuple(varied if one is driver else one for one in m.contractions)
            W, _ = replace(m, contractions=contractions).solid(E)
            terms.append(body.over(ufl.diff(W, e) * q, m.names))
    return sum(terms)


def kinetic_energy(body: Body, state: Motion) -> ufl.Form:
    """rho v^2 / 2 over a body with density [Pa µm^2], at the current time."""
    v, rho = state.velocity(), body.domain.constant(body.density)
    return body.over(0.5 * rho * ufl.dot(v, v))


def internal_work(body: Body, state: Motion, w: Any) -> ufl.Form:
    """Virtual work of the solid stress, int P : grad w dV with P = F c_s S_s [Pa µm] (eqs 6, 32)."""
    k = body.kinematics
    F, E = deformation_gradient(state.u, k), green_lagrange(state.u, k)
    return sum(body.over(ufl.inner(F * m.solid(E, state.p)[1], k.gradient(w)), m.names) for m in body.materials)


def viscous_work(body: Body, state: Motion, w: Any) -> ufl.Form | None:
    """Virtual work of the fluid stress, P = F c_f S_f [Pa µm] (eqs 6, 23); None where no fluid carries stress."""
    k = body.kinematics
    F, E_dot = deformation_gradient(state.u, k), state.strain_rate()
    terms = [
        body.over(ufl.inner(F * m.fluid(F, E_dot), k.gradient(w)), m.names) for m in body.materials if m.rate_dependent
    ]
    return sum(terms) if terms else None


def drag_work(body: Body, state: Motion, w: Any) -> ufl.Form | None:
    """Virtual work against the medium, int c v . w dA over the outline [Pa µm]; None without a medium that resists.

    With c = 3 eta/(2 R) this is Stokes' traction on a rigid sphere, which is uniform: in all 6 pi eta R v.
    """
    if body.drag is None:
        return None
    return body.along(body.domain.constant(body.drag) * ufl.dot(state.velocity(), w), ("outer",))


def inertial_work(body: Body, state: Motion, w: Any) -> ufl.Form | None:
    """Virtual work of rho a [Pa µm] (eq. 32); None for a quasi-static body."""
    if body.density is None:
        return None
    rho = body.domain.constant(body.density)
    return body.over(rho * ufl.dot(state.acceleration(), w))


def contact_work(body: Body, state: Motion, w: Any) -> ufl.Form | None:
    """Virtual work of the obstacles on the body, terms added as in eq. 27 [Pa µm]; None without obstacles."""
    if body.contact is None or not body.obstacles:
        return None
    place = body.domain.mesh, body.kinematics
    forces = [ufl.dot(body.contact.force(state.u, obstacle, *place), w) for obstacle in body.obstacles]
    if body.contact.on_surface:
        return sum(body.along(force, ("outer",), body.contact_degree) for force in forces)
    return sum(body.over(force, None, body.contact_degree) for force in forces)


def load_work(body: Body, w: Any) -> ufl.Form:
    """Virtual work of the dead loads at full amplitude [Pa µm] (eqs 24, 32)."""

    def vector(load: Any) -> Any:
        is_field = isinstance(load, ufl.core.expr.Expr)
        return load if is_field else body.domain.constant(load)

    work = body.over(ufl.dot(vector(body.body_force), w))
    for name, traction in (body.tractions or {}).items():
        work += body.along(ufl.dot(vector(traction), w), (name,))
    return work


def equilibrium(body: Body, state: Motion, amplitude: Any, shares: Sequence[Any] = ()) -> tuple[ufl.Form, ufl.Form]:
    """Residual R(u; w) of eq. 32 [Pa µm] and its tangent K = dR/du, always by `ufl.derivative`.

    The dead loads have this amplitude and each driver its share. With mixed materials K is the tangent at fixed
    pressure; `cellmech.solver.saddle` has the rest. The unknown is `state.u`, or `now.part` of a state that is written
    as part and offset.
    """
    w, du = ufl.TestFunction(body.space), ufl.TrialFunction(body.space)
    unknown = state.u if isinstance(state.u, ufl.Coefficient) else state.now.part
    R = internal_work(body, state, w) - amplitude * load_work(body, w)
    for resisting in (viscous_work(body, state, w), drag_work(body, state, w), inertial_work(body, state, w)):
        if resisting is not None:
            R += resisting
    contact = contact_work(body, state, w)
    if contact is not None:
        R -= contact
    for driver, share in zip(body.drivers, shares, strict=True):
        pull = driver.work(body, state.u, w)
        if pull is not None:
            R -= share * pull
    return R, ufl.derivative(R, unknown, du)
