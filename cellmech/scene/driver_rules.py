"""The rules of what pulls besides the weight: adhesion and actin."""

from __future__ import annotations

from collections.abc import Iterator

from cellmech.scene.breach import Breach
from cellmech.scene.driver_parts import Actin
from cellmech.scene.inputs import Inputs
from cellmech.scene.limits import told

THINNEST = 1e-3  # of the cell's radius: a part that holds actin


def of_drivers(scene: Inputs) -> Iterator[Breach]:
    """The rules that adhesion and actin break."""
    yield from _adhesion(scene)
    for number, actin in enumerate(scene.actin):
        where = f"actin.{number}"
        yield from _contraction(scene, where, actin)
        if actin.where == "sector" and actin.radii_um is None:
            yield Breach(
                f"{where}.radii_um", 'must be set where actin.where = "sector" (µm)', None, "Or name another place."
            )
        for key, pair in (("radii_um", actin.radii_um), ("angles_deg", actin.angles_deg)):
            if pair is not None and not pair[0] < pair[1]:
                yield Breach(f"{where}.{key}", "must rise", list(pair))
        thinnest = THINNEST * scene.radius_um
        if actin.radii_um is not None and 0.0 < actin.radii_um[1] - actin.radii_um[0] < thinnest:
            yield Breach(f"{where}.radii_um", f"must be at least {told(thinnest)} µm apart", list(actin.radii_um))
        if actin.radii_um is not None and actin.radii_um[0] >= scene.radius_um:
            rule = f"must begin inside the cell, below {told(scene.radius_um)} µm"
            yield Breach(f"{where}.radii_um", rule, list(actin.radii_um))


def _adhesion(scene: Inputs) -> Iterator[Breach]:
    adhesion = scene.adhesion
    if adhesion is None:
        return
    if not adhesion.on:
        yield Breach("adhesion.on", "must name pillar, flat or both", [], "Leave [adhesion] out for none.")
    there = {"pillar": bool(scene.pillar) or scene.array is not None, "flat": scene.flat is not None}
    if adhesion.on and not any(there[kind] for kind in adhesion.on):
        yield Breach("adhesion.on", "must name an obstacle that the scene has", list(adhesion.on))
    most = scene.radius_um / 2
    if adhesion.range_um > most:
        yield Breach("adhesion.range_um", f"must be <= half of the cell's radius, {told(most)} µm", adhesion.range_um)
    size = scene.mesh.contact_size_um
    if size is not None and size > adhesion.range_um:
        rule = f"must be <= adhesion.range_um = {told(adhesion.range_um)} µm: the mesh would miss the pull"
        yield Breach("mesh.contact_size_um", rule, size, "Leave it out: the program chooses it.")


def _contraction(scene: Inputs, where: str, actin: Actin) -> Iterator[Breach]:
    if actin.contraction is None:
        if actin.stiffness_factor != 1.0:
            rule = "needs a contraction: an active stress leaves the stiffness of its layer"
            yield Breach(f"{where}.stiffness_factor", rule, actin.stiffness_factor)
        return
    if actin.stress_Pa is not None:
        rule = "must be left out beside a contraction: actin has the one or the other"
        yield Breach(f"{where}.stress_Pa", rule, actin.stress_Pa, "Write two tables [[actin]] for both.")
    wanted = scene.mesh.pressure == "mixed" or (scene.mesh.pressure == "auto" and scene.nearly_incompressible())
    if wanted and scene.mesh.order == 2 and scene.cell.geometry != "3d":
        rule = "needs a scene without the pressure as an unknown, which knows of no active strain"
        yield Breach(f"{where}.contraction", rule, actin.contraction, 'Set mesh.pressure = "none".')
