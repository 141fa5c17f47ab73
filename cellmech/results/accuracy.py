"""Accuracy of each reported number: the same case refined in one respect at a time, and what that changes.

No finite elements here: a refinement is a scene, its result a result.json, and the error a comparison of numbers.
Relative errors of J1, J2, J3 and of what is built from them are taken on q - q0, q0 the value at rest.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from cellmech.errors import InputError
from cellmech.results.records import flatten
from cellmech.scene.files import read_scene, scene_to_toml
from cellmech.scene.parts import LAYER_NAMES, MOST_ACROSS
from cellmech.scene.scene import Scene
from cellmech.scene.studies import ALL_PARTS, MODELLING, PARTS

MESH_RATIO = math.sqrt(2.0)  # between the sizes of neighbouring meshes
TIME_RATIO, TIME_ORDER = 10.0, 2 / 3  # of the tolerance; local-error control of a second-order method gives rtol^(2/3)
SMOOTHING_RATIO, SMOOTHING_ORDER = 4.0, 1.0
PENALTY_RATIO = 4.0
ORDERS = (1.0, 5.0)  # observed orders of the mesh that an extrapolation is trusted with; strains of P3 have 3
BUDGET, SMALL, SMALL_BUDGET = 0.01, 1e-4, 1e-6  # 1 % of |q - q0|; for a J with |q - q0| below SMALL, absolute

TABLES = (
    "share_of_area_percent",
    "share_of_max",
    "share_of_integral",
    "shape_index",
    "nucleus_shape",
    "contact",
    "energy",
)
LENGTHS = ("lamina_pillar_distance_um", "nucleus_obstacle_distance_um", "indentation_um")  # in no table
IN_THE_PLANE = {"J1": 2.0, "J2": 2.0, "J3": 1.0}  # what results of earlier versions, which do not say it, are at rest
OF_VOLUMES = "share_of_volume_percent"  # outside plane strain, instead of the areas
REGIONS = ("nucleus", *reversed(LAYER_NAMES), "cell")
NOT_ASSESSED = ("balance_error", "max_time_s", "_at_um.x", "_at_um.y")  # errors themselves, and where and when
SHAPE_AT_REST = {"full": 1.0, "half_outline": 2 * math.pi**2 / (math.pi + 2) ** 2, "half_area_full_perimeter": 0.5}

Result: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True)
class Refinement:
    """A case with one thing refined.

    Args:
        name: of its folder.
        part: of the error that it shows.
        scene: the complete input.
    """

    name: str
    part: str
    scene: Scene


@dataclass(frozen=True)
class Assessed:
    """One scalar and its error.

    Args:
        key: dotted, as in summary.csv.
        value: as reported.
        rest: what relative errors are taken from.
        parts: absolute contributions by part; None where a refinement is missing.
        order: observed order of the mesh, None where the three meshes show none.
        extrapolated: the value for ever finer meshes, None likewise.
    """

    key: str
    value: float
    rest: float
    parts: Mapping[str, float | None]
    order: float | None = None
    extrapolated: float | None = None

    @property
    def error(self) -> float | None:
        """Estimated absolute error: the sum of the numerical parts; None where one is missing."""
        parts = [self.parts[name] for name in PARTS if name in self.parts]
        return None if any(part is None for part in parts) else math.fsum(part for part in parts if part is not None)

    def share(self, part: float | None) -> float | None:
        """An absolute contribution as a share of |q - q0| [-]."""
        size = abs(self.value - self.rest)
        return None if part is None or size == 0.0 else part / size

    @property
    def allowed(self) -> float:
        """The error that 1 % of |q - q0| allows; 1e-6 for a J within 1e-4 of rest."""
        size = abs(self.value - self.rest)
        return SMALL_BUDGET if self.rest and size < SMALL else BUDGET * size

    @property
    def within(self) -> bool:
        """True if the error is known and within 1 %."""
        return self.error is not None and self.error <= max(self.allowed, 1e-15)


def refinements(scene: Scene, parts: Iterable[str] = ALL_PARTS) -> tuple[Refinement, ...]:
    """The scenes that show the error of this one, for the parts that bear on it.

    Raises:
        InputError: a refined scene breaks a rule, such as a mesh beyond what fits into memory.
    """
    found = []
    for name, part, settings in _wanted(scene):
        if part not in parts:
            continue
        data = tomllib.loads(scene_to_toml(scene))
        for table, values in settings.items():
            data[table].update(values)
        try:
            found.append(Refinement(name, part, read_scene(data, "refined")))
        except InputError as error:
            hint = f"Leave {part} out of the parts of [accuracy], or begin with a coarser scene."
            raise InputError(f"accuracy, refinement {name}", error.key, error.rule, error.got, hint) from None
    return tuple(found)


def bears_on(scene: Scene) -> tuple[str, ...]:
    """The parts that this scene's error has."""
    return tuple(dict.fromkeys(part for _, part, _ in _wanted(scene)))


