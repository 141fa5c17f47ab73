"""The audit as tables, and what they say in a few sentences."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from cellmech import Cause
from cellmech.figures import NONE, PAPER, Row, Section, plain, provenance, signal, significant, tone_of, verdict, yes
from cellmech.results import to_csv
from studies.paper.audit import MAXIMA, Audit, Tried
from studies.paper.bounds import bounds, least_J2
from studies.paper.choices import QUESTIONS, SUBJECTS, Subject
from studies.paper.misfit import log_ratio
from studies.paper.printed import RESTS, in_print

HOW = (
    "Ratios are (ours − q0)/(printed − q0), q0 the value at rest; ours are the largest values in the nucleus of "
    "the static state at the end. Rows: the four laws of Figure 2; fluid: Figure 4's largest strains (c_f,l = "
    "0.7, c_f,np = 0.9); stiff: Figure 6's smallest J1 and J2 (E_l = 1500 Pa, E_np = 90 Pa); S2, S3: Table 3 (S1 "
    "is Saint-Venant, as nothing moves after the ramp). Misfit: root mean square of ln ratio over the printed σ, "
    "J1, J2, J3; a number of the other sign counts as a factor 1000."
)
HEAD = ("row", "choice", "σ", "J1", "J2", "J3", "misfit", "within 5 %")


def audit_markdown(audit: Audit) -> str:
    """Reading, tables and provenance."""
    parts = [f"# What the paper leaves open, tried: {PAPER}", "\n".join(f"- {line}" for line in reading(audit)), HOW]
    parts += [section.markdown() for section in sections(audit)]
    return "\n\n".join([*parts, "## Provenance of the audit", provenance(audit.study)]) + "\n"


def audit_csv(audit: Audit) -> str:
    """Every table's lines with all digits, told apart by the column "section"."""
    return to_csv([record for section in sections(audit) for record in section.records()], ("section",))


def sections(audit: Audit) -> list[Section]:
    """All tables, in the order to read them."""
    failed = [tried for tried in audit.tried if tried.failure]
    runs = "Every run with a solution; 1 is agreement."
    found = [
        Section("audit_moved", "What moves the numbers", *_moved(audit)),
        Section("audit_best", "The best that any choice does", "The run of least misfit.", HEAD, _best(audit)),
        Section("audit_numbers", "Which choices reach which number", *_numbers(audit)),
        Section("audit_why", "Why none can", *_why(audit)),
        Section("audit_single", "One choice at a time", runs, HEAD, _runs(audit.alone())),
    ]
    if pairs := [tried for tried in audit.tried if len(tried.trial.chosen) > 1]:
        found.append(Section("audit_pairs", "Two choices at a time", runs, HEAD, _runs(pairs)))
    header = ("row", "choice", "reason")
    return [*found, Section("audit_failed", "No solution", "And why.", header, [*map(_failed, failed)])]


def reading(audit: Audit) -> list[str]:
    """The outcome in sentences, each of which the tables bear out."""
    return [*_of_runs(audit), *_of_rows(audit), *_of_reasons(audit)]


def _of_runs(audit: Audit) -> Iterable[str]:
    failed = [tried for tried in audit.tried if tried.failure and tried.slot.case]
    slides = sum(tried.slot.case.cause is Cause.SLIDES for tried in failed if tried.slot.case)
    lost = len(audit.missing())
    yield (
        f"{len(audit.tried)} runs: {len(audit.solved())} with a solution, {len(failed) - slides} without an "
        f"equilibrium on the way to the load, {slides} where the cell slides "
        f"off{f', {lost} not run' if lost else ''}."
    )
    known = [(question, audit.movement(question)) for question in audit.order()]
    moved = ", ".join(f"{name} (factor {significant(math.exp(by))})" for name, by in known)
    yield f"Furthest that a choice alone moves a printed maximum, on q − q0: {moved}."


