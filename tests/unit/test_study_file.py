"""Study files: sweeps, named cases, overrides, and every way a file or a command line can be wrong."""

import os
import tomllib
from pathlib import Path

import pytest

from cellmech.errors import InputError
from cellmech.scene import toml_file, variants
from cellmech.scene.files import scene_to_toml
from cellmech.scene.scene import Scene
from cellmech.scene.studies import Study, load_study, parse_overrides

STUDIES = Path(__file__).parents[2] / "studies"


@pytest.fixture
def study(tmp_path, monkeypatch):
    """Write a study file and load it by the relative name a user would type."""
    monkeypatch.chdir(tmp_path)

    def load(text: str, *overrides: str, name: str = "my.toml") -> Study:
        Path(name).write_text(text, encoding="utf-8")
        return load_study(name, overrides)

    return load


@pytest.fixture
def refusal(study):
    """Load a study that must be refused; the error names what the user typed, on one line."""

    def load(text: str, *overrides: str, name: str = "my.toml") -> InputError:
        with pytest.raises(InputError) as caught:
            study(text, *overrides, name=name)
        error = caught.value
        assert error.where.startswith((name, "--set"))
        assert str(error).startswith(error.where + ": ")
        assert "\n" not in str(error)
        return error

    return load


def names(study: Study) -> list[str]:
    return [case.name for case in study.cases]


# One case


def test_file_without_cases_is_one_case_named_after_it(study):
    found = study('title = "Mine"\n[cell]\nlaw = "yeoh"', name="my.first.toml")
    assert (found.title, found.stem, found.path) == ("Mine", "my.first", Path("my.first.toml"))
    assert names(found) == ["my.first"]
    assert found.cases[0].scene.cell.law == "yeoh"
    assert found.cases[0].swept == {}


def test_empty_file_and_no_file_are_table_1(study):
    assert study("").cases[0].scene == Scene()
    assert study("").title == "my"
    table_1 = load_study(None)
    assert (table_1.stem, table_1.path, table_1.cases[0].scene) == ("table1", None, Scene())


