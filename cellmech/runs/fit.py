"""Keys of a study fitted to reference numbers: least squares within bounds, every trial a solve of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from scipy.optimize import least_squares

from cellmech.errors import InputError, SolveError
from cellmech.figures.comparison import Compared, compare
from cellmech.figures.parameters import value_at
from cellmech.figures.reference import References, read_references
from cellmech.results.records import to_csv, write_whole
from cellmech.runs.case import Progress
from cellmech.runs.library import solve
from cellmech.runs.messages import agreed
from cellmech.runs.trials import Fitted, Scale, Trial, standard_errors
from cellmech.scene.studies import Study, load_study

ENOUGH = 1e-6  # relative change of the sum of squares, and of the values within their bounds, at which a fit ends
AT_BOUND = 2e-3  # of the width: as near is at a bound
MOST_TRIALS = 200
TRIALS, TABLE = "trials", "trials.csv"

Bounds = Mapping[str, tuple[float, float]]
"""Dotted key of a scene -> its least and largest value, in the key's unit."""


def fit(
    study: str | Path,
    reference: str | Path,
    free: Bounds,
    folder: str | Path,
    *,
    overrides: Sequence[str] = (),
    most: int = MOST_TRIALS,
    comm: MPI.Comm = MPI.COMM_WORLD,
    note: Callable[[Trial], None] = lambda trial: None,
    progress: Callable[[Progress], None] = lambda progress: None,
) -> Fitted:
    """Find the values of keys at which a study's numbers come nearest to reference numbers. Collective on comm.

    The sum of ((ours - theirs) / weight)^2 is made least; a weight is the reference's uncertainty, or where none is
    said its distance from the value at rest. One least is found, near the scene's own values where these lie within
    the bounds, else near their middle: whether it is the only one, other bounds tell. Started again in the same folder
    it goes on: what was solved there is read.

    Args:
        study: a scene or study file; the cases that the reference names are solved.
        reference: the TOML file of the numbers, `figures.read_references`.
        free: the keys that are fitted, with their bounds; the same value goes to every case.
        folder: of the trials, a folder each, and of trials.csv.
        overrides: KEY=VALUE texts that are set in every case.
        most: number of trials after which it ends, come what may.
        comm: the ranks that share each case.
        note: told of each trial, on every rank.
        progress: told of every accepted step, on every rank.

    Returns:
        The fit; the same on every rank.

    Raises:
        InputError: for a file, a key or a bound that breaks a rule, or a number that no result has.
        SolveError: there is no solution where the fit starts, or beside a point that it has come to.
        OSError: the disk refuses.
    """
    search = agreed(comm, lambda: _Search(str(study), str(reference), free, Path(folder), overrides))
    return search.run(comm, most, note, progress)


class _Enough(Exception):
    """The trials are used up."""


