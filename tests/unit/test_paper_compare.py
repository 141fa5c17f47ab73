"""The comparison with the print, on made-up results: ratios, orders, places, failed and missing cases."""

from __future__ import annotations

import csv
import io
import json
import math
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest
from paper_files import REST, as_printed, steady, write_result, write_results

from cellmech.errors import InputError
from cellmech.figures.section import signal, significant, tone_of
from cellmech.scene.case import Case
from cellmech.scene.studies import load_study
from studies.paper.__main__ import main
from studies.paper.comparison import Comparison, compare
from studies.paper.numbers import Number
from studies.paper.ours import STUDIES
from studies.paper.places import Place
from studies.paper.printed import PAPER_NUMBERS, RESTS, read_paper


@pytest.fixture(scope="module")
def steady_results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_results(tmp_path_factory.mktemp("steady"))


@pytest.fixture
def results(steady_results: Path, tmp_path: Path) -> Path:
    """A copy to change."""
    return Path(shutil.copytree(steady_results, tmp_path / "results"))


def number(comparison: Comparison, table: str, row: str, quantity: str, kind: str = "") -> Number:
    found = [n for n in comparison.numbers if (n.table, n.row, n.quantity) == (table, row, quantity)]
    return next(n for n in found if not n.is_misprint and kind in n.kind)


def place(comparison: Comparison, table: str, quantity: str, what: str) -> Place:
    return next(p for p in comparison.places if (p.table, p.quantity, p.what) == (table, quantity, what))


def change(folder: Path, **entries: Any) -> None:
    path = folder / "result.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | entries))


def case_of(table: str, name: str) -> Case:
    return next(case for case in load_study(STUDIES / f"{table}.toml").cases if case.name == name)


class TestNumbers:
    def test_every_number_of_the_file_is_there(self, steady_results: Path) -> None:
        data = tomllib.loads(PAPER_NUMBERS.read_text())
        tables = {table: data[table] | {} for table in ("fig2", "fig4", "fig6", "table3")}
        expected: list[tuple[str, str, str, float]] = []
        for of in (tables, data["misprints"]):
            for table, rows in of.items():
                for row, values in rows.items():
                    if isinstance(values, dict):
                        expected += [
                            (table, row, key, v)
                            for key, v in values.items()
                            if key in RESTS
                            for _ in range(1 + 2 * (key == "SI"))
                        ]
        found = [(n.table, n.row, n.quantity, n.theirs) for n in compare(steady_results).numbers]
        assert sorted(found) == sorted(expected)
        assert ("fig2", "mooney-rivlin", "J2", 5.244) in found

    def test_ratios_are_raw_and_of_the_distance_from_rest(self, results: Path) -> None:
        half = {"sigma_mises": 2.064, "J1": 2.22, "J2": 4.27, "J3": 0.85}  # printed: 1.032, 2.44, 4.27, 1.15
        write_result(results / "fig2" / "neo-hookean", case_of("fig2", "neo-hookean"), half)
        of = {q: number(compare(results), "fig2", "neo-hookean", q) for q in ("sigma", "J1", "J2", "J3")}
        assert of["sigma"].ratio == of["sigma"].ratio_from_rest == pytest.approx(2)
        assert of["J1"].ratio == pytest.approx(2.22 / 2.44) and of["J1"].ratio_from_rest == pytest.approx(0.5)
        assert of["J2"].ratio_from_rest == pytest.approx(1)
        assert of["J3"].ratio_from_rest == pytest.approx(-1)
        assert [of[q].sign for q in of] == ["+", "−", "0", "−"]
        assert [of[q].tone for q in of] == ["near", "near", "close", "other"]

    def test_figure_2_takes_maxima_over_time_and_the_others_take_the_end(self, results: Path) -> None:
        for table, name in (("fig2", "yeoh"), ("table3", "S1")):
            path = results / table / name
            nucleus = json.loads((path / "result.json").read_text())["nucleus"]
            change(path, nucleus=nucleus | {"J1_max": 2.3, "J1_max_over_time": 2.9})
        comparison = compare(results)
        assert number(comparison, "fig2", "yeoh", "J1").ours == 2.9
        assert number(comparison, "table3", "S1", "J1").ours == 2.3

    def test_places_of_the_sweeps_are_found_by_their_parameters(self, steady_results: Path) -> None:
        slot = number(compare(steady_results), "fig4", "max_sigma", "sigma").slot
        assert slot.name == "lamina.fluid_fraction=0.1,nucleoplasm.fluid_fraction=0.7"
        assert slot.value("nucleus.sigma_mises_max_Pa") == steady(3)["sigma_mises"]

    def test_shares_are_measured_from_the_part_of_the_area(self, steady_results: Path) -> None:
        share = number(compare(steady_results), "fig2", "saint-venant", "share_J3")  # 24.8 for the printed 18
        assert share.ratio_from_rest == pytest.approx((24.8 - 25) / (18 - 25))

    def test_a_share_implies_a_mean_four_times_as_large(self, steady_results: Path) -> None:
        means = compare(steady_results).means
        found = {m.quantity: m for m in means if m.row == "mooney-rivlin"}
        assert {name: round(m.theirs, 6) for name, m in found.items()} == {
            "mean_J1": 2.24,
            "mean_J2": 3.24,
            "mean_J3": 0.92,
        }
        assert found["mean_J1"].ours == (steady(2)["J1"] + 2) / 2
        assert found["mean_J1"].uncertainty == pytest.approx(0.02)

    def test_the_nearest_of_the_three_shape_indices_is_named(self, steady_results: Path) -> None:
        found = [n for n in compare(steady_results).numbers if (n.row, n.quantity) == ("S1", "SI")]
        assert [(n.ours, n.note) for n in found] == [(0.99, ""), (0.75, ""), (0.495, "nearest of the three")]
        assert found[1].ratio_from_rest == pytest.approx((0.75 - 0.7466798) / (0.32 - 0.7466798), rel=1e-4)

    def test_an_error_that_was_measured_is_shown(self, results: Path) -> None:
        change(results / "fig2" / "yeoh", error={"nucleus": {"J1_max_over_time": 3e-4}})
        found = number(compare(results), "fig2", "yeoh", "J1")
        assert found.error == 3e-4 and math.isnan(number(compare(results), "fig2", "yeoh", "J2").error)
        assert signal(found.ours, 2.0, found.error) == "2.00800"
        assert found.outside is True and number(compare(results), "fig2", "yeoh", "J2").outside is None
        assert any(
            "Of 1 printed numbers whose error was measured, 1 lie" in line for line in compare(results).reading()
        )
        line = next(line for line in compare(results).markdown().splitlines() if "Yeoh" in line and "| J1 " in line)
        assert "0.0003" in line
        change(results / "fig2" / "yeoh", error={"nucleus": {"J1_max_over_time": 1.0}})
        assert number(compare(results), "fig2", "yeoh", "J1").outside is False

    def test_a_misprint_is_listed_and_not_counted(self, steady_results: Path) -> None:
        comparison = compare(steady_results)
        found = [n for n in comparison.numbers if n.is_misprint]
        assert sorted(n.theirs for n in found) == [1.31, 4.08, 5.244, 15.2]
        assert not set(map(id, found)) & set(map(id, comparison.judged()))
        assert "misprint: 5.44 elsewhere" in comparison.markdown()


