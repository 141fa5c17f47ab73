"""The rules that tie several keys of a scene together."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

from cellmech.mechanics.laws import LAWS
from cellmech.mechanics.obstacles import Pillar
from cellmech.scene.inputs import Inputs
from cellmech.scene.limits import below, told
from cellmech.scene.parts import LAYER_NAMES
from cellmech.scene.placement import TIE, Standing, overlaps, placement, standing, touch_of
from cellmech.solver.instants import CLOSEST, apart

MOST_CELLS = 5e6  # what fits into the memory of a large workstation
FINEST_CONTACT = 1e-5  # of the cell's radius: a contact zone of a fifth of the radius then has 20,000 edges
THINNEST_LAYER = 1e-4  # of the cell's radius, 1 nm of Table 1's cell: thinner is no continuum, and no mesh


class Breach(NamedTuple):
    """A rule that is broken: dotted key, rule with its unit, value got, what to do."""

    key: str
    rule: str
    got: object
    hint: str = ""


def breaches(scene: Inputs) -> Iterator[Breach]:
    """The rules the scene breaks, the ones that explain others first; nothing is computed before it is asked for."""
    yield from _geometry(scene)
    yield from _radii(scene)
    yield from _constants(scene)
    yield from _smearing(scene)
    yield from _load(scene)
    yield from _pillars(scene)
    yield from _flat(scene)
    yield from _start(scene)
    yield from _mesh(scene)
    yield from _times(scene)
    yield from _history(scene)


def _geometry(scene: Inputs) -> Iterator[Breach]:
    """What makes sense in a plane only, and what only there is no axis."""
    cell = scene.cell
    if cell.geometry == "plane":
        return
    if cell.shape != "half":
        hint = "The half disc is turned about x = 0 and makes the whole cell."
        yield Breach("cell.shape", 'must be "half" where cell.geometry is axisymmetric', cell.shape, hint)
    if cell.trace != "3d":
        yield Breach("cell.trace", 'must be "3d" where cell.geometry is axisymmetric', cell.trace, "It has no plane.")
    for i, pillar in enumerate(scene.pillar):
        if pillar.x_um < 0.0:
            rule = "must be >= 0 µm, the radius of its ring, where cell.geometry is axisymmetric"
            yield Breach(f"pillar.{i}.x_um", rule, pillar.x_um, "0 is a round pillar on the axis.")


def _radii(scene: Inputs) -> Iterator[Breach]:
    names = LAYER_NAMES[::-1]
    radii = [scene.layer_of(name).outer_radius_um for name in names]
    least = THINNEST_LAYER * radii[-1]
    if below(radii[0], least):  # Gmsh ends the process over what is no larger than rounding
        rule = f"must be >= {told(least)} µm, {THINNEST_LAYER:g} of the cell's radius"
        yield Breach(f"layer.{names[0]}.outer_radius_um", rule, radii[0])
    for inner, outer, r_inner, r_outer in zip(names[:-1], names[1:], radii[:-1], radii[1:], strict=True):
        if r_inner >= r_outer:
            rule = f"must be less than layer.{outer}.outer_radius_um = {told(r_outer)} µm"
            hint = f"Radii grow from the inside out: {' < '.join(names)}."
            yield Breach(f"layer.{inner}.outer_radius_um", rule, r_inner, hint)
        if below(r_outer - r_inner, least, r_outer):
            rule = f"must leave layer.{outer} a thickness of {told(least)} µm or more"
            hint = f"Its outer radius is {r_outer!r} µm."
            yield Breach(f"layer.{inner}.outer_radius_um", rule, r_inner, hint)


def _constants(scene: Inputs) -> Iterator[Breach]:
    """Constants that no law has, or out of its bounds."""
    places = {"cell": (scene.cell.constants, scene.laws())}
    places |= {f"layer.{n}": (scene.layer_of(n).constants, (scene.layer_law(n),)) for n in LAYER_NAMES}
    for place, (written, laws) in places.items():
        known = {constant.key: constant for law in laws for constant in LAWS[law].constants.values()}
        for key, value in (written or {}).items():
            where = f"{place}.constants.{key}"
            if (constant := known.get(key)) is None:
                has = f"which has {', '.join(known)}" if known else "which has none"
                yield Breach(where, f"must be a constant of the law {' or '.join(laws)}, {has}", value)
            elif not (constant.above < value and constant.least <= value <= constant.most):
                yield Breach(where, f"must be {constant.allowed}", value)


def _smearing(scene: Inputs) -> Iterator[Breach]:
    cell = scene.cell
    if cell.layers == "conforming":
        if cell.smear_um is not None:
            hint = 'Set cell.layers = "smeared", or leave cell.smear_um out.'
            yield Breach("cell.smear_um", 'belongs to cell.layers = "smeared" only (µm)', cell.smear_um, hint)
        if cell.fade != "centred":
            yield Breach("cell.fade", 'belongs to cell.layers = "smeared" only', cell.fade)
        return
    if cell.smear_um is None:
        hint = "Set cell.smear_um, the half-width in µm over which a layer fades into the next."
        yield Breach("cell.smear_um", "must be set, > 0 µm, when cell.layers is smeared", None, hint)
    elif cell.smear_um > scene.radius_um:
        yield Breach("cell.smear_um", f"must be <= the cell's radius, {told(scene.radius_um)} µm", cell.smear_um)
    poissons = sorted({scene.layer_poisson(name) for name in LAYER_NAMES})
    for key, values in (("law", scene.laws()), ("poisson", poissons)):
        if len(values) > 1:
            rule = f"must be the same in every layer when cell.layers is smeared (cell.{key} or layer.*.{key})"
            yield Breach(f"cell.{key}", rule, ", ".join(map(str, values)), "Smearing mixes moduli, not laws.")


def _load(scene: Inputs) -> Iterator[Breach]:
    cell = scene.cell
    if cell.density_kg_m3 < cell.medium_density_kg_m3:
        rule = f"must be >= cell.medium_density_kg_m3 = {told(cell.medium_density_kg_m3)} kg/m3"
        yield Breach("cell.density_kg_m3", rule, cell.density_kg_m3, "A lighter cell would rise off the substrate.")
    if cell.inertia and cell.density_kg_m3 == 0.0:
        yield Breach("cell.density_kg_m3", "must be > 0 kg/m3 when cell.inertia is true", cell.density_kg_m3)


def _pillars(scene: Inputs) -> Iterator[Breach]:
    """Pillars that overlap one another, or a mirror image (eq. 27 would count the force there twice)."""
    row = sorted(standing(scene.cell.shape == "half", scene.pillar), key=lambda pillar: _left(pillar.arch))
    for i, one in enumerate(row):
        right = one.arch.x_um + one.arch.half_width_um * (1 - TIE)
        for other in row[i + 1 :]:
            if _left(other.arch) >= right:
                break  # in the order of their left ends: all further ones start beyond this pillar
            both_mirrored = one.mirrored and other.mirrored  # the originals say the same
            if not both_mirrored and _overlap(one.arch, other.arch):
                yield _pillar_breach(scene, *sorted((one, other), key=lambda p: (p.mirrored, -p.pillar)))


def _flat(scene: Inputs) -> Iterator[Breach]:
    """A flat that rises above a pillar's foot, unless it buries the pillar deeper than a cell could sink."""
    if scene.flat is None:
        return
    level = scene.flat.y_um
    for i, pillar in enumerate(scene.pillar):
        foot, top = pillar.y_um, pillar.y_um + pillar.height_um
        if foot + TIE * pillar.height_um < level < top + scene.radius_um:
            rule = f"must be <= {told(foot)} µm, the foot of pillar.{i}: the two would overlap"
            hint = "Both would push a cell that touches both: raise the pillar, lower the flat, or set flat = false."
            yield Breach("flat.y_um", rule, level, hint)


