"""Odd but valid scenes, as a Hypothesis strategy, and how they must end."""

import copy
import json
import math
import re

from hostile import Attempt, dumped
from hypothesis import reject
from hypothesis import strategies as st

from cellmech.errors import InputError
from cellmech.scene import driver_parts, parts, substrate_parts
from cellmech.scene.files import read_scene
from cellmech.scene.keys import put
from cellmech.scene.value_types import TINIEST, Number


def ranges(table, start=""):
    """Dotted key, default and range of the numbers of a table."""
    for name, info in table.model_fields.items():
        for kind in info.metadata:
            if isinstance(kind, Number) and isinstance(info.default, float):
                yield start + name, info.default, kind


RANGES = [
    *ranges(parts.Cell, "cell."),
    *ranges(driver_parts.Load, "load."),
    *ranges(substrate_parts.Contact, "contact."),
    *ranges(parts.Time, "time."),
    *ranges(substrate_parts.Pillar, "pillar.0."),
    *(entry for name in parts.LAYER_NAMES for entry in ranges(getattr(parts, name.title()), f"layer.{name}.")),
]
WORDS = {
    "cell.shape": ["full"],
    "cell.law": ["saint-venant", "mooney-rivlin", "yeoh"],
    "cell.inertia": [True],
    "cell.lame_lambda": ["printed"],
    "cell.yeoh_reference": ["printed"],
    "contact.form": ["conservative", "volume", "volume-printed"],
    "time.history": [False, "auto"],
    "mesh.order": [1, 2],
    "mesh.thin_layers": [2, 8],
    "mesh.pressure": ["none"],
    "flat": [False],
    "pillar": [
        [],
        [{"x_um": 6.0, "half_width_um": 2.0}],
        [{"half_width_um": 2.0}, {"x_um": 9.0, "half_width_um": 4.0}],
    ],
    "output.times_s": [[1.0, 17999.0]],
}


@st.composite
def oddities(draw):
    """A key and a value that a scene may have: near the default, far from it, or at an edge of its range."""
    if draw(st.integers(0, 3)) == 0:
        key = draw(st.sampled_from(sorted(WORDS)))
        return key, draw(st.sampled_from(WORDS[key]))
    key, default, kind = draw(st.sampled_from(RANGES))
    factors = [0.0, -1.0, 1e-9, 1e-3, 0.03, 0.3, 0.9, 1.1, 3.0, 30.0, 1e3, 1e9]
    values = [(default or 1.0) * factor for factor in factors] + [kind.least, kind.most, kind.above + TINIEST]
    return key, draw(st.sampled_from([value for value in values if math.isfinite(value)]))


@st.composite
def scenes(draw):
    """A scene that keeps every rule, on a coarse mesh; what it sets is in its changes."""
    data = {"mesh": {"size_um": 5.0}, "time": {"rtol": 0.02}}
    chosen = dict(draw(st.lists(oddities(), min_size=1, max_size=3, unique_by=lambda pair: pair[0])))
    try:
        for key, value in sorted(chosen.items()):
            put(data, key, copy.deepcopy(value), "my.toml")
        read_scene(data, "my.toml")
    except InputError:
        reject()
    return Attempt("my.toml", dumped(data), (), tuple(f"{key}={value}" for key, value in chosen.items()))


def wrong_solve(answer, folder):
    """What is wrong with how a valid scene was solved, "" if nothing is; and else how it ended."""
    status, err = answer["status"], answer["err"]
    if answer.get("stopped"):
        kept = (folder / "checkpoint.npz").exists() or (folder / "history.csv").exists()
        return ("", "stopped at the limit") if status == 143 and kept else ("no end, and nothing kept", "")
    if status not in (0, 1):
        return f"status {status}", ""
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    ended, reason = result["status"], result["reason"]
    if (ended == "solved", err) != (status == 0, "" if status == 0 else f"cellmech: my: failed: {reason}\n"):
        return "status and messages do not fit the result", ""
    if result["cause"] == "internal":
        return reason, ""
    if result.get("steps", 0) and not (folder / "fields.pvd").exists():
        return "the last state is not saved", ""
    return "", ended if ended == "solved" else re.sub(r"-?\d[\d.e+-]*", "#", reason)[:60]
