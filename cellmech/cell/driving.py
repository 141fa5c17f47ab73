"""What drives a cell over time, from its scene: the ramps of weight, adhesion and actin, and the drivers themselves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cellmech.fem.domain import whole
from cellmech.mechanics.drivers import Actin, Adhesion, Driver, Sector, Timeline
from cellmech.mechanics.obstacles import Obstacle
from cellmech.scene import parts
from cellmech.scene.parts import LayerName
from cellmech.scene.scene import Scene
from cellmech.solver.time_steps import PUT_ON

CAP_UM = 0.1  # of the cell's radius: thickness of a cap
FADE = 0.02  # of the cell's radius: half-width of a sector's fade
# By `where`: angles from the top, direction, the layer that holds it.
PLACES: dict[str, tuple[tuple[float, float], str, LayerName | None]] = {
    "cap": ((0.0, 60.0), "tangential", "cytosol"),
    "basal": ((120.0, 180.0), "radial", "cytosol"),
    "cortex": ((0.0, 180.0), "tangential", "membrane"),
    "sector": ((0.0, 180.0), "tangential", None),
}


def ramp(half_ramp_s: float, start_s: float = 0.0) -> Callable[[float], float]:
    """t_g(t) [-]: the C2 step from 0 at the start to 1 at 2 T_g after it (eq. 25); 1 at once for T_g = 0."""

    def amplitude(t: float) -> float:
        if half_ramp_s == 0:
            return 1.0 if t >= start_s else 0.0
        s = min(max((t - start_s) / (2 * half_ramp_s), 0.0), 1.0)
        return s**3 * (10 - 15 * s + 6 * s**2)

    return amplitude


def driven(
    scene: Scene, centre: tuple[float, ...], obstacles: Mapping[str, Obstacle], groups: Sequence[str] | None
) -> dict[str, Any]:
    """What `Body` takes of how the load comes on: amplitude, dead, drivers, drag.

    Args:
        scene: the scene.
        centre: of the cell [µm].
        obstacles: by label.
        groups: names of the groups of cells, None where layers are not meshed apart.
    """
    weight = ramp(scene.load.half_ramp_s)
    drag = 1.5 * scene.medium.viscosity_Pa_s / scene.radius_um if scene.time.history else 0.0
    found: dict[str, Any] = {"drag": drag} if drag else {}
    if not scene.drivers:
        return found | {"amplitude": weight}
    ramps = [weight] if scene.has_weight else []
    for _, one in scene.drivers:
        shortest = 0.5 * PUT_ON * scene.time.end_s if one.start_s > 0 else 0.0
        ramps.append(ramp(max(one.half_ramp_s, shortest), one.start_s))
    line = Timeline(ramps, max(scene.ramp_end_s, scene.time.end_s))
    shares = [line.share(number) for number in range(len(ramps))]
    dead = shares.pop(0) if scene.has_weight else lambda progress: 0.0
    drivers = [
        _driver(scene, name, one, share, centre, obstacles, groups)
        for (name, one), share in zip(scene.drivers, shares, strict=True)
    ]
    return found | {"amplitude": line.progress, "dead": dead, "drivers": tuple(drivers)}


def _driver(
    scene: Scene,
    name: str,
    one: parts.Adhesion | parts.Actin,
    share: Callable[[float], float],
    centre: tuple[float, ...],
    obstacles: Mapping[str, Obstacle],
    groups: Sequence[str] | None,
) -> Driver:
    if isinstance(one, parts.Adhesion):
        bare = tuple(o for label, o in obstacles.items() if kind_of(label) not in one.on)
        return Adhesion(share, one.work_uJ_m2, one.range_um, bare, one.above_um, name)
    angles, direction, layer = PLACES[one.where]
    radii: tuple[float | None, float | None] = one.radii_um or radii_of(scene, one)
    names = None
    if layer is not None and groups is not None and one.radii_um is None:  # an interface of the mesh bounds it sharply
        names = tuple(name for name in groups if whole(name) == layer)
        inside = [r if r is not None and r < scene.outer_radius_um(layer) else None for r in radii]
        radii = (None, inside[1])
    sector = Sector(centre, radii, one.angles_deg or angles, FADE * scene.radius_um, names)
    return Actin(share, one.stress_Pa, sector, one.direction or direction, name)


def kind_of(label: str) -> str:
    """What an obstacle is to a driver: "flat", or else "pillar"."""
    return "flat" if label == "flat" else "pillar"


def radii_of(scene: Scene, actin: parts.Actin) -> tuple[float | None, float | None]:
    """Radii between which it lies, by where it is said to be [µm]."""
    nucleus, rim = scene.nucleus_radius_um, scene.inner_radius_um("membrane")
    return {
        "cap": (nucleus, min(nucleus + CAP_UM * scene.radius_um, rim)),
        "basal": (nucleus, rim),
        "cortex": (rim, None),
        "sector": (None, None),
    }[actin.where]