def test_byte_order_mark_and_windows_line_ends_are_taken(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(b'\xef\xbb\xbf[cell]\r\nlaw = "yeoh"\r\n')
    assert load_study(path).cases[0].scene.cell.law == "yeoh"


def test_written_scene_runs_again_as_it_is(study):
    cases = study('[[case]]\nname = "a"\n"pillar" = []\n"cell.law" = "yeoh"\n[[case]]\nname = "b"\nflat = false').cases
    for case in cases:
        assert study(scene_to_toml(case.scene), name=f"{case.name}.toml").cases[0].scene == case.scene
    assert cases[0].scene != cases[1].scene


# [sweep]


def test_figure_2_is_the_four_laws_under_table_1():
    found = load_study(STUDIES / "fig2.toml")
    assert names(found) == ["saint-venant", "neo-hookean", "mooney-rivlin", "yeoh"]
    assert found.title == "Figure 2: constitutive laws"
    for case in found.cases:
        rest = tomllib.loads(scene_to_toml(case.scene))
        assert rest["cell"].pop("law") == case.name == case.swept["cell.law"]
        table_1 = tomllib.loads(scene_to_toml(Scene(title=found.title)))
        del table_1["cell"]["law"]
        assert rest == table_1


def test_sweep_is_the_cartesian_product_with_the_last_axis_fastest(study):
    found = study(
        "[cell]\npoisson = 0.3\n[sweep]\n"
        '"layer.nucleoplasm.young_Pa" = [10, 30.0]\n"layer.lamina.young_Pa" = [1000, 1.5e3]'
    )
    assert names(found) == [
        "nucleoplasm.young_Pa=10,lamina.young_Pa=1000",
        "nucleoplasm.young_Pa=10,lamina.young_Pa=1500",
        "nucleoplasm.young_Pa=30,lamina.young_Pa=1000",
        "nucleoplasm.young_Pa=30,lamina.young_Pa=1500",
    ]
    last = found.cases[-1]
    assert last.swept == {"layer.nucleoplasm.young_Pa": 30.0, "layer.lamina.young_Pa": 1500.0}
    assert (last.scene.layer.nucleoplasm.young_Pa, last.scene.layer.lamina.young_Pa) == (30, 1500)
    assert last.scene.cell.poisson == 0.3


@pytest.mark.parametrize(
    ("sweep", "expected"),
    [
        ('"cell.inertia" = [true, false]', ["true", "false"]),
        ('"load.factor" = [1, 0.5, 1e-5, 2.0]', ["1", "0.5", "1e-05", "2"]),
        ('"flat.y_um" = [-10, -12.5]', ["y_um=-10", "y_um=-12.5"]),  # "-10" would look like an option
        ("cell.law = ['yeoh']", ["yeoh"]),
        ("[sweep.cell]\nlaw = ['yeoh']", ["yeoh"]),
        ('"cell.law" = ["yeoh"]\nload.factor = [2]', ["law=yeoh,factor=2"]),
        ('"pillar.0.y_um" = [-10]\n"flat.y_um" = [-11]', ["pillar.0.y_um=-10,flat.y_um=-11"]),
        ('"cell.poisson" = [0.1]\n"layer.lamina.poisson" = [0.2]', ["cell.poisson=0.1,lamina.poisson=0.2"]),
    ],
)
def test_sweep_names_are_short_and_plain(study, sweep, expected):
    assert names(study(f"[sweep]\n{sweep}")) == expected


def test_short_keys_are_the_shortest_endings_no_other_key_shares():
    keys = ["layer.lamina.young_Pa", "layer.cytosol.young_Pa", "load.factor", "pillar.0.x_um", "pillar.1.x_um"]
    assert list(variants.short_keys(keys).values()) == [
        "lamina.young_Pa", "cytosol.young_Pa", "factor", "pillar.0.x_um", "pillar.1.x_um",
    ]  # fmt: skip


def test_sweep_over_one_of_two_pillars_changes_only_that_one(study):
    text = 'cell.shape = "full"\n[[pillar]]\nx_um = -20\n[[pillar]]\nx_um = 5\n[sweep]\n"pillar.1.height_um" = [3, 4]'
    heights = [[pillar.height_um for pillar in case.scene.pillar] for case in study(text).cases]
    assert heights == [[9.5, 3], [9.5, 4]]


def test_radii_in_metres_are_blamed_not_the_mesh(refusal):
    radii = zip(("membrane", "cytosol", "lamina", "nucleoplasm"), (10e-6, 9.5e-6, 5e-6, 4.9e-6), strict=True)
    error = refusal("".join(f"[layer.{name}]\nouter_radius_um = {radius!r}\n" for name, radius in radii))
    assert error.key == "layer.membrane.outer_radius_um"
    assert "is in µm" in error.rule and error.hint == "In metres it would be 10 µm: write 10.0."


@pytest.mark.parametrize(
    ("text", "key", "hint"),
    [
        ('[sweep]\n"cell.radius_um" = [1e-5, 2e-5]', "cell.radius_um", "10 µm: write 10.0"),
        ('[sweep]\n"nucleus.radius_um" = [5e-6, 4e-6]', "nucleus.radius_um", "5 µm: write 5.0"),
        ("[layer.lamina]\nthickness_um = 1e-7", "layer.lamina.thickness_um", "0.1 µm: write 0.1"),
        ("[layer.nucleoplasm]\nouter_radius_um = 4.9e-6", "layer.nucleoplasm.outer_radius_um", "4.9 µm: write 4.9"),
        ("[cell]\nradius_um = 1e-5\n[nucleus]\nradius_um = 5e-6", "cell.radius_um", "10 µm: write 10.0"),
    ],
)
def test_a_size_in_metres_is_blamed_under_the_key_that_says_it(refusal, text, key, hint):
    error = refusal(text)
    assert error.key == key and "is in µm" in error.rule
    assert error.hint == f"In metres it would be {hint}."


@pytest.mark.parametrize("text", ["300,0", "1.234,5"])
def test_decimal_comma_is_named(study, text):
    with pytest.raises(InputError, match="decimal point") as refused:
        study(f"[layer.lamina]\nyoung_Pa = {text}")
    assert f"young_Pa = {text}" in str(refused.value)
    with pytest.raises(InputError, match="decimal point"):
        study("", f"layer.lamina.young_Pa={text}")


@pytest.mark.parametrize(
    ("sweep", "key", "rule", "got"),
    [
        ("sweep = 3", "sweep", "must be a table", "got 3"),
        ("[sweep]", "sweep", "must name a key and its values", '"cell.law" = ["yeoh"'),
        ('[sweep]\n"cell.lw" = ["yeoh"]', "cell.lw", "unknown key", "Did you mean cell.law?"),
        ('[sweep]\n"young" = [1]', "young", "unknown key", "young_Pa"),
        ('[sweep]\n"cell.law" = "yeoh"', "cell.law", "must be a list of values", "got 'yeoh'"),
        ('[sweep]\n"cell.law" = []', "cell.law", "must be a list of values, not empty", "got []"),
        ('[sweep]\n"output.times_s" = [[1], [2]]', "output.times_s", "must list numbers, texts", "got [1]"),
        ('[sweep]\n"cell.law" = ["yeoh"]\ncell.law = ["yeoh"]', "cell.law", "must be set once", "got ['yeoh']"),
        (
            '[sweep]\n"pillar.1.x_um" = [1]',
            "pillar.1.x_um",
            "there is no pillar 1, only 0 to 0",
            "my.toml, case '1': pillar.1.x_um: ",
        ),
        ('[sweep]\n"pillar.x_um" = [1]', "pillar.x_um", "unknown key", "Did you mean pillar.0.x_um?"),
        ('[sweep]\n"load.factor" = [1, 1.0]', "case", "must differ by more than upper and lower case", "got '1'"),
    ],
)
def test_bad_sweep_is_refused(refusal, sweep, key, rule, got):
    error = refusal(sweep)
    assert error.key == key
    assert rule in error.rule
    assert got in str(error)


def test_bad_swept_value_names_its_case_and_key(refusal):
    error = refusal('[sweep]\n"layer.lamina.young_Pa" = [10, -1]\n"load.factor" = [1]')
    assert error.where == "my.toml, case 'young_Pa=-1,factor=1'"
    assert (error.key, error.got) == ("layer.lamina.young_Pa", -1)


def test_bad_swept_text_is_refused_as_a_value_and_not_as_a_name(refusal):
    error = refusal('[sweep]\n"cell.law" = ["yeoh", "../x"]')
    assert (error.key, error.got) == ("cell.law", "../x")


def test_bad_value_of_the_file_does_not_blame_a_case(refusal):
    error = refusal('[cell]\npoisson = 0.7\n[sweep]\n"load.factor" = [1, 2]')
    assert (error.where, error.key) == ("my.toml", "cell.poisson")


def test_rule_between_swept_and_written_keys_blames_the_case(refusal):
    error = refusal('[cell]\nlayers = "smeared"\nsmear_um = 1\n[sweep]\n"layer.lamina.law" = ["neo-hookean", "yeoh"]')
    assert (error.where, error.key) == ("my.toml, case 'yeoh'", "cell.law")


def test_more_cases_than_the_limit_are_refused_before_they_are_built(refusal):
    values = list(range(1, 401))
    text = f'[sweep]\n"layer.lamina.young_Pa" = {values}\n"layer.cytosol.young_Pa" = {values}'
    assert "must give at most 100,000 cases; got 160000" in str(refusal(text))


# [[case]]


def test_cases_have_their_own_names_and_take_quoted_keys_and_tables(study):
    found = study(
        "[time]\nend_s = 24000\n"
        '[[case]]\nname = "S1"\n'
        '[[case]]\nname = "S2"\n"layer.lamina.young_Pa" = 20\nlayer.nucleoplasm.young_Pa = 30\n'
        '[[case]]\nname = "S3 (µ)"\n[case.cell]\nlaw = "yeoh"\n'
    )
    assert names(found) == ["S1", "S2", "S3 (µ)"]
    s1, s2, s3 = found.cases
    assert (s1.swept, s1.scene.layer.lamina.young_Pa) == ({}, 1000)
    assert s2.swept == {"layer.lamina.young_Pa": 20, "layer.nucleoplasm.young_Pa": 30}
    assert (s2.scene.layer.lamina.young_Pa, s2.scene.layer.nucleoplasm.young_Pa) == (20, 30)
    assert s3.scene.cell.law == "yeoh"
    assert {case.scene.time.end_s for case in found.cases} == {24000}


def test_cases_can_replace_pillars_and_flat(study):
    found = study(
        'flat = false\n[[case]]\nname = "a"\nflat = {y_um = -12}\n[[case]]\nname = "b"\npillar = [{height_um = 3}]\n'
        '[[case]]\nname = "c"\n"pillar.0.height_um" = 4'
    )
    a, b, c = (case.scene for case in found.cases)
    assert a.flat is not None
    assert (a.flat.y_um, b.flat) == (-12, None)
    assert [scene.pillar[0].height_um for scene in (a, b, c)] == [9.5, 3, 4]


@pytest.mark.parametrize(
    ("text", "where", "key", "rule"),
    [
        ("case = 3", "my.toml", "case", "must be an array of tables"),
        ('[case]\nname = "a"', "my.toml", "case", "must be an array of tables"),
        ("[[case]]\n", "my.toml", "case.0.name", "must be a text that names the case"),
        ('[[case]]\nname = "a"\n[[case]]\nname = 2', "my.toml", "case.1.name", "must be a text that names the case"),
        ('[[case]]\nname = "a"\n"cell.lw" = 1', "my.toml, case 'a'", "cell.lw", "unknown key"),
        ('[[case]]\nname = "a"\n[case.cell]\nlw = 1', "my.toml, case 'a'", "cell.lw", "unknown key"),
        ('[[case]]\nname = "a"\n"time.end_s" = 0', "my.toml, case 'a'", "time.end_s", "> 0"),
        ('[[case]]\nname = "a"\ncell = 3', "my.toml, case 'a'", "cell", "must be a table"),
        ('[[case]]\nname = "a"\n[[case]]\nname = "A"', "my.toml", "case", "upper and lower case from 'a'"),
        ('[[case]]\nname = "\u00e4"\n[[case]]\nname = "a\u0308"', "my.toml", "case", "how accents are coded from 'ä'"),
        ('[[case]]\nname = "\u00c4"\n[[case]]\nname = "a\u0308"', "my.toml", "case", "how accents are coded from 'Ä'"),
        ('[sweep]\n"cell.law" = ["yeoh"]\n[[case]]\nname = "a"', "my.toml", "case", "must not stand beside [sweep]"),
    ],
)
def test_bad_case_is_refused(refusal, text, where, key, rule):
    error = refusal(text)
    assert (error.where, error.key) == (where, key)
    assert rule in error.rule


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "a/b", "../a", "/a", ".a", "-a", "~a", " a", "a ", "a\\\\b", "a\\tb", "a\\u0000b", "a\\u007fb",
     "a\\u2028b", "x" * 121, "µ" * 61, "summary.csv", "Timings.CSV", "result.json"],
)  # fmt: skip
def test_name_that_is_no_safe_folder_is_refused(refusal, name):
    error = refusal(f'[[case]]\nname = "{name}"')
    assert error.key == "case"
    assert error.rule.startswith("a case's name must ")
    assert "got " in str(error)


