"""Least-squares fits of what the paper leaves open; the only part of this package that solves.

What is varied are logarithms, and a residual is the ln of ours / printed of the differences from rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mpi4py import MPI
from scipy.optimize import least_squares

from cellmech import SolveError, solve
from cellmech.figures import QUANTITIES
from cellmech.scene import load_study
from studies.paper.misfit import log_ratio, misfit, one_sided
from studies.paper.printed import LAWS, RESTS, Paper

EVALUATIONS = 8  # of the residuals at most, per fit; their differences come on top
STEP = 0.03  # of a finite difference, in ln
ENOUGH = 3e-3  # relative change at which a fit ends
STRAINS = ("J1", "J2")
MAXIMA = ("sigma", "J1", "J2", "J3")
LOAD, SMEAR = "load.factor", "cell.smear_um"
COLLAPSING = "saint-venant"  # the law whose load is bounded by where it has an equilibrium
BRACKET = (3.0, 4.0)  # load factors between which that bound lies
DIGITS = 0.01  # share of the load to which it is found


@dataclass(frozen=True)
class Free:
    """An open input that is fitted: its dotted key, bounds and first guess."""

    key: str
    least: float
    most: float
    start: float


@dataclass(frozen=True)
class Kind:
    """What is fitted to what.

    Args:
        name: for people.
        free: the inputs.
        targets: the printed numbers.
        settings: of the scene besides.
    """

    name: str
    free: tuple[Free, ...]
    targets: tuple[str, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)


LARGE_LOAD, MIDDLE_LOAD = (Free(LOAD, 0.5, 60.0, start) for start in (20.0, 8.0))
SMEARING = Free(SMEAR, 0.05, 1.0, 0.8)  # up to the paper's coarsest mesh
TO_STRAINS = Kind("load, to J1 and J2", (LARGE_LOAD,), STRAINS)
TOGETHER = Kind("one load for three laws, to J1 and J2", (LARGE_LOAD,), STRAINS)
TO_ALL = Kind("load, to stress and strains", (MIDDLE_LOAD,), MAXIMA)
SMEARED = Kind("load and smearing, to stress and strains", (MIDDLE_LOAD, SMEARING), MAXIMA, {"cell.layers": "smeared"})
LIMIT = Kind("nothing: the largest load with an equilibrium", (LARGE_LOAD,), STRAINS)
KINDS = (TO_STRAINS, TOGETHER, TO_ALL, SMEARED, LIMIT)


@dataclass(frozen=True)
class Fit:
    """How a fit ended.

    Args:
        kind: what was fitted.
        values: key -> fitted value.
        ratios: law -> quantity -> ours / printed of the differences from rest, targets or not; NaN without a solution.
        runs: scenes solved for it.
    """

    kind: Kind
    values: Mapping[str, float]
    ratios: Mapping[str, Mapping[str, float]]
    runs: int

    def misfit(self, law: str) -> float:
        """Root mean square of ln ratio over a law's targets."""
        return misfit(self.ratios[law][quantity] for quantity in self.kind.targets)


Settings = Mapping[str, Any]
Solve = Callable[[Settings], Mapping[str, float]]
"""Settings by dotted key -> the largest values in the nucleus, by the paper's names; NaN without an equilibrium."""
Printed = Mapping[str, Mapping[str, float]]
"""Law -> quantity -> printed value."""


def end_state(settings: Settings, overrides: Sequence[str] = ()) -> dict[str, float]:
    """Solve Table 1's scene with these settings for its end state; a `Solve`."""
    texts = [f"{key}={value}" for key, value in ({"time.history": "false"} | dict(settings)).items()]
    (case,) = load_study(None, [*texts, *overrides]).cases
    result = solve(case.scene, comm=MPI.COMM_SELF, check=False)
    return {
        q.paper_key: result.get(f"nucleus.{q.key}_max{q.suffix}") if not result.failure else math.nan
        for q in QUANTITIES
    }


