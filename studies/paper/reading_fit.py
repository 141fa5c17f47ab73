"""Least-squares fits of a reading's few open numbers to some printed figures; the others are then predictions.

What is varied are logarithms of scene settings, the same for all rows; a residual is the ln of ours / printed of a
difference from rest. Every trial is a reading of its own, solved into a folder of its own, and is not solved twice.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from cellmech.figures import Row, Section, significant
from studies.paper.misfit import Secants, one_sided
from studies.paper.printed import TABLES
from studies.paper.readings import EFFECTIVE, LIMITS, Reading, Score, misfits, named, within

STEP = 0.05  # of a finite difference, in ln
ENOUGH = 5e-3  # relative change at which a fit ends
ROUNDS = 6  # evaluations at most besides those of differences

Free = Mapping[str, tuple[float, float]]
"""Dotted key -> bounds."""
Judge = Callable[[Reading, Sequence[str], bool], Score]
"""Solves the printed rows of some tables under a reading, or all their runs, and scores them."""


@dataclass(frozen=True)
class Plan:
    """A fit.

    Args:
        name: of its folders.
        base: the reading to start from.
        free: what is fitted.
        tables: the figures it is fitted to; the others are predicted.
    """

    name: str
    base: Reading
    free: Free
    tables: tuple[str, ...]


def _plans() -> tuple[Plan, ...]:
    base = named("in-plane-5")
    stiffness, smear = {"cell.young_factor": (0.01, 1.0)}, {"cell.smear_um": (0.1, 1.0)}
    beta, viscosity = {"cell.beta_over_mu": (0.02, 2.5)}, {"cell.fluid_lambda_Pa_s": (1e3, 1e5)}
    return (
        Plan("on-fig2", base, stiffness | smear | beta | viscosity, ("fig2",)),
        Plan("on-figs-4-and-6", base, stiffness | smear, ("fig4", "fig6")),
        Plan("on-all", named("in-plane"), stiffness | smear, TABLES),
        Plan("on-all-twice", named(EFFECTIVE), stiffness | smear, TABLES),
    )


PLANS = _plans()


@dataclass(frozen=True)
class Fitted:
    """How a fit ended.

    Args:
        plan: what was fitted.
        values: key -> fitted value.
        score: of all tables and runs.
        trials: readings solved for it.
    """

    plan: Plan
    values: Mapping[str, float]
    score: Score
    trials: int


def fit(plan: Plan, judge: Judge, note: Callable[[str], None] = lambda line: None) -> Fitted:
    """Fit, then solve all runs with what was found. Collective where `judge` is."""
    keys, known = list(plan.free), {}
    least, most = (np.log([plan.free[key][end] for key in keys]) for end in (0, 1))
    start = np.log([float(plan.base.settings[key]) for key in keys])

    def reading(logs: np.ndarray) -> Reading:
        values = {key: float(f"{math.exp(x):.4g}") for key, x in zip(keys, logs, strict=True)}
        name = f"{plan.name}-" + "-".join(f"{value:g}" for value in values.values())
        text = f"{plan.name}: {_found(values)}"
        return replace(plan.base, name=name, text=text, settings={**plan.base.settings, **values})

    def residuals(logs: np.ndarray) -> np.ndarray:
        one = reading(logs)
        if one.name not in known:
            known[one.name] = judge(one, plan.tables, False).logs(plan.tables, shapes=False)
            note(f"{one.name}: rms {misfits(known[one.name])[0]:.3f}")
        return np.array(known[one.name])

    slopes = Secants(residuals, partial(one_sided, residuals, most=most, step=STEP))
    found = least_squares(
        residuals, start, slopes.at, (least, most), loss="soft_l1", xtol=ENOUGH, ftol=ENOUGH, max_nfev=ROUNDS
    )
    best = reading(found.x)
    return Fitted(plan, {key: best.settings[key] for key in keys}, judge(best, TABLES, True), len(known))


def _found(values: Mapping[str, float]) -> str:
    return ", ".join(f"{key} = {significant(value, 3)}" for key, value in values.items())


def fit_section(fits: Sequence[Fitted]) -> Section:
    """What each fit found, how far it is off what it was fitted to, and off what it predicts."""
    header = ("fit", "found", "figure", "numbers", "rms", "median", *LIMITS)
    text = (
        "Maxima, shape indices left out; rms and median of |ln(ours/print)| on q − q0. Bold: fitted to; the others are "
        "predictions. The least-squares loss is soft (soft_l1): a row that no choice brings near does not decide."
    )
    rows = []
    for one in fits:
        for table in TABLES:
            logs = one.score.logs((table,), shapes=False)
            (rms, median), near = misfits(logs), within(logs)
            name = f"**{table}**" if table in one.plan.tables else table
            numbers = (str(len(logs)), significant(rms, 2), significant(median, 2), *map(str, near))
            record = {"fit": one.plan.name, "found": json.dumps(dict(one.values)), "table": table, "rms": rms}
            record |= {"median": median, "numbers": len(logs)} | dict(zip(LIMITS, near, strict=True))
            rows.append(Row((one.plan.name, _found(one.values), name, *numbers), record))
    return Section("reading-fit", "Fits of the reading, and what they predict", text, header, rows)
