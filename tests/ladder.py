"""The verification ladder: tests state what they check as rows of one table, and each row is its own assertion.

A test that takes the fixture `ladder` is a member. `pytest --ladder FOLDER` runs the members alone, prints the table
(case, reference, ours, error, allowed, order, verdict) and writes it to FOLDER as verify.csv and verify.md.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

HEAD = ("case", "reference", "ours", "error", "allowed", "order", "verdict")
PASS, FAIL = "pass", "FAIL"


@dataclass(frozen=True)
class Row:
    """One line of the table; `used` is the share of what is allowed that is used up."""

    case: str
    reference: str
    ours: str
    error: str
    allowed: str
    order: str
    used: float

    @property
    def verdict(self) -> str:
        return PASS if self.used <= 1.0 else FAIL  # a NaN fails

    @property
    def cells(self) -> tuple[str, ...]:
        return (self.case, self.reference, self.ours, self.error, self.allowed, self.order, self.verdict)


class Table:
    """All rows of a session in the order of their first statement."""

    def __init__(self) -> None:
        self.rows: dict[str, Row] = {}

    def add(self, row: Row) -> None:
        """Of rows of the same case, as over random states, the worst stays."""
        known = self.rows.get(row.case)
        if known is None or not row.used <= known.used:
            self.rows[row.case] = row

    def lines(self) -> list[str]:
        rows = [HEAD, *(row.cells for row in self.rows.values())]
        widths = [max(len(cells[k]) for cells in rows) for k in range(len(HEAD))]
        return ["  ".join(c.ljust(w) for c, w in zip(cells, widths, strict=True)).rstrip() for cells in rows]

    def write(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        rows = [HEAD, *(row.cells for row in self.rows.values())]
        with open(folder / "verify.csv", "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)
        marked = ["| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |" for cells in rows]
        marked.insert(1, "|" + "---|" * len(HEAD))
        (folder / "verify.md").write_text("\n".join(marked) + "\n", encoding="utf-8")


class Ladder:
    """States rows and asserts them."""

    def __init__(self, table: Table) -> None:
        self.table, self.failed = table, False

    def __call__(
        self, case: str, *, ours: Any, reference: Any = 0.0, rel: float = 0.0, abs: float = 0.0, unit: str = ""
    ) -> None:
        """|ours - reference| is at most rel |reference| or abs, whichever is larger, entry by entry.

        The row shows the worst entry, its error relative where `rel` decides.
        """
        ours, reference = np.broadcast_arrays(np.asarray(ours, dtype=float), np.asarray(reference, dtype=float))
        gap, allowed = np.abs(ours - reference).ravel(), np.maximum(rel * np.abs(reference), abs).ravel()
        used = np.divide(gap, allowed, out=np.where(gap == 0.0, 0.0, np.inf), where=allowed > 0.0)
        worst = int(np.argmax(np.where(np.isnan(used), np.inf, used)))
        scale = np.abs(reference.ravel()[worst]) if rel * np.abs(reference.ravel()[worst]) > abs else 1.0
        suffix = f" {unit}" if unit else ""
        self._state(
            Row(
                case,
                f"{reference.ravel()[worst]:.6g}{suffix}",
                f"{ours.ravel()[worst]:.6g}{suffix}",
                f"{gap[worst] / scale:.2g}",
                f"{allowed[worst] / scale:.2g}",
                "",
                float(used[worst]),
            )
        )

    def between(self, case: str, *, ours: Any, low: float, high: float, unit: str = "") -> None:
        """Every entry lies in [low, high]; the row shows the one nearest to, or farthest beyond, a bound."""
        ours = np.atleast_1d(np.asarray(ours, dtype=float)).ravel()
        used = np.abs(ours - (low + high) / 2) / ((high - low) / 2)
        worst = int(np.argmax(np.where(np.isnan(used), np.inf, used)))
        suffix = f" {unit}" if unit else ""
        reference = f"{low:.4g} … {high:.4g}{suffix}"
        self._state(Row(case, reference, f"{ours[worst]:.4g}{suffix}", "", "", "", float(used[worst])))

    def order(
        self, case: str, errors: Sequence[float], expected: float, within: float, sizes: Sequence[float] | None = None
    ) -> None:
        """Each error against the one before falls with this order in the size, by default halved each time.

        The row shows the last error and all orders.
        """
        errors = np.asarray(errors, dtype=float)
        ratios = 2.0 if sizes is None else np.asarray(sizes[:-1]) / np.asarray(sizes[1:])
        orders = np.log(errors[:-1] / errors[1:]) / np.log(ratios)
        used = np.abs(orders - expected) / within
        shown = ", ".join(f"{o:.2f}" for o in orders)
        worst = np.inf if np.isnan(used).any() else used.max()
        self._state(Row(case, f"order {expected:g}", "", f"{errors[-1]:.2g}", f"± {within:g}", shown, float(worst)))

    def _state(self, row: Row) -> None:
        self.table.add(row)
        if row.verdict == FAIL:
            self.failed = True
            pytest.fail("  ".join(f"{name}: {cell}" for name, cell in zip(HEAD, row.cells, strict=True) if cell))


TABLE = pytest.StashKey[Table]()


@pytest.fixture
def ladder(request: pytest.FixtureRequest) -> Ladder:
    """States rows of the verification table, each with its assertion."""
    request.node.ladder = Ladder(request.config.stash[TABLE])
    return request.node.ladder


def _is_member(item: pytest.Item) -> bool:
    return "ladder" in getattr(item, "fixturenames", ())


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--ladder", metavar="FOLDER", help="run the verification ladder alone; its table goes to FOLDER")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[TABLE] = Table()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("ladder"):
        member = [_is_member(item) for item in items]
        config.hook.pytest_deselected(items=[item for item, m in zip(items, member, strict=True) if not m])
        items[:] = [item for item, m in zip(items, member, strict=True) if m]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """A member that fails before or beside its rows gets a row of its own: no failure is missing from the table."""
    report = yield
    if report.failed and _is_member(item):
        stated = getattr(item, "ladder", None)
        if stated is None or not stated.failed:
            item.config.stash[TABLE].add(Row(item.nodeid, "", "no value", "", "", "", np.inf))
    return report


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    folder = config.getoption("ladder")
    if folder is None:
        return
    table = config.stash[TABLE]
    failed = sum(row.verdict == FAIL for row in table.rows.values())
    terminalreporter.section("verification ladder")
    for line in table.lines():
        terminalreporter.write_line(line)
    table.write(config.rootpath / folder)
    terminalreporter.write_line(f"{len(table.rows)} rows, {failed} failed; in {folder}/verify.csv and verify.md")
