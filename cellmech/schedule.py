"""What a run is told, tells and remembers: when to stop, what a step and a whole run took, where to go on from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

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
    """What a whole run took."""

    steps: int = 0
    rejected_steps: int = 0
    failed_solves: int = 0
    newton_iterations: int = 0
    factorisations: int = 0


@dataclass(frozen=True)
class Schedule:
    """When to stop and where to land on the way.

    Args:
        end_s: end [s].
        landings_s: times that are hit exactly: end of the ramp, output times.
        rtol: tolerated relative local error of a step [-].
        ramp_end_s: end of the load ramp [s]; 0 when the load is switched on at once.
        load_steps: into how many a ramp is divided when nothing depends on rate; 0 for the landings only.
        small_um: errors are relative to the largest displacement so far, but never to less than this [µm].
    """

    end_s: float
    landings_s: tuple[float, ...] = ()
    rtol: float = 1e-3
    ramp_end_s: float = 0.0
    load_steps: int = LOAD_STEPS
    small_um: float = 1e-3

    @property
    def scale_s(self) -> float:
        """The time within which the load changes [s]: the ramp, or the whole time without one."""
        return self.ramp_end_s or self.end_s

    @property
    def skips_the_ramp(self) -> bool:
        """Whether a load that comes on bit by bit may be put on at once."""
        return self.ramp_end_s > 0 and not self.load_steps

    def next_landing(self, t: float) -> float:
        """The first landing time after t [s]."""
        return min([x for x in self.landings_s if x > t * (1 + 1e-12)] + [self.end_s])

    def next_load_step(self, t: float) -> float:
        """The first time after t [s] that is a landing or divides the ramp."""
        parts = [self.ramp_end_s * k / self.load_steps for k in range(1, self.load_steps + 1)]
        return min([self.next_landing(t), *(x for x in parts if t * (1 + 1e-12) < x)])


@dataclass(frozen=True)
class Memory:
    """What a run needs to go on from an accepted step as if it had never stopped.

    Args:
        numbers: what JSON can hold.
        fields: nodal vectors on this rank, owned nodes at least, flat.
    """

    numbers: dict[str, Any]
    fields: dict[str, np.ndarray]
