"""Any study beside reference numbers, and any study as a page."""

from __future__ import annotations

import base64
import csv
import math
from pathlib import Path

import pytest
from PIL import Image
from plot_files import change, write_study

from cellmech.errors import InputError
from cellmech.figures.commands import compare_main, report_main
from cellmech.figures.comparison import Pair, compare
from cellmech.figures.page import number_section, report
from cellmech.figures.reference import read_references, rest_of
from cellmech.figures.results import read_all

REFERENCE = """
title = "Indented cells"
source = "Measured in a dream."
[case.yeoh]
nucleus.J1_max = { value = 2.016, uncertainty = 0.001, note = "by eye" }
"nucleus.sigma_mises_max_Pa" = 8.0
shape_index.full = { value = 0.9, rest = 1.0 }
[case.neo-hookean]
nucleus.J3_max = 1.012
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Two laws; their values are those of `plot_files.peaks`."""
    return write_study(tmp_path / "laws", ("neo-hookean", "yeoh"))


@pytest.fixture
def reference(tmp_path: Path) -> Path:
    path = tmp_path / "reference.toml"
    path.write_text(REFERENCE)
    return path


def test_numbers_stand_beside_the_references_with_ratios_from_rest(study: Path, reference: Path) -> None:
    change(study / "yeoh", error={"nucleus": {"J1_max": 0.004}})
    comparison = compare(study, reference)
    J1, sigma, shape, J3 = comparison.compared
    assert (J1.ours, J1.error, J1.ratio_from_rest) == (2.006, 0.004, pytest.approx(0.006 / 0.016))
    assert J1.outside is True and sigma.outside is None  # 0.01 apart; 0.004 and 0.001 are granted
    assert (sigma.ours, sigma.ratio_from_rest, sigma.sign, sigma.tone) == (6.0, 0.75, "−", "near")
    assert (shape.rest, shape.ratio_from_rest) == (1.0, pytest.approx(0.2))
    assert (J3.ours, J3.ratio_from_rest) == (1.005, pytest.approx(0.005 / 0.012))
    assert comparison.reading() == [
        "4 reference numbers: on q − q0, 0 of ours are within 5 %, 1 more within a factor 2, 3 within 10, "
        "0 further off, 0 of the other sign.",
        "Typical (median) ours/theirs, of q − q0: × 0.40.",
        "Of 1 reference numbers whose error was measured, 1 lie outside our error bars.",
    ]


def test_uncertainty_of_theirs_is_granted() -> None:
    def pair(uncertainty: float) -> Pair:
        return Pair(theirs=2.0, uncertainty=uncertainty, rest=0.0, ours=1.0, error=0.6)

    assert [pair(u).outside for u in (0.39, 0.41, math.nan)] == [True, False, True]


def test_case_without_a_result_or_a_solution_has_no_number_and_says_why(study: Path, reference: Path) -> None:
    change(study / "yeoh", status="failed", reason="det F <= 0", cause="inside-out", t_s=50.0)
    reference.write_text(REFERENCE + "[case.gent]\nnucleus.J1_max = 2.1\n")
    comparison = compare(study, reference)
    lacks = {one.reference.case: one.lack for one in comparison.compared}
    assert lacks == {"yeoh": "failed at 50 s: det F <= 0", "neo-hookean": "", "gent": "not in this folder"}
    assert [math.isnan(one.ours) for one in comparison.compared] == [True, True, True, False, True]
    assert "4 without a result here" in comparison.reading()[0] and "gent: not in this folder" in comparison.markdown()


def test_number_that_no_result_has_is_refused(study: Path, reference: Path) -> None:
    reference.write_text("[case.yeoh]\nnucleus.J1_mux = 2.0\n")
    with pytest.raises(InputError, match=r"nucleus\.J1_mux: there is no such number.*J1_max"):
        compare(study, reference)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "case: must be a table"),
        ("case = 1", "case: must be a table"),
        ("[case.a]", "must hold a number"),
        ("[case]\na = 1", r"case\.a: must be a table of numbers"),
        ("[case.a]\nx.y = 'z'", r"case\.a\.x\.y\.value: must be a number"),
        ("[case.a]\nx.y = true", r"case\.a\.x\.y\.value: must be a number"),
        ("[case.a]\nx = { value = nan }", r"case\.a\.x\.value: must be finite"),
        ("[case.a]\nx = { value = 1, uncertainty = -1 }", "uncertainty: must be >= 0"),
        ("[case.a]\nx = { value = 1, error = 1 }", r"case\.a\.x\.error: must be one of value, uncertainty"),
        ("[case.a]\nx = { value = 1, note = 1 }", r"case\.a\.x\.note: must be a text"),
        ("titel = 'x'", "titel: must be one of title, source, case"),
        ("title = 1", "title: must be a text"),
    ],
)
def test_file_of_another_form_is_refused(reference: Path, text: str, said: str) -> None:
    reference.write_text(text)
    with pytest.raises(InputError, match=said):
        read_references(reference)