@pytest.mark.parametrize("name", ["a", "S1", "x" * 120, "µ" * 60, "a.b", "a,b=1", "0.5", "con"])
def test_name_that_is_a_safe_folder_is_taken(study, name):
    assert names(study(f'[[case]]\nname = "{name}"')) == [name]


# --set


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a=1", 1), ("a=1e-3", 1e-3), ("a=true", True), ('a="x"', "x"), ("a=x", "x"), ("a=neo-hookean", "neo-hookean"),
        ("a=[1, 2]", [1, 2]), ("a = 3 ", 3), ("a={b = 1}", {"b": 1}), ("a=b=c", "b=c"), ("a=1\nb=2", "1\nb=2"),
        ("a=.5", ".5"), ("'a'=1", 1), ("a=" + "[" * 5000, "[" * 5000),
    ],
)  # fmt: skip
def test_override_value_is_toml_or_else_a_bare_text(text, value):
    assert parse_overrides([text]) == {"a": value}


def test_overrides_change_every_case_and_the_last_one_counts(study):
    found = study(
        '[cell]\npoisson = 0.3\n[sweep]\n"load.factor" = [1, 2]',
        "cell.law=yeoh", "cell.poisson=0.1", "cell.poisson=0.2", "pillar.0.height_um=12", "flat=false", "title=x",
    )  # fmt: skip
    assert found.title == "x"
    for case in found.cases:
        assert (case.scene.cell.law, case.scene.cell.poisson, case.scene.flat) == ("yeoh", 0.2, None)
        assert case.scene.pillar[0].height_um == 12
        assert set(case.swept) == {"load.factor"}
    assert load_study(None, ["load.factor=3"]).cases[0].scene.load.factor == 3


