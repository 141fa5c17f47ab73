"""What a scene file cannot say: laws, obstacles and observables of one's own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from cellmech.contact import Obstacle
from cellmech.materials import Material
from cellmech.observables import Observer
from cellmech.scene import LayerName


@dataclass(frozen=True)
class Additions:
    """What is solved besides a scene, or instead of parts of it.

    Args:
        materials: of layers, instead of the scene's; their law may be any function of `(Invariants, **constants)`.
        obstacles: by label, beside the scene's. They may touch the cell at the start but not overlap it, and must be
            symmetric about x = 0 if half a cell is modelled.
        observables: by name, functions of the Observer after each accepted step that return a number; collective.
    """

    materials: Mapping[LayerName, Material] = field(default_factory=dict)
    obstacles: Mapping[str, Obstacle] = field(default_factory=dict)
    observables: Mapping[str, Callable[[Observer], float]] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.materials or self.obstacles or self.observables)

    def observe(self, observer: Observer) -> dict[str, dict[str, float]]:
        """The own numbers of a state as a table of result.json, none without any."""
        own = {name: float(number(observer)) for name, number in self.observables.items()}
        return {"own": own} if own else {}
