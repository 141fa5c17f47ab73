"""The work that a command line leaves: each case is solved once, and not at all if its outcome is known."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cellmech.causes import Cause
from cellmech.errors import CellmechError
from cellmech.results.accuracy import assess, bears_on
from cellmech.results.accuracy_report import error_trees, report, table_rows
from cellmech.results.archive import Record, alone_in, finished, forget, input_key, merge_tables, source_hash
from cellmech.results.records import RESULT, to_csv, write_whole
from cellmech.results.sealed import sealed
from cellmech.runs.command import Command, Order
from cellmech.runs.job import Job
from cellmech.runs.messages import PAUSE_S
from cellmech.runs.reuse import solved_beside, take_over
from cellmech.scene.case import Case

REFINED, ACCURACY = "accuracy", "accuracy.csv"  # folder, in a case's, of the runs that show its error


@dataclass
class Agenda:
    """The cases of a command line that are chosen, sorted by what is to be done.

    Args:
        jobs: to solve.
        known: results that are there, by label.
        sources: the folder that a result in `known` has been taken over from, by label.
        twins: cases with the same key as a job, which is the second of the pair.
        keys: for each order the `input_key` of all its study's cases, by name.
    """

    jobs: list[Job] = field(default_factory=list)
    known: dict[str, Record] = field(default_factory=dict)
    sources: dict[str, Path] = field(default_factory=dict)
    twins: list[tuple[Job, Job]] = field(default_factory=list)
    keys: list[dict[str, str]] = field(default_factory=list)


def draw_up(command: Command, mesh_plan: Callable[..., Any]) -> Agenda:
    """Sort the cases by what is on disk, take over what is solved elsewhere, bring the tables up to it.

    Raises:
        CellmechError: the disk refuses.
    """
    agenda = Agenda()
    try:
        chosen = _chosen(command, mesh_plan, agenda.keys)
        if command.options.fresh:
            for job in chosen:
                forget(job.folder)
        _sort(chosen, agenda, command.options.fresh)
    except OSError as error:
        raise CellmechError(f"{error.filename}: {error.strerror}") from None
    for order, keys in zip(command.orders, agenda.keys, strict=True):
        merge_tables(order.out, order.study.cases, keys, {})  # those of before would belie what now changes
    return agenda


def _chosen(command: Command, mesh_plan: Callable[..., Any], all_keys: list[dict[str, str]]) -> list[Job]:
    jobs = []
    for order in command.orders:
        keys = {case.name: input_key(case, mesh_plan(case.scene)) for case in order.study.cases}
        all_keys.append(keys)
        for case in order.chosen:
            label, folder = command.label(order, case), order.out / case.name
            jobs.append(Job(label, case, folder, mesh_plan(case.scene), keys[case.name], source_hash()))
            for refinement in order.refined(case):
                label = command.label(order, case, refinement)
                finer = Case(f"{case.name} [{refinement.name}]", refinement.scene)
                place = folder / REFINED / refinement.name
                plan = mesh_plan(finer.scene)
                jobs.append(Job(label, finer, place, plan, input_key(finer, plan), source_hash()))
    return jobs


def _sort(chosen: list[Job], agenda: Agenda, fresh: bool) -> None:
    first: dict[str, Job] = {}
    beside: dict[Path, dict[str, list[Path]]] = {}
    for job in chosen:
        notes: list[str] = []
        result, source = finished(job.folder, job.key, notes.append), None
        if result is None and not fresh and job.key not in first:
            out = job.folder.parent
            if out not in beside:
                beside[out] = solved_beside(out)
            for source in beside[out].get(job.key, ()):
                with suppress(OSError):  # it is solved then; a disk that refuses will say so again
                    result = take_over(source, job.case, job.folder, job.key)
                if result is not None:
                    break
        if result is not None:
            agenda.known[job.label] = result
            if source is not None:
                agenda.sources[job.label] = source
        elif job.key in first:
            agenda.twins.append((job, first[job.key]))
        else:
            first[job.key] = job
            agenda.jobs.append(replace(job, notes=tuple(notes)))


def share_with_twin(twin: Job, job: Job, result: Record) -> Record:
    """A job's result for a case with the same key: its files too, unless it will be tried again."""
    try:
        copied = take_over(job.folder, twin.case, twin.folder, twin.key)
    except OSError as error:
        result = {**result, **Cause.DISK.reason(told=f"{job.folder} cannot be copied ({error})").as_record()}
        copied = None
    return copied or {**result, "case": twin.case.name}


def attach_errors(command: Command, order: Order, results: dict[str, Record]) -> dict[str, list[str]]:
    """Put the errors that are asked for into the results and their files; returns lines for people by case.

    Args:
        command: what is asked for.
        order: one of its orders.
        results: by label, those of the refinements included; a case whose error is known gets a new one.

    Raises:
        CellmechError: a file cannot be written.
    """
    told = {}
    for case in order.chosen:
        label = command.label(order, case)
        if not order.parts or results[label]["status"] != "solved":
            continue
        refined = {r.name: results[command.label(order, case, r)] for r in order.refined(case)}
        good = {name: result if result["status"] == "solved" else None for name, result in refined.items()}
        assessed = assess(results[label], good, [part for part in bears_on(case.scene) if part in order.parts])
        results[label] = {**results[label], **error_trees(assessed)}
        folder = order.out / case.name
        try:
            with alone_in(folder, wait=lambda: time.sleep(PAUSE_S)):
                write_whole(folder / RESULT, sealed(results[label]))
                write_whole(folder / ACCURACY, to_csv(table_rows(assessed)))
        except OSError as error:
            raise CellmechError(f"{folder}: the errors cannot be written ({error.strerror})") from None
        told[label] = report(assessed)
    return told
