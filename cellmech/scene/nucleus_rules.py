"""The rules of a nucleus that is no circle or ball about the cell's centre."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cellmech.scene.breach import Breach
from cellmech.scene.inputs import Inputs
from cellmech.scene.limits import told
from cellmech.scene.outline_points import Points, turns_once
from cellmech.scene.parts import Nucleus
from cellmech.scene.sizes import nucleus_semi_axes

NAMES = {"plane": "x and y", "axisymmetric": "x and y", "3d": "x, y and z"}
FEWEST = 8  # points of an outline
ROOM = 0.03  # of the cell's radius: least width of the cytosol beside a nucleus
AROUND = 360  # looks at an ellipse


def of_nucleus(scene: Inputs) -> Iterator[Breach]:
    """Places and shapes that the geometry has no room for, and that its planes of symmetry do not halve."""
    nucleus, cell = scene.nucleus, scene.cell
    if nucleus is None:
        if cell.aspect != 1.0:
            yield from _room(scene)
        return
    if nucleus.centre_um and len(nucleus.centre_um) != (3 if cell.geometry == "3d" else 2):
        yield Breach("nucleus.centre_um", f"must be {NAMES[cell.geometry]} (µm)", list(nucleus.centre_um))
        return
    offset = scene.nucleus_offset_um
    for axis, at in (("x", offset[0]), ("z", offset[-1] if len(offset) == 3 else 0.0)):
        if at != 0.0 and axis in scene.mirrors:
            shown = (
                "the body is turned about x = 0" if cell.geometry == "axisymmetric" else f"{axis} = 0 mirrors the cell"
            )
            hint = "" if cell.geometry == "axisymmetric" else 'Set cell.shape = "full".'
            yield Breach("nucleus.centre_um", f"must be 0 µm along {axis}, as {shown}", list(offset), hint)
    if cell.layers == "smeared":
        hint = 'Set cell.layers = "conforming".'
        yield Breach("nucleus", 'belongs to cell.layers = "conforming": fades are circles', "[nucleus]", hint)
    if nucleus.outline_um is not None:
        yield from _outline(scene, nucleus, nucleus.outline_um)
    yield from _room(scene)


def _room(scene: Inputs) -> Iterator[Breach]:
    """A nucleus that comes too near to the membrane, or beyond, as seen from the cell's centre."""
    places = ((math.hypot(*at), at[1]) for at in _places(scene))
    found = ((r, _free_um(scene, y / r if r else 1.0)) for r, y in places)
    farthest, free = max(found, key=lambda one: one[0] - one[1])
    if farthest > free:
        rule = f"must leave the nucleus within {told(float(f'{free:.6g}'))} µm of the cell's centre, inside the cytosol"
        if scene.cell.aspect != 1.0:
            rule += ", which is so far from there where the nucleus is nearest to it"
        yield Breach("nucleus", rule, f"{farthest:.4g} µm", f"nucleus.radius_um is {told(scene.nucleus_radius_um)} µm.")


def _free_um(scene: Inputs, sine: float) -> float:
    """How far from the cell's centre the nucleus may reach, along a way whose elevation has this sine [µm]."""
    membrane, (wide, high) = scene.radius_um - scene.outer_radius_um("cytosol"), scene.semi_axes_um
    if scene.cell.aspect == 1.0:
        return scene.outer_radius_um("cytosol") - ROOM * scene.radius_um
    return 1 / math.sqrt((1 - sine**2) / wide**2 + sine**2 / high**2) - membrane - ROOM * scene.radius_um


def _outline(scene: Inputs, nucleus: Nucleus, points: Points) -> Iterator[Breach]:
    key = "nucleus.outline_um"
    if nucleus.aspect != 1.0 and scene.cell.geometry != "3d":
        rule = "must not stand beside an outline from the side, which has a height"
        yield Breach("nucleus.aspect", rule, nucleus.aspect, "Write one of the two.")
    if len(points) < FEWEST:
        yield Breach(key, f"must hold {FEWEST} points or more", f"{len(points)} points")
    elif not turns_once(points):
        rule = "must be points in order around an outline that each ray from its centroid meets once"
        yield Breach(key, rule, f"{len(points)} points")


def _places(scene: Inputs) -> Iterator[tuple[float, float, float]]:
    """Places of the nucleus's outline from the cell's centre, the farthest among them: x, y and, in space, z [µm].

    The mean of an outline and its mirror images is nowhere farther than the farthest of them. In space a section of the
    nucleus at the height sin(a) of half of its own is its horizontal outline times cos(a).
    """
    points = scene.nucleus.outline_um if scene.nucleus is not None else None
    (x, y, *z), (wide, high) = scene.nucleus_offset_um, nucleus_semi_axes(scene)
    angles = [2 * math.pi * k / AROUND for k in range(AROUND)]
    if points is None:  # round about y: farthest in the plane through its own axis and the cell's
        aside = math.hypot(x, *z)
        yield from ((aside + wide * math.cos(a), y + high * math.sin(a), 0.0) for a in angles)
    elif not z:
        yield from ((x + along, y + up, 0.0) for along, up in points)
    else:
        heights = [(math.cos(a), y + high * math.sin(a)) for a in angles[::4] if math.cos(a) >= 0.0]
        yield from ((x + c * along, up, z[0] + c * away) for along, away in points for c, up in heights)
