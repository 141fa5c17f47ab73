"""Progress of a study, in lines for a file or a pipe, or in silence; and its results as a short table."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cellmech.console import say
from cellmech.results.archive import is_final
from cellmech.results.records import flatten

if TYPE_CHECKING:  # brings DOLFINx along
    from cellmech.runs.case import Progress

LINE_EVERY_S = 10.0
DOUBTS = ("mesh", "contact mesh", "penalty")  # warnings of a model that concern the numbers of the table
COLUMNS = {  # head of a column of the table -> key of result.json, format
    "sigma_mises_Pa": ("nucleus.sigma_mises_max_Pa", ".5g"),
    "J1": ("nucleus.J1_max", ".6g"),
    "J2": ("nucleus.J2_max", ".6g"),
    "J3": ("nucleus.J3_max", ".6g"),
    "penetration_um": ("contact.max_depth_um", ".4g"),
    "steps": ("steps", "d"),
    "wall_s": ("wall_s", ".1f"),
}
COSTS = ("wall_s", "steps")  # the first to be left out where a terminal is narrow: timings.csv has them


def duration(seconds: float) -> str:
    """A time as one says it: 40 s, 5 min, 2 h 10 min."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


@dataclass
class Running:
    """A case that is being solved, since a reading of the clock [s].

    `before` is the share of the work that an earlier run has done [-].
    """

    since: float
    last: Progress | None = None
    before: float = 0.0

    def heard(self, progress: Progress) -> None:
        """A step has been made; the first is the case's first, or that after a checkpoint."""
        first, self.last = self.last is None, progress
        if first:
            self.before = self.share * (progress.step - 1) / progress.step

    @property
    def share(self) -> float:
        """Share of the work that is done, roughly [-]: steps grow with time, their number is about t^(1/3)."""
        return min(self.last.t_s / self.last.end_s, 1.0) ** (1 / 3) if self.last else 0.0


