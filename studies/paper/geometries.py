"""Table 1 in the three geometries, number by number, beside the print: studies/geometries.toml."""

from __future__ import annotations

import math
from pathlib import Path

from cellmech.figures import NONE, Row, Section, significant
from cellmech.results import Result, load
from studies.paper.printed import LAWS, RESTS, Paper

GEOMETRIES = {"plane": "plane", "axisymmetric": "axisymmetric", "3d": "3-D"}
# What is shown: in words, key in result.json, the strain whose value at rest is taken off, what the print calls it.
NUMBERS = (
    ("largest σ_Mises in the nucleus [Pa]", "nucleus.sigma_mises_max_Pa", "", "sigma"),
    ("largest σ_Mises in the nucleoplasm [Pa]", "nucleoplasm.sigma_mises_max_Pa", "", ""),
    ("mean σ_Mises of the nucleus [Pa]", "nucleus.sigma_mises_mean_Pa", "", ""),
    ("largest J1 − q0 in the nucleus", "nucleus.J1_max", "J1", "J1"),
    ("largest J2 − q0 in the nucleus", "nucleus.J2_max", "J2", "J2"),
    ("largest J3 − q0 in the nucleus", "nucleus.J3_max", "J3", "J3"),
    ("mean J1 − q0 of the nucleus", "nucleus.J1_mean", "J1", ""),
    ("mean J3 − q0 of the nucleus", "nucleus.J3_mean", "J3", ""),
    ("shape index of the section", "shape_index.full", "", ""),
    ("height over width of the nucleus", "nucleus_shape.aspect", "", ""),
    ("penetration [µm]", "contact.max_depth_um", "", ""),
)


def geometries_section(folder: Path, paper: Paper) -> Section:
    """The table; a case that is not there, or has no such number, leaves its place empty."""
    header = ("law", "number", "printed", *GEOMETRIES.values(), "3-D over axisymmetric − 1")
    text = (
        "Table 1 at 18,000 s on the paper's pillar: an endless ridge in the plane, a round pillar in the others. q0 is "
        "the value at rest, 2, 2, 1 in the plane and in print, 3, 3, 1 elsewhere."
    )
    rows, told = [], [text]
    for law, style in LAWS.items():
        cases = {name: _case(folder / f"law={law},geometry={name}") for name in GEOMETRIES}
        told += [f"{style.label}, {GEOMETRIES[name]}: {said}" for name, case in cases.items() if (said := _said(case))]
        printed = paper.table("fig2")[law].values
        for words, key, strain, in_print in NUMBERS:
            found = [_number(case, key, strain) for case in cases.values()]
            theirs = printed.get(in_print, math.nan) - RESTS.get(strain, 0.0)
            apart = found[2] / found[1] - 1
            difference = NONE if math.isnan(apart) else f"{100 * apart:+.2g} %"
            cells = (style.label, words, *map(_shown, (theirs, *found)), difference)
            record = {"law": law, "number": key, "printed": theirs, **dict(zip(GEOMETRIES, found, strict=True))}
            rows.append(Row(cells, record))
    return Section("geometries", "Table 1 in three geometries", "\n\n".join(told), header, rows)


def _case(folder: Path) -> Result | None:
    return load(folder) if (folder / "result.json").is_file() else None


def _said(case: Result | None) -> str:
    """Why a case has no numbers, or what they leave out; "" where nothing is to be said."""
    if case is None:
        return "not solved yet."
    lost = case.result["model"]["warnings"].get("ellipticity in space", "") if not case.failure else case.failure
    return f"{lost}." if lost else ""


def _number(case: Result | None, key: str, strain: str) -> float:
    if case is None or case.failure:
        return math.nan
    return case.number(key) - (case.rest(strain) if strain else 0.0)


def _shown(value: float) -> str:
    return NONE if math.isnan(value) else significant(value, 3)
