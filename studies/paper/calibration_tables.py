"""What the fits say: their table, and the study of the largest load that Saint-Venant bears."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cellmech.figures import NONE, Row, Section, significant, tone_of
from cellmech.results import to_csv
from studies.paper.audit import CLOSE
from studies.paper.calibration import COLLAPSING, DIGITS, LIMIT, LOAD, MAXIMA, SMEAR, TO_STRAINS, TOGETHER, Fit
from studies.paper.printed import LAWS
from studies.paper.study_files import study_text

MADE = 'Written by "python -m studies.paper calibrate".'
NEAR = math.log(2)  # misfit up to which a fit of the load comes near its strains


def chosen(fits: Sequence[Fit]) -> dict[str, Fit]:
    """Law -> the fit of the load to its strains, for the laws where that comes near."""
    found = {next(iter(one.ratios)): one for one in fits if one.kind == TO_STRAINS}
    return {law: one for law, one in found.items() if one.misfit(law) <= NEAR}


def limit(fits: Sequence[Fit]) -> Fit:
    """The largest load of the law that collapses."""
    return next(one for one in fits if one.kind == LIMIT)


def limit_study(fits: Sequence[Fit], mesh: str) -> str:
    """The study of Saint-Venant's largest load, found on this mesh."""
    one = limit(fits)
    load, ratios = _rounded(one.values[LOAD]), one.ratios[COLLAPSING]
    parts = ", ".join(f"{q} {significant(ratios[q])}" for q in MAXIMA)
    head = f"""Saint-Venant at the largest load that has an equilibrium: the cell of Table 1, load.factor found by
bisection to {100 * DIGITS:g} % ({mesh}). This is not the paper's input, whose load is 1.
{MADE} End state only.

What it must show
- Ours / printed of the differences from rest: {parts}.
  So this law never comes near the printed strains.
- Beyond this load the material loses ellipticity in the cytosol under the lamina (stability in result.json): a
  Saint-Venant solid softens in compression. studies/README.md has this load on several meshes. With the whole history
  (time.history = true) the fluid's viscosity delays the loss but does not prevent it."""
    cases = {COLLAPSING: {"cell.law": COLLAPSING, LOAD: load}}
    return study_text("Saint-Venant at the largest load that has an equilibrium", head, cases)


def fit_section(fits: Sequence[Fit], mesh: str) -> Section:
    """The fits as a table.

    Args:
        fits: all of them.
        mesh: what they were computed on.
    """
    text = (
        "Least-squares fits of open inputs to Figure 2's rows. Ratios of the differences from rest, ours / printed; "
        "misfit: root mean square of ln ratio over what was fitted to. Saint-Venant has no equilibrium beyond "
        f"load.factor = {limit(fits).values[LOAD]:.4g} (within {100 * DIGITS:g} %), which bounds its fits; J1 and J2 "
        f"fit best there. The other laws' loads were varied up to {TO_STRAINS.free[0].most:g}. Computed on the {mesh}."
    )
    header = ("fitted", "law", LOAD, SMEAR, *MAXIMA, "misfit", "runs")
    return Section(
        "fit", "Fits of the open inputs", text, header, [_row(one, law) for one in fits for law in one.ratios]
    )


def fit_reading(fits: Sequence[Fit]) -> list[str]:
    """What the table says."""
    lines = []
    for law, one in chosen(fits).items():
        of = one.ratios[law]
        lines.append(
            f"{LAWS[law].label}: load × {one.values[LOAD]:.3g} gives J1 − 2 × {significant(of['J1'])} and J2 − 2 × "
            f"{significant(of['J2'])} of the print, but σ_Mises × {significant(of['sigma'])} and J3 − 1 × "
            f"{significant(of['J3'])}."
        )
    at_limit = limit(fits)
    of = at_limit.ratios[COLLAPSING]
    lines.append(
        f"{LAWS[COLLAPSING].label}: no equilibrium beyond load × {at_limit.values[LOAD]:.3g}; there J1 − 2 is × "
        f"{significant(of['J1'])} and J2 − 2 × {significant(of['J2'])} of the print, σ_Mises × "
        f"{significant(of['sigma'])}."
    )
    together = next(one for one in fits if one.kind == TOGETHER)
    loads = ", ".join(f"{one.values[LOAD]:.3g}" for one in chosen(fits).values())
    worst = max(together.misfit(law) for law in together.ratios)
    lines.append(
        f"One load for the three laws: × {together.values[LOAD]:.3g}, off by a factor {math.exp(worst):.3g} (rms "
        f"over J1 and J2) for the worst of them; their own loads are × {loads}."
    )
    wide = [one for one in fits if len(one.kind.targets) > 2]
    least, law, kind = min((one.misfit(law), law, one.kind.name) for one in wide for law in one.ratios)
    lines.append(
        f"Stress and strains together: the best fit, {LAWS[law].label} ({kind}), is off by a factor "
        f"{math.exp(least):.3g} (rms)."
        + (" No fit explains the print; the table of residuals is the result." if least > math.log(1 + CLOSE) else "")
    )
    return lines


def calibration_markdown(fits: Sequence[Fit], mesh: str) -> str:
    """Reading and table."""
    title, lines = "# Can the open inputs be fitted to the print?", "\n".join(f"- {line}" for line in fit_reading(fits))
    return "\n\n".join([title, lines, fit_section(fits, mesh).markdown()]) + "\n"


def calibration_csv(fits: Sequence[Fit]) -> str:
    """The table with all digits."""
    return to_csv(fit_section(fits, "").records(), ("section",))


def _row(one: Fit, law: str) -> Row:
    smear, ratios, off = one.values.get(SMEAR), one.ratios[law], one.misfit(law)
    cells = (
        one.kind.name,
        LAWS[law].label,
        f"{one.values[LOAD]:.4g}",
        NONE if smear is None else f"{smear:.3g}",
        *(significant(ratios[q]) for q in MAXIMA),
        significant(off),
        str(one.runs),
    )
    record = {"fitted": one.kind.name, "law": law, LOAD: one.values[LOAD], SMEAR: smear, **ratios, "misfit": off}
    return Row(cells, record | {"runs": one.runs}, tone_of(math.exp(off)))


def _rounded(load: float) -> float:
    """With the digits that studies need."""
    return float(f"{load:.4g}")
