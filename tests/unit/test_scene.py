"""A scene: Table 1, every rule with its message, where the cell starts, out to TOML and back."""

import math
import subprocess
import sys
import tomllib

import pytest
from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from cellmech.errors import InputError
from cellmech.scene.driver_parts import Load
from cellmech.scene.files import read_scene, scene_hash, scene_to_toml
from cellmech.scene.parts import LAYER_NAMES, Cell
from cellmech.scene.placement import Placement, overlaps, placement, rest_beside
from cellmech.scene.scene import Scene
from cellmech.scene.substrate_parts import Pillar
from cellmech.scene.value_types import Number

FILE = "my/scene.toml"


def scene_of(text: str) -> Scene:
    return read_scene(tomllib.loads(text), FILE)


def refusal(text: str) -> InputError:
    with pytest.raises(InputError) as caught:
        scene_of(text)
    assert str(caught.value).startswith(f"{FILE}: ")
    assert "\n" not in str(caught.value)
    return caught.value


# Table 1 and what follows from it


@pytest.mark.parametrize(
    ("text", "order", "size", "thin"),
    [
        ("", 3, 2.4, 1),
        ("mesh.order = 2", 2, 0.6, 2),
        ("mesh = {order = 1, size_um = 1.0}", 1, 1.0, 2),
        ("mesh = {order = 3, thin_layers = 2}", 3, 2.4, 2),
        ("cell.poisson = 0.46", 2, 0.6, 2),
        ("cell.poisson = 0.46\nmesh.size_um = 1.0", 2, 1.0, 2),
        ("cell.poisson = 0.46\nmesh.order = 3", 3, 2.4, 1),
        ('cell.poisson = 0.46\nmesh.pressure = "none"', 3, 2.4, 1),
        ('mesh.pressure = "mixed"', 2, 0.6, 2),
        ("layer.lamina.poisson = 0.46", 2, 0.6, 2),
        ("layer.lamina.fluid_fraction = 1.0", 2, 0.6, 2),
    ],
)
def test_elements_are_of_third_order_unless_that_would_not_do(text, order, size, thin):
    mesh = scene_of(text).mesh
    assert (mesh.order, mesh.size_um, mesh.thin_layers) == (order, size, thin)


@pytest.mark.parametrize(
    ("text", "history"),
    [
        ("", False),
        ("time.end_s = 10520", True),  # 20 relaxation times of 26.4 s after the ramp: 10,527 s
        ("time.end_s = 10535", False),
        ("output.times_s = [9000.0]", True),
        ("output.times_s = [12000.0]", False),
        ("cell.inertia = true", True),
        ("layer.lamina.fluid_fraction = 1.0", True),
    ],
)
def test_automatic_history_is_left_out_where_the_fluid_has_come_to_rest(text, history):
    scene = scene_of(f'time.history = "auto"\n{text}')
    assert scene.time.history is history
    assert scene_of(scene_to_toml(scene)) == scene


def test_defaults_are_table_1():
    scene = scene_of("")
    assert scene == Scene()
    layers = [scene.layer_of(name) for name in LAYER_NAMES]
    assert LAYER_NAMES == ("membrane", "cytosol", "lamina", "nucleoplasm")
    assert [layer.young_Pa for layer in layers] == [100, 10, 1000, 10]
    assert [layer.outer_radius_um for layer in layers] == [10, 9.5, 5, 4.9]
    assert [layer.fluid_fraction for layer in layers] == [0.5] * 4
    assert (scene.cell.density_kg_m3, scene.cell.poisson, scene.cell.law) == (1000, 0.45, "neo-hookean")
    assert (scene.cell.fluid_lambda_Pa_s, scene.cell.fluid_mu_Pa_s) == (1000, 5e-3)
    assert scene.pillar == (Pillar(x_um=0, y_um=-10, half_width_um=10, height_um=9.5, exponent=4),)
    assert scene.flat is not None
    assert scene.flat.y_um == -10
    assert (scene.load.gravity_m_s2, scene.load.half_ramp_s, scene.ramp_end_s) == (9.81, 5000, 10000)
    assert (scene.contact.penalty_Pa_per_um, scene.time.end_s, scene.mesh.order) == (50, 18000, 3)


def test_derived_radii_are_the_layers_boundaries():
    scene = scene_of("layer.cytosol.outer_radius_um = 9")
    assert (scene.radius_um, scene.nucleus_radius_um) == (10, 5)
    assert [scene.inner_radius_um(name) for name in LAYER_NAMES] == [9, 5, 4.9, 0]
    assert [scene.outer_radius_um(name) for name in LAYER_NAMES] == [10, 9, 5, 4.9]


