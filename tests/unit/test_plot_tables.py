"""Tables 1 to 3, captions and Figure 7's words: every number is the scene's, the file's or the paper's."""

from __future__ import annotations

import csv
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from plot_files import change, write_named

from cellmech.errors import InputError
from cellmech.figures.curves import draw_curves
from cellmech.figures.nucleus import nucleus_lines
from cellmech.figures.number_tables import table3
from cellmech.figures.paper_plots import PAPER_NUMBERS, STUDIES
from cellmech.figures.parameter_tables import MINUS, PRINTED, keys, table1, table2
from cellmech.figures.parameters import parameter, value_at
from cellmech.figures.results import read_planned
from cellmech.figures.shapes import caption
from cellmech.figures.table import Document, Table, Value
from cellmech.scene.scene import Scene
from cellmech.scene.studies import load_study

PAPER = tomllib.loads(PAPER_NUMBERS.read_text(encoding="utf-8"))["table3"]
SIMULATIONS = load_study(STUDIES / "table3.toml")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_named(tmp_path_factory.mktemp("results") / "table3", SIMULATIONS)


def rows(table: Table) -> dict[tuple[str, str], list[str]]:
    return {(str(row[0]), str(row[1])): [str(cell) for cell in row[2:]] for row in table.rows}


class TestTable1:
    def test_every_input_stands_in_it(self) -> None:
        main, others = table1(Scene()).tables
        named = {key for row in main.rows for key in str(row[-1]).split(MINUS)} | {str(row[0]) for row in others.rows}
        assert named | {"schema", "title"} == set(keys(Scene()))

    def test_the_programs_values_are_the_printed_ones(self) -> None:
        for symbol, _, here, unit, paper, *_ in table1(Scene()).tables[0].rows:
            printed = {"µ_f": "0.005", "µ_ct": "50"}.get(str(symbol), paper)  # 5 × 10⁻³ Pa·s; 5 × 10⁷ Pa/m
            assert here == printed, (symbol, unit)

    def test_it_shows_the_scene_it_is_given(self) -> None:
        scene = Scene.model_validate({"layer": {"lamina": {"young_Pa": 77.0, "outer_radius_um": 5.2}}})
        found = {str(row[0]): row[2] for row in table1(scene).tables[0].rows}
        assert (found["E_l"], found["t_l"], found["r_n"]) == ("77", "0.3", "5.2")

    def test_a_scene_without_substrate_has_dashes(self) -> None:
        scene = Scene.model_validate({"pillar": [], "flat": False, "load": {"factor": 0.0}})
        found = {str(row[0]): row[2] for row in table1(scene).tables[0].rows}
        assert found["w_mp"] == found["y_flat"] == "–"

    @pytest.mark.parametrize(("_symbol", "_name", "key", "unit", "_paper", "_remark"), PRINTED)
    def test_units_are_those_of_the_keys(
        self, _symbol: str, _name: str, key: str, unit: str, _paper: str, _remark: str
    ) -> None:
        endings = {"µm": "_um", "Pa": "_Pa", "Pa·s": "_Pa_s", "kg/m³": "_kg_m3", "m/s²": "_m_s2", "s": "_s"}
        assert not unit or key.endswith(endings.get(unit, "_Pa_per_um"))


class TestTable2:
    def test_the_study_has_the_papers_parameters(self) -> None:
        found = rows(table2(SIMULATIONS, PAPER).tables[0])
        assert found == {
            ("S1", "Saint-Venant"): ["24,000", "10", "1000", "0.5", "0.5", "the same"],
            ("S2", "Saint-Venant"): ["24,000", "10", "1000", "0.9", "0.7", "the same"],
            ("S3", "Saint-Venant"): ["24,000", "10", "10", "0.9", "0.7", "the same"],
        }

    def test_a_difference_is_named(self) -> None:
        paper = PAPER | {"S2": PAPER["S2"] | {"young_l": 500}}
        assert rows(table2(SIMULATIONS, paper).tables[0])["S2", "Saint-Venant"][-1] == "E_l [Pa] 500"


class TestTable3:
    def test_end_values_stand_beside_the_papers_with_both_ratios(self, files: Path) -> None:
        found = rows(table3(read_planned(files, SIMULATIONS), PAPER).tables[0])
        assert len(found) == 12
        assert found["S2", "J1"] == ["2.00600", "2.89", f"{2.006 / 2.89:.3f}", f"{0.006 / 0.89:.4f}"]
        assert found["S3", "σ_Mises [Pa]"][:2] == ["7.0000", "1.13"]

    def test_the_shape_index_is_compared_in_three_readings(self, files: Path) -> None:
        found = rows(table3(read_planned(files, SIMULATIONS), PAPER).tables[1])
        assert found["S1", "full outline"] == ["0.9800", "1.0000", "0.32", f"{0.98 / 0.32:.3f}", f"{0.02 / 0.68:.4f}"]
        assert found["S1", "half outline"][:2] == ["0.7600", "0.7467"]
        assert found["S1", "half area, full perimeter"][:2] == ["0.4900", "0.5000"]

    def test_the_distance_is_given_at_both_ends(self, files: Path) -> None:
        assert rows(table3(read_planned(files, SIMULATIONS), PAPER).tables[2])[
            "S3", "lamina to pillar, on the axis"
        ] == [
            "4.600",
            "5.000",
        ]

    def test_a_failed_case_is_called_so(self, tmp_path: Path) -> None:
        write_named(tmp_path, SIMULATIONS)
        change(tmp_path / "S3", status="failed", reason="det F <= 0")
        assert ("S3 (failed)", "J1") in rows(table3(read_planned(tmp_path, SIMULATIONS), PAPER).tables[0])


