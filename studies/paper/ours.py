"""Our results at the places the paper prints: every case it has, solved, failed or missing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cellmech import InputError, Scene
from cellmech.figures import StudyResult
from cellmech.results import Result, load
from cellmech.scene import load_study
from studies.paper.printed import LAWS, PLACES, PrintedRow, at

STUDIES = Path(__file__).resolve().parents[1]
ABSENT = "no result"
FOLDERS = {  # table -> the studies that have its cases; the first is the one that says which these are
    "fig2": ("fig2", "fig3"),
    "fig4": ("fig4",),
    "fig6": ("fig6",),
    "table3": ("table3", "fig7"),
}


@dataclass(frozen=True)
class Slot:
    """A case of the paper, and what came of it here.

    Args:
        name: of the case in its study.
        scene: its input, as the study file has it.
        axes: the keys of `PLACES` that set the cases of its study apart.
        case: its result; None when there is none.
        lack: why there is none.
    """

    name: str
    scene: Scene
    axes: tuple[str, ...]
    case: Result | None
    lack: str = ""

    @property
    def status(self) -> str:
        """Solved, failed or missing."""
        if self.case is None:
            return "missing"
        return "failed" if self.case.failure else "solved"

    @property
    def reason(self) -> str:
        """Why there is no number; "" when there is one."""
        if self.case is None:
            return self.lack
        return f"failed at {self.case.get('t_s'):,.0f} s: {self.case.failure}" if self.case.failure else ""

    def value(self, key: str) -> float:
        """A number of result.json by its dotted key; NaN unless the case was solved."""
        return self.case.get(key) if self.case is not None and self.status == "solved" else math.nan

    def error(self, key: str) -> float:
        """How far that number may be off, where the accuracy was measured (in the number's unit); else NaN."""
        return self.value(f"error.{key}")

    def parameter(self, key: str) -> float:
        """The scene's value of a parameter that printed rows give."""
        layer, name, _, _ = PLACES[key]
        return float(getattr(getattr(self.scene.layer, layer), name))

    @property
    def label(self) -> str:
        """The case for people."""
        if self.name in LAWS:
            return LAWS[self.name].label
        return at({key: self.parameter(key) for key in self.axes}) if self.axes else self.name

    @property
    def area_ratio(self) -> float:
        """Area of the cell / area of the nucleus, at rest."""
        layers = self.scene.layer
        return (layers.membrane.outer_radius_um / layers.lamina.outer_radius_um) ** 2

    def fits(self, place: Mapping[str, float]) -> bool:
        """Whether its scene has these parameters."""
        return all(math.isclose(self.parameter(key), value) for key, value in place.items())


@dataclass(frozen=True)
class Ours:
    """The cases of each printed table, in the order of their study."""

    slots: Mapping[str, tuple[Slot, ...]]

    def at(self, row: PrintedRow) -> Slot:
        """The case that a printed row is about.

        Raises:
            InputError: when the study has no such case, or one with other parameters.
        """
        return self.find(row.table, row.name, row.place)

    def find(self, table: str, name: str, place: Mapping[str, float]) -> Slot:
        """The case of this name or, if there is none, at this place; raises as `at`."""
        slots = self.slots[table]
        named = [slot for slot in slots if slot.name == name] or ([*slots] if place else [])
        for slot in named:
            if slot.fits(place):
                return slot
        rule = f"the row {name} must be about one of the study's cases"
        raise InputError(str(STUDIES / f"{table}.toml"), "", rule, at(place) or None)

    def unsolved(self) -> list[str]:
        """One line for each case that is missing or failed, or for a study none of whose cases is there."""
        lines = []
        for table, slots in self.slots.items():
            if any(slot.case is not None or slot.lack != ABSENT for slot in slots):
                lines += [f"{table}/{slot.name}: {slot.reason}" for slot in slots if slot.reason]
            else:
                lines.append(f"{table}: none of its {len(slots)} cases has a result (make paper-runs solves them)")
        return lines

    def study(self, table: str) -> StudyResult:
        """The cases of a table that have a result, for `figures.style.provenance`."""
        return StudyResult(Path(table), {slot.name: slot.case for slot in self.slots[table] if slot.case is not None})


def read_ours(results: Path, studies: Path = STUDIES) -> Ours:
    """Read the results of every study the paper's numbers are about.

    Args:
        results: the folder that has those of each study in a folder of its own.
        studies: the folder of the study files, which say what cases there should be.

    Raises:
        InputError: when there is no result at all, or a file is broken.
    """
    slots = {table: tuple(_slots(results, studies, stems)) for table, stems in FOLDERS.items()}
    if not any(slot.case for of in slots.values() for slot in of):
        hint = "Run the studies first: make paper."
        raise InputError(str(results), "", f"must hold a result of {', '.join(FOLDERS)}", "none", hint)
    return Ours(slots)


def _slots(results: Path, studies: Path, stems: Sequence[str]) -> list[Slot]:
    cases = load_study(studies / f"{stems[0]}.toml").cases
    found = []
    for case in cases:
        folders = [results / stem / case.name for stem in stems]
        there = next((folder for folder in folders if (folder / "result.json").is_file()), None)
        slot = Slot(case.name, case.scene, (), load(there) if there else None, ABSENT)
        found.append(replace(slot, case=None, lack="solved with other inputs") if _is_other(slot) else slot)
    if len(stems) > 1:  # laws, or simulations with a name
        return found
    axes = tuple(key for key in PLACES if len({slot.parameter(key) for slot in found}) > 1)
    return [replace(slot, axes=axes) for slot in found]


def _is_other(slot: Slot) -> bool:
    """Whether the result is of other values of what the paper varies; mesh and tolerances may differ."""
    planned = {key: slot.parameter(key) for key in PLACES}
    return slot.case is not None and not (
        replace(slot, scene=slot.case.scene).fits(planned) and slot.case.scene.cell.law == slot.scene.cell.law
    )
