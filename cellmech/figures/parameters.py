"""Names of the parameters that studies vary, and their values in a scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cellmech.scene.scene import Scene
from cellmech.scene.variants import value_text


@dataclass(frozen=True)
class Parameter:
    """A scene key as figures name it: its key among the paper's numbers ("" : none), symbol, meaning and unit."""

    paper_key: str
    symbol: str
    meaning: str
    unit: str

    @property
    def axis_label(self) -> str:
        """For an axis."""
        return f"{self.meaning}  {self.symbol}".strip() + f"  [{self.unit or '–'}]"

    def setting(self, value: Any) -> str:
        """Such as "E_l = 1000 Pa"."""
        return f"{self.symbol or self.meaning} = {value_text(value)} {self.unit}".rstrip()


PARAMETERS: Mapping[str, Parameter] = {
    "layer.nucleoplasm.young_Pa": Parameter("young_np", "$E_{np}$", "Young's modulus of the nucleoplasm", "Pa"),
    "layer.lamina.young_Pa": Parameter("young_l", "$E_l$", "Young's modulus of the lamina", "Pa"),
    "layer.nucleoplasm.fluid_fraction": Parameter("c_f_np", "$c_{f,np}$", "fluid fraction of the nucleoplasm", ""),
    "layer.lamina.fluid_fraction": Parameter("c_f_l", "$c_{f,l}$", "fluid fraction of the lamina", ""),
}


UNITS = {  # by the ending of a key, the longer ones first
    "_Pa_per_um": "Pa/µm",
    "_uJ_m2": "µJ/m²",
    "_kg_m3": "kg/m³",
    "_m_s2": "m/s²",
    "_Pa_s": "Pa s",
    "_deg": "°",
    "_um": "µm",
    "_Pa": "Pa",
    "_s": "s",
}
WORDS = {"young": "Young's modulus", "poisson": "Poisson's ratio"}


def parameter(key: str) -> Parameter:
    """The parameter of a scene key; one that has no symbol is called by the words of its key."""
    ending = next((ending for ending in UNITS if key.endswith(ending)), "")
    *path, name = key.removesuffix(ending).split(".")
    name = WORDS.get(name, name)
    words = f"{name} of the {path[1]}" if path[:1] == ["layer"] else " ".join([*path, name])
    return PARAMETERS.get(key, Parameter("", "", words.replace("_", " "), UNITS.get(ending, "")))


def value_at(scene: Scene, key: str) -> Any:
    """A scene's value at a dotted key; None where the scene has no such part."""
    value: Any = scene
    for part in key.split("."):
        if isinstance(value, tuple):
            value = value[int(part)] if int(part) < len(value) else None
        else:
            value = getattr(value, part, None)
    return value
