"""The rules that tie several keys of a scene together."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from cellmech.mechanics.laws import LAWS
from cellmech.scene.breach import Breach
from cellmech.scene.driver_rules import of_drivers
from cellmech.scene.geometry_rules import of_geometry
from cellmech.scene.inputs import Inputs
from cellmech.scene.limits import below, told
from cellmech.scene.nucleus_rules import of_nucleus
from cellmech.scene.parts import LAYER_NAMES
from cellmech.scene.placement import overlaps, placement
from cellmech.scene.sizes import THINNEST_LAYER, of_sizes
from cellmech.scene.substrate_rules import of_substrate
from cellmech.solver.instants import CLOSEST, apart

MOST_CELLS = 5e6  # what fits into the memory of a large workstation
FINEST_CONTACT = 1e-5  # of the cell's radius: a contact zone of a fifth of the radius then has 20,000 edges
FREE = "the substrate, which only [adhesion] with work_uJ_m2 > 0 holds it to."


def breaches(scene: Inputs) -> Iterator[Breach]:
    """The rules the scene breaks, the ones that explain others first; nothing is computed before it is asked for."""
    yield from of_geometry(scene)
    yield from of_sizes(scene)
    yield from _radii(scene)
    yield from of_nucleus(scene)
    yield from _constants(scene)
    yield from _smearing(scene)
    yield from _load(scene)
    yield from of_drivers(scene)
    yield from of_substrate(scene)
    yield from _start(scene)
    yield from _mesh(scene)
    yield from _times(scene)
    yield from _history(scene)


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
    if cell.aspect != 1.0:
        hint = 'Set cell.layers = "conforming".'
        yield Breach("cell.aspect", "must be 1 where cell.layers is smeared: fades are circles", cell.aspect, hint)
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
    cell, load = scene.cell, scene.load
    if cell.density_kg_m3 < cell.medium_density_kg_m3 and not scene.adheres:
        rule = f"must be >= cell.medium_density_kg_m3 = {told(cell.medium_density_kg_m3)} kg/m3 without [adhesion]"
        yield Breach("cell.density_kg_m3", rule, cell.density_kg_m3, f"A lighter cell would rise off {FREE}")
    if load.factor < 0 and not scene.adheres:
        yield Breach(
            "load.factor", "must be >= 0 without [adhesion]", load.factor, f"It would lift the cell off {FREE}"
        )
    if load.start_s > 0 and not scene.drivers:
        hint = "Nothing would happen before it: add [adhesion] or [[actin]], or let the time begin with the load."
        yield Breach("load.start_s", "must be 0 s where only the weight pulls", load.start_s, hint)
    if cell.inertia and cell.density_kg_m3 == 0.0:
        yield Breach("cell.density_kg_m3", "must be > 0 kg/m3 when cell.inertia is true", cell.density_kg_m3)


def _start(scene: Inputs) -> Iterator[Breach]:
    cell = scene.cell
    start = placement(scene)
    for obstacle, depth in overlaps(scene, start):
        name = f"pillar.{obstacle}" if isinstance(obstacle, int) else f"the {obstacle}"
        rule = f"must be >= 0 µm: the cell would overlap {name} by {depth:g} µm"
        yield Breach("cell.gap_um", rule, cell.gap_um, "The gap is the vertical travel to first touch.")
    if cell.gap_um < 0.0:
        yield Breach("cell.gap_um", "must be >= 0 µm", cell.gap_um, "The gap is the vertical travel to first touch.")
    if not start.touch and scene.has_weight and not (cell.inertia or scene.medium.viscosity_Pa_s > 0):
        half = scene.semi_axes_um[0]
        ends = [(told(at - half), told(at + half)) for at in scene.centre_um]
        where = " and ".join(f"{axis} = {low} and {high} µm" for axis, (low, high) in zip("xz", ends, strict=False))
        rule = f"must have a pillar or the flat below the cell, between {where}"
        hint = "Without one the cell falls for ever: add an obstacle, set cell.inertia = true, or load.factor = 0."
        yield Breach("pillar", rule, f"{len(scene.pillar)} pillar(s), none of them there", hint)


def _finest_um(scene: Inputs) -> float:
    """Size of equal elements of which `MOST_CELLS` make the modelled part of the cell [µm], as it is told."""
    radius, space = scene.radius_um, scene.cell.geometry == "3d"
    whole = 4 / 3 * math.pi * radius**3 if space else math.pi * radius**2
    one = math.sqrt(2) / 12 if space else math.sqrt(3) / 4
    share = 0.5 ** len(scene.mirrors)
    return float(f"{(share * whole / (one * MOST_CELLS)) ** (1 / (3 if space else 2)):.2g}")


def _mesh(scene: Inputs) -> Iterator[Breach]:
    size, contact, radius = scene.mesh.size_um, scene.mesh.contact_size_um, scene.radius_um
    finest = _finest_um(scene)
    if size < finest or size > radius:
        cells = "tetrahedra" if scene.cell.geometry == "3d" else "triangles"
        rule = f"must be from {finest:g} µm (about {MOST_CELLS:.0e} {cells}) to the cell's radius, {told(radius)} µm"
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
