"""Study files that this package writes: cases by dotted keys, end states unless said otherwise."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

END_STATES = ["[time]", "history = false  # the state at the end is static: how it was reached does not matter", ""]


def study_text(
    title: str, head: str, cases: Mapping[str, Mapping[str, Any]], base: Mapping[str, Any] | None = None
) -> str:
    """A study file.

    Args:
        title: of the study.
        head: its comment: what it is, how it was made, what it must show.
        cases: name -> settings by dotted key.
        base: of all cases, by dotted key; None for end states of Table 1.
    """
    lines = [*(f"# {line}".rstrip() for line in head.splitlines()), "schema = 1", f"title = {_toml(title)}", ""]
    lines += [*(END_STATES if base is None else _tables(base)), "[[pillar]]", ""]
    for name, settings in cases.items():
        lines += ["[[case]]", f"name = {_toml(name)}", *(f"{_toml(k)} = {_toml(v)}" for k, v in settings.items()), ""]
    return "\n".join(lines).rstrip("\n") + "\n"


def _tables(settings: Mapping[str, Any]) -> list[str]:
    """Dotted keys as tables, those without a table first."""
    tables: dict[str, list[str]] = {"": []}
    for key, value in settings.items():
        table, _, name = key.rpartition(".")
        tables.setdefault(table, []).append(f"{name} = {_toml(value)}")
    heads = {table: [f"[{table}]"] if table else [] for table in tables}
    return [line for table, of in tables.items() if of for line in (*heads[table], *of, "")]


def _toml(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)