def test_layer_takes_the_cells_law_and_poisson_unless_it_has_its_own():
    scene = scene_of('cell = {law = "yeoh", poisson = 0.3}\nlayer.lamina = {law = "saint-venant", poisson = 0.0}')
    assert [scene.layer_law(name) for name in LAYER_NAMES] == ["yeoh", "yeoh", "saint-venant", "yeoh"]
    assert [scene.layer_poisson(name) for name in LAYER_NAMES] == [0.3, 0.3, 0.0, 0.3]
    assert scene.laws() == ("yeoh", "saint-venant")
    assert scene.layer.lamina.young_Pa == 1000


def test_pillars_and_flat_can_be_left_out_and_a_pillars_missing_keys_are_table_1s():
    assert scene_of("pillar = []").pillar == ()
    assert scene_of("flat = false").flat is None
    assert scene_of("[[pillar]]\nheight_um = 3").pillar == (Pillar(height_um=3.0),)


def test_integers_are_taken_for_numbers():
    young = scene_of("layer.lamina.young_Pa = 7").layer.lamina.young_Pa
    assert (young, type(young)) == (7.0, float)


def test_scene_is_immutable_and_keeps_the_rules_without_a_file():
    with pytest.raises(ValidationError, match="frozen"):
        Scene().cell.law = "yeoh"
    with pytest.raises(ValidationError, match="must be 0 µm for a half cell"):
        Scene(cell=Cell(centre_x_um=1.0))
    assert not Scene(load=Load(factor=0.0)).has_weight


def test_scene_layer_loads_neither_numpy_nor_dolfinx():
    heavy = "numpy", "dolfinx", "gmsh", "mpi4py"
    code = f"import sys, cellmech.scene.studies; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# Rules of one key

