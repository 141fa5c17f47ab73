"""Results of the paper's cases as studies leave them, made up: what comparison and report are made from."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from cellmech.scene.case import Case
from cellmech.scene.files import scene_to_toml
from cellmech.scene.studies import load_study
from studies.paper.ours import FOLDERS, STUDIES, Slot
from studies.paper.printed import read_paper

REST = {"sigma_mises": 0.0, "J1": 2.0, "J2": 2.0, "J3": 1.0}
Values = Mapping[str, float]  # sigma_mises, J1, J2, J3


def write_results(
    folder: Path, values: Callable[[str, Case], Values] | None = None, leave_out: tuple[str, ...] = (), **result: Any
) -> Path:
    """A folder with the results of every case of the paper.

    Args:
        folder: where.
        values: table, case -> largest values in the nucleus.
        leave_out: tables that have not been run.
        result: further entries of every result.json.
    """
    for table in FOLDERS:
        if table not in leave_out:
            for index, case in enumerate(load_study(STUDIES / f"{table}.toml").cases):
                found = values(table, case) if values else steady(index)
                write_result(folder / table / case.name, case, found, **result)
    return folder


def write_result(folder: Path, case: Case, values: Values, **result: Any) -> None:
    """One case's scene.toml and result.json."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(scene_to_toml(case.scene))
    (folder / "result.json").write_text(json.dumps(numbers(values) | result))


def steady(index: int) -> Values:
    """Values that grow from case to case."""
    return {
        "sigma_mises": 5.0 + index,
        "J1": 2.005 + 1e-3 * index,
        "J2": 2.02 + 1e-2 * index,
        "J3": 1.004 + 1e-4 * index,
    }


def numbers(values: Values) -> dict[str, Any]:
    """The part of result.json that is read."""
    nucleus: dict[str, Any] = {}
    for name, value in values.items():
        unit = "_Pa" if name == "sigma_mises" else ""
        mean = (value + REST[name]) / 2
        nucleus |= {f"{name}_max{unit}": value, f"{name}_max_over_time{unit}": value, f"{name}_mean{unit}": mean}
    return {
        "status": "solved",
        "reason": "",
        "t_s": 18000.0,
        "steps": 50,
        "newton_iterations": 200,
        "wall_s": 7.5,
        "mesh_cells": 1230,
        "versions": {"cellmech": "0.1.0", "dolfinx": "0.5.2"},
        "source_hash": "0123456789abcdef",
        "nucleus": nucleus,
        "share_of_area_percent": {"J1": 49.9, "J2": 49.95, "J3": 24.8},
        "shape_index": {"full": 0.99, "half_outline": 0.75, "half_area_full_perimeter": 0.495},
    }


def as_printed(table: str, case: Case) -> Values:
    """What the paper prints of the case; at rest where it prints nothing."""
    values = dict(REST)
    for row in read_paper().rows:
        here = row.name == case.name or (row.place and Slot(case.name, case.scene, (), None).fits(row.place))
        if row.table == table and here:
            printed = {"sigma_mises" if name == "sigma" else name: value for name, value in row.values.items()}
            values |= {name: value for name, value in printed.items() if name in REST}
    return values
