"""A dictionary of a table's columns: the unit of each, and what it means, as docs/files.md explains it."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

from cellmech.results.accuracy import REGIONS

UNITS = {  # endings of names, the longest first
    "_Pa_per_um": "Pa/µm",
    "_Pa_x_um": "Pa µm",
    "_percent": "%",
    "_Pa_s": "Pa s",
    "_um3": "µm³",
    "_um2": "µm²",
    "_deg": "°",
    "_um": "µm",
    "_Pa": "Pa",
    "_pN": "pN",
    "_s": "s",
}
ENDINGS = "(_Pa|_Pa_per_um)?"  # that follow a statistic in a name


@cache
def _entries() -> tuple[tuple[re.Pattern[str], bool, str, str], ...]:
    """Pattern of a name, whether it stands for itself alone, unit, meaning."""
    text = Path(__file__).with_name("columns.csv").read_text(encoding="utf-8")
    found = []
    for row in csv.DictReader(text.splitlines()):
        name = row["name"]
        pattern = re.escape(name).replace("…", r"\w+").replace("<layer>", r"\w+") + (
            ENDINGS if name.startswith("…") else ""
        )
        found.append((re.compile(pattern), "…" not in name, row["unit"], row["meaning"]))
    return tuple(found)


def dictionary(columns: Iterable[str], swept: Iterable[str] = ()) -> list[Mapping[str, str]]:
    """A row for each column: its name, unit and meaning; an empty meaning where the page has none.

    Args:
        columns: the names, dotted.
        swept: those that are keys of scenes.
    """
    keys = set(swept)
    return [{"column": name, **_explained(name, name in keys)} for name in columns]


def _explained(name: str, is_key: bool) -> Mapping[str, str]:
    if is_key:
        return {"unit": _unit(name, ""), "meaning": "key of the scene, varied by the study: docs/scene.md"}
    rest = name.removeprefix("error.")
    what = "error of the number: " if rest != name else ""
    region, _, inner = rest.partition(".")
    of = f"{region}: " if inner and region in REGIONS else ""
    key = re.sub(r"\.[xyz]$", "", inner if of else rest)
    exact = [(unit, text) for pattern, alone, unit, text in _entries() if alone and pattern.fullmatch(key)]
    found = exact or [(unit, text) for pattern, _, unit, text in _entries() if pattern.fullmatch(key)]
    meaning = "; ".join(text for _, text in found)
    return {"unit": _unit(key, found[0][0] if found else ""), "meaning": f"{what}{of}{meaning}" if meaning else ""}


def _unit(name: str, told: str) -> str:
    """By the ending of the last part of a name, or as the page tells it."""
    last = name.rpartition(".")[2]
    return next((unit for ending, unit in UNITS.items() if last.endswith(ending)), told)