def test_override_of_the_whole_pillar_list_then_of_one_key(study):
    pillars = study("", "pillar=[{x_um = 0}, {x_um = 30}]", "pillar.1.height_um=5").cases[0].scene.pillar
    assert [pillar.height_um for pillar in pillars] == [9.5, 5]
    again = study("", "pillar.0.height_um=4", "pillar=[{}]", "pillar.0.height_um=5").cases[0].scene
    assert again.pillar[0].height_um == 5


@pytest.mark.parametrize(
    ("override", "key", "rule", "got"),
    [
        ("load.factr=2", "load.factr", "unknown key", "Did you mean load.factor?"),
        ("sweep=2", "sweep", "unknown key", ""),
        ("load.g=2", "load.g", "unknown key", "[load] has gravity_m_s2, factor, start_s, half_ramp_s."),
        ("factor=2", "factor", "unknown key", "Did you mean load.factor?"),
        ("lamina.young_Pa=2", "lamina.young_Pa", "unknown key", "Did you mean layer.lamina.young_Pa?"),
        ("sweep=2", "sweep", "unknown key", ""),
        ("pillar.1.x_um=2", "pillar.1.x_um", "there is no pillar 1, only 0 to 0", "Write [[pillar]] to add one."),
        ("pillar.-1.x_um=2", "pillar.-1.x_um", "unknown key", "Did you mean pillar.0.x_um?"),
        ("pillar.0.heigth_um=2", "pillar.0.heigth_um", "unknown key", "Did you mean pillar.0.height_um?"),
        ("pillar.99999999999999999999.x_um=2", "pillar.99999999999999999999.x_um", "there is no pillar 999999999", ""),
        ("pillar.0=2", "pillar.0", "unknown key", ""),
        ("cell={a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r.s.t.u=1}", "", "must not nest", ""),
        ("cell=2", "cell", "must be a table", "got 2"),
        ("cell.poisson=0.5", "cell.poisson", "must be < 0.5", "got 0.5"),
        ("cell.poisson=.3", "cell.poisson", "must be a finite number", "got '.3'. Write 0.3, without quotes"),
        ("cell.law=yeo", "cell.law", "must be one of", "got 'yeo'. Did you mean 'yeoh'?"),
        ("cell.inertia=True", "cell.inertia", "must be true or false", "got 'True'"),
        ("layer.lamina.outer_radius_um=4", "layer.nucleoplasm.outer_radius_um", "must be less than", "got 4.9"),
        ("load.factor", "", "must be KEY=VALUE", "got 'load.factor'"),
        ("load.factor=", "", "must be KEY=VALUE", "got 'load.factor='"),
        ("=2", "", "must be KEY=VALUE", "got '=2'"),
    ],
)
def test_bad_override_is_refused_in_the_name_of_set(refusal, override, key, rule, got):
    error = refusal("", override)
    assert (error.where, error.key) == ("--set", key)
    assert rule in error.rule
    assert got in str(error)


