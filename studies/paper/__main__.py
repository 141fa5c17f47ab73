"""The paper's numbers beside ours: python -m studies.paper compare|report|audit|audit-study|audit-pairs|calibrate.

All but `calibrate`, which solves and may run under mpirun, read and write files only and do not need DOLFINx. Exit
status: 0; 1 when a result is missing, or for `compare` and `report` failed (the output names it); 2 for bad input.
"""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cellmech import InputError
from cellmech.figures import Section, path_there, run_command, say, write_text
from cellmech.results import to_csv
from studies.paper.comparison import compare
from studies.paper.ours import STUDIES
from studies.paper.printed import PAPER_NUMBERS, read_paper

Command = Callable[[argparse.Namespace], list[str]]
"""What a command does; what is missing is returned, a line each."""


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; the exit status is returned."""
    return run_command(_parser(), arguments, lambda options: options.run(options))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m studies.paper", description="The paper's numbers beside ours.")
    commands = parser.add_subparsers(required=True, metavar="WHAT")

    def add(name: str, run: Command, about: str, out: str = "DIR of --results/figures") -> argparse.ArgumentParser:
        command: argparse.ArgumentParser = commands.add_parser(name, help=about, description=about)
        results = "has a folder a study; default: %(default)s"
        command.add_argument("--results", type=path_there, default=Path("results"), metavar="DIR", help=results)
        command.add_argument("--out", type=path_there, metavar="DIR", help=f"where to write; default: {out}")
        command.add_argument(
            "--paper", type=path_there, default=PAPER_NUMBERS, metavar="FILE", help="the printed numbers"
        )
        command.add_argument("--studies", type=path_there, default=STUDIES, metavar="DIR", help="of the study files")
        command.set_defaults(run=run)
        return command

    add("compare", _compare, "every printed number beside ours: compare.md and compare.csv")
    add("report", _report, "one page with figures, comparison and statistics: report.html", "DIR of --results")
    add("audit", _audit, "which open choices bring which printed numbers: audit.md, audit.csv and a picture")
    add("audit-study", _audit_study, "the audit's runs, one choice at a time: audit.toml", "studies")
    add("audit-pairs", _audit_pairs, "its pairs, of what moved most in results/audit: audit-pairs.toml", "studies")
    readings = add("readings", _readings, "solve readings of the paper and score them: readings.md and .csv")
    readings.add_argument("--only", action="append", default=[], metavar="NAME", help="this one; can be repeated")
    readings.add_argument("--unsolved", action="store_true", help="solve nothing, score what is there")
    readings.add_argument("--whole", action="store_true", help="all 57 runs, not only those with printed numbers")
    add("effective-study", _effective_study, "the reading that fits best: paper-effective.toml", "studies")
    fits = add("fit-readings", _fit_readings, "fit a reading to some figures, predict the others: reading-fits.md")
    fits.add_argument("--only", action="append", default=[], metavar="NAME", help="this fit; can be repeated")
    add("geometries", _geometries, "Table 1 in three geometries beside the print: geometries.md and .csv")
    add("stresses", _stresses, "which von Mises stress fits the print, in the best reading: stresses.md and .csv")
    calibrate = add("calibrate", _calibrate, "fit open inputs: calibration.md and .csv; saint-venant-limit.toml")
    calibrate.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE", help="overrides of every scene")
    return parser


def _compare(options: argparse.Namespace) -> list[str]:
    comparison = compare(options.results, options.paper)
    say("\n".join(comparison.reading()))
    write_text(_figures(options) / "compare.md", comparison.markdown())
    write_text(_figures(options) / "compare.csv", comparison.csv())
    return comparison.ours.unsolved()


def _report(options: argparse.Namespace) -> list[str]:
    from studies.paper.report import report_html  # brings Jinja2 and Pillow along

    comparison = compare(options.results, options.paper)
    write_text((options.out or options.results) / "report.html", report_html(options.results, comparison))
    return comparison.ours.unsolved()


def _audit(options: argparse.Namespace) -> list[str]:
    from cellmech.figures import save, styled
    from studies.paper.audit import read_audit
    from studies.paper.audit_picture import draw_audit
    from studies.paper.audit_tables import audit_csv, audit_markdown, reading

    audit = read_audit(options.results, read_paper(options.paper), options.studies)
    say("\n".join(reading(audit)))
    write_text(_figures(options) / "audit.md", audit_markdown(audit))
    write_text(_figures(options) / "audit.csv", audit_csv(audit))
    with styled():
        for path in save(draw_audit(audit), _figures(options), "audit"):
            say(str(path))
    return audit.missing()


def _audit_study(options: argparse.Namespace) -> list[str]:
    from studies.paper.audit_studies import singles_text

    write_text((options.out or options.studies) / "audit.toml", singles_text())
    return []


def _audit_pairs(options: argparse.Namespace) -> list[str]:
    from studies.paper.audit import read_audit
    from studies.paper.audit_studies import pairs_text

    audit = read_audit(options.results, read_paper(options.paper), options.studies, pairs=False)
    write_text((options.out or options.studies) / "audit-pairs.toml", pairs_text(audit))
    return audit.missing()


def _readings(options: argparse.Namespace) -> list[str]:
    from cellmech.fem import MPI
    from studies.paper import reading_tables, readings

    paper, place = read_paper(options.paper), options.results / "readings"
    chosen = _chosen(readings.READINGS, options.only)
    for one in () if options.unsolved else chosen:
        readings.solve(one, paper, place, everything=options.whole)
    if MPI.COMM_WORLD.rank != 0:
        return []
    there = [one for one in readings.READINGS if (place / one.name).is_dir()]
    scores = {one.name: readings.score(one, paper, place) for one in there}
    sections = [reading_tables.reading_section(list(scores.values())), reading_tables.resolved_section(scores)]
    if {"printed", readings.EFFECTIVE} <= scores.keys():
        sections.append(reading_tables.beside_section(scores["printed"], scores[readings.EFFECTIVE]))
    _write_sections(_figures(options), "readings", sections)
    return []


def _chosen(named: Sequence[Any], only: Sequence[str]) -> list[Any]:
    """Those of these names, all without any.

    Raises:
        InputError: for a name that none has.
    """
    known = [one.name for one in named]
    for name in only:
        if name not in known:
            raise InputError("--only", "", f"must be one of {', '.join(known)}", name)
    return [one for one in named if not only or one.name in only]


def _effective_study(options: argparse.Namespace) -> list[str]:
    from studies.paper import readings

    text = readings.effective_study(readings.named(readings.EFFECTIVE), read_paper(options.paper))
    write_text((options.out or options.studies) / "paper-effective.toml", text)
    return []


def _stresses(options: argparse.Namespace) -> list[str]:
    from studies.paper import readings, stresses

    section = stresses.stress_section(readings.named(readings.EFFECTIVE), read_paper(options.paper), _say)
    _write_sections(_figures(options), "stresses", [section])
    return []


def _geometries(options: argparse.Namespace) -> list[str]:
    from studies.paper.geometries import geometries_section

    section = geometries_section(options.results / "geometries", read_paper(options.paper))
    _write_sections(_figures(options), "geometries", [section])
    return []


def _fit_readings(options: argparse.Namespace) -> list[str]:
    from studies.paper import reading_fit, reading_tables, readings

    paper, place = read_paper(options.paper), options.results / "reading-fits"

    def judge(reading: readings.Reading, tables: Sequence[str], everything: bool) -> readings.Score:
        readings.solve(reading, paper, place, tables, everything)
        return readings.score(reading, paper, place)

    plans = _chosen(reading_fit.PLANS, options.only)
    fits = [reading_fit.fit(plan, judge, _say) for plan in plans]
    sections = [reading_fit.fit_section(fits), reading_tables.reading_section([one.score for one in fits])]
    _write_sections(_figures(options), "reading-fits", sections)
    return []


def _calibrate(options: argparse.Namespace) -> list[str]:
    from functools import partial

    from cellmech.fem import MPI, release
    from cellmech.scene import load_study
    from studies.paper import calibration_tables
    from studies.paper.calibration import end_state, fit_all

    world = MPI.COMM_WORLD
    release(world)
    load_study(None, options.set)  # refuses a bad override on every rank alike
    solve, paper = partial(end_state, overrides=options.set), read_paper(options.paper)
    try:
        fits = fit_all(paper, solve, world, _say)
    except Exception:
        if world.size > 1:  # the others would wait for this rank
            traceback.print_exc()
            world.Abort(1)
        raise
    if world.rank == 0:
        mesh = f"mesh of {' '.join(options.set)}" if options.set else "default mesh"
        write_text(_figures(options) / "calibration.md", calibration_tables.calibration_markdown(fits, mesh))
        write_text(_figures(options) / "calibration.csv", calibration_tables.calibration_csv(fits))
        write_text(options.studies / "saint-venant-limit.toml", calibration_tables.limit_study(fits, mesh))
    return []


def _write_sections(folder: Path, stem: str, sections: Sequence[Section]) -> None:
    """Show the first, write all."""
    say(sections[0].markdown())
    write_text(folder / f"{stem}.md", "\n\n".join(section.markdown() for section in sections) + "\n")
    write_text(folder / f"{stem}.csv", to_csv([r for s in sections for r in s.records()], ("section",)))


def _say(line: str) -> None:
    say(line)


def _figures(options: argparse.Namespace) -> Path:
    return Path(options.out or options.results / "figures")


if __name__ == "__main__":
    sys.exit(main())
