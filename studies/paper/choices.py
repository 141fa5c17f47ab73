"""What the paper leaves open or prints ambiguously, as settings of a scene, and the runs that try them.

The subjects are rows the paper prints numbers for. `singles` tries one choice at a time on each, `pairs` two.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from studies.paper.printed import LAWS

AS_PRINTED = "as-printed"
MOST_RUNS = 300  # of both studies together


@dataclass(frozen=True)
class Subject:
    """A printed row to be explained.

    Args:
        name: begins the names of its cases.
        table, row: where it is printed, as in paper_numbers.toml.
        settings: of its scene, by dotted key.
        law: its law.
        fully: whether every option is tried on it, or those that stand for their question only.
    """

    name: str
    table: str
    row: str
    settings: Mapping[str, Any]
    law: str
    fully: bool = True


@dataclass(frozen=True)
class Option:
    """One way to settle an open question.

    Args:
        label: names it in a case's name; no comma.
        settings: by dotted key.
        laws: for which it makes a difference.
        stands_for: the laws for which it stands for its question where not every option is tried.
    """

    label: str
    settings: Mapping[str, Any]
    laws: tuple[str, ...] = tuple(LAWS)
    stands_for: tuple[str, ...] = tuple(LAWS)


def _subjects() -> tuple[Subject, ...]:
    soft = {"layer.lamina.fluid_fraction": 0.7, "layer.nucleoplasm.fluid_fraction": 0.9}
    stiff = {"layer.lamina.young_Pa": 1500, "layer.nucleoplasm.young_Pa": 90}
    saint_venant = {"cell.law": "saint-venant", "time.end_s": 24000.0}
    laws = [Subject(law, "fig2", law, {"cell.law": law}, law) for law in LAWS]
    return (
        *laws,
        Subject("fluid", "fig4", "max_strain", soft, "neo-hookean", False),
        Subject("stiff", "fig6", "min_J1_J2", stiff, "neo-hookean", False),
        Subject("S2", "table3", "S2", saint_venant | soft, "saint-venant", False),
        Subject("S3", "table3", "S3", saint_venant | soft | {"layer.lamina.young_Pa": 10}, "saint-venant", False),
    )


def _load(factor: int) -> Option:
    """A load; Saint-Venant collapses early, and what one load collapses a larger one does too."""
    laws = ("saint-venant",) if factor in (2, 5) else tuple(LAWS)[1:] if factor in (10, 20) else ()
    return Option(f"load={factor}", {"load.factor": factor}, stands_for=laws)


def _smeared(width_um: float) -> Option:
    settings = {"cell.layers": "smeared", "cell.smear_um": width_um}
    return Option(f"smeared={width_um:g}", settings, stands_for=tuple(LAWS) if width_um in (0.4, 0.8) else ())


SUBJECTS = _subjects()
BETA_LAWS = ("mooney-rivlin", "yeoh")
QUESTIONS: Mapping[str, tuple[Option, ...]] = {
    "load factor": tuple(map(_load, (2, 5, 10, 15, 20, 25))),
    "smeared layers": tuple(map(_smeared, (0.1, 0.4, 0.8, 1.0))),
    "pillar half-width": (Option("half-width=5", {"pillar.0.half_width_um": 5.0}),),
    "beta/mu": (
        Option("beta=0.4", {"cell.beta_over_mu": 0.4}, BETA_LAWS),
        Option("beta=0.25", {"cell.beta_over_mu": 0.25}, BETA_LAWS, ()),
    ),
    "Yeoh's reference": (Option("yeoh-printed", {"cell.yeoh_reference": "printed"}, ("yeoh",)),),
    "Lamé's lambda": (Option("lambda-printed", {"cell.lame_lambda": "printed"}),),
    "contact form": (
        Option("volume", {"contact.form": "volume"}, stands_for=()),
        Option("volume-printed", {"contact.form": "volume-printed"}),
    ),
    "cell over the pillar's edge": (
        Option("edge-of-two", {"pillar.0.x_um": 10.0}),
        Option("edge-of-one", {"cell.shape": "full", "cell.centre_x_um": 10.0}, stands_for=()),
    ),
}
"""Each open question with the ways to settle it besides the one that the paper's studies take."""


@dataclass(frozen=True)
class Trial:
    """A run of the audit: a subject and what was chosen for it, by question."""

    subject: Subject
    chosen: Mapping[str, Option]

    @property
    def name(self) -> str:
        """Of its case."""
        return f"{self.subject.name},{self.label}"

    @property
    def label(self) -> str:
        """What was chosen, in a word each."""
        return ",".join(option.label for option in self.chosen.values()) or AS_PRINTED

    @property
    def settings(self) -> dict[str, Any]:
        """Of its scene, by dotted key."""
        found = dict(self.subject.settings)
        for option in self.chosen.values():
            found |= option.settings
        return found


def trial(name: str) -> Trial:
    """The trial of a case's name; ValueError when there is none."""
    subjects = {subject.name: subject for subject in SUBJECTS}
    options = {option.label: (question, option) for question, of in QUESTIONS.items() for option in of}
    first, *labels = name.split(",")
    try:
        chosen = dict(options[label] for label in labels if label != AS_PRINTED)
        return Trial(subjects[first], chosen)
    except KeyError as error:
        raise ValueError(f"{name}: there is no subject or choice {error} in the audit") from None


def singles() -> list[Trial]:
    """Every subject as printed, then with one choice at a time."""
    found = [Trial(subject, {}) for subject in SUBJECTS]
    for subject in SUBJECTS:
        for question in QUESTIONS:
            found += [Trial(subject, {question: option}) for option in _options(subject, question, subject.fully)]
    return found


def pairs(order: Sequence[str]) -> list[Trial]:
    """Two choices at a time, by the options that stand for their questions.

    Args:
        order: the questions, the one whose choices moved the numbers most first.

    Returns:
        That question with every other, then the next two with each other; no more than there is room for.
    """
    first, second, third, *_ = order
    found = []
    for a, b in [*((first, other) for other in order[1:]), (second, third)]:
        for subject in SUBJECTS:
            found += [
                Trial(subject, {a: one, b: other}) for one in _options(subject, a) for other in _options(subject, b)
            ]
    return found[: MOST_RUNS - len(singles())]


def _options(subject: Subject, question: str, every: bool = False) -> list[Option]:
    law = subject.law
    return [o for o in QUESTIONS[question] if law in o.laws and (every or law in o.stands_for)]