@pytest.mark.parametrize("override", ["cell.law=yeoh", "cell={law='yeoh'}"])
def test_override_of_a_swept_key_is_refused(refusal, override):
    error = refusal('[sweep]\n"cell.law" = ["yeoh"]', override)
    assert error.where == "--set"
    assert "must not override cell.law, which the study varies" in error.rule


def test_error_of_the_file_is_not_blamed_on_an_override(refusal):
    assert refusal("[cell]\npoisson = 0.7", "load.factor=2").where == "my.toml"


@pytest.mark.parametrize("bad", ["pillar=1", "pillar=[1]", "layer.lamina=3"])
def test_override_that_is_no_table_is_refused_before_a_key_is_set_below_it(refusal, bad):
    key = bad.partition("=")[0]
    below = "pillar.0.x_um=2" if key == "pillar" else f"{key}.young_Pa=2"
    error = refusal("", bad, below)
    assert (error.where, error.key) == ("--set", key)


def test_override_of_a_pillar_where_there_is_none_is_refused(refusal):
    assert "there are no pillars" in refusal("pillar = []", "pillar.0.x_um=2").rule


def test_long_keys_and_values_are_cut_short_in_the_message(refusal):
    assert len(str(refusal(f'"{"x" * 5000}" = 1'))) < 200
    assert len(str(refusal("", f"pillar.{'9' * 5000}.x_um=1"))) < 250
    assert len(str(refusal(f'cell.law = "{"x" * 5000}"'))) < 300


def test_override_that_repairs_the_file_is_taken(study):
    assert study("[cell]\npoisson = 0.7", "cell.poisson=0.3").cases[0].scene.cell.poisson == 0.3


def test_override_that_clashes_with_one_case_names_both(refusal):
    error = refusal('[cell]\nshape = "full"\n[sweep]\n"cell.shape" = ["full", "half"]', "cell.centre_x_um=1")
    assert error.where == "--set, case 'half'"


