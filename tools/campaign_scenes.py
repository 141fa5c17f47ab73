"""Random scenes that keep every rule, over all scales: load, stiffness, length, time, nearly equal obstacles.

A scene is made of its number and the campaign's seed alone. Lengths are drawn for a cell of 10 µm, Table 1's, and all
scaled together; moduli, penalty and load are drawn apart, then the load is held, mostly, to what the cell bears.
"""

from __future__ import annotations

import copy
import math
import random
from dataclasses import dataclass, field
from typing import Any

from cellmech.errors import InputError
from cellmech.scene.files import read_scene
from cellmech.scene.scene import Scene

Data = dict[str, Any]
TABLE_1_UM = 10.0  # radius of the cell for which lengths are drawn
WEIGHT_PER_WIDTH = math.pi / 2 * 1000 * 9.81e-6  # of Table 1's cell, per radius [Pa/µm]: pi R^2 rho g over 2 R
BEARABLE = 0.3  # load over the softest layer's stiffness that most scenes stay below
SINKS = 0.05  # of the radius, to which most scenes' obstacles let the cell sink in
NEAR_S = 1e-12, 1e-3  # how near two events lie, relative
NEAR_UM = 1e-9, 1e-1  # by how much nearly equal pillars differ
LAWS = ("saint-venant", "neo-hookean", "neo-hookean", "mooney-rivlin", "yeoh")
LAYERS = ("membrane", "cytosol", "lamina", "nucleoplasm")
RADII = dict(zip(LAYERS, (10.0, 9.5, 5.0, 4.9), strict=True))
# What is done with a scene besides solving it, by the last digits of its number.
EXTRAS = {3: "twin", 13: "twin", 5: "end state", 15: "end state", 7: "killed", 11: "ranks", 17: "twin"}
CYCLE = 20


@dataclass(frozen=True)
class Draw:
    """A scene and what is to be known of it.

    Args:
        number: of the scene in the campaign.
        data: its tables.
        scene: the same, read.
        tags: what is special in it, for the table.
        extra: what is done besides solving it (`EXTRAS`), "" for nothing.
    """

    number: int
    data: Data
    scene: Scene
    tags: tuple[str, ...]
    extra: str = ""


@dataclass
class Dice:
    """Random choices of one scene."""

    random: random.Random
    tags: list[str] = field(default_factory=list)

    def log(self, least: float, most: float) -> float:
        """Log-uniform; three digits, which makes shorter files."""
        exponent = self.random.uniform(math.log10(least), math.log10(max(most, least)))
        return float(f"{10**exponent:.3g}")

    def even(self, least: float, most: float) -> float:
        """Uniform."""
        return float(f"{self.random.uniform(least, most):.4g}")

    def now_and_then(self, share: float) -> bool:
        """True in this share of cases."""
        return self.random.random() < share

    def one_of(self, *values: Any) -> Any:
        """One of these."""
        return self.random.choice(values)


def draw(seed: int, number: int) -> Draw:
    """Scene `number` of the campaign with this seed: the first of a series of its own that keeps every rule."""
    for attempt in range(1000):
        dice = Dice(random.Random(f"{seed}:{number}:{attempt}"))
        data = _scene(dice)
        try:
            scene = read_scene(copy.deepcopy(data), "campaign")
        except InputError:
            continue
        extra = EXTRAS.get(number % CYCLE, "")
        return Draw(number, data, scene, tuple(dice.tags), extra)
    raise RuntimeError(f"scene {number} of seed {seed}: a thousand attempts break a rule")


def _scene(dice: Dice) -> Data:
    scale = dice.log(0.05, 1000.0) / TABLE_1_UM
    if dice.now_and_then(0.25):
        scale = 1.0
    data: Data = {"schema": 1, "cell": _cell(dice), "layer": _layers(dice, scale)}
    data |= _obstacles(dice, scale, data["cell"])
    stress = _load(dice, scale, data)
    data["contact"] = _contact(dice, scale, stress)
    data["mesh"] = _mesh(dice, scale, data)
    data["time"] = {}
    _times(dice, data)
    if dice.now_and_then(0.1):
        _make_inert(dice, scale, data)
    return data