@pytest.mark.parametrize(
    ("key", "rest"),
    [
        ("nucleus.J1_max", 2.0),
        ("lamina.J3_mean", 1.0),
        ("cell.J2_max_over_time", 2.0),
        ("nucleus.sigma_mises_p99_Pa", 0.0),
        ("nucleus.J1_max_time_s", 0.0),
        ("contact.max_depth_um", 0.0),
    ],
)
def test_rest_is_that_of_the_quantity(key: str, rest: float) -> None:
    assert rest_of(key) == rest


def test_compare_writes_a_table_for_people_and_one_with_all_digits(
    study: Path, reference: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert compare_main([str(study), str(reference)]) == 0
    text = (study / "figures/compare.md").read_text()
    assert text.startswith("# Indented cells, and ours\n\nMeasured in a dream.\n") and "by eye" in text
    rows = list(csv.DictReader((study / "figures/compare.csv").read_text().splitlines()))
    assert [(row["case"], row["key"], float(row["theirs"]), float(row["ours"])) for row in rows[:2]] == [
        ("yeoh", "nucleus.J1_max", 2.016, 2.006),
        ("yeoh", "nucleus.sigma_mises_max_Pa", 8.0, 6.0),
    ]
    assert (rows[0]["uncertainty"], rows[1]["uncertainty"]) == ("0.001", "")
    assert capsys.readouterr().out.startswith("4 reference numbers: ")


def test_commands_tell_of_failures_and_bad_input(
    study: Path, reference: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change(study / "yeoh", status="failed", reason="det F <= 0", cause="inside-out", t_s=50.0)
    assert compare_main([str(study), str(reference)]) == report_main([str(study)]) == 1
    told = f"warning: {study}: not complete: yeoh: failed at 50 s (det F <= 0)\n"
    assert capsys.readouterr().err == 2 * told
    assert report_main([str(study.parent)]) == compare_main([str(study), str(study / "none.toml")]) == 2
    assert capsys.readouterr().err.count("error: ") == 2


def test_page_has_cases_failures_with_advice_pictures_and_the_comparison(study: Path, reference: Path) -> None:
    change(study / "yeoh", status="failed", reason="<turns>", cause="turns", model={"warnings": {"mesh": "coarse"}})
    (study / "figures").mkdir()
    Image.new("RGB", (40, 30)).save(study / "figures" / "my_cell.png")
    frames = [Image.new("RGB", (40, 30), colour) for colour in ("red", "blue")]
    frames[0].save(study / "figures" / "turntable.gif", save_all=True, append_images=frames[1:])
    page = report(read_all(study), compare(study, reference))
    assert "&lt;turns&gt;" in page and "<turns>" not in page
    assert "Raise contact.penalty_Pa_per_um." in page and "yeoh: coarse" in page
    assert 'alt="my cell. "' in page and "data:image/png;base64," in page
    film = base64.b64encode((study / "figures" / "turntable.gif").read_bytes()).decode()
    assert f"data:image/gif;base64,{film}" in page  # as it is, with all its pictures
    assert "1 of 2" in page and "Indented cells" in page and "by eye" not in page
    assert "http" not in page  # it needs nothing else


def test_report_draws_the_cells_that_have_fields_if_asked(study: Path) -> None:
    (study / "yeoh" / "fields.pvd").unlink()
    assert report_main([str(study), "--draw"]) == 0
    assert sorted(path.name for path in (study / "figures").glob("*.png")) == ["shape-neo-hookean.png"]
    assert 'alt="shape neo hookean. "' in (study / "report.html").read_text()


def test_table_of_cases_shows_what_sets_them_apart(study: Path) -> None:
    section = number_section(read_all(study))
    assert section.header[:3] == ("case", "cell.law", "status")
    assert section.rows[1].cells[:3] == ("yeoh", "yeoh", "solved")
    assert section.rows[1].record["nucleus.J1_max"] == 2.006