# Files


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        (b"[cell\nlaw = 1", "is no valid TOML: Expected ']'"),
        (b"[cell]\npoisson = 0.3\npoisson = 0.4\n", "(at line 3, column 14)"),
        (b"[cell]\nlaw = yeoh", "(at line 2, column 7)"),
        (b"a = 1" + b"0" * 5000, "is no valid TOML"),
        (b"[cell]\n# \xb5m", "must be UTF-8 text, and is not (at line 2)"),
        (b"a = " + b"[" * 5000, "must not nest lists and tables more than 20 deep"),
        (b"title = " + b"{a=" * 30 + b"1" + b"}" * 30, "must not nest lists and tables more than 20 deep"),
        (b".".join([b"a"] * 500) + b" = 1", "must not nest lists and tables more than 20 deep"),
        (b"[load]\nfactor = 0x" + b"f" * 5000, "must be a number within the range of a double"),
        (b'[sweep]\n"load.factor" = [0x' + b"f" * 5000 + b"]", "must be a number within the range of a double"),
        (b"unknown = [{a = 0x" + b"f" * 5000 + b"}]", "must be a number within the range of a double"),
        (b"#" * 1_000_001, "must be at most 1,000,000 bytes long"),
    ],
)
def test_file_that_is_no_toml_is_refused_with_its_line(tmp_path, monkeypatch, content, rule):
    monkeypatch.chdir(tmp_path)
    Path("bad.toml").write_bytes(content)
    with pytest.raises(InputError) as caught:
        load_study("bad.toml")
    assert caught.value.where == "bad.toml"
    assert rule in caught.value.rule


@pytest.mark.parametrize("key", ["a.", "a . ", '"a b".', "'a'."])
@pytest.mark.parametrize("start", ["", "[", "x = {", "[cell]\n"])
def test_key_of_many_parts_never_reaches_the_parser(study, monkeypatch, start, key):
    """Whose memory goes with the square of their number: 200 KB would take tens of gigabytes."""
    monkeypatch.setattr(toml_file.tomllib, "loads", lambda text: pytest.fail("parsed"))
    with pytest.raises(InputError, match="must not nest"):
        study(start + key * 60 + "b = 1")


def test_many_words_with_dots_are_no_key(study):
    words = ". ".join(["# one. two"] * 100) + "\n" + "# " + "3.14 " * 200 + "\n"
    assert study(words + "[output]\ntimes_s = [" + ", ".join(f"{i}.5" for i in range(1, 200)) + "]").cases


def test_message_is_one_short_line_whatever_the_names_and_values_hold():
    error = InputError("a\nb\x1b[31m.toml", "key\u2028", "rule\r", ["\n" * 5000], "hint\x00" * 5000)
    assert str(error).isprintable()
    assert len(str(error)) < 1500
    assert str(error).startswith(r"a\nb\x1b[31m.toml: key\u2028: rule\r; got ['\n\n")


def test_value_of_a_case_that_would_fill_the_screen_is_cut(refusal):
    assert len(str(refusal("[[case]]\nname = [" + "0, " * 20_000 + "]"))) < 300


@pytest.mark.parametrize(
    ("path", "rule"),
    [
        ("missing.toml", "there is no such file"),
        ("folder.toml", "must be a TOML file, and is a folder"),
        ("pipe.toml", "must be a TOML file, and is a device or pipe"),
        ("plain.toml/x.toml", "cannot be read (Not a directory)"),
        ("x" * 300 + ".toml", "cannot be read (File name too long)"),
        ("a\0b.toml", "cannot be read (null byte in its name)"),
    ],
)
def test_path_that_is_no_file_is_refused_as_typed(tmp_path, monkeypatch, path, rule):
    monkeypatch.chdir(tmp_path)
    Path("folder.toml").mkdir()
    Path("plain.toml").touch()
    os.mkfifo("pipe.toml")
    with pytest.raises(InputError) as caught:
        load_study(path)
    assert (caught.value.where, caught.value.rule) == (path, rule)


def test_file_that_may_not_be_read_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.toml"
    path.touch()

    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("builtins.open", refuse)  # a mode of 000 does not stop root
    with pytest.raises(InputError, match=r"cannot be read \(Permission denied\)"):
        load_study(path)


def test_file_whose_name_cannot_name_a_folder_is_refused(refusal):
    error = refusal("", name="-a.toml")
    assert "the file's name without its ending must not be empty or begin with a dot, dash" in error.rule
    assert error.got == "-a"