def _cell(dice: Dice) -> Data:
    cell: Data = {"shape": dice.one_of("half", "half", "half", "full", "full"), "law": dice.one_of(*LAWS)}
    cell["fluid_lambda_Pa_s"] = dice.one_of(1000.0, 1000.0, 0.0, dice.log(1e-3, 1e9))
    cell["fluid_mu_Pa_s"] = dice.one_of(5e-3, 5e-3, dice.log(1e-6, 1e6))
    if dice.now_and_then(0.2):
        cell["poisson"] = dice.one_of(0.0, 0.3, 0.4, 0.48, 0.499)
    if dice.now_and_then(0.2):
        cell["beta_over_mu"] = dice.one_of(0.0, 0.25, 1.0)
    if dice.now_and_then(0.1):
        cell["medium_density_kg_m3"] = dice.one_of(500.0, 900.0, 999.0)
    return cell


def _layers(dice: Dice, scale: float) -> Data:
    kind = dice.one_of("each", "each", "bead", "table", "table")
    bead, factor = dice.log(1.0, 1e10), dice.log(0.1, 1e7)
    table = dict(zip(LAYERS, (100.0, 10.0, 1000.0, 10.0), strict=True))
    modulus = {
        "each": lambda name: dice.log(1.0, 1e10),
        "bead": lambda name: bead,
        "table": lambda name: float(f"{table[name] * factor:.3g}"),
    }[kind]
    if kind == "bead":
        dice.tags.append("bead")
    fluid = dice.one_of("none", "half", "each", "each")
    layers: Data = {}
    for name in LAYERS:
        share = {"none": 0.0, "half": 0.5, "each": dice.one_of(0.0, 0.3, 0.5, 0.9, 0.99)}[fluid]
        layers[name] = {"young_Pa": modulus(name), "fluid_fraction": share, "outer_radius_um": RADII[name] * scale}
    if dice.now_and_then(0.1):
        layers[dice.one_of(*LAYERS)]["law"] = dice.one_of(*LAWS)
    return layers


def _obstacles(dice: Dice, scale: float, cell: Data) -> Data:
    half, count = cell["shape"] == "half", dice.one_of(0, 1, 1, 1, 2, 2, 2, 3, 4)
    flat: Any = False if count and dice.now_and_then(0.35) else {"y_um": -10.0 * scale}
    if not count:
        return {"pillar": [], "flat": flat}
    pitch = TABLE_1_UM * dice.even(0.3, 1.8)
    first = dice.one_of(0.0, 0.5) if half else -(count - 1) / 2
    same = {"half_width_um": pitch * dice.even(0.15, 0.49), "exponent": dice.one_of(2.0, 3.0, 4.0, 4.0, 4.5, 8.0, 20.0)}
    pillars = [{"x_um": pitch * (first + k), "y_um": -10.0, "height_um": 9.5, **same} for k in range(count)]
    if count > 1 and dice.now_and_then(0.6):
        _nearly_equal(dice, pillars)
    elif count > 1 and dice.now_and_then(0.3):
        dice.tags.append("unequal")
        dice.one_of(*pillars)["height_um"] *= dice.even(0.5, 0.98)
    for pillar in pillars:
        for key in ("x_um", "y_um", "height_um", "half_width_um"):
            pillar[key] *= scale
    if not half and dice.now_and_then(0.3):
        off = dice.log(1e-9, 1e-1) if dice.now_and_then(0.7) else TABLE_1_UM * dice.even(-0.5, 0.5)
        cell["centre_x_um"] = off * scale
        dice.tags.append(f"off centre {off:.3g}")
    if dice.now_and_then(0.1):
        cell["gap_um"] = scale * dice.log(1e-6, 10.0)
    return {"pillar": pillars, "flat": flat}


def _nearly_equal(dice: Dice, pillars: list[Data]) -> None:
    """One pillar differs from the others in one of its numbers by next to nothing."""
    key, by = dice.one_of("height_um", "height_um", "x_um", "exponent", "half_width_um"), dice.log(*NEAR_UM)
    dice.one_of(*pillars)[key] += dice.one_of(1, -1) * by
    dice.tags.append(f"nearly equal {key} {by:.3g}")


