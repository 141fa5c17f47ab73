"""Files of a case, and what ties a result to its inputs."""

import csv
import io
import json
import os
import re
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

from cellmech.results import archive, records
from cellmech.results.archive import finished, input_key, write_tables
from cellmech.results.records import CaseFolder, flatten, to_csv, write_whole
from cellmech.results.sealed import plain, sealed
from cellmech.scene.case import Case
from cellmech.scene.files import read_scene


class Plan:
    def __init__(self, text="apart"):
        self.text = text

    def key(self):
        return self.text


@pytest.fixture
def folder(tmp_path):
    with_lead = CaseFolder(tmp_path / "deep" / "case", MPI.COMM_SELF)
    yield with_lead
    with_lead.close()


def history(folder):
    with open(folder.path / "history.csv", newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def names(folder):
    return sorted(path.name for path in folder.path.iterdir())


def case(name="a", **data):
    return Case(name, read_scene(data, "test"))


# Whole or not at all


def test_write_whole_replaces_at_once_and_leaves_nothing_beside(tmp_path):
    path = tmp_path / "a.txt"
    write_whole(path, "old\n")
    write_whole(path, "ν = 0.45\n")
    assert path.read_bytes() == "ν = 0.45\n".encode()
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_write_whole_that_fails_keeps_the_old_content(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    write_whole(path, "old")

    def refuse(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(OSError, match="No space"):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_files_can_be_read_by_others_as_the_umask_says(tmp_path):
    before = os.umask(0o022)
    try:
        write_whole(tmp_path / "a.txt", "text")
    finally:
        os.umask(before)
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == 0o644


def test_replace_with_moves_into_place_at_success_only(folder):
    with folder.replace_with("fields_0000.vtu") as path:
        path.write_text("new")
        assert path.suffix == ".vtu"  # writers choose their format by it
        assert "fields_0000.vtu" not in names(folder)
    with pytest.raises(KeyError), folder.replace_with("fields_0000.vtu") as path:
        path.write_text("half")
        raise KeyError
    assert names(folder) == ["fields_0000.vtu", "run.log"]
    assert (folder.path / "fields_0000.vtu").read_text() == "new"


def test_what_the_disk_refuses_is_kept_for_all_ranks_to_meet(folder, monkeypatch):
    folder.write_text("scene.toml", "old")
    fsync = os.fsync

    def refuse(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", refuse)
    folder.write_text("scene.toml", "new")
    monkeypatch.setattr(os, "fsync", fsync)
    with folder.replace_with("checkpoint.npz") as path:  # of rows that may not be there
        path.write_text("")
    with pytest.raises(OSError, match="No space"):
        folder.finish({"status": "solved"})
    assert names(folder) == ["run.log", "scene.toml"]
    assert (folder.path / "scene.toml").read_text() == "old"
    folder.agree()  # it has been met
    folder.write_text("scene.toml", "new")
    assert (folder.path / "scene.toml").read_text() == "new"


def test_folders_of_others_are_let_be_whatever_their_name(tmp_path):
    theirs = tmp_path / "fields_paraview"
    theirs.mkdir()
    folder = CaseFolder(tmp_path, MPI.COMM_SELF)
    folder.finish({"status": "solved"})
    folder.close()
    assert theirs.is_dir() and json.loads((tmp_path / "result.json").read_text())["files"] == {}


def test_folder_begins_afresh_but_keeps_what_is_not_ours(tmp_path):
    for name in ("result.json", "history.csv", "fields_0003.vtu", "fields.pvd", ".partial-9-result.json", "notes.txt"):
        (tmp_path / name).write_text("old")
    (tmp_path / "run.log").write_text("old")
    folder = CaseFolder(tmp_path, MPI.COMM_SELF)
    folder.log("new")
    assert names(folder) == ["notes.txt", "run.log"]
    assert (tmp_path / "run.log").read_text() == "new\n"  # before it is closed
    folder.close()


def test_only_the_lead_writes_but_all_ranks_see_a_nan(tmp_path):
    folder = CaseFolder(tmp_path / "case", SimpleNamespace(rank=1))
    folder.log("line")
    folder.add_row({"t_s": 1.0})
    folder.flush(force=True)
    folder.write_text("scene.toml", "")
    with folder.replace_with("fields.vtu"):
        pass
    with pytest.raises(ValueError, match=r"energy\.stored must be finite"):
        folder.add_row({"energy.stored": float("nan")})
    folder.close()
    assert not (tmp_path / "case").exists()


# Histories


def test_history_reads_back_to_the_last_digit(folder):
    values = [0.1 + 0.2, 1e-300, -2.0 / 3.0, np.float64(1) / 7]
    for value in values:
        folder.add_row({"t_s": value, "newton": 3, "share": None})
    folder.flush(force=True)
    assert [float(row["t_s"]) for row in history(folder)] == values
    assert [(row["newton"], row["share"]) for row in history(folder)] == [("3", "")] * 4


def test_history_is_written_now_and_then_and_at_the_end(folder, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(records.time, "monotonic", lambda: now[0])
    counts = []
    for i in range(8):
        folder.add_row({"t_s": float(i)})
        counts.append(len(history(folder)))
        now[0] += 1.0
    assert counts == [1, 1, 1, 4, 4, 4, 7, 7]
    folder.close()
    assert len(history(folder)) == 8


def test_history_takes_a_column_that_comes_later(folder):
    folder.add_row({"t_s": 1.0})
    folder.add_row({"t_s": 2.0, "late": 5.0})
    folder.flush(force=True)
    assert [row["late"] for row in history(folder)] == ["", "5.0"]


# Scalars and tables


def test_flatten_gives_scalars_by_dotted_key():
    result = {
        "schema": 1, "case": "a", "scene": {"time": {"end_s": 3.0}}, "status": "solved", "versions": {"numpy": "1"},
        "model": {"modelled": {"law": "yeoh"}}, "steps": np.int64(7), "settled": np.float32(0.5),
        "nucleus": {"J1_max": 2.5, "J1_max_at_um": [1.0, -2.0], "J2_max_at_um": None, "J2_max": None},
        "lamina": None,
    }  # fmt: skip
    flat = flatten(result)
    assert flat == {
        "steps": 7, "settled": 0.5,
        "nucleus.J1_max": 2.5, "nucleus.J1_max_at_um.x": 1.0, "nucleus.J1_max_at_um.y": -2.0,
        "nucleus.J2_max_at_um.x": None, "nucleus.J2_max_at_um.y": None, "nucleus.J2_max": None, "lamina": None,
    }  # fmt: skip
    assert {type(value) for value in flat.values()} == {int, float, type(None)}


def test_csv_drops_the_null_of_a_region_that_others_have():
    text = to_csv([{"lamina": None, "t": 1.0}, {"lamina.J1_max": 2.5, "t": 2.0}, {"flat": True, "flat.y": 1.0}])
    assert text == "t,lamina.J1_max,flat,flat.y\n1.0,,,\n2.0,2.5,,\n,,true,1.0\n"


def test_csv_quotes_what_needs_it():
    rows = [{"case": "a,b", "times": [1.0, 2.5], "reason": 'says "no"'}]
    read = list(csv.DictReader(io.StringIO(to_csv(rows))))
    assert read == [{"case": "a,b", "times": "[1.0, 2.5]", "reason": 'says "no"'}]


def test_plain_turns_numpy_into_python_and_refuses_the_rest():
    data = plain({"a": np.float64(0.1), "b": np.arange(2), "c": (1, None), "d": np.bool_(True), 5: "text"})
    assert data == {"a": 0.1, "b": [0, 1], "c": [1, None], "d": True, "5": "text"}
    assert json.loads(json.dumps(data)) == data
    with pytest.raises(TypeError, match=r"a\.0: a set does not fit"):
        plain({"a": [{1}]})
    with pytest.raises(ValueError, match=r"a\.b\.1 must be finite, got inf"):
        plain({"a": {"b": [1.0, float("inf")]}})


def test_summary_is_in_the_order_of_the_study_with_all_swept_keys(tmp_path):
    cases = [
        Case("S1", case().scene, {"cell.law": "yeoh"}),
        Case("S2", case().scene, {"load.factor": 2.5, "cell.inertia": False}),
    ]
    results = [
        {"status": "failed", "reason": "no, not so", "wall_s": 3.25, "ranks": 2},
        {"status": "solved", "reason": "", "wall_s": 1.5, "ranks": 1, "memory_MB": 99.5, "cell": {"J1_max": 2.5}},
    ]
    write_tables(tmp_path, cases, results)
    assert (tmp_path / "summary.csv").read_text() == (
        "case,cell.law,load.factor,cell.inertia,status,reason,cell.J1_max\n"
        'S1,yeoh,,,failed,"no, not so",\n'
        "S2,,2.5,false,solved,,2.5\n"
    )
    with open(tmp_path / "timings.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["case"], row["wall_s"], row["ranks"], row["memory_MB"]) for row in rows] == [
        ("S1", "3.25", "2", ""), ("S2", "1.5", "1", "99.5"),
    ]  # fmt: skip


# Ties to the inputs


def test_input_key_changes_with_scene_plan_and_program_only(monkeypatch):
    key = input_key(case(), Plan())
    assert input_key(case("b", title="Other"), Plan()) == key
    assert input_key(case(load={"factor": 1.0 + 1e-15}), Plan()) != key
    assert input_key(case(), Plan("merged")) != key
    monkeypatch.setattr(archive, "source_hash", lambda: "other")
    assert input_key(case(), Plan()) != key


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ('{"status": "solved", "reason": "", "input_hash": "k2"}', "other inputs"),
        (
            '{"status": "failed", "reason": "internal error: X", "cause": "internal", "input_hash": "k"}',
            r"failed \(internal error: X\)",
        ),
        ('{"status": "solved", "input_ha', "cannot be read"),
        ('"solved"', "not one of this program's"),
        ("[" * 100_000, "cannot be read"),
    ],
)
def test_result_that_cannot_be_served_is_named(tmp_path, content, why):
    if content.endswith("}"):
        content = sealed(json.loads(content))
    (tmp_path / "result.json").write_text(content)
    notes = []
    assert finished(tmp_path, "k", notes.append) is None
    (note,) = notes
    assert re.search(why, note)


def test_solved_result_is_served_in_silence(tmp_path):
    notes = []
    assert finished(tmp_path / "missing", "k", notes.append) is None
    folder = CaseFolder(tmp_path / "case", MPI.COMM_SELF)
    stored = {"status": "solved", "reason": "", "input_hash": "k", "x": 0.1 + 0.2, "law": "µ"}
    folder.finish(stored)
    folder.close()
    found = finished(folder.path, "k", notes.append)
    assert {key: found[key] for key in stored} == stored
    assert notes == []
