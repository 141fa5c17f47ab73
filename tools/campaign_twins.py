"""Scenes whose strains are those of another scene, and what differs between two results that should be alike.

The equations have three scalings: moduli, viscosities, penalty and load together; all lengths with penalty and load the
other way; times and viscosities together. Factors are powers of two, which are exact: what differs betrays a threshold
that knows of units.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import Any

from campaign_scenes import Data, Draw

from cellmech.errors import InputError
from cellmech.results.records import flatten
from cellmech.scene.files import read_scene

COSTS = ("wall_s", "memory_MB", "ranks")
SHAPES = 1e-9  # relative: by how much shapes of elements differ that are the same but for rounding
STIFFER, LARGER = 2.0**12, 2.0**4
VISCOSITIES = (("fluid_lambda_Pa_s", 1000.0), ("fluid_mu_Pa_s", 5e-3))


def twin_of(drawn: Draw) -> tuple[Data, float, float] | None:
    """A scene of equal strains: its tables, and how many times as large stresses and lengths are in it.

    None where there is none: with inertia, or beyond what a scene may say.
    """
    if drawn.scene.cell.inertia:
        return None
    kind, sign = ("stiffer", "larger", "slower")[drawn.number % 3], 1 if drawn.number % 2 else -1
    factor = (LARGER if kind == "larger" else STIFFER) ** sign
    data = {"stiffer": _stiffer, "larger": _larger, "slower": _slower}[kind](copy.deepcopy(drawn.data), factor)
    try:
        read_scene(copy.deepcopy(data), "twin")
    except InputError:
        return None
    return data, factor if kind == "stiffer" else 1.0, factor if kind == "larger" else 1.0


def _stiffer(data: Data, k: float) -> Data:
    for layer in data["layer"].values():
        layer["young_Pa"] *= k
    data["contact"]["penalty_Pa_per_um"] *= k
    data["load"]["factor"] *= k
    for key, default in VISCOSITIES:
        data["cell"][key] = data["cell"].get(key, default) * k
    return data


def _larger(data: Data, k: float) -> Data:
    for layer in data["layer"].values():
        layer["outer_radius_um"] *= k
    for pillar in data["pillar"]:
        for key in ("x_um", "y_um", "half_width_um", "height_um"):
            pillar[key] *= k
    if data["flat"]:
        data["flat"]["y_um"] *= k
    for table, keys in {
        "cell": ("gap_um", "centre_x_um"),
        "contact": ("smoothing_um", "volume_width_um"),
        "mesh": ("size_um",),
    }.items():
        data[table] |= {key: data[table][key] * k for key in keys if key in data[table]}
    data["contact"]["penalty_Pa_per_um"] /= k
    data["load"]["factor"] /= k
    return data


def _slower(data: Data, k: float) -> Data:
    data["time"]["end_s"] *= k
    data["load"]["half_ramp_s"] *= k
    if "output" in data:
        data["output"]["times_s"] = [t * k for t in data["output"]["times_s"]]
    for key, default in VISCOSITIES:
        data["cell"][key] = data["cell"].get(key, default) * k
    return data


def differences(
    one: Mapping[str, Any], other: Mapping[str, Any], tolerance: float, stress: float = 1.0, length: float = 1.0
) -> Iterator[str]:
    """What differs between two results of equal strains, `stress` and `length` times as large in the other."""
    force, energy = stress * length, stress * length**2
    for region in ("nucleus", "nucleoplasm", "lamina", "cytosol", "membrane", "cell"):
        yield from _unequal(one, other, f"{region}.sigma_mises_max_Pa", stress, tolerance, 1e-12 * _stiffest(one))
        for name, rest in (("J1", 2.0), ("J2", 2.0), ("J3", 1.0)):
            yield from _unequal(one, other, f"{region}.{name}_max", 1.0, tolerance, 1e-12, rest)
        yield from _unequal(one, other, f"{region}.det_F_min", 1.0, tolerance, 1e-12, 1.0)
    yield from _unequal(one, other, "contact.force_Pa_x_um", force, tolerance)
    for key in ("max_depth_um", "half_width_um"):
        yield from _unequal(one, other, f"contact.{key}", length, max(tolerance, 1e-5), 1e-13 * _radius(one))
    rounded = _stiffest(one) * (1e-12 * _radius(one)) ** 2  # what the strains that rounding makes store
    for key, floor in (("stored", rounded), ("gravity_work", 1e-300)):
        yield from _unequal(one, other, f"energy.{key}", energy, max(tolerance, 1e-5), floor)


def same_mesh(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two results have one mesh, to scale: as many elements, of the same shapes.

    Gmsh, whose tolerances know of units, may put single nodes elsewhere and make as many elements.
    """
    a, b = ({k: v for k, v in (r.get("mesh_quality") or {}).items() if not k.endswith("_um")} for r in (one, other))
    return a.keys() == b.keys() and all(abs(a[key] - b[key]) <= SHAPES * abs(a[key]) for key in a)


def changed_digits(one: Mapping[str, Any], other: Mapping[str, Any]) -> Iterator[str]:
    """Numbers of two results that are not the same to the last digit, but for what a run costs."""
    a, b = flatten(one), flatten(other)
    for key in dict.fromkeys([*a, *b]):
        if key not in COSTS and a.get(key) != b.get(key):
            yield f"{key}: {a.get(key)!r} against {b.get(key)!r}"


def _stiffest(result: Mapping[str, Any]) -> float:
    return max(layer["young_Pa"] for layer in result["scene"]["layer"].values())


def _radius(result: Mapping[str, Any]) -> float:
    return float(result["scene"]["layer"]["membrane"]["outer_radius_um"])


def _unequal(
    one: Mapping[str, Any],
    other: Mapping[str, Any],
    key: str,
    factor: float,
    tolerance: float,
    floor: float = 0.0,
    rest: float = 0.0,
) -> Iterator[str]:
    """The numbers of a dotted key where they do not fit, counted from rest."""

    def get(result: Mapping[str, Any]) -> Any:
        value: Any = result
        for part in key.split("."):
            value = None if value is None else value.get(part)
        return value

    a, b = get(one), get(other)
    if a is None or b is None:
        return
    a, b = a - rest, (b - rest) / factor
    if abs(a - b) > tolerance * max(abs(a), abs(b)) + floor:
        yield f"{key}: {a:.8g} against {b:.8g}"