def _left(arch: Pillar) -> float:
    return arch.x_um - arch.half_width_um


def _overlap(a: Pillar, b: Pillar) -> bool:
    met = touch_of(a, b)
    return met is not None and met[1] - abs(a.y_um - b.y_um) > TIE * (a.height_um + b.height_um)


def _pillar_breach(scene: Inputs, one: Standing, other: Standing) -> Breach:
    apart = one.arch.half_width_um + other.arch.half_width_um
    hint = f"Their middles must be {told(apart)} µm apart along x (the sum of the half-widths)."
    name = f"pillar.{other.pillar}"
    if other.mirrored:
        name = ("its own mirror image" if one.pillar == other.pillar else f"the mirror image of {name}") + " at x = 0"
        mirrors = "A half cell mirrors its pillars."
        hint += f" {mirrors if scene.cell.geometry == 'plane' else 'Off the axis a pillar is a ring.'}"
    return Breach(f"pillar.{one.pillar}.x_um", f"must not overlap {name} (µm)", scene.pillar[one.pillar].x_um, hint)


def _start(scene: Inputs) -> Iterator[Breach]:
    cell = scene.cell
    if cell.shape == "half" and cell.centre_x_um != 0.0:
        hint = 'Set cell.shape = "full" for a cell off the axis.'
        yield Breach("cell.centre_x_um", "must be 0 µm for a half cell", cell.centre_x_um, hint)
        return
    start = placement(scene)
    for obstacle, depth in overlaps(scene, start):
        name = "the flat" if obstacle == "flat" else f"pillar.{obstacle}"
        rule = f"must be >= 0 µm: the cell would overlap {name} by {depth:g} µm"
        yield Breach("cell.gap_um", rule, cell.gap_um, "The gap is the vertical travel to first touch.")
    if cell.gap_um < 0.0:
        yield Breach("cell.gap_um", "must be >= 0 µm", cell.gap_um, "The gap is the vertical travel to first touch.")
    if not start.touch and scene.has_weight and not cell.inertia:
        left, right = cell.centre_x_um - scene.radius_um, cell.centre_x_um + scene.radius_um
        rule = f"must have a pillar or the flat below the cell, between x = {told(left)} and {told(right)} µm"
        hint = "Without one the cell falls for ever: add an obstacle, set cell.inertia = true, or load.factor = 0."
        yield Breach("pillar", rule, f"{len(scene.pillar)} pillar(s), none of them there", hint)