BAD_VALUES = [
    # file, key, part of the rule, part of what was got
    ("schema = 2", "schema", "must be 1", "2"),
    ("title = 3", "title", "must be one line of text", "3"),
    ('title = "a\\nb"', "title", "must be one line of text", "'a\\nb'"),
    ("cell = 3", "cell", "must be a table", "3"),
    ("layer.lamina = 3", "layer.lamina", "must be a table", "3"),
    ("load = [1]", "load", "must be a table", "[1]"),
    ('cell.shape = "round"', "cell.shape", "must be one of half, full", "'round'"),
    ('cell.law = "hooke"', "cell.law", "must be one of saint-venant, neo-hookean, mooney-rivlin, yeoh", "'hooke'"),
    ("cell.law = 1", "cell.law", "must be one of saint-venant", "1"),
    ('layer.lamina.law = "yeo"', "layer.lamina.law", "must be one of saint-venant", "'yeo'"),
    ('cell.yeoh_reference = "x"', "cell.yeoh_reference", "must be one of stress-free, printed", "'x'"),
    ('cell.lame_lambda = "x"', "cell.lame_lambda", "must be one of standard, printed", "'x'"),
    ('cell.layers = "x"', "cell.layers", "must be one of conforming, smeared", "'x'"),
    ('contact.form = "x"', "contact.form", "must be one of surface, conservative, volume, volume-printed", "'x'"),
    ("cell.inertia = 1", "cell.inertia", "must be true or false", "1"),
    ('cell.inertia = "yes"', "cell.inertia", "must be true or false", "'yes'"),
    ("cell.poisson = 0.5", "cell.poisson", "must be < 0.5: the laws have no incompressible limit here", "0.5"),
    ("cell.poisson = 0.49999", "cell.poisson", "<= 0.4999", "0.49999"),
    ("cell.poisson = -1", "cell.poisson", "> -1", "-1"),
    ("layer.cytosol.poisson = 0.6", "layer.cytosol.poisson", "must be < 0.5", "0.6"),
    ("cell.density_kg_m3 = -1", "cell.density_kg_m3", ">= 0 and <= 1e+06 kg/m3", "-1"),
    ("cell.fluid_lambda_Pa_s = -1", "cell.fluid_lambda_Pa_s", ">= 0 and <= 1e+15 Pa s", "-1"),
    ("cell.fluid_mu_Pa_s = -1", "cell.fluid_mu_Pa_s", ">= 0 and <= 1e+15 Pa s", "-1"),
    ("cell.beta_over_mu = -1", "cell.beta_over_mu", ">= 0", "-1"),
    ("layer.lamina.young_Pa = -1000", "layer.lamina.young_Pa", "> 0 and <= 1e+12 Pa", "-1000"),
    ("layer.membrane.young_Pa = 0", "layer.membrane.young_Pa", "> 0 and <= 1e+12 Pa", "0"),
    (
        'layer.membrane.young_Pa = "10"',
        "layer.membrane.young_Pa",
        "must be a finite number",
        "'10'. Write 10.0, without",
    ),
    ("layer.membrane.young_Pa = true", "layer.membrane.young_Pa", "must be a finite number", "True"),
    ("layer.membrane.young_Pa = [1]", "layer.membrane.young_Pa", "must be a finite number", "[1]"),
    ("layer.membrane.young_Pa = 2020-01-01", "layer.membrane.young_Pa", "must be a finite number", "datetime.date("),
    (f"layer.membrane.young_Pa = 1{'0' * 400}", "layer.membrane.young_Pa", "must be a finite number", "'10000"),
    ("layer.lamina.fluid_fraction = 1.01", "layer.lamina.fluid_fraction", ">= 0 and <= 1 (no unit)", "1.01"),
    ("layer.lamina.fluid_fraction = -0.01", "layer.lamina.fluid_fraction", ">= 0 and <= 1", "-0.01"),
    ("layer.lamina.outer_radius_um = 0", "layer.lamina.outer_radius_um", "> 0 and <= 100000 µm", "0"),
    ("pillar = 3", "pillar", "must be an array of tables", "3"),
    ("[pillar]\nx_um = 0", "pillar", "must be an array of tables", "{'x_um': 0}. Write [[pillar]]"),
    ("[[pillar]]\nhalf_width_um = 0", "pillar.0.half_width_um", "> 0 and <= 100000 µm", "0"),
    ("[[pillar]]\n[[pillar]]\nheight_um = -1", "pillar.1.height_um", "> 0 and <= 100000 µm", "-1"),
    ("[[pillar]]\nexponent = 1", "pillar.0.exponent", ">= 2 and <= 50", "1"),
    ("[[pillar]]\nexponent = 51", "pillar.0.exponent", ">= 2 and <= 50", "51"),
    ("flat = true", "flat", "must be a table, or false", "True"),
    ("flat = -10", "flat", "must be a table, or false", "-10"),
    ('flat.y_um = "low"', "flat.y_um", "must be a finite number", "'low'"),
    ("load.gravity_m_s2 = -9.81", "load.gravity_m_s2", ">= 0 and <= 1e+06 m/s2", "-9.81"),
    ("load.factor = -1", "load.factor", ">= 0", "-1"),
    ("load.half_ramp_s = -1", "load.half_ramp_s", ">= 0 and <= 1e+12 s", "-1"),
    ("contact.penalty_Pa_per_um = 0", "contact.penalty_Pa_per_um", "> 0 and <= 1e+12 Pa/µm", "0"),
    ("contact.smoothing_um = 0", "contact.smoothing_um", "> 0 and <= 100000 µm", "0"),
    ("contact.volume_width_um = -0.1", "contact.volume_width_um", "> 0 and <= 100000 µm", "-0.1"),
    ("time.end_s = 0", "time.end_s", "> 0 and <= 1e+12 s", "0"),
    ("time.rtol = 0", "time.rtol", ">= 1e-10 and <= 0.5", "0"),
    ('time.history = "never"', "time.history", 'must be true, false or "auto"', "'never'"),
    ("time.rtol = 0.6", "time.rtol", ">= 1e-10 and <= 0.5", "0.6"),
    ("mesh.size_um = 0", "mesh.size_um", "> 0 and <= 100000 µm", "0"),
    ("mesh.size_um = 10.5", "mesh.size_um", "the cell's radius, 10 µm", "10.5"),
    ("mesh.size_um = 1e-3", "mesh.size_um", "must be from 0.0085 µm (about 5e+06 triangles)", "0.001"),
    ("mesh.contact_size_um = 2.5", "mesh.contact_size_um", "to mesh.size_um = 2.4 µm", "2.5"),
    ("mesh.contact_size_um = 1e-5", "mesh.contact_size_um", "must be from 0.0001", "1e-05"),
    ("mesh.thin_layers = 0", "mesh.thin_layers", "a whole number from 1 to 8", "0"),
    ("mesh.thin_layers = 1.0", "mesh.thin_layers", "a whole number from 1 to 8", "1.0"),
    ("mesh.order = 4", "mesh.order", "a whole number from 1 to 3", "4"),
    ('mesh = {pressure = "mixed", order = 1}', "mesh.pressure", '"auto" or "none" where mesh.order is 1', "'mixed'"),
    ('mesh = {pressure = "mixed", order = 3}', "mesh.pressure", '"auto" or "none" where mesh.order is 3', "'mixed'"),
    ("mesh.order = true", "mesh.order", "a whole number from 1 to 3", "True"),
    ("output.times_s = 5", "output.times_s", "must be a list of numbers", "5"),
    ("output.times_s = [0]", "output.times_s.0", "> 0 and <= 1e+12 s", "0"),
    ('output.times_s = [1, "2"]', "output.times_s.1", "must be a finite number", "'2'"),
]


@pytest.mark.parametrize(("text", "key", "rule", "got"), BAD_VALUES, ids=[f"{b[1]}-{b[3][:12]}" for b in BAD_VALUES])
def test_bad_value_is_refused_with_file_key_rule_and_value(text, key, rule, got):
    error = refusal(text)
    assert error.key == key
    assert f"{FILE}: {key}: " in str(error)
    assert rule in error.rule
    assert f"; got {got}" in str(error)


