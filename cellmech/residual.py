"""Equilibrium of the deforming body: eq. 32 as a weak form, with only the terms that are asked for."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from cellmech.contact import Contact, Obstacle
from cellmech.domain import Domain
from cellmech.kinematics import deformation_gradient, embed, green_lagrange, plane
from cellmech.materials import Mixture
from cellmech.mixed import ElementPressure

BULK_DEGREE = 4  # quadrature degree of the bulk terms
CONTACT_DEGREE = 9  # of the contact terms, whose integrand has a kink inside an element


@dataclass(frozen=True)
class Body:
    """A mechanical problem, free of any scene: what moves, what it is made of, what acts on it.

    Args:
        domain: mesh and named groups.
        mixtures: materials (`cellmech.materials.mixtures`).
        bcs: homogeneous or fixed Dirichlet conditions on the displacement, built on `space`.
        body_force: dead force per reference volume at full load [Pa/µm], shape (2,), numbers or a UFL vector field.
        tractions: dead traction per reference area at full load [Pa] by name of the facet group, each as `body_force`.
        contact: how obstacles push, None without any.
        obstacles: the obstacles that are modelled.
        density: [Pa s^2/µm^2] when inertia is modelled, None for a quasi-static body.
        amplitude: load factor as a function of time [s], 0 … 1.
        bulk_degree, contact_degree: quadrature degrees.
        pressure_space: discontinuous functions for the pressure of mixed materials, if there are any.
    """

    domain: Domain
    mixtures: tuple[Mixture, ...]
    space: fem.FunctionSpace
    bcs: tuple[Any, ...] = ()
    body_force: Any = (0.0, 0.0)
    tractions: dict[str, Any] | None = None
    contact: Contact | None = None
    obstacles: tuple[Obstacle, ...] = ()
    density: float | None = None
    amplitude: Callable[[float], float] = lambda t: 1.0
    bulk_degree: int = BULK_DEGREE
    contact_degree: int = CONTACT_DEGREE
    pressure_space: fem.FunctionSpace | None = None

    @property
    def rate_dependent(self) -> bool:
        """Whether any stress depends on rate, or inertia is modelled: whether time is more than a load parameter."""
        return self.density is not None or any(m.rate_dependent for m in self.mixtures)


class TimeDerivative:
    """d/dt at the current time as a0 (.) + a1 (.)_n + a2 (.)_{n-1}; the a's are set by the time loop [1/s]."""

    def __init__(self, mesh: Any) -> None:
        self._a = [fem.Constant(mesh, 0.0) for _ in range(3)]

    def set(self, a: Sequence[float]) -> None:
        """Set the coefficients [1/s]."""
        for constant, value in zip(self._a, a, strict=True):
            constant.value = value

    def __call__(self, now: Any, before: Any, earlier: Any) -> Any:
        """The derivative of a symbolic quantity given at the three times."""
        return self._a[0] * now + self._a[1] * before + self._a[2] * earlier


class Displacement:
    """A displacement at one time, `whole`, and the same written as a translation, `offset`, and the rest, `part` [µm].

    Strains made of the part keep the digits that those of the whole lose to the translation: a stiff body sinks much
    farther than it deforms, and a falling one travels many radii.
    """

    def __init__(self, space: fem.FunctionSpace) -> None:
        self.whole, self.part = fem.Function(space), fem.Function(space)
        self.offset = fem.Constant(space.mesh, np.zeros(2))

    @property
    def written(self) -> Any:
        """Part and offset as one UFL expression."""
        return self.part + self.offset

    def join(self) -> None:
        """Make the whole what part and offset say."""
        self.whole.x.array[:] = self._joined()

    def split(self, free: np.ndarray) -> None:
        """Bring part and offset to the whole's present value, unless they agree with it. Collective.

        Args:
            free: whether nothing holds the x and the y component anywhere, shape (2,).
        """
        u, comm = self.whole.x.array, self.whole.function_space.mesh.comm
        if not comm.allreduce(bool(np.array_equal(u, self._joined())), op=MPI.LAND):
            self.part.x.array[:], self.offset.value = u, 0.0
            self.recentre(free)

    def recentre(self, free: np.ndarray) -> None:
        """Move the mean of the part, as far as it is free to move, into the offset. Collective."""
        index_map, nodes = self.part.function_space.dofmap.index_map, self.part.x.array.reshape(-1, 2)
        total = self.part.function_space.mesh.comm.allreduce(nodes[: index_map.size_local].sum(axis=0))
        mean = np.where(free, total / index_map.size_global, 0.0)
        self.offset.value = self.offset.value + mean
        self.part.x.array[:] = (nodes - mean).ravel()
        self.join()

    def _joined(self) -> np.ndarray:
        return (self.part.x.array.reshape(-1, 2) + self.offset.value).ravel()

    def take(self, other: Displacement) -> None:
        """Become equal to another one."""
        self.whole.x.array[:], self.part.x.array[:] = other.whole.x.array, other.part.x.array
        self.offset.value = other.offset.value


