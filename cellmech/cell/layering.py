"""Layers that a mesh keeps apart, and the rings that follow smeared ones (eqs 1-5)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from cellmech.cell.actin_places import bounds_of, pulls_all_round
from cellmech.fem.domain import whole
from cellmech.mesh.disc import UNIFORM, Grading
from cellmech.scene.parts import LAYER_NAMES, LayerName
from cellmech.scene.scene import Scene

INSIDE_OUT: tuple[LayerName, ...] = tuple(reversed(LAYER_NAMES))
MERGED: dict[tuple[LayerName, ...], str] = {("nucleoplasm", "lamina"): "nucleus", ("cytosol", "membrane"): "cytoplasm"}
THINNEST = 5e-3  # of the radius: their least width
SHELL = 0.1  # of the radius: a layer below it is a shell
LEAST_SOLID = 0.1  # of a layer, as far as its stiffness is estimated
ON_INTERFACE = 1e-6  # of the radius: a circle so near to an interface is on it
ASIDE = {"inside": -1.0, "outside": 1.0}  # half-widths from an interface to its fade's middle


@dataclass(frozen=True)
class MeshPlan:
    """The plan of a mesh.

    Args:
        merged: pairs of layers that are meshed as one (`mesh_plan`).
        grading: where the elements are small.
    """

    merged: tuple[tuple[LayerName, ...], ...] = ()
    grading: Grading = Grading()

    def key(self) -> str:
        """For the hash that ties a result to its inputs; the default grading is part of the program's own."""
        other = [] if self.grading == Grading() else [repr(self.grading)]
        return ";".join(["+".join(pair) for pair in self.merged] + other)

    def interfaces(self, scene: Scene) -> tuple[tuple[str, float], ...]:
        """(name, outer radius [µm]) of the groups to mesh, from the inside out."""
        found = []
        for inner, outer in (INSIDE_OUT[:2], INSIDE_OUT[2:]):
            if (inner, outer) in self.merged:
                found.append((MERGED[inner, outer], scene.outer_radius_um(outer)))
            else:
                found += [(inner, scene.outer_radius_um(inner)), (outer, scene.outer_radius_um(outer))]
        if scene.cell.smear_um is not None:
            found = _with_fades(scene, found)
        elif not self.merged:
            found = _cut(found, bounds_of(scene), ON_INTERFACE * scene.radius_um)
        return tuple(found)


def fade_of(scene: Scene, name: LayerName) -> tuple[float, float]:
    """Middle of a layer's fade into the next one outside, and its half-width along the radius [µm].

    In squared distance (eqs 1-5 as printed) widths are `smear_um` at the nucleus's rim and narrower farther out.
    """
    smear, radius = scene.cell.smear_um or 0.0, scene.outer_radius_um(name)
    if scene.cell.fade == "squared":
        return radius, smear * scene.nucleus_radius_um / radius
    return radius + smear * ASIDE.get(scene.cell.fade, 0.0), smear


def _with_fades(scene: Scene, interfaces: list[tuple[str, float]]) -> list[tuple[str, float]]:
    """The interfaces and circles between them, so that a fade from layer to layer is some elements wide."""
    smear = scene.cell.smear_um or 0.0
    rings = min(int(smear / (THINNEST * scene.radius_um) + 1e-9), scene.mesh.fade_rings)
    if rings == 0:
        return interfaces
    fades = [
        middle + k * (half / rings)
        for middle, half in (fade_of(scene, name) for name in INSIDE_OUT[:-1])
        for k in range(-rings, rings + 1)
    ]
    step = min(fade_of(scene, name)[1] for name in INSIDE_OUT[:-1]) / rings
    return _cut(interfaces, fades, step / 2)


def _cut(interfaces: list[tuple[str, float]], radii: Iterable[float], apart: float) -> list[tuple[str, float]]:
    """The interfaces and those circles between them that are apart from all others by more than this [µm].

    The innermost pieces of a group are named after it with a number, the outermost keeps its name.
    """
    kept = [radius for _, radius in interfaces]
    for radius in sorted(r for r in radii if 0 < r < interfaces[-1][1]):
        if min(abs(radius - other) for other in kept) > apart:
            kept.append(radius)
    found, inner = [], 0.0
    for name, outer in interfaces:
        pieces = sorted(radius for radius in kept if inner < radius < outer)
        found += [(f"{name} {k}", radius) for k, radius in enumerate(pieces, 1)] + [(name, outer)]
        inner = outer
    return found


def stiffness_Pa(scene: Scene, name: LayerName) -> float:
    """Young's modulus of a layer's mixture, an estimate [Pa]."""
    return scene.layer_young_Pa(name) * max(scene.layer_solid(name), LEAST_SOLID)


def shells(scene: Scene, interfaces: tuple[tuple[str, float], ...]) -> dict[str, float]:
    """Thin layers, each with its stiffness over that of the softest layer [-]; of fades the most that it can be.

    Args:
        scene: whose layers are meshed.
        interfaces: (name, outer radius [µm]) of what is meshed, from the inside out.
    """
    stiffness: dict[str, float] = {name: stiffness_Pa(scene, name) for name in LAYER_NAMES}
    softest, stiffest, inner, found = min(stiffness.values()), max(stiffness.values()), 0.0, {}
    for name, outer in interfaces:
        if outer - inner < SHELL * scene.radius_um:
            found[name] = (stiffest if scene.cell.layers == "smeared" else stiffness[whole(name)]) / softest
        inner = outer
    return found


def mesh_plan(scene: Scene) -> MeshPlan:
    """Mesh every layer apart, but for smeared ones, whose interfaces are none.

    Layers of equal properties are meshed apart too: without an interface their maxima are looked for inside elements,
    which takes longer than the few elements saved, and moves them by more than their error (`benchmarks/needs.py`).
    """
    merged = (INSIDE_OUT[:2], INSIDE_OUT[2:]) if scene.cell.layers == "smeared" else ()
    return MeshPlan(merged, UNIFORM if scene.mesh.grading == "uniform" else graded(scene, Grading()))


def graded(scene: Scene, usual: Grading) -> Grading:
    """The usual grading; where actin pulls at the back of the nucleus, as fine there as in front."""
    return replace(usual, back=usual.outline) if pulls_all_round(scene) else usual