class TestPlaces:
    def test_results_as_printed_agree_everywhere(self, tmp_path: Path) -> None:
        comparison = compare(write_results(tmp_path, as_printed))
        tones = {n.tone for n in comparison.judged() if n.quantity in ("sigma", "J1", "J2", "J3")}
        assert tones == {"close"}
        named = [
            p for p in comparison.places if p.table in ("fig2", "table3") and p.quantity in ("sigma", "J1", "J2", "J3")
        ]
        assert len(named) == 24 and all(p.agrees for p in named)
        largest = [p for p in comparison.places if p.table in ("fig4", "fig6", "all") and p.what == "largest"]
        assert len(largest) == 12 and all(p.agrees for p in largest if p.table != "fig6" or p.quantity != "sigma")
        tie = place(comparison, "fig6", "sigma", "largest")  # 1.47 Pa is printed twice
        assert tie.lead == 0 and tie.note.startswith("near tie with E_l = ")

    def test_an_order_that_disagrees_is_said(self, results: Path) -> None:
        comparison = compare(results)  # ours grow in the order of the study: Yeoh is largest
        found = place(comparison, "fig2", "J1", "largest")
        assert (found.printed, found.ours, found.agrees) == ("Mooney–Rivlin", "Yeoh", False)
        assert found.lead == pytest.approx(1e-3 / 8e-3)
        order = place(comparison, "fig2", "J1", "order")
        assert order.ours == "Yeoh > Mooney–Rivlin > neo-Hookean > Saint-Venant" and order.agrees is False
        assert place(comparison, "fig2", "J1", "smallest").agrees is True

    def test_the_unsolved_case_of_the_print_is_left_out_and_mentioned(self, steady_results: Path) -> None:
        found = place(compare(steady_results), "fig4", "J1", "largest")  # ours grow, so 0.9, 0.9 is the largest
        assert found.ours == "c_f,l = 0.9, c_f,np = 0.7"
        assert "c_f,l = 0.9, c_f,np = 0.9, unsolved in print, goes beyond" in found.note

    def test_what_the_print_does_not_say_is_not_judged(self, steady_results: Path) -> None:
        found = place(compare(steady_results), "fig6", "sigma", "smallest")
        assert (found.printed, found.ours, found.agrees) == ("", "E_l = 1000 Pa, E_np = 10 Pa", None)