def _of_rows(audit: Audit) -> Iterable[str]:
    whole = [tried.slot.name for tried in audit.solved() if tried.close() == tried.judged]
    if whole:
        yield f"Every printed number of its row within 5 %: {'; '.join(whole)}."
    else:
        yield "No choice, alone or with another, brings every printed number of any row within 5 %."
    hits = {(s.name, quantity) for s in SUBJECTS for tried in audit.of(s) for quantity in tried.close()}
    count = sum(len(audit.as_printed(subject).judged) for subject in SUBJECTS)
    yield f"{len(hits)} of {count} printed numbers are within 5 % in some run, the other {count - len(hits)} in none."
    both = [(max(abs(log_ratio(tried.ratios[q])) for q in ("sigma", "J1")), tried) for tried in audit.solved()]
    if both:
        off, nearest = min(both, key=lambda one: one[0])
        yield f"σ_Mises and J1 of a row at once: at best off by a factor {math.exp(off):.2g} ({nearest.slot.name})."
    for subject in SUBJECTS:
        most = max(audit.of(subject), key=lambda tried: (len(tried.close()), -tried.misfit))
        names = [_name(quantity) for quantity in most.judged if (subject.name, quantity) in hits]
        if names:
            yield (
                f"{subject.name}: at most {len(most.close())} of its {len(most.judged)} printed numbers at once "
                f"({most.trial.label}); reached at all: {', '.join(names)}."
            )
        else:
            yield f"{subject.name}: none of its {len(most.judged)} printed numbers is reached."


def _of_reasons(audit: Audit) -> Iterable[str]:
    rows = {subject.name: audit.bounded(subject) for subject in SUBJECTS}
    bad = [name for name, row in rows.items() if row.stress_possible is False]
    checked = [tried.obeys for tried in audit.solved() if tried.obeys is not None]
    silent = [name for name, row in rows.items() if row.stress_possible is None]
    without = f" For {', '.join(silent)} it says nothing." if silent else ""
    yield (
        f"Why: in {len(bad)} of the {len(rows)} rows tried here ({', '.join(bad)}) the printed σ_Mises is less than "
        "the printed strains demand with the printed moduli, whatever the load, pillar or place; of our runs "
        f"{sum(checked)} of {len(checked)} obey that inequality.{without}"
    )
    base = audit.as_printed(SUBJECTS[0])
    weight, width = base.slot.value("contact.weight_Pa_x_um"), 2 * base.slot.scene.radius_um
    yield (
        f"Under the printed load the weight over the cell's width is {significant(weight / width)} Pa, against (1 "
        "− c_f) E = 5 Pa of nucleoplasm and cytosol (1 Pa where c_f,np = 0.9): strains of some per cent. Where "
        "the volume hardly changes, J1 − 2 and J2 − 2 are of second order in them."
    )
    table = audit.paper.table("table3")
    twin = audit.paper.table("fig2")["saint-venant"]
    if "S1" in table:
        yield (
            "S1 is the scene of saint-venant, static after the ramp, yet the print has σ_Mises "
            f"{in_print('sigma', table['S1'].values['sigma'])} and {in_print('sigma', twin.values['sigma'])} Pa: "
            "no choice that holds for both can meet both."
        )


def _moved(audit: Audit) -> tuple[str, tuple[str, ...], list[Row]]:
    text = (
        "The largest factor by which a choice of each question, alone, changes ours / printed of a maximum. "
        "Numbers that change sign have no factor and are left out."
    )
    rows = []
    for question in audit.order():
        options = ", ".join(option.label for option in QUESTIONS[question])
        cells = (question, options, NONE, NONE, NONE)
        record: dict[str, Any] = {"question": question, "options": options}
        if most := audit.most_moved(question):
            by, tried, quantity = most
            cells = (question, options, significant(math.exp(by)), _name(quantity), tried.slot.name)
            record |= {"factor": math.exp(by), "quantity": quantity, "run": tried.slot.name}
        rows.append(Row(cells, record))
    return text, ("question", "choices", "factor", "of", "by"), rows


def _best(audit: Audit) -> list[Row]:
    return [_run(audit.best(subject)) for subject in SUBJECTS]


def _runs(tried: Sequence[Tried]) -> list[Row]:
    return [_run(one) for one in tried if not one.failure]


def _run(tried: Tried) -> Row:
    ratios = (significant(tried.ratios.get(quantity, math.nan)) for quantity in MAXIMA)
    close = ", ".join(map(_name, tried.close())) or NONE
    cells = (tried.trial.subject.name, tried.trial.label, *ratios, significant(tried.misfit), close)
    record: dict[str, Any] = {"row": tried.trial.subject.name, "choice": tried.trial.label, "misfit": tried.misfit}
    return Row(cells, record | dict(tried.ratios), tone_of(math.exp(tried.misfit)))