def _mesh(scene: Inputs) -> Iterator[Breach]:
    size, contact, radius = scene.mesh.size_um, scene.mesh.contact_size_um, scene.radius_um
    share = 0.5 if scene.cell.shape == "half" else 1.0
    finest = float(f"{math.sqrt(share * math.pi * radius**2 / (math.sqrt(3) / 4 * MOST_CELLS)):.2g}")  # as it is told
    if size < finest or size > radius:
        rule = f"must be from {finest:g} µm (about {MOST_CELLS:.0e} triangles) to the cell's radius, {told(radius)} µm"
        yield Breach("mesh.size_um", rule, size)
    least = FINEST_CONTACT * radius
    if contact is not None and (below(contact, least) or contact > size):
        rule = f"must be from {told(least)} to mesh.size_um = {told(size)} µm"
        yield Breach("mesh.contact_size_um", rule, contact)
    if scene.mesh.pressure == "mixed" and scene.mesh.order != 2:
        rule = f'must be "auto" or "none" where mesh.order is {scene.mesh.order}'
        yield Breach("mesh.pressure", rule, "mixed", "Set mesh.order = 2.")


def _times(scene: Inputs) -> Iterator[Breach]:
    times, end = scene.output.times_s, scene.time.end_s
    rule = f"must rise, at least {CLOSEST:g} of time.end_s apart, and end by time.end_s = {end:g} s"
    for i, (earlier, later) in enumerate(pairwise((0.0, *times))):
        if not apart(earlier, later, end) or (later != end and not apart(later, end, end)):
            yield Breach(f"output.times_s.{i}", rule, later, "The end is always written and need not be listed.")


def _history(scene: Inputs) -> Iterator[Breach]:
    if scene.time.history:
        return
    hint = "Without history only elastic equilibria are computed."
    if scene.cell.inertia:
        yield Breach("time.history", "must be true where cell.inertia is", False, hint)
    for name in scene.without_solid():
        rule = f"must be true where a layer has no solid (layer.{name}.fluid_fraction = 1)"
        yield Breach("time.history", rule, False, hint)