@pytest.mark.parametrize("value", ["5e-324", "9e-31"])
@pytest.mark.parametrize("key", ["layer.cytosol.young_Pa", "cell.poisson", "cell.gap_um", "load.factor"])
def test_numbers_that_would_overflow_a_quotient_are_refused(key, value):
    error = refusal(f"{key} = {value}")
    assert error.key == key
    assert "not nearer to 0 than 1e-30" in error.rule
    assert f"got {value}" in str(error)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
@pytest.mark.parametrize(
    "key",
    ["cell.gap_um", "cell.poisson", "layer.lamina.young_Pa", "layer.lamina.fluid_fraction", "flat.y_um", "load.factor",
     "time.end_s", "cell.beta_over_mu", "contact.penalty_Pa_per_um"],
)  # fmt: skip
def test_numbers_that_are_not_finite_are_refused(key, value):
    error = refusal(f"{key} = {value}")
    assert error.key == key
    assert f"got {value}" in str(error)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_number_without_bounds_must_still_be_finite(value):
    with pytest.raises(PydanticCustomError, match="must be a finite number µm"):
        Number("µm").check(value)


ODD_BUT_GOOD = [
    "cell.poisson = 0",
    "cell.poisson = -0.2",
    "cell.poisson = 0.4999",
    "layer.lamina.fluid_fraction = 0\nlayer.nucleoplasm.fluid_fraction = 1",
    "cell.medium_density_kg_m3 = 1000",
    "load.factor = 0",
    "load.half_ramp_s = 0",
    "cell.fluid_mu_Pa_s = 0",
    "time.rtol = 1e-10",
    "[[pillar]]\nexponent = 2.5",
    "mesh = {size_um = 10, contact_size_um = 0.01, thin_layers = 8, order = 1}",
    "pillar = []",
    'cell = {shape = "full", centre_x_um = -3}',
    'cell = {layers = "smeared", smear_um = 0.8}',
    "output.times_s = [1, 2.5, 18000]",
    "cell.gap_um = 3",
]


@pytest.mark.parametrize("text", ODD_BUT_GOOD)
def test_value_on_the_edge_of_its_range_is_taken_and_survives_a_round_trip(text):
    scene = scene_of(text)
    assert scene != Scene()
    assert scene_of(scene_to_toml(scene)) == scene


# Unknown keys


@pytest.mark.parametrize(
    ("text", "key", "suggestion"),
    [
        ('[cell]\nlw = "yeoh"', "cell.lw", "Did you mean cell.law?"),
        ("[cell]\ndensity = 1", "cell.density", "Did you mean cell.density_kg_m3?"),
        ("[cel]\ngap_um = 1", "cel", "Did you mean cell?"),
        ("[layer.nucleus]\nyoung_Pa = 1", "layer.nucleus", "Did you mean layer.nucleoplasm?"),
        ("[layer.lamina]\nYoung_pa = 1", "layer.lamina.Young_pa", "Did you mean layer.lamina.young_Pa?"),
        ("[[pillar]]\n[[pillar]]\nheigth_um = 1", "pillar.1.heigth_um", "Did you mean pillar.1.height_um?"),
        ("[mesh]\nsize = 1", "mesh.size", "Did you mean mesh.size_um?"),
        ("schema_ = 1", "schema_", "Did you mean schema?"),
        ("[sweeep]", "sweeep", "Did you mean sweep?"),
        (
            "half_ramp_s = 1",
            "half_ramp_s",
            "Did you mean load.half_ramp_s or adhesion.half_ramp_s or actin.0.half_ramp_s?",
        ),
        ('"cell.law" = "yeoh"', "cell.law", "The dot must be outside the quotes: [cell] law"),
    ],
)
def test_unknown_key_is_refused_and_the_nearest_known_one_named(text, key, suggestion):
    error = refusal(text)
    assert (error.key, error.rule) == (key, "unknown key")
    assert suggestion in error.hint


def test_unknown_key_like_no_other_gets_the_keys_of_its_table():
    assert refusal("[load]\nqqqq = 1").hint == "[load] has gravity_m_s2, factor, start_s, half_ramp_s."
    assert refusal("[[pillar]]\n[[pillar]]\nz = 1").hint.startswith("[pillar.1] has x_um, y_um, ")
    assert refusal("qqqq = 1").hint == ""


def test_misspelt_key_is_reported_before_the_values_it_may_explain():
    assert refusal("[cell]\npoisson = 0.7\n[mesh]\nsice_um = 1").key == "mesh.sice_um"


# Rules of several keys


@pytest.mark.parametrize(
    ("inner", "radius", "outer", "limit"),
    [("nucleoplasm", 5.0, "lamina", 5), ("lamina", 9.6, "cytosol", 9.5), ("cytosol", 11.0, "membrane", 10)],
)
def test_layer_radii_must_grow_outwards(inner, radius, outer, limit):
    error = refusal(f"layer.{inner}.outer_radius_um = {radius}")
    assert (error.key, error.got) == (f"layer.{inner}.outer_radius_um", radius)
    assert error.rule == f"must be less than layer.{outer}.outer_radius_um = {limit} µm"
    assert "nucleoplasm < lamina < cytosol < membrane" in error.hint