class State:
    """Displacement now and at the two accepted times before [µm], and the rates the forms are made of.

    `u` may be set by its values; whoever reads what is made of the parts calls `update` then.
    """

    def __init__(self, body: Body) -> None:
        V = body.space
        self.now, self.before, self.earlier = (Displacement(V) for _ in range(3))
        self.u, self.u_n, self.u_nn = (d.whole for d in (self.now, self.before, self.earlier))
        self.v_n, self.v_nn = (fem.Function(V) for _ in range(2))
        self.ddt = TimeDerivative(V.mesh)
        self.free = free_translations(body)
        self.pressure: ElementPressure | None = None
        if body.pressure_space is not None:
            u = self.now.written, self.now.part
            self.pressure = ElementPressure(body.domain, body.mixtures, body.pressure_space, *u, body.bulk_degree)

    @property
    def p(self) -> fem.Function | None:
        """Pressure of the mixed materials, positive in tension [Pa]; of the last `update`."""
        return None if self.pressure is None else self.pressure.p

    def written(self) -> State:
        """The same state, its displacements written as part and offset; the unknown of its forms is `now.part`."""
        return self._view(*(d.written for d in (self.now, self.before, self.earlier)))

    def parts(self) -> State:
        """The same state without its translations: for what is made of strains alone."""
        return self._view(self.now.part, self.before.part, self.earlier.part)

    def _view(self, now: Any, before: Any, earlier: Any) -> State:
        view = copy.copy(self)
        view.u, view.u_n, view.u_nn = now, before, earlier
        return view

    def split(self) -> None:
        """Bring parts and offsets to the displacements' present values. Collective."""
        for displacement in (self.now, self.before, self.earlier):
            displacement.split(self.free)

    def recentre(self) -> None:
        """Take the translation that has got into the part out of it. Collective."""
        self.now.recentre(self.free)

    def update(self) -> None:
        """Bring what follows from the displacement to its present value: its part, the pressure of mixed materials."""
        self.split()
        if self.pressure is not None:
            self.pressure.update()

    def strain_rate(self) -> Any:
        """dE/dt [1/s], shape (2, 2): BDF acts on the strain itself, so that rotations cause no stress."""
        return self.ddt(green_lagrange(self.u), green_lagrange(self.u_n), green_lagrange(self.u_nn))

    def velocity(self) -> Any:
        """du/dt [µm/s]."""
        return self.ddt(self.u, self.u_n, self.u_nn)

    def acceleration(self) -> Any:
        """d^2u/dt^2 [µm/s^2]."""
        return self.ddt(self.velocity(), self.v_n, self.v_nn)

    def nodal_velocity(self, a: Sequence[float]) -> np.ndarray:
        """The velocity's nodal values by the formula of a step, a [1/s], on this rank with ghosts [µm/s], flat."""
        return np.asarray(a[0] * self.u.x.array + a[1] * self.u_n.x.array + a[2] * self.u_nn.x.array)

    def offsets(self) -> list[list[float]]:
        """The translations now and at the two times before [µm]."""
        return [d.offset.value.tolist() for d in (self.now, self.before, self.earlier)]

    def fields(self, inertia: bool) -> dict[str, fem.Function]:
        """All else that the state consists of, by name; velocities only where they are used."""
        parts = {"u": self.now.part, "u_n": self.before.part, "u_nn": self.earlier.part}
        return parts | ({"v_n": self.v_n, "v_nn": self.v_nn} if inertia else {})

    def recall(self, offsets: Sequence[Sequence[float]], fields: Mapping[str, np.ndarray], inertia: bool) -> None:
        """Become what `offsets` and `fields` said. Collective."""
        for name, function in self.fields(inertia).items():
            function.x.array[:] = fields[name]
        for displacement, offset in zip((self.now, self.before, self.earlier), offsets, strict=True):
            displacement.offset.value = offset
            displacement.join()
        self.update()

    def rest(self) -> None:
        """Take the current displacement as one of rest: it was the same at all earlier times. Collective."""
        self.split()
        self.before.take(self.now)
        self.earlier.take(self.now)

    def advance(self, a: Sequence[float], inertia: bool) -> None:
        """Make the current displacement the last accepted one; velocities by the formula of the step, a [1/s]."""
        self.split()
        if inertia:
            self.v_nn.x.array[:] = self.v_n.x.array
            self.v_n.x.array[:] = self.nodal_velocity(a)
        self.earlier.take(self.before)
        self.before.take(self.now)


