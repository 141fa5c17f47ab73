"""What drives a cell over time, from its scene: the ramps of weight, adhesion and actin, and the drivers themselves."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from cellmech.cell.actin_places import PLACES, radii_of
from cellmech.fem.domain import Domain
from cellmech.mechanics.contraction import Contraction
from cellmech.mechanics.drivers import Actin, Adhesion, Driver, Timeline
from cellmech.mechanics.kinematics import GEOMETRIES
from cellmech.mechanics.obstacles import Obstacle
from cellmech.mechanics.sector import Sector
from cellmech.scene import driver_parts
from cellmech.scene.scene import Scene
from cellmech.solver.time_steps import PUT_ON

FADE = 0.02  # of the cell's radius: half-width of a fade along the radius, where no interface of the mesh bounds actin
FADE_AROUND = 0.1  # of the cell's radius, and at most half of the arc: half-width of its fades to the sides
ON_BOUND = 1e-9  # of the cell's radius: so near to a bound an interface is on it


def ramp(half_ramp_s: float, start_s: float = 0.0) -> Callable[[float], float]:
    """t_g(t) [-]: the C2 step from 0 at the start to 1 at 2 T_g after it (eq. 25); 1 at once for T_g = 0."""

    def amplitude(t: float) -> float:
        if half_ramp_s == 0:
            return 1.0 if t >= start_s else 0.0
        s = min(max((t - start_s) / (2 * half_ramp_s), 0.0), 1.0)
        return s**3 * (10 - 15 * s + 6 * s**2)

    return amplitude


def driven(
    scene: Scene,
    centre: tuple[float, ...],
    obstacles: Mapping[str, Obstacle],
    interfaces: Sequence[tuple[str, float]],
    domain: Domain | None = None,
) -> dict[str, Any]:
    """What `Body` takes of how the load comes on: amplitude, dead, drivers, drag.

    Args:
        scene: the scene.
        centre: of the cell [µm].
        obstacles: by label.
        interfaces: name and outer radius [µm] of the groups of cells, from the inside out; none of smeared layers.
        domain: the mesh, for what contracts by an active strain.
    """
    drag = 1.5 * scene.medium.viscosity_Pa_s / scene.radius_um if scene.time.history else 0.0
    found: dict[str, Any] = {"drag": drag} if drag else {}
    if not scene.drivers:
        return found | {"amplitude": ramp(scene.load.half_ramp_s)}
    ramps, weight = [], [scene.load] if scene.has_weight else []
    for one in (*weight, *(one for _, one in scene.drivers)):
        shortest = 0.5 * PUT_ON * scene.time.end_s if one.start_s > 0 else 0.0
        ramps.append(ramp(max(one.half_ramp_s, shortest), one.start_s))
    line = Timeline(ramps, max(scene.ramp_end_s, scene.time.end_s))
    shares = [line.share(number) for number in range(len(ramps))]
    dead = shares.pop(0) if scene.has_weight else lambda progress: 0.0
    drivers = [
        _driver(scene, name, one, share, centre, obstacles, interfaces, domain)
        for (name, one), share in zip(scene.drivers, shares, strict=True)
    ]
    return found | {"amplitude": line.progress, "dead": dead, "drivers": tuple(drivers)}


def _driver(
    scene: Scene,
    name: str,
    one: driver_parts.Adhesion | driver_parts.Actin,
    share: Callable[[float], float],
    centre: tuple[float, ...],
    obstacles: Mapping[str, Obstacle],
    interfaces: Sequence[tuple[str, float]],
    domain: Domain | None,
) -> Driver:
    if isinstance(one, driver_parts.Adhesion):
        bare = tuple(o for label, o in obstacles.items() if kind_of(label) not in one.on)
        return Adhesion(share, one.work_uJ_m2, one.range_um, bare, one.above_um, name)
    angles, direction = PLACES[one.where]
    inner, outer = radii_of(scene, one)
    first, last = one.angles_deg or angles
    radius, arc = scene.radius_um, math.radians(last - first) * (inner + outer) / 2
    around = min(FADE_AROUND * radius, arc / 2)
    bounds = inner or None, outer if outer < radius else None
    sector = Sector(centre, bounds, (first, last), FADE * radius, around, aspect=scene.cell.aspect)
    if interfaces:
        slack, rims = ON_BOUND * radius, pairwise([("", 0.0), *interfaces])
        names = [name for (_, r), (name, rim) in rims if inner - slack <= r and rim <= outer + slack]
        sector = replace(sector, radii_um=(None, None), names=tuple(names))
    way = one.direction or direction
    if one.contraction is None:
        return Actin(share, one.pull_Pa, sector, way, name)
    assert domain is not None
    stiffness = 1.0 if one.stiffness_factor == 1.0 else domain.constant(one.stiffness_factor)
    kinematics = GEOMETRIES[scene.cell.geometry]
    return Contraction(share, one.contraction, sector, domain.constant(0.0), kinematics, way, stiffness, name)


def kind_of(label: str) -> str:
    """What an obstacle is to a driver: "flat", or else "pillar"."""
    return "flat" if label == "flat" else "pillar"
