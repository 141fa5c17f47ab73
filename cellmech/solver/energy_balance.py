"""Balance of the work of gravity and drivers: stored, dissipated, done against contact and medium, kinetic."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from petsc4py import PETSc

from cellmech.fem.jit import compile_form
from cellmech.mechanics.balance import (
    Body,
    contact_work,
    contraction_power,
    drag_work,
    kinetic_energy,
    load_work,
    stored_energy,
    viscous_work,
)
from cellmech.solver.state import State

Fields: TypeAlias = dict[str, np.ndarray]


def owned_values(form: Any) -> np.ndarray:
    """A compiled linear form assembled: the values that this rank owns, shape (n,). Collective."""
    vector: PETSc.Vec = petsc.assemble_vector(form)
    vector.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
    values = vector.getArray().copy()
    vector.destroy()  # petsc4py keeps what is merely dropped
    return values


class Ledger:
    """Integrates the works over accepted steps, force and path as quadratics through the last three of them.

    The follower traction of the contact has no potential, so its energy is the time integral of its power. Third order
    in the step; the first step, which has no predecessor, is booked by the trapezoidal rule. The contact's work, small
    beside the others, needs this: at the default tolerance the trapezoidal rule alone is 1.6 % off.
    Serves one body; after a change of its obstacles `rebind` it.

    The work of a contraction e is int dW/de de: its forces are dW/de, shared out among the nodes, and the path of each
    is e.
    """

    def __init__(self, body: Body, state: State) -> None:
        self.works = dict.fromkeys(("load", "viscous", "contact"), 0.0)
        self.amplitude, self.turnover = 0.0, 0.0
        self.rebind(body, state)
        self.rest()

    def rebind(self, body: Body, state: State) -> None:
        """Compile the forms of a body whose obstacles changed, keeping what has been integrated."""
        self.body, self.state = body, state
        comm = body.domain.mesh.comm
        w = ufl.TestFunction(body.space)
        parts = state.parts()
        self._stored = compile_form(stored_energy(body, parts), comm)
        self._kinetic = None if body.density is None else compile_form(kinetic_energy(body, state.written()), comm)
        terms = {
            "load": load_work(body, w),
            "viscous": viscous_work(body, parts, w),
            "contact": contact_work(body, state, w),
            "drag": drag_work(body, state.written(), w),
        }
        terms |= {driver.name: driver.work(body, state.u, w) for driver in body.drivers}
        terms |= {driver.name: contraction_power(body, parts, driver, w[0]) for driver in body.contracting}
        self._contracting = {driver.name: driver for driver in body.contracting}
        self._shares = {driver.name: driver.share for driver in body.drivers if driver not in body.contracting}
        acting = (*self._shares, *self._contracting, *(["drag"] if body.drag else []))
        self.works |= {name: 0.0 for name in acting if name not in self.works}
        self._terms = {name: compile_form(form, comm) for name, form in terms.items() if form is not None}
        self._components = body.space.dofmap.index_map_bs
        self._owned = body.space.dofmap.index_map.size_local * self._components
        self.load_vector = self._assemble("load")

    def _assemble(self, name: str) -> np.ndarray:
        if name not in self._terms:
            return np.zeros(self._owned)
        return owned_values(self._terms[name])

    def _sum(self, values: Any) -> Any:
        return self.body.domain.mesh.comm.allreduce(values)

    def rest(self) -> None:
        """Start from the current displacement, free of force."""
        self._earlier = self.state.u.x.array[: self._owned].copy()
        self._forces = {name: np.zeros(self._owned) for name in self.works if name != "load"}
        self._slopes: Fields = {}
        self._last_step = 0.0

    def begin(self, amplitude: float) -> None:
        """State the amplitude [-] at which the body is at rest at the start (0, or 1 when it is switched on).

        What contracts at once does its work before anything moves.
        """
        self.amplitude = amplitude
        self.body.contract(0.0)
        for name, driver in self._contracting.items():
            before = self._store()
            driver.now.value = driver.at(amplitude)
            self.works[name] += self._store() - before
        for name in self._contracting:
            self._forces[name] = self._acting(name, amplitude)

    def given(self) -> dict[str, float]:
        """Works of what drives the body so far [Pa µm^2]: "load", and of each driver by its name."""
        return {"load": self.works["load"]} | {driver.name: self.works[driver.name] for driver in self.body.drivers}

    @property
    def load_work(self) -> float:
        """Work of the dead loads so far [Pa µm^2]."""
        return self.works["load"]

    @property
    def dissipated(self) -> float:
        """Work against the fluid's stress so far [Pa µm^2]."""
        return self.works["viscous"]

    @property
    def contact_work(self) -> float:
        """Work against the contact so far [Pa µm^2]."""
        return -self.works["contact"]

    def _acting(self, name: str, amplitude: float) -> np.ndarray:
        """Nodal forces of a term at an amplitude [Pa µm]."""
        if name in self._contracting:
            self.body.contract(amplitude)
        share = self._shares[name](amplitude) if name in self._shares else 1.0
        return share * self._assemble(name)

    def _obstacles(self, amplitude: float) -> np.ndarray:
        """Nodal forces of the obstacles, push and pull [Pa µm]."""
        return sum((self._acting(d.name, amplitude) for d in self.body.pulling), self._assemble("contact"))

    def _resultant(self, forces: np.ndarray) -> np.ndarray:
        """Sum of nodal forces over the modelled body, a component each. Collective."""
        return self._sum(forces.reshape(-1, self._components).sum(axis=0))

    def contact_force(self, amplitude: float | None = None) -> np.ndarray:
        """Resultant of the obstacles, push and pull, on the modelled body now [Pa µm], a component each. Collective.

        Args:
            amplitude: at which they pull [-]; that of the last step if left out.
        """
        return self._resultant(self._obstacles(self.amplitude if amplitude is None else amplitude))

    def pull(self, amplitude: float) -> np.ndarray:
        """Resultant of the obstacles' pull on the modelled body now [Pa µm], a component each. Collective."""
        found = [self._resultant(self._acting(driver.name, amplitude)) for driver in self.body.pulling]
        return sum(found, np.zeros(self._components))

    def resultant(self, name: str) -> np.ndarray:
        """Resultant of one term on the modelled body, with its share at the last step [Pa µm], a component each."""
        return self._resultant(self._acting(name, self.amplitude))

    def load_resultant(self) -> np.ndarray:
        """Resultant of the dead loads at full amplitude [Pa µm], a component each. Collective."""
        return self._resultant(self.load_vector)

    def moment(self, amplitude: float) -> float:
        """Moment of obstacles and load now about where the load acts, or the nodes' middle [Pa µm^2 or aJ]. Collective.

        Counter-clockwise in the plane; in space its size, of the components that no plane of symmetry bears. Stresses
        that are symmetric add nothing to it.
        """
        load = self.load_vector.reshape(-1, self._components)
        nodes = self.body.space.tabulate_dof_coordinates()[: len(load), : self._components]
        x = nodes + self.state.u.x.array[: self._owned].reshape(load.shape)
        weights = load[:, 1] if self._sum(np.abs(load[:, 1]).sum()) > 0 else np.ones(len(load))
        centre = self._sum(weights @ x) / self._sum(weights.sum())
        obstacles = self._obstacles(amplitude).reshape(-1, self._components)
        lever, force = x - centre, obstacles + self.body.dead(amplitude) * load
        if self._components == 2:
            return float(self._sum(np.sum(lever[:, 0] * force[:, 1] - lever[:, 1] * force[:, 0])))
        free = np.array([np.delete(self.state.free, axis).all() for axis in range(3)])
        return float(np.linalg.norm(self._sum(np.cross(lever, force).sum(axis=0))[free]))

    def stored(self) -> float:
        """Strain energy at the last step's amplitude now [Pa µm^2]. Collective."""
        self.body.contract(self.amplitude)
        return self._store()

    def _store(self) -> float:
        return float(self._sum(fem.assemble_scalar(self._stored)))

    def kinetic(self) -> float:
        """Kinetic energy now [Pa µm^2]; 0 for a quasi-static body. Call before history moves; collective."""
        return 0.0 if self._kinetic is None else float(self._sum(fem.assemble_scalar(self._kinetic)))

    def add_step(self, amplitude: float, step: float) -> None:
        """Book the step [s] from the last accepted displacement to now. Call before history moves; collective."""
        u = self.state.u.x.array[: self._owned].copy()
        forces = {name: self._acting(name, amplitude) for name in self._forces}
        load, load_before = ({"load": self.body.dead(a) * self.load_vector} for a in (amplitude, self.amplitude))
        paths, earlier = (
            {"path": v} | self._contracted(a) for v, a in ((u, amplitude), (self._earlier, self.amplitude))
        )
        now, before = forces | load | paths, self._forces | load_before | earlier
        slopes = {name: (now[name] - before[name]) / step for name in now}
        works = self._sum(np.array([self._work(name, now, before, slopes, step) for name in self.works]))
        for name, work in zip(self.works, works, strict=True):
            self.works[name] += float(work)
        self.turnover = max(self.turnover, sum(map(abs, self.given().values())))
        self._earlier, self._forces, self.amplitude = u, forces, amplitude
        self._slopes, self._last_step = slopes, step

    def _contracted(self, amplitude: float) -> Fields:
        """Paths of the contractions, each the same at every node [-]."""
        return {f"path_{name}": np.full(self._owned, one.at(amplitude)) for name, one in self._contracting.items()}

    def _work(self, name: str, now: Fields, before: Fields, slopes: Fields, step: float) -> float:
        """int f . du over the step [Pa µm^2]: the trapezoidal rule, and what the curvatures of f and u add to it.

        With second divided differences f2, u2 over the last two steps the quadratics give h^3/6 (f' . u2 - f2 . u').
        """
        path = f"path_{name}" if name in self._contracting else "path"
        f, u = slopes[name], slopes[path]
        trapezoid = float((before[name] + now[name]) @ u) * step / 2
        if not self._slopes:
            return trapezoid
        f2, u2 = ((slopes[n] - self._slopes[n]) / (step + self._last_step) for n in (name, path))
        return trapezoid + step**3 / 6 * float(f @ u2 - f2 @ u)

    def numbers(self) -> dict[str, float]:
        """The integrals and their largest so far [Pa µm^2], the amplitude they are brought to [-], and the step [s]."""
        return self.works | {"turnover": self.turnover, "amplitude": self.amplitude, "last_step": self._last_step}

    def fields(self) -> Fields:
        """The forces at the last accepted step [Pa µm], and the slopes over it of forces and path; owned nodes."""
        return self._forces | {f"slope_{name}": values for name, values in self._slopes.items()}

    def recall(self, numbers: dict[str, float], fields: Fields) -> None:
        """Go on from what `numbers` and `fields` held; the state has been recalled."""
        self.works = {name: numbers[name] for name in self.works}
        self.turnover, self.amplitude, self._last_step = (numbers[n] for n in ("turnover", "amplitude", "last_step"))
        self._earlier = self.state.u.x.array[: self._owned].copy()
        self._forces = {name: fields[name][: self._owned].copy() for name in self._forces}
        slopes = [name for name in fields if name.startswith("slope_")]
        self._slopes = {name.removeprefix("slope_"): fields[name][: self._owned].copy() for name in slopes}