def _load(dice: Dice, scale: float, data: Data) -> float:
    """Draw the load; returns the mean stress it brings: weight over width [Pa]."""
    layers = data["layer"].values()
    soft = min(layer["young_Pa"] * (1 - layer["fluid_fraction"]) for layer in layers)
    per_factor = WEIGHT_PER_WIDTH * TABLE_1_UM * scale
    most = 1e3
    if not dice.now_and_then(0.15):
        most = min(max(BEARABLE * soft / per_factor, 2e-12), 1e3)
    factor = dice.log(1e-12, most) if dice.now_and_then(0.6) else dice.log(max(1e-3 * most, 1e-12), most)
    data["load"] = {"factor": factor}
    return per_factor * factor


def _contact(dice: Dice, scale: float, stress: float) -> Data:
    least = max(stress / (SINKS * TABLE_1_UM * scale), 1e-9)
    penalty = dice.one_of(max(50.0 / scale, least), dice.log(least, max(1e8 / scale, 10 * least)))
    contact: Data = {"penalty_Pa_per_um": penalty, "form": "surface"}
    contact["smoothing_um"] = scale * dice.one_of(1e-4, 1e-4, dice.log(1e-6, 1e-2))
    if dice.now_and_then(0.2):
        contact["form"] = dice.one_of("volume", "volume", "volume-printed")
        contact["volume_width_um"] = scale * dice.one_of(0.05, dice.log(0.01, 0.5))
    return contact


def _mesh(dice: Dice, scale: float, data: Data) -> Data:
    incompressible = data["cell"].get("poisson", 0.45) > 0.45
    order = 2 if incompressible else dice.one_of(3, 3, 3, 2, 1)
    return {"order": order, "size_um": scale * {3: 5.0, 2: 3.0, 1: 2.0}[order], "thin_layers": 1}


def _times(dice: Dice, data: Data) -> None:
    """End, ramp and output times, some of them side by side."""
    end = dice.log(1e-6, 1e6)
    near = dice.one_of(1, -1) * dice.log(*NEAR_S)
    ramp = {
        "at once": 0.0,
        "shorter": end * dice.log(1e-6, 1.0),
        "as long": end * (1 + near),
        "longer": end * dice.log(1.0, 1e4),
        "usual": end * 10_000 / 18_000,
    }
    kind = dice.one_of("at once", "shorter", "shorter", "as long", "longer", "usual", "usual", "usual")
    dice.tags.append(f"ramp {kind}" + (f" {near:.3g}" if kind == "as long" else ""))
    data["time"] |= {"end_s": end, "history": dice.one_of(True, True, True, False, "auto")}
    data["time"]["rtol"] = dice.one_of(1e-3, 1e-3, 1e-2)
    data["load"]["half_ramp_s"] = ramp[kind] / 2
    if dice.now_and_then(0.5):
        return
    near_ramp = ramp[kind] * (1 + dice.one_of(1, -1) * dice.log(*NEAR_S))
    near_end = end * (1 - dice.log(*NEAR_S))
    times = [end * dice.even(0.0, 1.0), end * dice.log(1e-8, 1.0), near_ramp, near_end]
    chosen = sorted({t for t in dice.random.sample(times, dice.one_of(1, 1, 2, 3)) if 0 < t <= end})
    if {near_ramp, near_end} & set(chosen):
        dice.tags.append("events side by side")
    data["output"] = {"times_s": chosen}


def _make_inert(dice: Dice, scale: float, data: Data) -> None:
    """Let it fall: a gap, a time of that order, mass."""
    data["cell"] |= {"inertia": True, "gap_um": scale * dice.one_of(0.0, dice.log(1e-3, 100.0), dice.log(1e-3, 100.0))}
    if dice.now_and_then(0.2):
        data |= {"pillar": [], "flat": False}
    data["load"]["factor"] = max(data["load"]["factor"], 1e-6)
    gravity = 9.81e6 * data["load"]["factor"]
    fall = math.sqrt(2 * max(data["cell"]["gap_um"], 0.1 * scale) / gravity)
    data["time"] |= {"history": True, "end_s": fall * dice.one_of(dice.even(0.2, 0.95), dice.even(1.0, 1.3))}
    data["load"]["half_ramp_s"] = dice.one_of(0.0, 0.0, data["time"]["end_s"] * dice.even(0.1, 0.6))
    data["output"] = {"times_s": [data["time"]["end_s"] * 0.5]}
    dice.tags[:] = [tag for tag in dice.tags if not tag.startswith(("ramp", "events"))] + ["inertia"]