def test_layer_thinner_than_a_ten_thousandth_of_the_radius_is_refused():
    error = refusal("layer.nucleoplasm.outer_radius_um = 4.9995")
    assert "must leave layer.lamina a thickness of 0.001 µm" in error.rule
    assert scene_of("layer.nucleoplasm.outer_radius_um = 4.998").nucleus_radius_um == 5


def test_disc_inside_thinner_than_a_ten_thousandth_of_the_radius_is_refused():
    """Gmsh 4.8 ended the whole process over 5e-9 µm, with all other cases of the study."""
    error = refusal("layer.nucleoplasm.outer_radius_um = 4.9e-9")
    assert (error.key, error.got) == ("layer.nucleoplasm.outer_radius_um", 4.9e-9)
    assert error.rule == "is in µm, and must be >= 0.001 µm, 0.0001 of the cell's radius"
    assert scene_of("layer.nucleoplasm.outer_radius_um = 1e-3")


@pytest.mark.parametrize(
    ("text", "key", "rule", "got"),
    [
        ("cell.smear_um = 0.8", "cell.smear_um", 'belongs to cell.layers = "smeared" only', "got 0.8"),
        ("cell.constants = {i1_limit = 0.1}", "cell.constants.i1_limit", "the law neo-hookean, which has none", "0.1"),
        (
            'cell = {law = "gent"}\nlayer.lamina.constants = {i1_limit = 0}',
            "layer.lamina.constants.i1_limit",
            "must be > 0 and <= 1e+06",
            "got 0",
        ),
        ('cell.fade = "inside"', "cell.fade", 'belongs to cell.layers = "smeared" only', "got 'inside'"),
        ('cell.layers = "smeared"', "cell.smear_um", "must be set, > 0 µm", "when cell.layers is smeared"),
        ('cell = {layers = "smeared", smear_um = 0}', "cell.smear_um", "> 0 and <= 100000 µm", "got 0"),
        (
            'cell = {layers = "smeared", smear_um = 11}',
            "cell.smear_um",
            "must be <= the cell's radius, 10 µm",
            "got 11",
        ),
        (
            'cell = {layers = "smeared", smear_um = 1}\nlayer.lamina.law = "yeoh"',
            "cell.law",
            "must be the same in every layer",
            "got 'neo-hookean, yeoh'",
        ),
        (
            'cell = {layers = "smeared", smear_um = 1}\nlayer.lamina.poisson = 0.3',
            "cell.poisson",
            "must be the same in every layer",
            "got '0.3, 0.45'",
        ),
        ("cell.medium_density_kg_m3 = 1001", "cell.density_kg_m3", "= 1001 kg/m3 without [adhesion]", "got 1000.0"),
        ("load.factor = -1\nadhesion.work_uJ_m2 = 0", "load.factor", ">= 0 without [adhesion]", "got -1.0"),
        ("load.start_s = 5", "load.start_s", "must be 0 s where only the weight pulls", "got 5.0"),
        ("cell = {inertia = true, density_kg_m3 = 0}", "cell.density_kg_m3", "must be > 0 kg/m3", "got 0.0"),
        ("cell.centre_x_um = 1", "cell.centre_x_um", "must be 0 µm for a half cell", "got 1.0"),
        ("output.times_s = [2, 1]", "output.times_s.1", "must rise", "got 1.0"),
        ("output.times_s = [2, 2]", "output.times_s.1", "must rise", "got 2.0"),
        ("output.times_s = [1, 18001]", "output.times_s.1", "end by time.end_s = 18000 s", "got 18001.0"),
        ("output.times_s = [1, 1.000001]", "output.times_s.1", "at least 1e-09 of time.end_s apart", "got 1.000001"),
        ("output.times_s = [17999.999999]", "output.times_s.0", "at least 1e-09 of time.end_s apart", "got 17999.99"),
    ],
)
def test_keys_that_contradict_each_other_are_refused(text, key, rule, got):
    error = refusal(text)
    assert error.key == key
    assert rule in error.rule
    assert got in str(error)


def test_smeared_layers_take_one_law_written_in_every_layer():
    laws = "".join(f'layer.{name}.law = "yeoh"\n' for name in LAYER_NAMES)
    assert scene_of('cell = {layers = "smeared", smear_um = 0.8}\n' + laws).laws() == ("yeoh",)


@pytest.mark.parametrize(
    ("text", "obstacle", "depth"),
    [
        ("cell.gap_um = -0.5", "pillar.0", "0.5 µm"),
        ("cell.gap_um = -0.25\npillar = []", "the flat", "0.25 µm"),
        ("cell.gap_um = -0.5\n[[pillar]]\ny_um = -40\n[[pillar]]\nx_um = 12", "pillar.1", "0.5 µm"),
    ],
)
def test_negative_gap_names_the_obstacle_and_the_overlap(text, obstacle, depth):
    error = refusal(text)
    assert error.key == "cell.gap_um"
    assert f"must be >= 0 µm: the cell would overlap {obstacle} by {depth}" in error.rule
    assert f"got {error.got}" in str(error)
    assert isinstance(error.got, float)
    assert error.got < 0


