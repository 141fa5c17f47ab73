"""Whether mechanics supports a verdict: what statics alone says of a scene, by estimates on the safe side."""

from __future__ import annotations

import math

import numpy as np
from campaign_states import obstacles_of, ramp, weight_per_area

from cellmech.causes import Cause
from cellmech.scene.parts import LAYER_NAMES
from cellmech.scene.scene import Scene

SUPPORTED, SUSPECT, NAMED, CRASH = "verdict supported", "verdict SUSPECT", "round-off named", "crash"
EPS = float(np.finfo(float).eps)
# Load over stiffness below which a law bears it: 0.03 is Table 1, 0.1 the load at which Saint-Venant gives in there.
BEARS = {"neo-hookean": 0.15, "mooney-rivlin": 0.1, "saint-venant": 0.02, "yeoh": 0.02}
SINKING = 0.1  # of the radius: rigid obstacles that the cell sinks into by less hold it
ON_A_SLOPE = 1e-3  # tilt of a normal above which a contact pushes the cell aside
LEVEL = 1e-5  # the same below which nothing lets it slide: above, down from a hilltop, it may, as slowly as it be
HARD = 0.3  # strain at an impact beyond which a cell may be crushed; of weaker laws less, as at rest
WORTH = 3e-8  # rounding over load above which a solver may say so; a balance within 1e-3 needs much less


def stress(scene: Scene, t_s: float) -> float:
    """Weight over the width that carries it [Pa]: the cell's, or the pillars' where they are narrower."""
    width = 2 * scene.radius_um
    if scene.flat is None or _first(scene)[0] != "flat":
        width = min(width, max((2 * p.half_width_um for p in scene.pillar), default=width))
    return weight_per_area(scene) * math.pi * scene.radius_um**2 * ramp(scene, t_s) / width


def strain(scene: Scene, t_s: float) -> float:
    """That over the stiffness of the softest layer's solid [-]."""
    solid = min((1 - scene.layer_of(n).fluid_fraction) * scene.layer_of(n).young_Pa for n in LAYER_NAMES)
    return stress(scene, t_s) / solid if solid > 0 else math.inf


def settles(scene: Scene, t_s: float) -> float:
    """By how much the cell comes down, roughly [µm]: into the penalty, and by its own strain."""
    return stress(scene, t_s) / scene.contact.penalty_Pa_per_um + min(strain(scene, t_s), 1.0) * scene.radius_um


def rounding(scene: Scene, t_s: float) -> float:
    """Rounding over load: of stresses that cancel, and of the depth that carries the load [-]."""
    load = stress(scene, t_s)
    if load == 0:
        return math.inf
    stiffest = max((1 - scene.layer_of(n).fluid_fraction) * scene.layer_of(n).young_Pa for n in LAYER_NAMES)
    fluid = max(scene.layer_of(n).fluid_fraction for n in LAYER_NAMES) if scene.time.history else 0.0
    viscosity = fluid * (scene.cell.fluid_lambda_Pa_s + scene.cell.fluid_mu_Pa_s)
    stiffest += viscosity / min(scene.time.end_s, 2 * scene.load.half_ramp_s or scene.time.end_s) * 1e4
    extent = scene.radius_um + abs(scene.cell.centre_x_um)
    depth, s = load / scene.contact.penalty_Pa_per_um, scene.contact.smoothing_um
    depth = depth if depth > s else math.sqrt(2 * s * depth)
    return EPS * max(stiffest / load, 2 * extent / depth)


def _touches(scene: Scene) -> list[tuple[float, float, str]]:
    """(level of the centre at touch [µm], sideways part of the normal there, name) for each obstacle below the cell."""
    radius, x0, found = scene.radius_um, scene.cell.centre_x_um, []
    for k, obstacle in enumerate(obstacles_of(scene)):
        if len(obstacle) == 1:
            found.append((obstacle[0] + radius, 0.0, "flat"))
            continue
        x, y, w, h, e = obstacle
        low, high = max(x - w, x0 - radius), min(x + w, x0 + radius)
        for _ in range(12 if low < high else 0):  # both are concave: the highest is found by narrowing
            at = np.linspace(low, high, 201)
            level = y + h * np.clip(1 - np.abs((at - x) / w) ** e, 0, None) ** (1 / e)
            level += np.sqrt(np.clip(radius**2 - (at - x0) ** 2, 0, None))
            best = int(np.argmax(level))
            low, high = at[max(best - 1, 0)], at[min(best + 1, 200)]
        if low < high:
            found.append((float(level[best]), float((x0 - at[best]) / radius), f"obstacle {k}"))
    return found


def _first(scene: Scene) -> tuple[str, float]:
    """Name and tilt of what is touched first; "" without obstacles below."""
    _, tilt, name = max(_touches(scene), default=(0.0, 0.0, ""))
    return name, tilt


def stands(scene: Scene, t_s: float, level: float = ON_A_SLOPE) -> bool:
    """Whether statics gives a full cell an equilibrium next to where it starts, and a half cell its symmetric one.

    A tilt up to `level` is none.
    """
    if scene.cell.shape == "half":
        return True
    touches = _touches(scene)
    first = max(touches)
    if abs(first[1]) <= level:
        return True
    reached = [touch for touch in touches if touch[0] >= first[0] - 0.3 * settles(scene, t_s)]
    return min(t[1] for t in reached) < 0 < max(t[1] for t in reached)  # held from both sides


def bears(scene: Scene, t_s: float) -> bool:
    """Whether the material bears the load by a wide margin, and the obstacles too."""
    tilt = max((abs(t[1]) for t in _touches(scene)), default=0.0)
    steep = max(1 - tilt**2, 1e-3)
    limit = min(BEARS[scene.layer_law(name)] for name in LAYER_NAMES)
    if scene.cell.yeoh_reference == "printed":
        return False
    sinks = stress(scene, t_s) / scene.contact.penalty_Pa_per_um / scene.radius_um
    return strain(scene, t_s) < limit * steep and sinks < SINKING * steep


def impact(scene: Scene) -> float:
    """Strain that stops a cell which has fallen its gap [-]: its speed over that of waves in the softest solid."""
    solid = min((1 - scene.layer_of(n).fluid_fraction) * scene.layer_of(n).young_Pa for n in LAYER_NAMES)
    return math.sqrt(2 * abs(weight_per_area(scene)) * scene.cell.gap_um / solid) if solid > 0 else math.inf


def verdict(scene: Scene, cause: Cause) -> str:
    """What to think of a case that failed: "verdict supported", "verdict SUSPECT", "round-off named".

    Args:
        scene: what was asked for.
        cause: why, as the program says.
    """
    end = scene.time.end_s
    if cause.passing:
        return CRASH
    if cause is Cause.ROUND_OFF:
        return NAMED if rounding(scene, min((*scene.output.times_s, end))) > WORTH else SUSPECT
    if cause is Cause.TOO_COARSE:
        return SUPPORTED  # measured beside the solver's own points
    if cause is Cause.SLIDES:
        return SUSPECT if stands(scene, end, LEVEL) else SUPPORTED
    if scene.cell.inertia:
        weakest = min(BEARS[scene.layer_law(name)] for name in LAYER_NAMES) / max(BEARS.values())
        return SUPPORTED if impact(scene) > HARD * weakest else SUSPECT
    if not stands(scene, end) or not bears(scene, end):
        return SUPPORTED
    return SUSPECT