class _Model:
    """Our numbers over the printed ones, as a function of the logarithms of what is free; nothing is solved twice."""

    def __init__(self, laws: Sequence[str], kind: Kind, printed: Printed, solve: Solve, most: np.ndarray) -> None:
        self.laws, self.kind, self.printed, self.solve, self.most = laws, kind, printed, solve, most
        self.known: dict[tuple[float, ...], dict[str, dict[str, float]]] = {}

    def values(self, logs: np.ndarray) -> tuple[float, ...]:
        """Of what is free, with the digits that count."""
        return tuple(float(f"{math.exp(x):.6g}") for x in logs)

    def ratios(self, logs: np.ndarray) -> dict[str, dict[str, float]]:
        """Law -> quantity -> ratio of the differences from rest."""
        values = self.values(logs)
        if values not in self.known:
            free = {f.key: value for f, value in zip(self.kind.free, values, strict=True)}
            self.known[values] = {law: self._of(law, free) for law in self.laws}
        return self.known[values]

    def _of(self, law: str, free: Settings) -> dict[str, float]:
        ours, printed = self.solve({"cell.law": law, **self.kind.settings, **free}), self.printed[law]
        return {q: (ours[q] - RESTS[q]) / (printed[q] - RESTS[q]) for q in MAXIMA}

    def residuals(self, logs: np.ndarray) -> np.ndarray:
        """The ln of the ratios of the targets."""
        found = self.ratios(logs)
        return np.array([log_ratio(found[law][q]) for law in self.laws for q in self.kind.targets])

    def jacobian(self, logs: np.ndarray) -> np.ndarray:
        """Their one-sided differences."""
        return one_sided(self.residuals, logs, self.most, STEP)


def fit(laws: Sequence[str], kind: Kind, printed: Printed, solve: Solve, most_load: float = math.inf) -> Fit:
    """Fit what is free of a kind to the printed numbers of these laws at once.

    Args:
        laws: each of all layers.
        kind: what is free, and the targets.
        printed: the laws' rows.
        solve: gives our numbers.
        most_load: an upper bound of the load factor, besides that of the kind.
    """
    least, most = (np.log([getattr(f, end) for f in kind.free]) for end in ("least", "most"))
    start = np.log([f.start for f in kind.free])
    most[0] = min(most[0], math.log(most_load))
    start[0] = min(start[0], most[0] - 2 * STEP)
    model = _Model(laws, kind, printed, solve, most)
    result = least_squares(
        model.residuals, start, model.jacobian, (least, most), xtol=ENOUGH, ftol=ENOUGH, max_nfev=EVALUATIONS
    )
    values = dict(zip((f.key for f in kind.free), model.values(result.x), strict=True))
    return Fit(kind, values, model.ratios(result.x), len(model.known) * len(laws))


def largest_load(law: str, solve: Solve, least: float, most: float) -> tuple[float, int]:
    """The largest load factor with an equilibrium, by bisection to `DIGITS` of it, and the scenes solved.

    Args:
        law: of all layers.
        solve: gives our numbers.
        least, most: load factors with and without an equilibrium.

    Raises:
        SolveError: `least` has none, or `most` has one.
    """

    def stands(load: float) -> bool:
        return math.isfinite(solve({"cell.law": law, LOAD: load})["J1"])

    if not stands(least) or stands(most):
        raise SolveError(f"{law}: the largest load is not between {least:g} and {most:g}")
    runs = 2
    while most - least > DIGITS * least:
        middle = float(f"{math.sqrt(least * most):.4g}")
        least, most = (middle, most) if stands(middle) else (least, middle)
        runs += 1
    return least, runs


def fit_all(paper: Paper, solve: Solve, comm: MPI.Intracomm, note: Callable[[str], None]) -> list[Fit]:
    """Every fit, shared by the ranks; the same on each. Collective.

    Args:
        paper: the printed numbers.
        solve: gives our numbers.
        comm: the ranks.
        note: told of each fit that has ended, on the rank that made it.
    """
    from cellmech.runs import Counter, hand_out

    printed = {law: paper.table("fig2")[law].values for law in LAWS}
    others = [law for law in LAWS if law != COLLAPSING]
    jobs: list[Callable[[], list[Fit]]] = [lambda: _collapsing(printed, solve)]
    for kind in (TO_STRAINS, SMEARED, TO_ALL):
        jobs += [lambda law=law, kind=kind: [fit([law], kind, printed, solve)] for law in others]  # type: ignore[misc]
    jobs.append(lambda: [fit(others, TOGETHER, printed, solve)])
    counter = Counter(comm)
    mine = []
    for index in hand_out(len(jobs), counter, MPI.COMM_SELF):
        for one in jobs[index]():
            mine.append(one)
            note(f"{one.kind.name}, {', '.join(one.ratios)}: {dict(one.values)}, {one.runs} runs")
    found = [one for part in comm.allgather(mine) for one in part]
    counter.close()
    return sorted(found, key=lambda one: (KINDS.index(one.kind), list(LAWS).index(next(iter(one.ratios)))))


def _collapsing(printed: Printed, solve: Solve) -> list[Fit]:
    """The fits of the law that collapses, below its largest load. Its strains grow with the load, so that fits best."""
    load, runs = largest_load(COLLAPSING, solve, *BRACKET)
    logs = np.log([load])
    at_most = Fit(LIMIT, {LOAD: load}, _Model([COLLAPSING], LIMIT, printed, solve, logs).ratios(logs), runs + 1)
    return [at_most, *(fit([COLLAPSING], kind, printed, solve, load) for kind in (TO_ALL, SMEARED))]
