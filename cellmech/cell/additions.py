"""Additions to a scene file: laws, obstacles and observables of one's own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cellmech.causes import Cause
from cellmech.cell.observables import Observer
from cellmech.errors import InputError, SolveError
from cellmech.mechanics.materials import Material
from cellmech.mechanics.obstacles import Obstacle
from cellmech.names import plain
from cellmech.scene.parts import LAYER_NAMES, LayerName

WHERE = "Additions"


@dataclass(frozen=True)
class Additions:
    """Parts of a problem besides a scene, or instead of parts of it.

    Args:
        materials: of layers, instead of the scene's; their law may be any function of `(Invariants, **constants)`.
        obstacles: by label, beside the scene's. They may touch the cell at the start but not overlap it, and must be
            symmetric about x = 0 if half a cell is modelled.
        observables: by name, functions of the Observer after each accepted step that return a number; collective. Names
            are letters, digits and underscores.

    Raises:
        InputError: for an unknown layer, or something else than a material, an obstacle or a function.
    """

    materials: Mapping[LayerName, Material] = field(default_factory=dict)
    obstacles: Mapping[str, Obstacle] = field(default_factory=dict)
    observables: Mapping[str, Callable[[Observer], float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for part in ("materials", "obstacles", "observables"):
            if not isinstance(getattr(self, part), Mapping):
                raise InputError(WHERE, part, "must be a dict of names", getattr(self, part))
            object.__setattr__(self, part, _plain_names(part, getattr(self, part)))
        for layer, material in self.materials.items():
            if layer not in LAYER_NAMES:
                raise InputError(WHERE, f"materials.{layer}", f"must be named {' or '.join(LAYER_NAMES)}")
            if not isinstance(material, Material):
                raise InputError(WHERE, f"materials.{layer}", "must be a cellmech.Material", material)
        for label, obstacle in self.obstacles.items():
            if lacking := [m for m in ("length_um", "level_set", "gradient") if not hasattr(obstacle, m)]:
                raise InputError(WHERE, f"obstacles.{label}", f"must have {', '.join(lacking)}", obstacle)
            _try(label, obstacle)
        for name, number in self.observables.items():
            if not name.isidentifier() or name.endswith("_at_um"):
                rule = "must be named by letters, digits and underscores, not ending with _at_um"
                raise InputError(WHERE, "observables", rule, name)
            if not callable(number):
                raise InputError(WHERE, f"observables.{name}", "must be a function of the Observer", number)

    def __bool__(self) -> bool:
        return bool(self.materials or self.obstacles or self.observables)

    def beside(self, built_in: Mapping[str, Obstacle], half_cell_radius_um: float | None) -> dict[str, Obstacle]:
        """The scene's obstacles and these.

        Raises:
            InputError: for a label that the scene has, or an obstacle without the symmetry that half a cell needs.
        """
        for label, obstacle in self.obstacles.items():
            if label in built_in:
                raise InputError(WHERE, f"obstacles.{label}", "the scene has an obstacle of this name")
            if half_cell_radius_um is not None:
                x, y = np.meshgrid(*[half_cell_radius_um * np.linspace(0.05, 2.0, 20)] * 2)
                if not np.allclose(obstacle.level_set((x, y)), obstacle.level_set((-x, y))):
                    rule = 'must be symmetric about x = 0, or cell.shape = "full"'
                    raise InputError(WHERE, f"obstacles.{label}", rule)
        return {**built_in, **self.obstacles}

    def observe(self, observer: Observer) -> dict[str, dict[str, float]]:
        """The own numbers of a state as a table of result.json, none without any. Collective.

        Raises:
            SolveError: on every rank, when a function fails on one or does not return a finite number.
        """
        own: dict[str, float] = {}
        for name, number in self.observables.items():
            fault = ""
            try:
                own[name] = float(number(observer))
                if not math.isfinite(own[name]):
                    fault = f"it is {own[name]}"
            except Exception as error:
                fault = f"{type(error).__name__}: {error}"
            if faults := [text for text in observer.comm.allgather(fault) if text]:
                raise SolveError(Cause.OBSERVABLE.reason(name=name, told=faults[0]))
        return {"own": own} if own else {}


def _try(label: str, obstacle: Obstacle) -> None:
    """Raise InputError for an obstacle whose functions do not take a point."""
    try:
        found = float(obstacle.level_set((0.3, 0.7))), len(obstacle.gradient((0.3, 0.7)))
        if hasattr(obstacle, "distance"):
            float(obstacle.distance((0.3, 0.7)))
    except TypeError as error:
        rule = f"its level_set, gradient and distance must take a point, (x, y) as one vector ({error})"
        raise InputError(WHERE, f"obstacles.{label}", rule, obstacle) from None
    if found[1] != 2:
        raise InputError(WHERE, f"obstacles.{label}", "its gradient must have two components", found[1])


def _plain_names(part: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """The same by names in the form that all have."""
    found: dict[str, Any] = {}
    for name, value in given.items():
        if not isinstance(name, str):
            raise InputError(WHERE, part, "must be a dict of names", name)
        if plain(name) in found:
            raise InputError(WHERE, part, "names must differ by more than how accents are coded", name)
        found[plain(name)] = value
    return found