def test_negative_gap_over_nothing_is_refused_too():
    error = refusal("cell.gap_um = -0.5\npillar = []\nflat = false\nload.factor = 0")
    assert (error.key, error.rule, error.got) == ("cell.gap_um", "must be >= 0 µm", -0.5)


def pillars_at(*places: float, half_width: float = 2.0) -> str:
    return "".join(f"[[pillar]]\nx_um = {x}\nhalf_width_um = {half_width}\n" for x in places)


@pytest.mark.parametrize(
    ("text", "key", "rule", "got"),
    [
        ('cell.shape = "full"\n' + pillars_at(0, 3), "pillar.1.x_um", "must not overlap pillar.0", 3.0),
        ('cell.shape = "full"\n' + pillars_at(3, 20, 0), "pillar.2.x_um", "must not overlap pillar.0", 0.0),
        ('cell.shape = "full"\n' + pillars_at(1, 1), "pillar.1.x_um", "must not overlap pillar.0", 1.0),
        ("[[pillar]]\n[[pillar]]\nexponent = 6", "pillar.1.x_um", "must not overlap pillar.0", 0.0),
        (pillars_at(20, 23), "pillar.1.x_um", "must not overlap pillar.0", 23.0),
        (pillars_at(1), "pillar.0.x_um", "must not overlap its own mirror image at x = 0", 1.0),
        (pillars_at(-1.99), "pillar.0.x_um", "must not overlap its own mirror image at x = 0", -1.99),
        (pillars_at(5, -6), "pillar.1.x_um", "must not overlap the mirror image of pillar.0 at x = 0", -6.0),
    ],
)
def test_pillars_that_overlap_are_refused_naming_both(text, key, rule, got):
    error = refusal(text)
    assert (error.key, error.got) == (key, got)
    assert rule in error.rule
    assert "Their middles must be 4 µm apart" in error.hint or "20 µm apart" in error.hint


@pytest.mark.parametrize(
    "text",
    [
        'cell.shape = "full"\n' + pillars_at(-2, 2),
        'cell.shape = "full"\n' + pillars_at(0.1, 0.3, half_width=0.1),  # their edges meet but for rounding
        'cell.shape = "full"\n' + pillars_at(1, 30),  # would overlap its mirror image in a half cell
        pillars_at(2),
        pillars_at(0, 4, -8),
        # boxes overlap by 2 µm either way, the rounded corners do not
        'cell.shape = "full"\n[[pillar]]\nexponent = 2\n[[pillar]]\nexponent = 2\nx_um = 18\ny_um = 7',
    ],
)
def test_pillars_side_by_side_are_taken(text):
    assert len(scene_of(text).pillar) >= 1


def test_overlap_of_pillars_follows_their_curved_outline():
    # circles of radius 10 (exponent 2) centred (18, dy) apart meet at dy = sqrt(20^2 - 18^2) = 8.7178
    circle = "[[pillar]]\nheight_um = 10\nexponent = 2\n"
    text = f'cell.shape = "full"\n{circle}{circle}x_um = 18\n'
    assert len(scene_of(text + "y_um = -1.282").pillar) == 2  # 8.718 higher
    assert refusal(text + "y_um = -1.283").key == "pillar.1.x_um"


def test_cell_over_nothing_is_refused_unless_it_has_no_weight_or_may_fall():
    nothing = "flat = false\n[[pillar]]\nx_um = 30\n"
    error = refusal(nothing)
    assert error.key == "pillar"
    assert "below the cell, between x = -10 and 10 µm" in error.rule
    assert "1 pillar(s), none of them there" in str(error)
    assert scene_of("load.factor = 0\n" + nothing).pillar[0].x_um == 30
    assert scene_of("cell.medium_density_kg_m3 = 1000\n" + nothing).flat is None
    assert scene_of("cell.inertia = true\n" + nothing).flat is None


# Where the cell starts


def test_placement_of_table_1_just_touches_the_pillar():
    place = placement(Scene())
    assert place == ((0.0, 9.5), (((0.0, -0.5), 0, (0.0, 1.0)),), (0.0,))


def test_placement_gap_lifts_the_cell_and_leaves_the_touch():
    place = placement(scene_of("cell.gap_um = 2"))
    assert (place.centre, place.touch) == ((0.0, 11.5), placement(Scene()).touch)


def test_placement_on_the_flat_and_over_nothing():
    assert placement(scene_of("pillar = []")) == ((0.0, 0.0), (((0.0, -10.0), "flat", (0.0, 1.0)),), (0.0,))
    nothing = scene_of("pillar = []\nflat = false\nload.factor = 0\ncell.gap_um = 1.5")
    assert placement(nothing) == ((0.0, 11.5), (), (0.0,))