def _wanted(scene: Scene) -> list[tuple[str, str, dict[str, dict[str, float]]]]:
    mesh, contact = scene.mesh, scene.contact
    wanted: list[tuple[str, str, dict[str, dict[str, float]]]] = []
    for level in (1, 2):
        finer: dict[str, float] = {"size_um": _rounded(mesh.size_um / MESH_RATIO**level)}
        if mesh.contact_size_um is not None:
            finer["contact_size_um"] = _rounded(mesh.contact_size_um / MESH_RATIO**level)
        finer["thin_layers"] = min(mesh.thin_layers + level, MOST_ACROSS)
        wanted.append((f"mesh-{level}", "mesh", {"mesh": finer}))
    if scene.time.history and (scene.cell.inertia or _viscous(scene)):
        wanted.append(("time", "time", {"time": {"rtol": _rounded(scene.time.rtol / TIME_RATIO)}}))
    degrees = {"mesh": {"quadrature_degree": mesh.quadrature_degree + 2}}
    if scene.pillar or scene.array or scene.flat is not None:
        width = contact.width_key
        narrow = _rounded(getattr(contact, width) / SMOOTHING_RATIO)
        degrees["contact"] = {"quadrature_degree": 2 * contact.quadrature_degree + 1}
        wanted.append(("smoothing", "smoothing", {"contact": {width: narrow}}))
        stiff = {"penalty_Pa_per_um": contact.penalty_Pa_per_um * PENALTY_RATIO, width: narrow}
        wanted.append((MODELLING, MODELLING, {"contact": stiff}))
    wanted.append(("quadrature", "quadrature", degrees))  # type: ignore[arg-type]
    return wanted


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")


def _viscous(scene: Scene) -> bool:
    viscosity = scene.cell.fluid_lambda_Pa_s + scene.cell.fluid_mu_Pa_s
    return viscosity > 0 and any(scene.layer_of(name).fluid_fraction > 0 for name in LAYER_NAMES)


def assess(base: Result, refined: Mapping[str, Result | None], parts: Iterable[str]) -> dict[str, Assessed]:
    """The error of every scalar of a solved case, by dotted key.

    Args:
        base: its result.json.
        refined: result.json of the refinements by name, None or absent where one failed.
        parts: those that bear on the case (`bears_on`).
    """
    values = {name: numbers(result) for name, result in refined.items() if result is not None}
    parts, rest = tuple(parts), _values_at_rest(base)
    return {
        key: _assessed(key, value, rest(key), {name: row.get(key) for name, row in values.items()}, parts)
        for key, value in numbers(base).items()
    }


def _assessed(
    key: str, value: float, rest: float, others: Mapping[str, float | None], parts: tuple[str, ...]
) -> Assessed:
    found: dict[str, float | None] = {}
    order = extrapolated = None
    if "mesh" in parts:
        found["mesh"], order, extrapolated = _mesh_error(value, others.get("mesh-1"), others.get("mesh-2"))
    for part, ratio, power in (("time", TIME_RATIO, TIME_ORDER), ("smoothing", SMOOTHING_RATIO, SMOOTHING_ORDER)):
        if part in parts:
            found[part] = _difference(value, others.get(part), 1 / (1 - ratio**-power))
    for part in ("quadrature", MODELLING):
        if part in parts:
            found[part] = _difference(value, others.get(part), 1.0)
    return Assessed(key, value, rest, found, order, extrapolated)


def _difference(value: float, other: float | None, factor: float) -> float | None:
    return None if other is None else factor * abs(value - other)


def _mesh_error(value: float, fine: float | None, finest: float | None) -> tuple[float | None, float | None, Any]:
    """Error of the coarsest of three meshes; the order they show and the limit it leads to, None without one.

    Without a plausible order the finest is taken to be still off by as much as it differs from the middle one.
    Source: Roache, Verification and Validation in Computational Science and Engineering (1998), 5.4.
    """
    if fine is None or finest is None:
        return None, None, None
    first, second = value - fine, fine - finest
    if first == 0.0 and second == 0.0:
        return 0.0, None, None
    if first * second > 0:
        order = math.log(first / second) / math.log(MESH_RATIO)
        if ORDERS[0] <= order <= ORDERS[1]:
            limit = finest - second / (MESH_RATIO**order - 1)
            return abs(value - limit), order, limit
    return abs(value - finest) + abs(second), None, None


def numbers(result: Result) -> dict[str, float]:
    """The scalars of a result that have an error, by dotted key."""
    known = (*REGIONS, *TABLES, OF_VOLUMES)
    tables = {name: result[name] for name in known if isinstance(result.get(name), Mapping)}
    tables |= {name: result.get(name) for name in LENGTHS}
    return {
        key: float(value)
        for key, value in flatten(tables).items()
        if value is not None and not key.endswith(NOT_ASSESSED)
    }


def _values_at_rest(base: Result) -> Any:
    """A function: the value at rest of a scalar by its key, 0 for what is no strain or shape."""
    strains = base.get("rest") or IN_THE_PLANE
    nucleus, cell = base.get("nucleus") or {}, base.get("cell") or {}
    content = "area_um2" if "area_um2" in cell else "volume_um3"
    percent = 100 * nucleus.get(content, 0.0) / cell.get(content, math.inf)

    def rest(key: str) -> float:
        table, _, name = key.rpartition(".")
        if table == "shape_index":
            return SHAPE_AT_REST.get(name, 0.0)
        if table in ("share_of_area_percent", OF_VOLUMES):
            return percent * strains.get(name, 0.0)
        return strains.get(name.split("_")[0], 0.0) if table in REGIONS else 0.0

    return rest
