"""The numbers the paper prints, as studies/paper_numbers.toml has them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cellmech import InputError
from cellmech.figures import LAWS as STYLES
from cellmech.figures import QUANTITIES, printed
from cellmech.scene import read_toml

PAPER_NUMBERS = Path(__file__).resolve().parents[1] / "paper_numbers.toml"
LAWS = {name: STYLES[name] for name in ("saint-venant", "neo-hookean", "mooney-rivlin", "yeoh")}  # of Figure 2
TABLES = ("fig2", "fig4", "fig6", "table3")
NUCLEUS_PERCENT = 25.0  # of the cell's area, by Table 1's radii

RESTS = {q.paper_key: q.rest for q in QUANTITIES}
"""The value of each printed quantity where nothing is deformed; that of SI depends on what is taken for the outline."""
RESTS |= {f"share_{key}": NUCLEUS_PERCENT * rest for key, rest in RESTS.items() if rest} | {"SI": math.nan}
PLACES = {  # key of a printed row -> layer, key of the scene, name, unit
    "c_f_l": ("lamina", "fluid_fraction", "c_f,l", ""),
    "c_f_np": ("nucleoplasm", "fluid_fraction", "c_f,np", ""),
    "young_l": ("lamina", "young_Pa", "E_l", " Pa"),
    "young_np": ("nucleoplasm", "young_Pa", "E_np", " Pa"),
}


@dataclass(frozen=True)
class PrintedRow:
    """What the paper prints of one case.

    Args:
        table: one of `TABLES`.
        name: of the row there.
        place: parameter -> value, for the keys of `PLACES` that the row gives.
        values: quantity -> printed value, for the keys of `RESTS`.
        misprints: quantity -> value that is printed too and that the paper itself contradicts.
    """

    table: str
    name: str
    place: Mapping[str, float]
    values: Mapping[str, float]
    misprints: Mapping[str, float]


@dataclass(frozen=True)
class Paper:
    """The printed numbers: by row, and the place at which the paper found no solution."""

    rows: tuple[PrintedRow, ...]
    not_converged: Mapping[str, float]

    def table(self, name: str) -> dict[str, PrintedRow]:
        """The rows of a table by their names."""
        return {row.name: row for row in self.rows if row.table == name}

    def largest(self, table: str, quantity: str) -> float:
        """The largest value a table prints of a quantity, which bounds those it does not print."""
        return max(row.values[quantity] for row in self.rows if row.table == table and quantity in row.values)


def read_paper(path: Path = PAPER_NUMBERS) -> Paper:
    """Read the printed numbers.

    Raises:
        InputError: for a file without these tables, or a row with an unknown key or a value that is no number.
    """
    data, where = read_toml(str(path)), str(path)
    misprints = data.get("misprints", {})
    rows = []
    for table in TABLES:
        if not isinstance(data.get(table), dict):
            raise InputError(where, table, "there must be such a table")
        places = {name: row for name, row in data[table].items() if isinstance(row, dict) and name != "not_converged"}
        rows += [_row(where, table, name, row, misprints) for name, row in places.items()]
    not_converged = data["fig4"].get("not_converged", {})
    return Paper(tuple(rows), dict(_numbers(where, "fig4.not_converged", not_converged)))


def _row(where: str, table: str, name: str, row: Mapping[str, Any], misprints: Any) -> PrintedRow:
    found = dict(_numbers(where, f"{table}.{name}", row))
    wrong = dict(_numbers(where, f"misprints.{table}.{name}", misprints.get(table, {}).get(name, {})))
    values = {key: value for key, value in found.items() if key in RESTS}
    return PrintedRow(table, name, {key: found[key] for key in PLACES if key in found}, values, wrong)


def _numbers(where: str, start: str, row: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    for key, value in row.items():
        if key not in RESTS and key not in PLACES:
            raise InputError(where, f"{start}.{key}", f"must be one of {', '.join([*RESTS, *PLACES])}")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(where, f"{start}.{key}", "must be a number", value)
        yield key, float(value)


def in_print(quantity: str, value: float) -> str:
    """A printed value with the digits it was printed with: none after the point for a share."""
    return f"{value:.0f}" if quantity.startswith("share_") else printed(value)


def half_digit(quantity: str, value: float) -> float:
    """Half a unit of the last printed digit, which is as well as the number is known."""
    text = in_print(quantity, value)
    return 0.5 * 10.0 ** -(len(text.partition(".")[2]))


def at(place: Mapping[str, float]) -> str:
    """A place for people: "c_f,l = 0.7, c_f,np = 0.9"."""
    return ", ".join(f"{PLACES[key][2]} = {value:g}{PLACES[key][3]}" for key, value in place.items())