class TestDocument:
    DOCUMENT = Document(
        "Title", "", [Table("", "A", "", ["q", "x"], [["J1", Value(1 / 3, ".2f")], ["J2", Value(float("nan"), ".2f")]])]
    )

    def test_markdown_is_rounded_and_csv_has_all_digits(self, tmp_path: Path) -> None:
        paths = self.DOCUMENT.save(tmp_path / "new", "t")
        assert [path.name for path in paths] == ["t.md", "t.csv"]
        assert "| J1 | 0.33 |" in paths[0].read_text() and "| J2 |    – |" in paths[0].read_text()
        with open(paths[1], newline="") as stream:
            assert list(csv.reader(stream)) == [["q", "x"], ["J1", repr(1 / 3)], ["J2", ""]]

    def test_each_table_has_a_csv_file_of_its_own(self, tmp_path: Path, files: Path) -> None:
        paths = table3(read_planned(files, SIMULATIONS), PAPER).save(tmp_path, "table3")
        names = ["table3.md", "table3.csv", "table3-shape.csv", "table3-distance.csv"]
        assert [path.name for path in paths] == names and sorted(p.name for p in tmp_path.iterdir()) == sorted(names)

    def test_columns_of_numbers_are_aligned_to_the_right(self) -> None:
        table = Table("", "A", "", ["n", "word"], [["1", "ab"], ["10", "c"]])
        assert table.markdown().splitlines()[-2:] == ["|  1 | ab   |", "| 10 | c    |"]

    def test_a_folder_that_cannot_be_is_bad_input(self, tmp_path: Path) -> None:
        (tmp_path / "file").write_text("in the way")
        with pytest.raises(InputError, match="--out"):
            self.DOCUMENT.save(tmp_path / "file", "t")


class TestWords:
    def test_figure_7_gives_three_shape_indices_and_the_distance(self, files: Path) -> None:
        case = read_planned(files, SIMULATIONS).cases["S2"]
        text = "\n".join(nucleus_lines(case, PAPER))
        for part in ("paper: 0.26", "full outline: 0.9800", "half outline: 0.7600", "perimeter: 0.4900", "4.600 µm"):
            assert part in text
        assert "5.000 µm at the start" in text

    def test_captions_name_what_the_cases_differ_in(self, files: Path) -> None:
        varied = read_planned(files, SIMULATIONS).varied
        assert caption("S3", varied["S3"]) == ("S3", "$c_{f,l}$ = 0.7,  $c_{f,np}$ = 0.9,  $E_l$ = 10 Pa")
        assert caption("yeoh", {"cell.law": "yeoh"}) == ("Yeoh", "")

    def test_a_key_without_a_symbol_is_called_by_its_words_and_unit(self) -> None:
        assert parameter("load.factor").setting(8.0) == "load factor = 8"
        assert parameter("load.factor").axis_label == "load factor  [–]"
        assert parameter("pillar.0.x_um").axis_label == "pillar 0 x  [µm]"
        assert parameter("contact.penalty_Pa_per_um").setting(50.0) == "contact penalty = 50 Pa/µm"
        assert parameter("layer.cytosol.young_Pa").setting(9.5) == "Young's modulus of the cytosol = 9.5 Pa"
        assert parameter("medium.viscosity_Pa_s").axis_label == "medium viscosity  [Pa s]"

    def test_values_are_found_by_dotted_keys(self) -> None:
        assert value_at(Scene(), "pillar.0.half_width_um") == 10.0
        assert value_at(Scene(), "pillar.1.half_width_um") is None
        assert value_at(Scene.model_validate({"flat": False}), "flat.y_um") is None

    def test_curves_of_any_cases_are_drawn_in_colours_of_their_own(self, files: Path) -> None:
        figure = draw_curves(read_planned(files, SIMULATIONS))
        labels = [text.get_text() for text in figure.legends[0].get_texts()]
        assert labels == ["S1", "S2", "S3", "computed time step"]
        found = [line for line in figure.axes[0].lines if (line.get_gid() or "").startswith("law:")]
        assert len({line.get_color() for line in found}) == len(found) == 3

    def test_curves_of_end_states_are_refused_with_what_would_help(self, files: Path, tmp_path: Path) -> None:
        study = read_planned(files, SIMULATIONS)
        for name, case in list(study.cases.items()):
            rows = (case.folder / "history.csv").read_text().splitlines()
            (tmp_path / name).mkdir()
            (tmp_path / name / "history.csv").write_text("\n".join([rows[0], rows[-1]]))
            study.cases[name] = replace(case, folder=tmp_path / name)
        with pytest.raises(InputError, match=r"no case with several times.*time\.history = true"):
            draw_curves(study)
