"""The command `cellmech`: what it finds, what it starts, first scenes, fits."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from cli.programs import ENVIRONMENT, PATIENCE_S, program

import cellmech
from cellmech.__main__ import COMMANDS, main
from cellmech.results.dictionary import UNITS
from cellmech.scene.starter import GEOMETRIES
from cellmech.scene.studies import load_study

ALL = ("-m", "cellmech")
COARSE = "[mesh]\nsize_um = 6.0\n[time]\nhistory = false\n"
YOUNG = "layer.lamina.young_Pa"
NUMBERS = ("lamina.sigma_mises_mean_Pa", "nucleus.J1_mean", "shape_index.full")


def called(capsys, *words):
    """Exit status, standard output and error of the command in this process."""
    capsys.readouterr()
    return (main(words), *capsys.readouterr())


def test_version_is_the_packages(capsys):
    assert called(capsys, "--version") == (0, f"cellmech {cellmech.__version__}\n", "")


def test_help_names_every_command(capsys):
    status, out, err = called(capsys)
    assert (status, err) == (0, "")
    assert (0, out, "") == called(capsys, "--help")
    assert all(re.search(rf"^  {name} +\w", out, re.MULTILINE) for name in COMMANDS)
    assert set(COMMANDS) == {"run", "check", "plot", "report", "compare", "fit", "new"}


@pytest.mark.parametrize(
    ("word", "hint"), [("rnu", "mean run?"), ("my.toml", "cellmech run my.toml?"), ("?", "--help")]
)
def test_wrong_command_is_refused_with_the_nearest(capsys, word, hint):
    status, out, err = called(capsys, word)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("cellmech: error: command line: must begin with a command") and hint in err


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_names_it_and_starts_neither_mpi_nor_dolfinx(folder, name):
    code = "import sys\nfrom cellmech.__main__ import main\ntry:\n    main()\nexcept SystemExit:\n    pass\n"
    code += "print([name for name in ('mpi4py.MPI', 'dolfinx') if name in sys.modules])"
    words = [sys.executable, "-c", code, name, "--help"]
    done = subprocess.run(words, env=ENVIRONMENT, capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    assert done.stdout.startswith(f"usage: cellmech {name} ")
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("name", ["run", "check", "fit"])
def test_mistake_names_the_command(folder, capsys, name):
    status, out, err = called(capsys, name, "--bogus")
    assert (status, out) == (2, "") and err.endswith(f"See cellmech {name} --help.\n")


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_new_scene_is_valid_and_check_has_nothing_against_it(folder, capsys, geometry):
    assert called(capsys, "new", "my.toml", "--geometry", geometry)[0] == 0
    (case,) = load_study("my.toml").cases
    assert case.scene.cell.geometry == geometry
    status, out, err = called(capsys, "check", "my.toml")
    assert (status, err) == (0, "")
    assert out.startswith("my: ") and "warning: " not in out


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_new_scene_tells_the_unit_of_every_length_modulus_and_time(folder, capsys, geometry):
    called(capsys, "new", "my.toml", "--geometry", geometry)
    units = {"_kg_m3": "kg/m3", "_uJ_m2": "µJ/m2", **UNITS}
    lines = [line for line in Path("my.toml").read_text(encoding="utf-8").splitlines() if re.match(r"\w+ =", line)]
    with_unit = [(line, unit) for line in lines for unit in [unit_of(line.split()[0], units)] if unit]
    assert len(with_unit) > 12
    assert [line for line, unit in with_unit if not re.search(rf"# {re.escape(unit)}\b", line)] == []


def unit_of(key, units):
    return next((unit for ending, unit in units.items() if key.endswith(ending)), None)


def test_new_scene_overwrites_nothing(folder, capsys):
    Path("my.toml").write_text("precious")
    status, out, err = called(capsys, "new", "my.toml")
    assert (status, out, err.count("\n")) == (2, "", 1) and "my.toml: is there already" in err
    assert Path("my.toml").read_text() == "precious"


@pytest.mark.parametrize("name", ["my", "my.json", ".toml", "no/such/folder.toml"])
def test_new_scene_needs_a_name_that_can_be_written_and_solved(folder, capsys, name):
    status, out, err = called(capsys, "new", name)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert [*Path().iterdir()] == []


def solved(folder):
    result = json.loads(Path(folder, "s/result.json").read_text(encoding="utf-8"))
    assert result["status"] == "solved", result["reason"]
    return {key: result[key] for key in ("nucleus", "contact", "dofs")}


@pytest.mark.mpi
def test_run_solves_what_the_study_module_solves_also_on_two_ranks(folder):
    Path("s.toml").write_text(COARSE)
    assert program("s.toml", "--out", "old", "--quiet").status == 0
    done = program("run", "s.toml", "--out", "new", "--quiet", ranks=2, program=ALL)
    assert (done.status, done.err) == (0, "")
    assert solved("new")["contact"] == pytest.approx(solved("old")["contact"], rel=1e-6, abs=1e-9)
    script = Path(sys.executable).with_name("cellmech")
    words = [script, "run", "s.toml", "--out", "old"]
    again = subprocess.run(words, env=ENVIRONMENT, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert (again.returncode, again.stderr) == (0, "")
    assert again.stdout.startswith("already solved: s ")


@pytest.fixture
def target(folder):
    """A scene with another modulus than the one of its reference numbers, 700 Pa."""
    Path("s.toml").write_text(f"{COARSE}[layer.lamina]\nyoung_Pa = 700.0\n")
    result = cellmech.solve("s.toml")
    lines = "".join(f"{key} = {result.number(key)!r}\n" for key in NUMBERS)
    Path("m.toml").write_text(f"[case.s]\n{lines}")
    Path("s.toml").write_text(f"{COARSE}[layer.lamina]\nyoung_Pa = 2000.0\n")
    return folder


def test_fit_recovers_a_modulus_from_its_own_numbers(target, capsys):
    status, out, err = called(capsys, "fit", "s.toml", "m.toml", "--free", f"{YOUNG}=100:10000")
    assert (status, err) == (0, "")
    found = json.loads(Path("results/s-fit/fit.json").read_text())
    assert found["values"][YOUNG] == pytest.approx(700.0, rel=1e-5)
    assert found["rms"] < 1e-6 and found["ended"] and found["at_bounds"] == found["untold"] == []
    lines = out.splitlines()
    assert next(line for line in lines if line.startswith("trial ")).startswith(f"trial 1: {YOUNG} = 2000: rms ")
    assert f"{YOUNG} = 700 ±" in out and lines[-1].endswith(f"--set {YOUNG}=700")
    assert len(Path("results/s-fit/trials.csv").read_text().splitlines()) == found["trials"] + 1
    assert "lamina.sigma_mises_mean_Pa" in Path("results/s-fit/compare.md").read_text()


def test_fit_goes_on_where_it_stopped(target, capsys):
    words = ("fit", "s.toml", "m.toml", "--free", f"{YOUNG}=100:10000", "--out", "out")
    status, out, _ = called(capsys, *words, "--most", "3")
    assert status == 1 and "not ended" in out
    first = Path("out/trials/001/s/result.json")
    before = first.stat().st_mtime_ns
    assert called(capsys, *words)[0] == 0
    assert first.stat().st_mtime_ns == before


def test_fit_says_what_no_number_tells_and_what_is_at_its_bound(target, capsys):
    Path("m.toml").write_text(Path("m.toml").read_text().replace("[case.s]", "[case.s]\nnucleus.area_um2 = 70.0"))
    status, out, _ = called(capsys, "fit", "s.toml", "m.toml", "--free", f"{YOUNG}=1500:5000", "cell.beta_over_mu=1:3")
    assert status == 0
    assert re.search(rf"{re.escape(YOUNG)} = 150\d ± .* \(at its bound", out)
    assert re.search(r"cell.beta_over_mu = 2.5.* do not tell it", out)


BAD_FITS = {
    "no key": ([], "--free: must name a key"),
    "unknown key": (["--free", "layer.lamina.young_pa=1:2"], "Did you mean layer.lamina.young_Pa?"),
    "no bounds": (["--free", YOUNG], "must be KEY=LEAST:MOST"),
    "bounds out of order": (["--free", f"{YOUNG}=2:1"], f"free: {YOUNG}: must have a least and a larger most"),
    "bound that breaks a rule": (["--free", f"{YOUNG}=-1:5"], f"free: {YOUNG}: must be a finite number > 0"),
    "unknown number": (["--free", f"{YOUNG}=100:9000"], "there is no such number"),
    "unknown case": (["--free", f"{YOUNG}=100:9000", "--case"], "m.toml: case.t: must be a case of s.toml. It has s."),
}


@pytest.mark.parametrize(("words", "told"), BAD_FITS.values(), ids=BAD_FITS)
def test_bad_fit_is_refused_with_one_message(folder, capsys, words, told):
    Path("s.toml").write_text(COARSE)
    other = "--case" in words
    Path("m.toml").write_text("[case.t]\na = 1.0\n" if other else "[case.s]\nnucleus.J9_max = 1.0\n")
    status, out, err = called(capsys, "fit", "s.toml", "m.toml", *(word for word in words if word != "--case"))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert told in err