class TestWithoutResults:
    def test_a_failed_case_is_shown_with_its_reason_and_no_number(self, results: Path, capsys: Any) -> None:
        change(results / "fig2" / "mooney-rivlin", status="failed", reason="an element is inverted", t_s=8000.0)
        comparison = compare(results)
        found = number(comparison, "fig2", "mooney-rivlin", "J1")
        assert math.isnan(found.ours) and found.tone == "none"
        assert "failed at 8,000 s: an element is inverted" in comparison.markdown()
        assert place(comparison, "fig2", "J1", "largest").agrees is None  # the print has Mooney–Rivlin
        smallest = place(comparison, "fig2", "J1", "smallest")  # Saint-Venant in print and here, but of three only
        assert smallest.agrees is None and "1 of 4 cases without a result" in smallest.note
        assert place(comparison, "fig2", "J3", "largest").agrees is False  # Yeoh is beyond Saint-Venant anyhow
        assert main(["compare", "--results", str(results)]) == 1
        assert "mooney-rivlin: failed at 8,000 s" in capsys.readouterr().err

    def test_a_missing_study_is_shown_row_by_row(self, tmp_path: Path) -> None:
        comparison = compare(write_results(tmp_path, leave_out=("fig6",)))
        lack = "fig6: none of its 25 cases has a result (make paper-runs solves them)"
        assert comparison.ours.unsolved() == [lack]
        rows = [n for n in comparison.numbers if n.table == "fig6"]
        assert len(rows) == 17 and all(math.isnan(n.ours) and n.slot.reason == "no result" for n in rows)
        assert all(p.agrees is None for p in comparison.places if p.table in ("fig6", "all"))

    def test_figure_7_stands_in_for_table_3(self, results: Path) -> None:
        (results / "table3").rename(results / "fig7")
        assert compare(results).ours.unsolved() == []

    def test_results_of_other_inputs_do_not_count(self, results: Path) -> None:
        other = case_of("table3", "S2")
        write_result(results / "table3" / "S1", other, REST)
        assert compare(results).ours.unsolved() == ["table3/S1: solved with other inputs"]

    def test_no_result_at_all_is_bad_input(self, tmp_path: Path, capsys: Any) -> None:
        assert main(["compare", "--results", str(tmp_path)]) == 2
        assert "must hold a result" in capsys.readouterr().err

    def test_the_case_the_paper_could_not_solve_has_its_status(self, results: Path) -> None:
        assert "c_f,l = 0.9, c_f,np = 0.9: solved here" in "\n".join(compare(results).reading())
        change(
            results / "fig4" / "lamina.fluid_fraction=0.9,nucleoplasm.fluid_fraction=0.9", status="failed", reason="x"
        )
        assert "c_f,l = 0.9, c_f,np = 0.9: failed here (failed at 18,000 s: x)" in "\n".join(compare(results).reading())


class TestFiles:
    def test_csv_reads_back_to_the_last_digit(self, results: Path) -> None:
        value = {"sigma_mises": 1 / 3, "J1": 2 + 1 / 7, "J2": 2.5, "J3": 1.1}
        write_result(results / "fig2" / "yeoh", case_of("fig2", "yeoh"), value)
        rows = [*csv.DictReader(io.StringIO(compare(results).csv()))]
        found = {row["quantity"]: row for row in rows if (row["section"], row["row"]) == ("fig2", "yeoh")}
        assert float(found["sigma"]["ours"]) == 1 / 3
        assert float(found["J1"]["ratio_from_rest"]) == (2 + 1 / 7 - 2) / (2.31 - 2)
        assert found["sigma"]["error"] == ""

    def test_command_writes_both_files_and_prints_the_reading(
        self, steady_results: Path, tmp_path: Path, capsys: Any
    ) -> None:
        assert main(["compare", "--results", str(steady_results), "--out", str(tmp_path / "out")]) == 0
        text = (tmp_path / "out" / "compare.md").read_text()
        assert (tmp_path / "out" / "compare.csv").is_file()
        printed = capsys.readouterr().out
        assert "67 printed numbers" in printed and "Typical (median) ours/printed" in printed
        assert all(line in text for line in printed.splitlines()[:-2])
        assert "1,230 elements of order 3" in text and "sources 0123456789" in text

    def test_a_row_with_an_unknown_key_is_refused(self, tmp_path: Path) -> None:
        path = tmp_path / "numbers.toml"
        path.write_text(PAPER_NUMBERS.read_text().replace("max_J3 = {", "max_J3 = { J4 = 1.0,"))
        with pytest.raises(InputError, match=r"fig6.max_J3.J4: must be one of"):
            read_paper(path)


@pytest.mark.parametrize(
    ("ratio", "tone"),
    [(1.049, "close"), (0.94, "near"), (2.1, "off"), (0.5, "near"), (0.09, "far"), (-1.0, "other"), (math.nan, "none")],
)
def test_tone_says_how_far_a_ratio_is_from_one(ratio: float, tone: str) -> None:
    assert tone_of(ratio) == tone


def test_values_have_three_digits_of_their_signal_and_no_more_than_their_error_leaves() -> None:
    assert signal(2.0051028, 2.0) == "2.00510"
    assert signal(2.0051028, 2.0, 2e-3) == "2.0051"
    assert signal(5.413, 0.0) == "5.41"
    assert significant(0.0116) == "0.0116" and significant(12345.6, 2) == "12,346" and significant(-0.5, 1) == "−0.5"
