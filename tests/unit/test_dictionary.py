"""What columns mean: each of a summary is explained, with its unit, in words of the page of result files."""

import csv
import sys
from pathlib import Path

import pytest
from pages import ROOT

import cellmech
from cellmech.results.archive import write_tables
from cellmech.results.dictionary import dictionary
from cellmech.scene.case import Case

sys.path.insert(0, str(ROOT / "tools"))
import columns


def test_file_is_up_to_date():
    assert columns.FILE.read_text(encoding="utf-8") == columns.table(), "python tools/columns.py writes it anew"


@pytest.mark.parametrize(
    ("name", "unit", "words"),
    [
        ("nucleus.sigma_mises_max_Pa", "Pa", ["nucleus: von Mises", "largest value at the end"]),
        ("lamina.J1_max_at_um.x", "µm", ["lamina: tr C", "where: x and y in the undeformed cell"]),
        ("nucleus.J1_max_time_s", "s", ["largest value of all times"]),
        ("contact.max_depth_um", "µm", ["how deep the cell sinks"]),
        ("nucleus_shape.aspect", "–", ["height over width"]),
        ("error.nucleus.J1_max", "–", ["error of the number: nucleus: tr C"]),
        ("energy.stored", "Pa µm²", ["elastic energy"]),
    ],
)
def test_meaning_is_the_pages(name, unit, words):
    ((row),) = dictionary([name])
    assert (row["column"], row["unit"]) == (name, unit)
    assert all(word in row["meaning"] for word in words), row


def test_key_of_a_sweep_is_one_of_the_scene():
    (row,) = dictionary(["layer.lamina.young_Pa"], ["layer.lamina.young_Pa"])
    assert row["unit"] == "Pa" and row["meaning"].startswith("key of the scene")


@pytest.mark.parametrize("geometry", ["plane", "axisymmetric"])
def test_every_column_of_a_summary_is_explained_beside_it(tmp_path, geometry):
    driven = {"adhesion": {"work_uJ_m2": 0.01}, "actin": ({"stress_Pa": 0.1},)}
    tables = {"cell": {"geometry": geometry}, "mesh": {"size_um": 8.0}, "time": {"history": False}, **driven}
    scene = cellmech.Scene(**tables)
    result = cellmech.solve(scene, tmp_path / "one").result
    write_tables(tmp_path, [Case("one", scene, {"load.factor": 1.0})], [result])
    header = next(csv.reader((tmp_path / "summary.csv").read_text(encoding="utf-8").splitlines()))
    told = list(csv.DictReader(Path(tmp_path / "columns.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["column"] for row in told] == header and len(header) > 150
    assert [row["column"] for row in told if not row["meaning"]] == []
