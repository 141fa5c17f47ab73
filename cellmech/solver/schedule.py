"""Orders, accounts and memory of a run: when to stop, the cost of a step and of all, where to go on from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cellmech.solver.instants import distinct

SMALL = 0.15  # of a displacement that the load leads to: errors of what is smaller are not relative to it
LOAD_STEPS = 20  # reported equilibria of a ramp when nothing depends on rate


@dataclass(frozen=True)
class Step:
    """One accepted step.

    Args:
        t_s, dt_s: time reached and step [s].
        amplitude: load amplitude at that time [-].
        newton: Newton iterations.
        error_estimate: relative local error [-], None where nothing depends on rate.
    """

    t_s: float
    dt_s: float
    amplitude: float
    newton: int
    error_estimate: float | None


@dataclass
class Totals:
    """The cost of a whole run, and the largest `rounded` of its accepted steps (`cellmech.solver.newton.Outcome`)."""

    steps: int = 0
    rejected_steps: int = 0
    failed_solves: int = 0
    newton_iterations: int = 0
    factorisations: int = 0
    linear_iterations: int = 0
    rounded: float = 0.0


@dataclass(frozen=True)
class Schedule:
    """The end of a run, and the times to land on before.

    Args:
        end_s: end [s].
        outputs_s: times that are hit exactly.
        rtol: tolerated relative local error of a step [-].
        ramp_end_s: end of the load ramp [s]; 0 when the load is switched on at once.
        load_steps: into how many a ramp is divided when nothing depends on rate; 0 for the landings only.
        small_um: errors are relative to the largest displacement so far, but never to less than this [µm].
        told_um: a state that has moved less than this [µm] may err by as much as it has moved.
    """

    end_s: float
    outputs_s: tuple[float, ...] = ()
    rtol: float = 1e-3
    ramp_end_s: float = 0.0
    load_steps: int = LOAD_STEPS
    small_um: float = 1e-3
    told_um: float = 0.0

    @property
    def scale_s(self) -> float:
        """The time within which the load changes [s]: the ramp, or the whole time without one."""
        return self.ramp_end_s or self.end_s

    @cached_property
    def landings_s(self) -> tuple[float, ...]:
        """Times that are hit exactly: outputs, the ramp's end unless it is skipped, the end [s]."""
        return distinct(self.outputs_s, (self.ramp_end_s,) if self.load_steps else (), self.end_s)

    @cached_property
    def load_landings_s(self) -> tuple[float, ...]:
        """The same and what divides the ramp, for a body of which nothing depends on rate [s]."""
        parts = (self.ramp_end_s * k / self.load_steps for k in range(1, self.load_steps))
        return distinct(self.landings_s, parts, self.end_s)

    def next_landing(self, t: float) -> float:
        """The first landing time after t [s]."""
        return next(x for x in self.landings_s if x > t)

    def next_load_step(self, t: float) -> float:
        """The first time after t [s] that is a landing or divides the ramp."""
        return next(x for x in self.load_landings_s if x > t)


@dataclass(frozen=True)
class Memory:
    """All that a run needs to go on from an accepted step as if it had never stopped.

    Args:
        numbers: what JSON can hold.
        fields: nodal vectors on this rank, owned nodes at least, flat.
    """

    numbers: dict[str, Any]
    fields: dict[str, np.ndarray]
