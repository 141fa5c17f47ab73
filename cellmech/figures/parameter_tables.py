"""Tables 1 and 2: the parameters as the program uses them, beside the paper's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from cellmech.figures.parameters import PARAMETERS, value_at
from cellmech.figures.style import LAWS, PAPER
from cellmech.figures.table import NONE, Cell, Document, Table
from cellmech.scene.scene import Scene
from cellmech.scene.studies import Study
from cellmech.scene.variants import value_text

MINUS = " − "  # between two keys whose difference is meant
NOT_SET, OF_A_LAYER = "the cell's", "layer."
PRINTED = (  # symbol, definition, scene key, unit, as printed in Table 1, what differs
    ("r_c", "cell radius", "layer.membrane.outer_radius_um", "µm", "10", ""),
    ("r_m", "membrane radius", "layer.membrane.outer_radius_um", "µm", "10", ""),
    ("t_m", "membrane thickness", "layer.membrane.outer_radius_um − layer.cytosol.outer_radius_um", "µm", "0.5", ""),
    ("r_cs", "cytosol radius", "layer.cytosol.outer_radius_um", "µm", "9.5", ""),
    ("r_n", "nucleus radius", "layer.lamina.outer_radius_um", "µm", "5", ""),
    ("r_l", "lamina radius", "layer.lamina.outer_radius_um", "µm", "5", ""),
    ("t_l", "lamina thickness", "layer.lamina.outer_radius_um − layer.nucleoplasm.outer_radius_um", "µm", "0.1", ""),
    ("r_np", "nucleoplasm radius", "layer.nucleoplasm.outer_radius_um", "µm", "4.9", "called r_cs in print"),
    ("c_f,m", "fluid fraction of the membrane", "layer.membrane.fluid_fraction", "", "0.5", ""),
    ("c_f,cs", "fluid fraction of the cytosol", "layer.cytosol.fluid_fraction", "", "0.5", ""),
    ("c_f,l", "fluid fraction of the lamina", "layer.lamina.fluid_fraction", "", "0.5", ""),
    ("c_f,np", "fluid fraction of the nucleoplasm", "layer.nucleoplasm.fluid_fraction", "", "0.5", ""),
    ("ρ_c", "density of the cell", "cell.density_kg_m3", "kg/m³", "1000", ""),
    ("ν_c", "Poisson's ratio of the cell", "cell.poisson", "", "0.45", ""),
    ("E_m", "Young's modulus of the membrane", "layer.membrane.young_Pa", "Pa", "100", ""),
    ("E_cs", "Young's modulus of the cytosol", "layer.cytosol.young_Pa", "Pa", "10", ""),
    ("E_l", "Young's modulus of the lamina", "layer.lamina.young_Pa", "Pa", "1000", ""),
    ("E_np", "Young's modulus of the nucleoplasm", "layer.nucleoplasm.young_Pa", "Pa", "10", ""),
    ("λ_f", "isotropic viscosity", "cell.fluid_lambda_Pa_s", "Pa·s", "1000", ""),
    ("µ_f", "deviatoric viscosity", "cell.fluid_mu_Pa_s", "Pa·s", "5 × 10⁻³", ""),
    ("g", "gravitational acceleration", "load.gravity_m_s2", "m/s²", "9.81", ""),
    ("T_g", "time constant of the load", "load.half_ramp_s", "s", "5000", ""),
    ("y_flat", "height of the flat substrate", "flat.y_um", "µm", "−10", ""),
    ("x_mp", "x of the micropillar", "pillar.0.x_um", "µm", "0", ""),
    ("y_mp", "y of the micropillar", "pillar.0.y_um", "µm", "−10", ""),
    ("w_mp", "half-width of the micropillar", "pillar.0.half_width_um", "µm", "10", "the text: a width of 20 µm"),
    ("h_mp", "height of the micropillar", "pillar.0.height_um", "µm", "9.5", ""),
    ("µ_ct", "contact penalty", "contact.penalty_Pa_per_um", "Pa/µm", "5 × 10⁷ Pa·s", "read as Pa/m: 50 Pa/µm"),
    ("T_end", "end of the simulation", "time.end_s", "s", "18000", ""),
)
ELSEWHERE = {  # what the paper says of the other inputs
    "cell.gap_um": "the cell's centre is not given",
    "cell.medium_density_kg_m3": "no buoyancy",
    "cell.law": "four laws in Figure 2; not stated for Figures 4 to 6",
    "cell.beta_over_mu": "β = µ/0.4",
    "cell.yeoh_reference": "eq. 20, printed, has stress at rest",
    "cell.lame_lambda": "eq. 17 is damaged in print",
    "cell.inertia": "eq. 30 has it; 10⁻¹⁶ of the elastic forces",
    "cell.layers": "smeared, eqs 1 to 5; width not given",
    "pillar.0.exponent": "4, eq. 26",
    "load.factor": "1",
    "contact.form": "volume force, eq. 27",
    "contact.volume_width_um": "not given",
    "mesh.size_um": "0.3 to 1",
    "mesh.order": "quadratic",
    "time.rtol": "1 %, of the Newton solve",
}


def table1(scene: Scene) -> Document:
    """Table 1 as a scene has it, and the inputs that the paper's table does not list.

    Args:
        scene: the default one is Table 1.
    """
    header = ["symbol", "parameter", "here", "unit", "paper", "remark", "key"]
    rows: list[list[Cell]] = [
        [symbol, name, _value(scene, key), unit or NONE, print_, remark or NONE, key]
        for symbol, name, key, unit, print_, remark in PRINTED
    ]
    listed = {key for row in PRINTED for key in row[2].split(MINUS)}
    others: list[list[Cell]] = [
        [key, _unit(key), _value(scene, key), ELSEWHERE.get(key, NONE)]
        for key in keys(scene)
        if key not in listed and key not in ("schema", "title")
    ]
    tables = [
        Table("", "As printed, and as used", "", header, rows),
        Table("others", "Inputs that the paper's table leaves out", "", ["key", "unit", "here", "paper"], others),
    ]
    text = "What a scene file does not say has these values."
    return Document(f"Table 1: the parameters of the model ({PAPER}, section 3)", text, tables)


def table2(study: Study, paper: Mapping[str, Any]) -> Document:
    """Table 2: what S1, S2 and S3 are.

    Args:
        study: S1, S2, S3.
        paper: the printed parameters by simulation, as `[table3]` of paper_numbers.toml.
    """
    names = {"young_np": "E_np [Pa]", "young_l": "E_l [Pa]", "c_f_np": "c_f,np", "c_f_l": "c_f,l"}
    places = {parameter.paper_key: key for key, parameter in PARAMETERS.items()}
    rows: list[list[Cell]] = []
    for case in study.cases:
        theirs = paper.get(case.name, {})
        values = {name: value_at(case.scene, places[name]) for name in names}
        other = [f"{names[name]} {theirs[name]:g}" for name in names if theirs.get(name, values[name]) != values[name]]
        agreed = ("; ".join(other) or "the same") if theirs else NONE
        end = f"{case.scene.time.end_s:,.0f}"
        rows.append([case.name, LAWS[case.scene.cell.law].label, end, *map(value_text, values.values()), agreed])
    header = ["simulation", "law", "end [s]", *names.values(), "in the paper"]
    text = "All else is Table 1's. The law and the end are stated in the paper's text."
    return Document(
        f"Table 2: the simulations ({PAPER}, section 3.4)", text, [Table("", "Parameters", "", header, rows)]
    )


def keys(scene: Scene) -> list[str]:
    """The dotted keys of all inputs."""
    return list(_leaves(scene.model_dump(by_alias=True), ""))


def _leaves(data: object, start: str) -> Iterator[str]:
    if isinstance(data, Mapping):
        for key, value in data.items():
            yield from _leaves(value, f"{start}.{key}" if start else str(key))
    elif isinstance(data, tuple | list) and data and isinstance(data[0], Mapping):
        for index, value in enumerate(data):
            yield from _leaves(value, f"{start}.{index}")
    else:
        yield start


def _value(scene: Scene, key: str) -> str:
    first, *rest = (value_at(scene, part) for part in key.split(MINUS))
    if rest and isinstance(first, float) and isinstance(rest[0], float):
        first = round(first - rest[0], 9)
    if first is None:
        return NOT_SET if key.startswith(OF_A_LAYER) else NONE
    if first == ():
        return "the end alone" if key == "output.times_s" else NONE
    text = value_text(first)
    return text.replace("-", "−") if isinstance(first, float) else text


def _unit(key: str) -> str:
    """As the key says it."""
    units = {
        "_um": "µm",
        "_Pa": "Pa",
        "_s": "s",
        "_kg_m3": "kg/m³",
        "_m_s2": "m/s²",
        "_Pa_s": "Pa·s",
        "_Pa_per_um": "Pa/µm",
    }
    return next((units[end] for end in sorted(units, key=len, reverse=True) if key.endswith(end)), NONE)