class Quiet:
    """Keeps count, and speaks of failures only.

    Args:
        labels: of the cases to solve.
        served: number of cases that were solved before.
        groups: how many cases run at once.
        clock: in seconds.
    """

    def __init__(
        self, labels: Sequence[str], served: int, groups: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.labels, self.groups, self.clock = labels, groups, clock
        self.total, self.done = served + len(labels), served
        self.running: dict[int, Running] = {}
        self.walls: list[float] = []

    def __enter__(self) -> Quiet:
        return self

    def __exit__(self, *error: object) -> None:
        """Leave the terminal as it was."""

    def started(self, index: int) -> None:
        """A group has begun with a case."""
        self.running[index] = Running(self.clock())

    def progressed(self, index: int, progress: Progress) -> None:
        """A case has made a step."""
        self.running[index].heard(progress)

    def finished(self, index: int, result: Mapping[str, Any]) -> None:
        """A case has come to its end, good or bad."""
        run = self.running.pop(index)
        self.walls.append((self.clock() - run.since) / (1.0 - run.before))
        self.done += 1
        self.tell(index, result)

    def tell(self, index: int, result: Mapping[str, Any]) -> None:
        """Say how a case ended."""
        if result["status"] != "solved":
            say(f"cellmech: {self.labels[index]}: failed: {result['reason']}", sys.stderr)

    def tick(self) -> None:
        """Some time has passed."""

    @property
    def waiting(self) -> int:
        """Cases nobody has begun with."""
        return self.total - self.done - len(self.running)

    def left_s(self) -> float | None:
        """Estimate of the time left [s]: from the cases that are done, else from the share of the running ones."""
        now = self.clock()
        runs = [(now - run.since, run.share - run.before, 1.0 - run.before) for run in self.running.values()]
        guesses = self.walls or [age / done for age, done, _ in runs if done > 0.02]
        if not guesses:
            return None
        whole = sum(guesses) / len(guesses)
        work = sum(max(whole * part - age, 0.0) for age, _, part in runs) + self.waiting * whole
        return work / max(min(self.groups, len(self.running) + self.waiting), 1)

    def state(self) -> str:
        """One line: cases done, running and left, time left."""
        left = self.left_s()
        estimate = "" if left is None else f", about {duration(left)} left"
        return f"{self.done} of {self.total} cases done, {len(self.running)} running, {self.waiting} waiting{estimate}"


class Plain(Quiet):
    """A line for each case that ends and a line now and then: for files and pipes."""

    def __init__(
        self, labels: Sequence[str], served: int, groups: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(labels, served, groups, clock)
        self._next = clock() + LINE_EVERY_S

    def tell(self, index: int, result: Mapping[str, Any]) -> None:
        """Say how a case ended."""
        self.line(f"[{self.done}/{self.total}] {self.labels[index]}: {ending(result)}")
        if not is_final(result):
            super().tell(index, result)

    def line(self, text: str) -> None:
        """Print a line."""
        say(text)

    def tick(self) -> None:
        """Print how far the cases are, if that is due."""
        if self.running and self.clock() >= self._next:
            self._next = self.clock() + LINE_EVERY_S
            cases = [f"{self.labels[index]}: {where(run)}" for index, run in sorted(self.running.items())]
            say("; ".join([self.state(), *cases[:4], *["..."] * (len(cases) > 4)]))


def where(run: Running) -> str:
    """Progress of a case, in a few words."""
    if run.last is None:
        return "starting"
    last = run.last
    return f"t = {last.t_s:.5g} of {last.end_s:.5g} s, step {last.step}, Newton {last.newton}"


def ending(result: Mapping[str, Any]) -> str:
    """The end of a case, in a few words."""
    if result["status"] != "solved":
        return f"FAILED: {result['reason']}"
    return f"solved, {result.get('steps')} steps, {result.get('wall_s', 0.0):.1f} s"


def results_table(names: Sequence[str], results: Sequence[Mapping[str, Any]], width: int | None = None) -> str:
    """The results of a study for the terminal: maxima in the nucleus, contact, cost; failures with their reasons.

    Args:
        names: of the cases.
        results: the content of their result.json.
        width: characters a line; where they do not do, costs are left out, then names have lines of their own.
    """
    scalars = [{"status": result["status"], **flatten(result)} for result in results]
    heads = {"status": ("status", ""), **COLUMNS}
    columns = {head: [head, *(_brief(of.get(key), form) for of in scalars)] for head, (key, form) in heads.items()}
    first = ["case", *names]
    shown = _fitting(first, columns, width)
    if own_lines := width is not None and _wide(first, shown) > width:
        shown = _fitting([""], columns, width)
    widths, lines = [max(map(len, column)) for column in shown.values()], []
    for name, *row in zip(first, *shown.values(), strict=True):
        status, *cells = (cell.rjust(wide) for cell, wide in zip(row, widths, strict=True))
        lines += [name] * (own_lines and name != "case")
        start = "" if own_lines else name.ljust(max(map(len, first)))
        lines.append("  ".join([start, status.strip().ljust(widths[0]), *cells]))
    failed = [(name, result) for name, result in zip(names, results, strict=True) if result["status"] != "solved"]
    lines += [f"{name} failed: {result['reason']}" for name, result in failed]
    return "\n".join(lines + doubtful(names, results))


def _fitting(
    first: Sequence[str], columns: Mapping[str, Sequence[str]], width: int | None
) -> Mapping[str, Sequence[str]]:
    """The columns without the costs that make a line longer than the width."""
    for cost in COSTS:
        if width is not None and _wide(first, columns) > width:
            columns = {head: column for head, column in columns.items() if head != cost}
    return columns


def _wide(first: Sequence[str], columns: Mapping[str, Sequence[str]]) -> int:
    """Characters of a line of the table."""
    return sum(2 + max(map(len, column)) for column in (first, *columns.values())) - 2


def doubtful(names: Sequence[str], results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Lines on cases whose numbers the mesh or the penalty puts in doubt."""
    lines = []
    for name, result in zip(names, results, strict=True):
        warnings = (result.get("model") or {}).get("warnings") or {}
        lines += [f"{name} in doubt: {key}: {text}" for key, text in warnings.items() if key in DOUBTS]
    return lines


def _brief(value: float | str | None, form: str) -> str:
    return "-" if value is None else format(value, form)
