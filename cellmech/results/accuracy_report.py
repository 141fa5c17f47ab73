"""The error of every number as files and people get it: trees of result.json, rows of accuracy.csv, lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cellmech.results.accuracy import ALL_PARTS, SMALL_BUDGET, Assessed


def error_trees(assessed: Mapping[str, Assessed]) -> dict[str, Any]:
    """Entries of result.json: `error`, absolute, under the names of the scalars, and `accuracy` with its parts."""
    rows = assessed.values()
    parts = [part for part in ALL_PARTS if any(part in row.parts for row in rows)]
    return {
        "error": _tree({row.key: row.error for row in rows}),
        "accuracy": {
            "parts": {part: _tree({row.key: row.parts.get(part) for row in rows}) for part in parts},
            "order": _tree({row.key: row.order for row in rows}),
            "extrapolated": _tree({row.key: row.extrapolated for row in rows}),
            "within_1_percent": all(row.within for row in rows),
            "beyond_1_percent": [row.key for row in rows if not row.within],
        },
    }


def _tree(values: Mapping[str, Any]) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    for key, value in values.items():
        *tables, name = key.split(".")
        target = tree
        for table in tables:
            target = target.setdefault(table, {})
        target[name] = value
    return tree


def table_rows(assessed: Mapping[str, Assessed]) -> list[dict[str, Any]]:
    """Rows of accuracy.csv: each scalar, its error, and the parts, absolute and in percent of |q - q0|."""
    rows = []
    for row in assessed.values():
        cells: dict[str, Any] = {"scalar": row.key, "value": row.value, "rest": row.rest, "error": row.error}
        percent = {"error": row.error, **row.parts}
        cells |= {f"{name}_percent": _percent(row.share(part)) for name, part in percent.items()}
        cells |= {"within_1_percent": row.within, "mesh_order": row.order, "extrapolated": row.extrapolated}
        rows.append(cells)
    return rows


def _percent(share: float | None) -> float | None:
    return None if share is None else float(f"{100 * share:.4g}")


def report(assessed: Mapping[str, Assessed], worst: int = 6) -> list[str]:
    """Lines for the terminal: how many scalars are within 1 %, and the worst with their parts in percent."""
    rows = [row for row in assessed.values() if row.error is not None]
    missing = len(assessed) - len(rows)
    inside = sum(row.within for row in rows)
    lines = [
        f"{inside} of {len(assessed)} scalars within 1 % of |q - q0| (a J within 1e-4 of rest: 1e-6)"
        + (f"; {missing} without an error: a refined run failed" if missing else "")
    ]
    rows.sort(key=lambda row: (row.error or 0.0) / max(row.allowed, 1e-15), reverse=True)
    for row in rows[:worst]:
        size, by = _percent(row.share(row.error)), "absolute " if row.allowed == SMALL_BUDGET else ""
        shares = ", ".join(f"{name} {100 * share:.2g}" for name, p in row.parts.items() if (share := row.share(p)))
        text = f"error {row.error:.2g}" + (f" = {size:.2g} %" if size is not None else "")
        lines.append(f"  {row.key} {row.value:.7g}: {by}{text} ({shares})")
    return lines