class _Search:
    """A fit on its way."""

    def __init__(self, study: str, reference: str, free: Bounds, folder: Path, overrides: Sequence[str]) -> None:
        self.path, self.reference, self.folder, self.overrides = study, reference, folder, list(overrides)
        self.references = read_references(Path(reference))
        self.scales = {key: Scale(*_bounds(key, bounds)) for key, bounds in free.items()}
        if not self.scales:
            raise InputError("free", "", "must name a key with its bounds", None, "Such as layer.lamina.young_Pa.")
        for end in (0.0, 1.0):  # a bound that breaks a rule is better known before anything is solved
            try:
                found = self.study(np.full(len(self.scales), end))
            except InputError as error:
                where = "free" if error.key in self.scales else error.where
                raise InputError(where, error.key, error.rule, error.got, error.hint) from None
        _check_cases(self.references, found, reference)
        self.trials: list[Trial] = []

    def values(self, shares: np.ndarray) -> dict[str, float]:
        return {key: scale.value(float(x)) for (key, scale), x in zip(self.scales.items(), shares, strict=True)}

    def study(self, shares: np.ndarray) -> Study:
        return load_study(self.path, [*self.overrides, *(f"{k}={x!r}" for k, x in self.values(shares).items())])

    def start(self) -> np.ndarray:
        """The scene's own values, where they are numbers within the bounds; else the middle."""
        scene = load_study(self.path, self.overrides).cases[0].scene
        own = {key: value_at(scene, key) for key in self.scales}
        inside = (
            (scale, own[key] if isinstance(own[key], int | float) else math.nan) for key, scale in self.scales.items()
        )
        return np.array([scale.share(x) if scale.least < x < scale.most else 0.5 for scale, x in inside])

    def run(
        self, comm: MPI.Comm, most: int, note: Callable[[Trial], None], progress: Callable[[Progress], None]
    ) -> Fitted:
        known: dict[bytes, Trial] = {}

        def tried(shares: np.ndarray) -> Trial:
            if shares.tobytes() not in known:
                if len(self.trials) >= most:
                    raise _Enough
                trial = self.solved(shares, comm, progress)
                known[shares.tobytes()] = trial
                self.trials.append(trial)
                agreed(comm, self.write)
                note(trial)
            return known[shares.tobytes()]

        first = tried(self.start())
        if first.failure:
            raise SolveError(f"there is no solution where the fit starts ({first.line()}); begin elsewhere")
        slopes: list[np.ndarray] = []

        def jacobian(shares: np.ndarray) -> np.ndarray:
            slopes.append(self.slopes(shares, tried))
            return slopes[-1]

        ended = True
        try:
            least_squares(
                lambda shares: tried(shares).residuals,
                self.start(),
                jacobian,
                (0.0, 1.0),
                xtol=ENOUGH,
                ftol=ENOUGH,
                gtol=ENOUGH**2,
            )
        except _Enough:
            ended = False
        best = min((trial for trial in self.trials if not trial.failure), key=lambda trial: trial.rms)
        where = next(np.frombuffer(key) for key, trial in known.items() if trial is best)
        errors: dict[str, float] = dict.fromkeys(self.scales, math.nan)
        untold: tuple[str, ...] = ()
        if slopes:
            weighed = all(math.isfinite(one.uncertainty) for one in self.references.numbers)
            errors, untold = standard_errors(self.scales, where, best.residuals, slopes[-1], weighed)
        pairs = zip(self.scales, where, strict=True)
        at_bounds = tuple(key for key, x in pairs if not AT_BOUND < x < 1 - AT_BOUND and key not in untold)
        return Fitted(best, errors, at_bounds, untold, tuple(self.trials), ended)

    def solved(self, shares: np.ndarray, comm: MPI.Comm, progress: Callable[[Progress], None]) -> Trial:
        """The cases that the reference names, solved with these values. Collective."""
        study, names, number = self.study(shares), self.references.cases(), len(self.trials) + 1
        place, values = self.folder / TRIALS / f"{number:03d}", self.values(shares)
        for case in study.cases:
            if case.name in names:
                result = solve(case.scene, place / case.name, comm=comm, check=False, progress=progress)
                if result.failure:
                    lost = np.full(len(self.references.numbers), math.inf)
                    return Trial(number, values, None, lost, f"{case.name}: {result.failure}")
        comparison = agreed(comm, lambda: compare(place, self.reference))
        residuals = [self.residual(one) for one in comparison.compared]
        return Trial(number, values, comparison, np.array(residuals))

    def residual(self, one: Compared) -> float:
        key = f"case.{one.reference.case}.{one.reference.key}"
        if math.isnan(one.ours):
            raise InputError(self.reference, key, "must be a number that this case has; it is null there")
        weight = abs(one.theirs - one.rest) if math.isnan(one.uncertainty) else one.uncertainty
        if not weight > 0:
            rule = "must have an uncertainty > 0: its distance from rest, which would be its weight, is 0 or not known"
            raise InputError(self.reference, key, rule, one.theirs)
        return (one.ours - one.theirs) / weight

    def slopes(self, shares: np.ndarray, tried: Callable[[np.ndarray], Trial]) -> np.ndarray:
        """Derivatives of the residuals by one-sided differences, shape (n, free); to the side that has a solution.

        Raises:
            SolveError: neither side has.
        """
        here, columns = tried(shares), []
        for index, scale in enumerate(self.scales.values()):
            step = scale.step if shares[index] + scale.step <= 1.0 else -scale.step
            beside = tried(at := _moved(shares, index, step))
            if beside.failure:
                beside = tried(at := _moved(shares, index, -step))
            if beside.failure:
                raise SolveError(f"there is no solution beside a point of the fit ({beside.line()}); narrow the bounds")
            columns.append((beside.residuals - here.residuals) / (at[index] - shares[index]))
        return np.column_stack(columns)

    def write(self) -> None:
        """All trials so far, a row each."""
        names = [f"{one.case}: {one.key}" for one in self.references.numbers]
        rows: list[dict[str, Any]] = []
        for trial in self.trials:
            ours = [one.ours for one in trial.comparison.compared] if trial.comparison else [math.nan] * len(names)
            found = {"trial": trial.number, **trial.values, "rms": trial.rms, **dict(zip(names, ours, strict=True))}
            rows.append(found | {"failure": trial.failure})
        write_whole(self.folder / TABLE, to_csv(rows))


def _moved(shares: np.ndarray, index: int, step: float) -> np.ndarray:
    moved = shares.copy()
    moved[index] = min(max(moved[index] + step, 0.0), 1.0)
    return moved


def _bounds(key: str, bounds: tuple[float, float]) -> tuple[float, float]:
    least, most = bounds
    if not (math.isfinite(least) and math.isfinite(most) and least < most):
        raise InputError("free", key, "must have a least and a larger most value", f"{least:g}:{most:g}")
    return float(least), float(most)


def _check_cases(references: References, study: Study, where: str) -> None:
    names = [case.name for case in study.cases]
    for name in references.cases():
        if name not in names:
            close = get_close_matches(name, names, 3) or names[:8]
            rule = f"must be a case of {study.path}"
            raise InputError(where, f"case.{name}", rule, None, f"It has {', '.join(close)}.")