@pytest.mark.parametrize("offset", [0.0, 1e-9, 3.0, -7.5, 14.9, -19.999])
def test_placement_on_a_round_pillar_is_that_of_two_circles(offset):
    text = f'flat = false\ncell = {{shape = "full", centre_x_um = {offset}}}\n[[pillar]]\nheight_um = 10\nexponent = 2'
    place = placement(scene_of(text))
    level = -10 + math.sqrt(400 - offset**2)
    (touch,) = place.touch
    assert place.centre[1] == pytest.approx(level, rel=0, abs=1e-11)
    # the touch is half-way between the two centres; its place is found less sharply than the height
    assert touch.at == pytest.approx((offset / 2, (level - 10) / 2), abs=1e-7)
    assert touch.normal == pytest.approx((offset / 20, (level + 10) / 20), abs=1e-8)


PLACED = {
    "two pillars of a half cell": pillars_at(6, 12),
    "two pillars, off the middle": 'cell = {shape = "full", centre_x_um = 0.7}\n' + pillars_at(-6, 6, 12),
    "half-width 1": "[[pillar]]\nhalf_width_um = 1",
    "half-width 1, off its edge": 'cell = {shape = "full", centre_x_um = 4}\n[[pillar]]\nhalf_width_um = 1',
    "sharp exponent": 'cell = {shape = "full", centre_x_um = 14}\n[[pillar]]\nexponent = 50',
    "off Table 1's edge": 'cell = {shape = "full", centre_x_um = 13}',
    "grazing": 'flat = false\ncell = {shape = "full", centre_x_um = 19.99}',
    "real exponent": """load.factor = 0
cell = {shape = "full", centre_x_um = 8}
pillar = [{exponent = 2.7, half_width_um = 3}]""",
    "large cell, small pillar": "layer.membrane.outer_radius_um = 500\n[[pillar]]\nhalf_width_um = 0.5\nx_um = 40",
}


@pytest.mark.parametrize("text", PLACED.values(), ids=PLACED)
def test_placement_touches_and_does_not_overlap(text):
    scene = scene_of(text)
    place = placement(scene)
    radius = scene.radius_um
    obstacles = [(p.x_um * side, p) for p in scene.pillar for side in ((1, -1) if scene.cell.shape == "half" else (1,))]

    def top(x: float) -> float:
        tops = [-math.inf if scene.flat is None else scene.flat.y_um]
        for middle, p in obstacles:
            xi = abs(x - middle) / p.half_width_um
            if xi <= 1:
                tops.append(p.y_um + p.height_um * (1 - xi**p.exponent) ** (1 / p.exponent))
        return max(tops)

    def clearance(x: float) -> float:
        return place.centre[1] - math.sqrt(radius**2 - (x - place.centre[0]) ** 2) - top(x)

    n = 20_000
    xs = [place.centre[0] + radius * (2 * i / n - 1) for i in range(n + 1)]
    assert min(map(clearance, xs)) > -1e-11
    assert place.touch
    for touch in place.touch:
        assert touch.at[1] == pytest.approx(top(touch.at[0]), abs=1e-9)
        assert clearance(touch.at[0]) == pytest.approx(0, abs=1e-10)
        foot = tuple(middle - radius * n for middle, n in zip(place.centre, touch.normal, strict=True))
        assert foot == pytest.approx(touch.at, abs=1e-9)


def test_placement_between_two_pillars_touches_both_and_a_half_cell_gives_one_side():
    full = placement(scene_of('cell.shape = "full"\n' + pillars_at(-6, 6)))
    assert [touch.obstacle for touch in full.touch] == [0, 1]
    assert full.touch[0].at[0] == pytest.approx(-full.touch[1].at[0], abs=1e-12)
    half = placement(scene_of(pillars_at(-6)))
    assert [touch.obstacle for touch in half.touch] == [0]
    assert half.touch[0].at == full.touch[1].at
    assert half.centre == full.centre


@pytest.mark.parametrize(("right", "touched"), [(6 + 1e-10, [0, 1]), (6.001, [0])])
def test_placement_counts_touches_that_differ_by_rounding_only_as_one(right, touched):
    place = placement(
        scene_of('cell.shape = "full"\ncell.inertia = true\n' + pillars_at(-6, right))
    )  # it does not slide
    assert [touch.obstacle for touch in place.touch] == touched


@pytest.mark.parametrize(("level", "buried"), [(-9.99, False), (-0.5, False), (0.5, False), (9.4, False), (9.6, True)])
def test_flat_may_not_overlap_a_pillar_within_reach(level, buried):
    """The pillar stands on -10 and is 9.5 high; where the flat is as high, its force would be counted twice."""
    text = f"flat.y_um = {level}"
    if buried:
        assert [touch.obstacle for touch in placement(scene_of(text)).touch] == ["flat"]
        return
    error = refusal(text)
    assert (error.key, error.got) == ("flat.y_um", level)
    assert "must be <= -10 µm, the foot of pillar.0" in error.rule


