"""The end values of a sweep over two parameters as a grid, and where on it the paper prints its extremes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cellmech.errors import InputError
from cellmech.figures.parameters import Parameter, parameter
from cellmech.figures.results import StudyResult
from cellmech.figures.style import Quantity

Place = tuple[int, int]  # row, column


@dataclass(frozen=True)
class Extreme:
    """The place of the paper's largest or smallest value, and the value, None where it prints none of its own."""

    place: Place
    value: float | None


class Grid:
    """The cases of a sweep by row and column; the key that runs fastest runs along the columns.

    Args:
        study: its cases.
        paper: the printed numbers of this sweep, as `[fig4]` and `[fig6]` of paper_numbers.toml.

    Raises:
        InputError: when the study varies other than two keys, or its values are no numbers.
    """

    def __init__(self, study: StudyResult, paper: Mapping[str, Any]) -> None:
        keys = list(next(iter(study.varied.values()), {}))
        if len(keys) != 2:
            hint = "Such as a [sweep] with two lists."
            raise InputError(str(study.folder), "sweep", "a map needs a study that varies two keys", keys, hint)
        self.study, self.paper = study, paper
        self.y, self.x = map(parameter, keys)
        self.y_values, self.x_values = ([_number(v[key], key) for v in study.varied.values()] for key in keys)
        places = zip(self.y_values, self.x_values, strict=True)
        self.y_values, self.x_values = sorted(set(self.y_values)), sorted(set(self.x_values))
        self.names = {
            (self.y_values.index(y), self.x_values.index(x)): name
            for name, (y, x) in zip(study.varied, places, strict=True)
        }

    @property
    def shape(self) -> Place:
        """Number of rows and columns."""
        return len(self.y_values), len(self.x_values)

    def values(self, quantity: Quantity) -> np.ndarray:
        """Largest values in the nucleus at the end, less the one at rest; NaN where no case was solved to its end."""
        found = np.full(self.shape, np.nan)
        for place, name in self.names.items():
            case = self.study.cases.get(name)
            if case is not None and not case.failure:
                found[place] = case.get(f"nucleus.{quantity.key}_max{quantity.suffix}") - case.rest(quantity.key)
        return found

    def lack(self, place: Place) -> str:
        """Why a cell of the map has no value, in two or three words."""
        case = self.study.cases.get(self.names.get(place, ""))
        if case is None:
            return "no result" if place in self.names else "not in the study"
        return f"failed at\n{case.get('t_s'):,.0f} s" if case.failure else "no value"

    def printed_extreme(self, kind: str, quantity: Quantity) -> Extreme | None:
        """The place of the paper's extreme of a quantity; None where it names no place, or one that is not swept.

        Args:
            kind: "max" or "min".
            quantity: which one.
        """
        for name, entry in self.paper.items():
            what = name.removeprefix(f"{kind}_")
            covers = quantity.paper_key in what.split("_") or (what == "strain" and bool(quantity.rest))
            place = self.place_of(entry) if what != name and covers else None
            if place is not None:
                return Extreme(place, entry.get(quantity.paper_key))
        return None

    def place_of(self, entry: object) -> Place | None:
        """Row and column of a place as the paper's numbers give it, such as { c_f_l = 0.9, c_f_np = 0.9 }."""
        if not isinstance(entry, Mapping):
            return None
        try:
            row, column = self.y_values.index(entry[self.y.paper_key]), self.x_values.index(entry[self.x.paper_key])
        except (KeyError, ValueError):
            return None
        return row, column

    def at(self, place: Place) -> str:
        """A place in words."""
        settings: list[tuple[Parameter, float]] = [(self.y, self.y_values[place[0]]), (self.x, self.x_values[place[1]])]
        return ", ".join(of.setting(value) for of, value in settings)


def extremes(values: np.ndarray) -> dict[str, Place]:
    """Places of the smallest and the largest value, for a grid that holds any."""
    if np.isnan(values).all():
        return {}
    found = {"max": np.nanargmax(values), "min": np.nanargmin(values)}
    rows = {kind: np.unravel_index(index, values.shape) for kind, index in found.items()}
    return {kind: (int(row), int(column)) for kind, (row, column) in rows.items()}


def _number(value: object, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError("the study", key, "a map needs numbers along its axes", value)
    return float(value)
