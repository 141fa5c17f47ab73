"""One name in two codings of its accents is one name, on a disk that keeps the bytes."""

import json
from pathlib import Path

import pytest

from cellmech import Additions, InputError, load
from cellmech.names import folded, plain, spelt
from cellmech.runs.command import understand
from cellmech.scene.files import scene_to_toml
from cellmech.scene.studies import load_study

NFC, NFD = "caf\u00e9", "cafe\u0301"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_codings_of_a_name_are_one_and_other_names_are_not():
    assert NFC != NFD and plain(NFD) == plain(NFC) == NFC
    assert folded("\u00c9a") == folded("e\u0301A") != folded("ea")


@pytest.mark.parametrize("disk", [NFC, NFD])
def test_path_is_spelt_as_the_disk_has_it(here, disk):
    Path(disk, disk).mkdir(parents=True)
    for name in (NFC, NFD):
        assert Path(spelt(f"{name}/{name}/new")) == Path(disk, disk, "new")
        assert Path(spelt(here / name)) == here / disk
    assert spelt(f"{NFC}x") == f"{NFC}x"
    Path(NFC).mkdir(exist_ok=True)
    Path(NFD).mkdir(exist_ok=True)
    assert (spelt(NFC), spelt(NFD)) == (NFC, NFD)  # two there: each is itself


@pytest.mark.parametrize("written", [NFC, NFD])
@pytest.mark.parametrize("asked", [NFC, NFD])
def test_case_and_file_are_found_by_either_coding(here, written, asked):
    Path(f"{written}.toml").write_text(f'[[case]]\nname = "{written}"\n[[case]]\nname = "b"\n', encoding="utf-8")
    (order,) = understand([f"{asked}.toml", "--only", asked, "--list"], 1).orders
    assert [case.name for case in order.chosen] == [NFC]
    assert (order.study.stem, order.out) == (NFC, Path("results", NFC))


def test_results_folder_is_used_by_either_coding(here):
    Path(NFD).mkdir()
    Path("my.toml").touch()
    (order,) = understand(["my.toml", "--out", NFC], 1).orders
    assert order.out == Path(NFD)


def test_two_files_of_one_name_are_refused(here):
    for name in (NFC, NFD):
        Path(f"{name}.toml").touch()
    with pytest.raises(InputError, match="must differ in name"):
        understand([f"{NFC}.toml", f"{NFD}.toml", "--list"], 1)


def test_override_and_number_are_the_same_by_either_coding(here):
    Path("my.toml").touch()
    assert load_study("my.toml", [f"title={NFD}"]).title == NFC
    case = Path(NFD)
    case.mkdir()
    (case / "scene.toml").write_text(scene_to_toml(load_study("my.toml").cases[0].scene))
    (case / "result.json").write_text(json.dumps({"status": "solved", "own": {NFC: 2.5}}))
    for name in (NFC, NFD):
        found = load(name)
        assert (found.name, found.number(f"own.{name}")) == (NFC, 2.5)


def test_names_of_additions_are_one_in_either_coding():
    assert list(Additions(observables={NFD: lambda observer: 1.0}).observables) == [NFC]
    with pytest.raises(InputError, match="accents"):
        Additions(observables={NFC: lambda observer: 1.0, NFD: lambda observer: 2.0})
    with pytest.raises(InputError, match="must be a dict of names"):
        Additions(obstacles={1: None})