def _numbers(audit: Audit) -> tuple[str, tuple[str, ...], list[Row]]:
    text = (
        "The choices that bring each printed number within 5 %, and the nearest one. A number met by a choice "
        "that misses the others of its row explains nothing. Loads were tried in steps: one between or beyond "
        "them may meet a single number more (see the fits)."
    )
    header = ("row", "number", "printed", "as printed", "nearest", "ratio", "by", "within 5 %", "such as")
    rows = [_number(audit, s, quantity) for s in SUBJECTS for quantity in audit.as_printed(s).judged]
    return text, header, rows


def _number(audit: Audit, subject: Subject, quantity: str) -> Row:
    runs = [tried for tried in audit.of(subject) if not tried.failure]
    base = audit.as_printed(subject)
    printed, rest = base.printed[quantity], RESTS[quantity]
    nearest = min(runs or [base], key=lambda tried: abs(log_ratio(tried.ratios[quantity])))
    hits = sorted((tried for tried in runs if quantity in tried.close()), key=lambda tried: tried.misfit)
    ratio, ours = nearest.ratios[quantity], (base.value(quantity), nearest.value(quantity))
    head = (subject.name, _name(quantity), in_print(quantity, printed), *(signal(value, rest) for value in ours))
    such = "; ".join(tried.trial.label for tried in hits[:3]) or NONE
    cells = (*head, significant(ratio), nearest.trial.label, f"{len(hits)} of {len(runs)}", such)
    record: dict[str, Any] = {"row": subject.name, "quantity": quantity, "printed": printed, "as_printed": ours[0]}
    record |= {"nearest": ours[1], "ratio_from_rest": ratio, "choice": nearest.trial.label}
    return Row(cells, record | {"within": len(hits), "runs": len(runs)}, tone_of(ratio))


def _why(audit: Audit) -> tuple[str, tuple[str, ...], list[Row]]:
    text = (
        "In plane strain σ_Mises ≥ (√3/2) c_s µ √(J1² − 4 J3)/√J3 for each law where J1 ≥ 2, and Saint-Venant's "
        "own law demands more; c_s µ is that of the softer layer of the nucleus. Neither load, pillar, contact, "
        "place nor β enters. And J2 = J1² − 2 J3 everywhere. Possible: half a digit granted to each printed "
        "number. Ours that obey: of the runs with a solution, smeared layers too, those whose stress is at least "
        "the first bound of our strains."
    )
    header = ("row", "printed σ [Pa]", "at least", "possible", "printed J2", "at least", "possible", "ours that obey")
    return text, header, [_reason(audit, subject) for subject in SUBJECTS]


def _reason(audit: Audit, subject: Subject) -> Row:
    row = audit.bounded(subject)
    sigma, J2 = row.printed["sigma"], row.printed["J2"]
    least = max((bound for bound in bounds(row.slot, row.printed) if math.isfinite(bound)), default=math.nan)
    obeys = [tried.obeys for tried in audit.of(subject) if tried.obeys is not None]
    stress = (in_print("sigma", sigma), significant(least), yes(row.stress_possible))
    strain = (in_print("J2", J2), f"{least_J2(row.printed):.2f}", yes(row.J2_possible))
    cells = (subject.name, *stress, *strain, f"{sum(obeys)} of {len(obeys)}")
    record: dict[str, Any] = {
        "row": subject.name,
        "printed": sigma,
        "least_sigma": least,
        "least_J2": least_J2(row.printed),
    }
    record |= {"possible": plain(row.stress_possible), "J2_possible": plain(row.J2_possible)}
    return Row(cells, record | {"obey": sum(obeys), "runs": len(obeys)}, verdict(row.stress_possible))


def _failed(tried: Tried) -> Row:
    cells = (tried.trial.subject.name, tried.trial.label, tried.failure)
    return Row(cells, dict(zip(("row", "choice", "failure"), cells, strict=True)), "none")


def _name(quantity: str) -> str:
    return "σ" if quantity == "sigma" else quantity.replace("share_", "share of ")
