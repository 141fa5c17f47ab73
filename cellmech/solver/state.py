"""Present and past of a body: displacements as a translation and the rest, and their rates."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from cellmech.mechanics.balance import Body
from cellmech.mechanics.kinematics import green_lagrange
from cellmech.solver.element_pressure import ElementPressure


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
        self.components = space.dofmap.index_map_bs
        self.offset = fem.Constant(space.mesh, np.zeros(self.components))

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
            free: whether nothing holds each component anywhere.
        """
        u, comm = self.whole.x.array, self.whole.function_space.mesh.comm
        if not comm.allreduce(bool(np.array_equal(u, self._joined())), op=MPI.LAND):
            self.part.x.array[:], self.offset.value = u, 0.0
            self.recentre(free)

    def recentre(self, free: np.ndarray) -> None:
        """Move the mean of the part, as far as it is free to move, into the offset. Collective."""
        index_map, nodes = self.part.function_space.dofmap.index_map, self.part.x.array.reshape(-1, self.components)
        total = self.part.function_space.mesh.comm.allreduce(nodes[: index_map.size_local].sum(axis=0))
        mean = np.where(free, total / index_map.size_global, 0.0)
        self.offset.value = self.offset.value + mean
        self.part.x.array[:] = (nodes - mean).ravel()
        self.join()

    def _joined(self) -> np.ndarray:
        return (self.part.x.array.reshape(-1, self.components) + self.offset.value).ravel()

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
        self.ddt, self.kinematics = TimeDerivative(V.mesh), body.kinematics
        self.free = free_translations(body)
        self.pressure: ElementPressure | None = None
        if body.pressure_space is not None:
            self.pressure = ElementPressure(body, self.now.written, self.now.part)

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
        """dE/dt [1/s], shape (3, 3): BDF acts on the strain itself, so that rotations cause no stress."""
        return self.ddt(*(green_lagrange(u, self.kinematics) for u in (self.u, self.u_n, self.u_nn)))

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
    """For each component, True if no Dirichlet condition holds it anywhere. Collective."""
    components = body.space.dofmap.index_map_bs
    held = np.zeros(components, dtype=bool)
    for bc in body.bcs:
        held[np.unique(bc.dof_indices()[0] % components)] = True
    return np.asarray(body.domain.mesh.comm.allreduce(held.astype(int))) == 0  # MPI.LOR knows no arrays