def test_placement_beside_a_pillar_stands_on_the_flat():
    place = placement(scene_of('cell.shape = "full"\n[[pillar]]\nx_um = 20'))
    assert (place.centre[1], [touch.obstacle for touch in place.touch]) == (0.0, ["flat"])


def test_overlaps_gives_the_vertical_travel_to_be_free_of_each_obstacle():
    scene = Scene()
    assert overlaps(scene, Placement((0.0, 9.5), ())) == ()
    assert overlaps(scene, Placement((0.0, 9.5 - 1e-9), ())) == ()
    assert overlaps(scene, Placement((0.0, 9.0), ())) == ((0, 0.5),)
    assert overlaps(scene, Placement((0.0, -1.0), ())) == ((0, 10.5), ("flat", 1.0))


# Out and back


def test_toml_of_a_scene_gives_the_equal_scene():
    scene = scene_of(
        'title = "µ \\"x\\" \\\\"\ncell = {law = "yeoh", gap_um = 0.1, smear_um = 0.3, layers = "smeared"}\n'
        "layer.lamina.young_Pa = 0.1234567890123456789\nlayer.nucleoplasm.poisson = 0.45\nflat = false\n"
        "mesh.contact_size_um = 0.01\noutput.times_s = [1e-3, 12]\n" + pillars_at(0, 1 / 3 + 5)
    )
    text = scene_to_toml(scene)
    assert scene_of(text) == scene
    assert scene_to_toml(scene_of(text)) == text
    assert text.count("[[pillar]]") == 2


def test_toml_of_a_scene_names_every_key_with_a_value():
    data = tomllib.loads(scene_to_toml(Scene()))
    assert set(data) == {
        "schema",
        "title",
        "cell",
        "layer",
        "pillar",
        "flat",
        "load",
        "contact",
        "time",
        "mesh",
        "output",
        "stability",
    }
    assert set(data["cell"]) == set(Cell.model_fields) - {"smear_um", "constants", "radius_um"}
    assert set(data["pillar"][0]) == set(Pillar.model_fields) - {"profile", "width_um"}


def test_hash_ignores_title_and_spelling_but_no_value():
    base = scene_hash(Scene())
    assert scene_hash(scene_of('title = "other"\nlayer.lamina.young_Pa = 1000\nflat.y_um = -10')) == base
    assert scene_hash(scene_of('layer.lamina.law = "neo-hookean"\nlayer.lamina.poisson = 0.45')) == base
    assert scene_hash(scene_of("cell.gap_um = -0.0")) == base
    others = [
        "layer.lamina.young_Pa = 1000.0000000001", 'layer.lamina.law = "yeoh"', "flat = false", "pillar = []",
        "mesh.thin_layers = 3", "output.times_s = [1]", "cell.poisson = 0.44", "load.half_ramp_s = 0",
    ]  # fmt: skip
    hashes = {scene_hash(scene_of(text)) for text in others}
    assert len(hashes | {base}) == len(others) + 1
    assert len(base) == 64


TWINS = [{"x_um": -7.0, "half_width_um": 3.0}, {"x_um": 7.0, "half_width_um": 3.0}]


def twins(left=(), right=(), **cell):
    pillars = [{**TWINS[0], **dict(left)}, {**TWINS[1], **dict(right)}]
    return read_scene({"cell": {"shape": "full", **cell}, "pillar": pillars}, "test")


@pytest.mark.parametrize(
    "scene",
    [
        twins(right={"height_um": 9.499}),
        twins(right={"height_um": 9.4}),
        twins(right={"x_um": 7.000001}),
        twins(right={"exponent": 4.001}),
        twins(centre_x_um=0.3),
        twins(centre_x_um=-1e-7),
    ],
    ids=["nanometre", "tenth", "place", "exponent", "cell aside", "cell hardly aside"],
)
def test_cell_beside_a_second_pillar_starts_where_it_touches_both(scene):
    start = placement(scene)
    assert {touch.obstacle for touch in start.touch} == {0, 1}
    assert start.touch[0].normal[0] * start.touch[1].normal[0] < 0
    assert overlaps(scene, start) == ()
    assert start.centre[0] == scene.cell.centre_x_um + start.slide_um[0] and abs(start.slide_um[0]) < 1.0


def test_cell_slides_into_a_valley_within_half_its_radius_unless_it_falls():
    assert placement(twins(centre_x_um=3.0)).slide_um == pytest.approx((-3.0,), abs=1e-7)
    far = twins(centre_x_um=6.5)
    assert placement(far).centre[0] == 6.5 and placement(far).slide_um == (0.0,)
    assert rest_beside(far) == pytest.approx((-6.5,), abs=1e-7)
    assert placement(twins(right={"height_um": 9.499}, inertia=True)).slide_um == (0.0,)
    assert placement(twins()).slide_um == (0.0,)
