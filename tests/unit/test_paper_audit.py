"""The audit: its runs, ratios, order and words, on results that are made up."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from cellmech.errors import InputError
from cellmech.figures.style import styled
from cellmech.scene.studies import load_study
from studies.paper.__main__ import main
from studies.paper.audit import PAIRS, SINGLES, Audit, Tried, read_audit
from studies.paper.audit_picture import draw_audit
from studies.paper.audit_studies import pairs_text, singles_text
from studies.paper.audit_tables import audit_csv, audit_markdown, reading, sections
from studies.paper.choices import MOST_RUNS, QUESTIONS, SUBJECTS, Trial, pairs, singles, trial
from studies.paper.misfit import LOST, log_ratio, misfit
from studies.paper.ours import STUDIES
from studies.paper.printed import read_paper
from tests.paper_files import REST, write_result

SIZES = {"sigma_mises": 5.0, "J1": 0.004, "J2": 0.008, "J3": 0.004}  # of the made-up differences from rest, as printed
ORDER = [*QUESTIONS]


def grown(by: Mapping[str, float]) -> Callable[[Trial], dict[str, float]]:
    """Values whose differences from rest each of these choices multiplies, in all quantities alike."""

    def values(one: Trial) -> dict[str, float]:
        factor = math.prod(by.get(option.label, 1.0) for option in one.chosen.values())
        return {name: rest + factor * SIZES[name] for name, rest in REST.items()}

    return values


def write(results: Path, stem: str, values: Callable[[Trial], Mapping[str, float]], **failed: str) -> None:
    """Results of a study of the audit; `failed`: name of a case, with _ for other letters -> reason."""
    for case in load_study(STUDIES / f"{stem}.toml").cases:
        reason = failed.get("".join(c if c.isalnum() else "_" for c in case.name), "")
        cause = "slides" if reason.startswith("slides") else "inside-out"
        more = {"status": "failed", "reason": reason, "cause": cause} if reason else {}
        contact = {"weight_Pa_x_um": 3.08}
        write_result(results / stem / case.name, case, values(trial(case.name)), contact=contact, **more)


def read(results: Path, **more: Any) -> Audit:
    return read_audit(results, read_paper(), **more)


def run(audit: Audit, name: str) -> Tried:
    return next(tried for tried in audit.tried if tried.slot.name == name)


def test_studies_are_what_the_program_writes() -> None:
    assert (STUDIES / "audit.toml").read_text(encoding="utf-8") == singles_text()
    for stem in (SINGLES, PAIRS):
        lines = (STUDIES / f"{stem}.toml").read_text(encoding="utf-8").splitlines()
        assert any('Written by "python -m studies.paper audit-' in line for line in lines)
        assert max(map(len, lines)) <= 120


def test_single_runs_are_one_choice_at_a_time_on_scenes_that_have_it() -> None:
    trials, cases = singles(), load_study(STUDIES / "audit.toml").cases
    assert [one.name for one in trials] == [case.name for case in cases]
    assert all(len(one.chosen) <= 1 for one in trials)
    tried = {option.label for one in trials for option in one.chosen.values()}
    assert tried == {option.label for options in QUESTIONS.values() for option in options}
    scenes = {case.name: case.scene for case in cases}
    assert scenes["yeoh,yeoh-printed"].cell.yeoh_reference == "printed"
    assert scenes["neo-hookean,half-width=5"].pillar[0].half_width_um == 5
    assert scenes["neo-hookean,edge-of-one"].cell.centre_x_um == 10
    assert scenes["S2,load=2"].load.factor == 2 and scenes["S2,load=2"].layer.nucleoplasm.fluid_fraction == 0.9
    assert not any(scene.time.history for scene in scenes.values())
    assert "neo-hookean,yeoh-printed" not in scenes and "saint-venant,beta=0.4" not in scenes


def test_pairs_join_the_first_question_with_all_and_the_next_two_within_the_room() -> None:
    order = ["smeared layers", "load factor", "contact form", *(q for q in ORDER if q not in ORDER[:2])]
    order = list(dict.fromkeys(order))
    found = pairs(order)
    assert len(found) + len(singles()) <= MOST_RUNS
    couples = {tuple(one.chosen) for one in found}
    assert couples == {("smeared layers", other) for other in order[1:]} | {("load factor", "contact form")}
    assert len({one.name for one in found}) == len(found)
    loads = {
        one.chosen["load factor"].label for one in found if one.subject.name == "S2" and "load factor" in one.chosen
    }
    assert loads == {"load=2", "load=5"}


def test_committed_pairs_are_runs_of_the_audit_with_two_choices() -> None:
    trials = [trial(case.name) for case in load_study(STUDIES / "audit-pairs.toml").cases]
    assert all(len(one.chosen) == 2 for one in trials)
    assert 50 < len(trials) <= MOST_RUNS - len(singles())


def test_trial_of_a_name_is_the_one_that_has_it() -> None:
    for one in [*singles(), *pairs(ORDER)]:
        assert trial(one.name) == one
    for name in ("S1,load=2", "S2,load=3"):
        with pytest.raises(ValueError, match="no subject or choice"):
            trial(name)


def test_misfit_counts_logarithms_and_no_number_without_limit() -> None:
    assert log_ratio(2) == pytest.approx(-log_ratio(0.5)) == pytest.approx(math.log(2))
    assert log_ratio(-3.0) == log_ratio(math.nan) == log_ratio(1e9) == LOST == -log_ratio(1e-9)
    assert misfit([math.e, 1 / math.e, 1.0, 1.0]) == pytest.approx(math.sqrt(0.5))


def test_ratios_are_of_the_differences_from_rest(tmp_path: Path) -> None:
    write(tmp_path, SINGLES, grown({}))
    ratios = run(read(tmp_path), "neo-hookean,as-printed").ratios
    assert ratios == pytest.approx({"sigma": 5 / 1.032, "J1": 0.004 / 0.44, "J2": 0.008 / 2.27, "J3": 0.004 / 0.15})
    stiff = run(read(tmp_path), "stiff,as-printed")
    assert "share_J1" in stiff.printed and "share_J1" not in stiff.judged  # printed is 50 %, the value at rest


def test_close_is_within_five_per_cent_of_the_difference(tmp_path: Path) -> None:
    printed = {"sigma_mises": 1.032, "J1": 2.44, "J2": 4.27, "J3": 1.15}
    rests = {"sigma_mises": 0.0, "J1": 2.0, "J2": 2.0, "J3": 1.0}
    off = {"sigma_mises": 1.049, "J1": 0.951, "J2": 1.051, "J3": 0.949}
    write(tmp_path, SINGLES, lambda one: {q: rests[q] + off[q] * (printed[q] - rests[q]) for q in rests})
    assert run(read(tmp_path), "neo-hookean,as-printed").close() == ["sigma", "J1"]


def test_order_is_by_the_largest_movement_of_a_choice_alone(tmp_path: Path) -> None:
    write(tmp_path, SINGLES, grown({"load=5": 30.0, "half-width=5": 0.1, "volume": 1.5, "beta=0.25": 1.2}))
    audit = read(tmp_path)
    assert audit.order()[:4] == ["load factor", "pillar half-width", "contact form", "beta/mu"]
    assert audit.movement("pillar half-width") == pytest.approx(math.log(10))
    assert audit.movement("smeared layers") == pytest.approx(0)
    most = audit.most_moved("beta/mu")
    assert most is not None and most[1].trial.chosen["beta/mu"].label == "beta=0.25"


def test_numbers_that_change_sign_and_failed_runs_do_not_count_as_movement(tmp_path: Path) -> None:
    write(tmp_path, SINGLES, grown({"yeoh-printed": -1.0, "load=25": 99.0}), saint_venant_load_25="turns inside out")
    audit = read(tmp_path)
    assert audit.movement("Yeoh's reference") == 0
    most = audit.most_moved("load factor")
    assert most is not None and most[1].trial.subject.name != "saint-venant"


def test_failed_runs_are_told_with_their_reason_and_never_best(tmp_path: Path) -> None:
    values = grown({"load=25": 100.0})
    write(tmp_path, SINGLES, values, neo_hookean_load_25="turns inside out", yeoh_edge_of_one="slides: no equilibrium")
    audit = read(tmp_path)
    assert audit.best(SUBJECTS[1]).trial.label == "as-printed"
    assert audit.best(SUBJECTS[2]).trial.label == "load=25"
    assert "107 with a solution, 1 without an equilibrium on the way to the load, 1 where" in reading(audit)[0]
    rows = {row.cells for row in sections(audit)[-1].rows}
    assert rows == {("neo-hookean", "load=25", "turns inside out"), ("yeoh", "edge-of-one", "slides: no equilibrium")}
    assert not audit.missing()


def test_runs_that_are_missing_or_of_other_inputs_are_named(tmp_path: Path) -> None:
    write(tmp_path, SINGLES, grown({}))
    (tmp_path / SINGLES / "yeoh,load=2" / "result.json").unlink()
    scene = tmp_path / SINGLES / "yeoh,load=5" / "scene.toml"
    scene.write_text(scene.read_text().replace("factor = 5", "factor = 6"))
    missing = read(tmp_path).missing()
    assert len(missing) == 2 and "yeoh,load=2: not finished" in missing[0] and "other inputs" in missing[1]


def test_reading_says_whether_a_row_is_met_as_a_whole(tmp_path: Path) -> None:
    printed = {"sigma_mises": 1.032, "J1": 2.44, "J2": 4.27, "J3": 1.15}
    write(tmp_path, SINGLES, grown({}))
    none = "\n".join(reading(read(tmp_path)))
    assert "No choice, alone or with another, brings every printed number" in none and "0 of 41 printed numbers" in none
    write(tmp_path, SINGLES, lambda one: printed if one.name == "neo-hookean,load=10" else grown({})(one))
    met = "\n".join(reading(read(tmp_path)))
    assert "Every printed number of its row within 5 %: neo-hookean,load=10." in met
    assert "neo-hookean: at most 4 of its 4 printed numbers at once (load=10)" in met


def test_the_inequality_tells_possible_rows_and_runs_that_break_it(tmp_path: Path) -> None:
    write(tmp_path, SINGLES, grown({}))
    why = next(section for section in sections(read(tmp_path)) if section.stem == "audit_why")
    possible = {row.record["row"]: row.record["possible"] for row in why.rows}
    assert possible == dict.fromkeys([s.name for s in SUBJECTS], "no") | {"stiff": ""}
    values = {"sigma_mises": 1.032, "J1": 2.44, "J2": 4.27, "J3": 1.15}  # less stress than these strains demand
    write(tmp_path, SINGLES, lambda one: values if one.name == "neo-hookean,load=10" else grown({})(one))
    audit = read(tmp_path)
    assert run(audit, "neo-hookean,load=10").obeys is False and run(audit, "neo-hookean,load=15").obeys is True
    assert "of our runs 108 of 109 obey" in "\n".join(reading(audit))


def test_pairs_are_read_when_they_are_there_and_asked_for(tmp_path: Path) -> None:
    write(tmp_path, SINGLES, grown({}))
    assert len(read(tmp_path).tried) == len(singles())
    write(tmp_path, PAIRS, grown({}))
    assert len(read(tmp_path).tried) > len(singles()) == len(read(tmp_path, pairs=False).tried)


def test_no_results_or_a_foreign_case_are_bad_input(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such results folder"):
        read(tmp_path)
    write(tmp_path, SINGLES, grown({}))
    text = (STUDIES / "audit.toml").read_text(encoding="utf-8").replace("neo-hookean,load=2", "neo-hookean,load=3")
    (tmp_path / "audit.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="one of the audit's"):
        read(tmp_path, studies=tmp_path)


def test_tables_have_every_solved_run_and_all_digits(tmp_path: Path) -> None:
    write(tmp_path, SINGLES, grown({"load=2": 2.0}), S2_load_5="turns inside out")
    audit = read(tmp_path)
    records = list(csv.DictReader(audit_csv(audit).splitlines()))
    alone = [record for record in records if record["section"] == "audit_single"]
    assert len(alone) == len(singles()) - 1
    record = next(r for r in alone if (r["row"], r["choice"]) == ("neo-hookean", "load=2"))
    assert float(record["J1"]) == pytest.approx(2 * 0.004 / 0.44, rel=1e-9)
    text = audit_markdown(audit)
    assert "| S2 " in text and "turns inside out" in text and "## Why none can" in text


def test_picture_shows_a_dot_for_every_solved_run(tmp_path: Path) -> None:
    write(tmp_path, SINGLES, grown({}), S2_load_5="turns inside out")
    write(tmp_path, PAIRS, grown({}))
    audit = read(tmp_path)
    with styled():
        figure = draw_audit(audit)
    panels = figure.axes
    dots = [
        sum(len(line.get_xdata()) for line in axes.lines if line.get_marker() not in (None, "None")) for axes in panels
    ]
    shown = [sum(q in tried.ratios for tried in audit.solved()) for q in ("sigma", "J1", "J2", "J3")]
    assert dots == shown
    assert [label.get_text() for label in panels[0].get_yticklabels()][:2] == ["Saint-Venant", "neo-Hookean"]


def test_commands_write_study_files_tables_and_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, SINGLES, grown({"load=5": 30.0, "half-width=5": 0.1, "volume": 1.5}))
    where = ["--results", str(tmp_path), "--out", str(tmp_path)]
    assert main(["audit-study", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "audit.toml").read_text(encoding="utf-8") == singles_text()
    assert main(["audit-pairs", *where]) == 0
    text = (tmp_path / "audit-pairs.toml").read_text(encoding="utf-8")
    assert text == pairs_text(read(tmp_path)) and "load factor, pillar half-width, contact form" in text
    names = [case.name for case in load_study(tmp_path / "audit-pairs.toml").cases]
    assert names == [one.name for one in pairs(read(tmp_path).order())]
    result = tmp_path / SINGLES / "S3,load=2" / "result.json"
    result.write_text(json.dumps(json.loads(result.read_text()) | {"status": "failed", "reason": "turns inside out"}))
    assert main(["audit", *where]) == 0  # that it failed is a finding, not a fault
    assert all((tmp_path / name).stat().st_size > 1000 for name in ("audit.md", "audit.csv", "audit.png"))
    result.unlink()
    assert main(["audit", *where]) == 1
    assert "S3,load=2: not finished" in capsys.readouterr().err
    assert main(["audit", "--results", str(tmp_path / "none")]) == 2