def free_translations(body: Body) -> np.ndarray:
    """Whether no Dirichlet condition holds the x or the y component anywhere, shape (2,). Collective."""
    held = np.zeros(2, dtype=bool)
    for bc in body.bcs:
        held[np.unique(bc.dof_indices()[0] % 2)] = True
    return np.asarray(body.domain.mesh.comm.allreduce(held.astype(int))) == 0  # MPI.LOR knows no arrays


def stored_energy(body: Body, state: State) -> ufl.Form:
    """Sum of c_s W over the body [Pa µm^2]."""
    E = embed(green_lagrange(state.u))
    return sum(m.solid(E, state.p)[0] * body.domain.dx(body.bulk_degree, m.names) for m in body.mixtures)


def kinetic_energy(body: Body, state: State) -> ufl.Form:
    """rho v^2 / 2 over a body with density [Pa µm^2], at the current time."""
    v, rho = state.velocity(), fem.Constant(body.domain.mesh, body.density)
    return 0.5 * rho * ufl.dot(v, v) * body.domain.dx(body.bulk_degree)


def internal_work(body: Body, state: State, w: Any) -> ufl.Form:
    """Virtual work of the solid stress, int P : grad w dV with P = F c_s S_s [Pa µm] (eqs 6, 32)."""
    F, E = deformation_gradient(state.u), embed(green_lagrange(state.u))
    return sum(
        ufl.inner(F * plane(m.solid(E, state.p)[1]), ufl.grad(w)) * body.domain.dx(body.bulk_degree, m.names)
        for m in body.mixtures
    )


def viscous_work(body: Body, state: State, w: Any) -> ufl.Form | None:
    """Virtual work of the fluid stress, P = F c_f S_f [Pa µm] (eqs 6, 23); None where no fluid carries stress."""
    F, E_dot = deformation_gradient(state.u), state.strain_rate()
    terms = [
        ufl.inner(F * m.fluid(F, E_dot), ufl.grad(w)) * body.domain.dx(body.bulk_degree, m.names)
        for m in body.mixtures
        if m.rate_dependent
    ]
    return sum(terms) if terms else None


def inertial_work(body: Body, state: State, w: Any) -> ufl.Form | None:
    """Virtual work of rho a [Pa µm] (eq. 32); None for a quasi-static body."""
    if body.density is None:
        return None
    rho = fem.Constant(body.domain.mesh, body.density)
    return rho * ufl.dot(state.acceleration(), w) * body.domain.dx(body.bulk_degree)


def contact_work(body: Body, state: State, w: Any) -> ufl.Form | None:
    """Virtual work of the obstacles on the body, terms added as in eq. 27 [Pa µm]; None without obstacles."""
    if body.contact is None or not body.obstacles:
        return None
    dx, ds = body.domain.dx(body.contact_degree), body.domain.ds(body.contact_degree, ("outer",))
    return sum(body.contact.virtual_work(state.u, w, obstacle, dx, ds) for obstacle in body.obstacles)


def load_work(body: Body, w: Any) -> ufl.Form:
    """Virtual work of the dead loads at full amplitude [Pa µm] (eqs 24, 32)."""

    def vector(load: Any) -> Any:
        is_field = isinstance(load, ufl.core.expr.Expr)
        return load if is_field else fem.Constant(body.domain.mesh, np.array(load, dtype=float))

    work = ufl.dot(vector(body.body_force), w) * body.domain.dx(body.bulk_degree)
    for name, traction in (body.tractions or {}).items():
        work += ufl.dot(vector(traction), w) * body.domain.ds(body.bulk_degree, (name,))
    return work


def equilibrium(body: Body, state: State, amplitude: Any) -> tuple[ufl.Form, ufl.Form]:
    """Residual R(u; w) of eq. 32 [Pa µm] and its tangent K = dR/du, always by `ufl.derivative`.

    With mixed materials K is the tangent at fixed pressure; `cellmech.saddle` has the rest. The unknown is `state.u`,
    or `now.part` of a state that is written as part and offset.
    """
    w, du = ufl.TestFunction(body.space), ufl.TrialFunction(body.space)
    unknown = state.u if isinstance(state.u, fem.Function) else state.now.part
    R = internal_work(body, state, w) - amplitude * load_work(body, w)
    for resisting in (viscous_work(body, state, w), inertial_work(body, state, w)):
        if resisting is not None:
            R += resisting
    contact = contact_work(body, state, w)
    if contact is not None:
        R -= contact
    return R, ufl.derivative(R, unknown, du)
