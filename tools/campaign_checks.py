"""What must hold of a result, whatever the solver thought of it: statics, energy, times, finite numbers, free fall.

Each check compares with what the scene alone says, or with a `State` integrated anew; none uses a tolerance of the
solver. `judge` makes them all; a case may fail, and then its last saved state is judged.
"""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from campaign_states import State, pressure, ramp, weight_per_area

from cellmech.scene.scene import Scene

BALANCE = (
    1e-3  # of the load at the time: what may be out of balance, upwards, sideways, and as a moment over the radius
)
REPORTED = 1e-3  # relative: how well a reported number must be the one that follows from the fields
COARSE = 0.05  # relative: what the mesh of the contact may miss of the force between the solver's points, unsaid
ENERGY = 0.02  # of the largest work: what may be missing in the balance, for time steps of finite length
IN_THE_AIR = 1e-4  # relative: of the way fallen
STRAIGHT = 0.05  # relative: of the disc's area, which straight edges cut
FAR = 2.0  # radii: a quasi-static cell does not go further


@dataclass(frozen=True)
class Fault:
    """A check that does not hold.

    Args:
        check: its name.
        text: what was found, and what is right.
    """

    check: str
    text: str


def judge(scene: Scene, folder: Path) -> list[Fault]:
    """All that is wrong with a case's files, nothing if all is right."""
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    rows = read_history(folder / "history.csv")
    series = read_series(folder / "fields.pvd")
    faults = [*numbers_are_finite(result, rows), *times_are_there(scene, result, rows, series)]
    if not rows:
        return faults + ([Fault("history", "solved without an accepted step")] if result["status"] == "solved" else [])
    told = "energy" in result["model"]["warnings"]
    faults += [*history_is_balanced(scene, rows), *energy_is_balanced(scene, rows, told), *material_is_whole(rows)]
    for t_s, path in series:
        if not path.exists():
            continue  # `times_are_there` has said so
        state = State(scene, path)
        found = state_is_right(scene, state, t_s, result, rows)
        faults += [Fault(fault.check, f"t = {t_s:.6g} s: {fault.text}") for fault in found]
    return faults


def read_history(path: Path) -> list[dict[str, float]]:
    """Rows of history.csv, NaN where a cell is empty; none where there is no file."""
    if not path.exists():
        return []
    with open(path, encoding="utf-8", newline="") as stream:
        return [{key: float(cell or "nan") for key, cell in row.items()} for row in csv.DictReader(stream)]


def read_series(path: Path) -> list[tuple[float, Path]]:
    """Times [s] and files that fields.pvd lists; none where there is no file."""
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    return [(float(t), path.parent / name) for t, name in re.findall(r'timestep="([^"]+)" file="([^"]+)"', text)]


def numbers_are_finite(result: Mapping[str, Any], rows: Sequence[Mapping[str, float]]) -> Iterator[Fault]:
    """No NaN and no infinity, in result.json and in what history.csv fills in."""

    def walk(value: Any, key: str) -> Iterator[str]:
        if isinstance(value, Mapping):
            for name, inner in value.items():
                yield from walk(inner, f"{key}.{name}" if key else name)
        elif isinstance(value, list):
            for inner in value:
                yield from walk(inner, key)
        elif isinstance(value, float) and not math.isfinite(value):
            yield key

    bad = [*walk(result, ""), *(key for row in rows for key, value in row.items() if math.isinf(value))]
    if bad:
        yield Fault("finite", f"not finite: {', '.join(dict.fromkeys(bad))}")


def times_are_there(
    scene: Scene, result: Mapping[str, Any], rows: Sequence[Mapping[str, float]], series: Sequence[tuple[float, Path]]
) -> Iterator[Fault]:
    """The end is reached, every requested time that was reached has its files, time goes forward."""
    solved, reached = result["status"] == "solved", result["t_s"]
    if solved and reached != scene.time.end_s:
        yield Fault("times", f"ends at {reached!r} s, not at {scene.time.end_s!r} s")
    asked = [t for t in (*scene.output.times_s, scene.time.end_s) if solved or t <= reached]
    missing = [t for t in asked if t not in [t_s for t_s, _ in series]] if rows else []
    if missing:
        yield Fault("times", f"no field file of exactly {', '.join(map(repr, missing))} s")
    gone = [path.name for _, path in series if not path.exists()]
    if gone:
        yield Fault("times", f"listed but not there: {', '.join(gone)}")
    at = [row["t_s"] for row in rows]
    if any(later <= earlier for earlier, later in pairwise(at)):
        yield Fault("times", "time does not go forward in history.csv")
    if rows and at[-1] != reached:
        yield Fault("times", f"history.csv ends at {at[-1]!r} s, result.json at {reached!r} s")


def history_is_balanced(scene: Scene, rows: Sequence[Mapping[str, float]]) -> Iterator[Fault]:
    """The weight told is the load at the time; quasi-static, the contact carries it in every step, however small."""
    full = weight_per_area(scene) * math.pi * scene.radius_um**2
    off, worst = 0.0, (0.0, 0.0, 0.0)
    for row in rows:
        load, told = full * ramp(scene, row["t_s"]), row["contact.weight_Pa_x_um"]
        off = max(off, abs(told - load) / load if load else abs(told))
        if told:
            worst = max(worst, (abs(row["contact.force_Pa_x_um"] / told - 1), row["t_s"], told))
    if off > (STRAIGHT if scene.mesh.order == 1 else REPORTED):
        yield Fault("weight", f"the weight in history.csv is off by {off:.3g} of rho g area times the ramp")
    if worst[0] > BALANCE and not scene.cell.inertia:
        share, t_s, load = worst
        yield Fault("history balance", f"t = {t_s:.6g} s: off by {share:.3g} of the load then, {load:.3g} Pa um")


def energy_is_balanced(scene: Scene, rows: Sequence[Mapping[str, float]], told: bool = False) -> Iterator[Fault]:
    """Work of gravity = stored + dissipated + contact + kinetic, or the program says so; dissipation never falls."""
    works = [row.get("energy.gravity_work", math.nan) for row in rows]
    if any(math.isnan(work) for work in works):
        return
    largest, missing = max(map(abs, works)), abs(rows[-1]["energy.balance_error"])
    if missing > max(ENERGY, 5 * scene.time.rtol) * largest and not told:
        yield Fault("energy", f"{missing:.3g} Pa um2 missing at the end, {missing / (largest or 1):.3g} of the work")
    parts = ("stored", "dissipated", "contact_work", "kinetic", "balance_error")
    last = rows[-1]
    total = sum(value for key in parts if not math.isnan(value := last.get(f"energy.{key}", 0.0)))
    if abs(total - works[-1]) > 1e-9 * max(largest, abs(total)):
        yield Fault("energy", f"the parts add up to {total:.6g}, the work of gravity is {works[-1]:.6g} Pa um2")
    if last["energy.dissipated"] < -ENERGY * largest or last["energy.stored"] < -ENERGY * largest:
        yield Fault("energy", "stored or dissipated energy is negative")


def material_is_whole(rows: Sequence[Mapping[str, float]]) -> Iterator[Fault]:
    """det F > 0 in every accepted step."""
    least = min(row["cell.det_F_min"] for row in rows)
    if not least > 0:
        yield Fault("det F", f"{least:.3g} in history.csv")


def state_is_right(
    scene: Scene,
    state: State,
    t_s: float,
    result: Mapping[str, Any] | None,
    rows: Sequence[Mapping[str, float]],
) -> Iterator[Fault]:
    """One saved state of a case."""
    if not state.finite():
        yield Fault("finite", "a field file holds NaN or infinity")
        return
    if not state.det_F.min() > 0:
        yield Fault("det F", f"{state.det_F.min():.3g} in the field file")
    yield from reports_fit(scene, state, t_s, result, rows)
    if scene.cell.inertia:
        yield from falls_freely(scene, state, t_s)
    else:
        yield from is_in_balance(scene, state, t_s)


def reports_fit(
    scene: Scene,
    state: State,
    t_s: float,
    result: Mapping[str, Any] | None,
    rows: Sequence[Mapping[str, float]],
) -> Iterator[Fault]:
    """Force, depth, pressure and width as reported are those that follow from the fields."""
    row = next((row for row in rows if row["t_s"] == t_s), None)
    if row is None:
        yield Fault("times", "the field file's time is no row of history.csv")
        return
    if result is not None and t_s == result.get("t_s"):
        told = {key: result["contact"][key] for key in ("force_Pa_x_um", "max_depth_um")}
        if any(value != row[f"contact.{key}"] for key, value in told.items() if value is not None):
            yield Fault("reported", "result.json and the last row of history.csv differ")
    bubble = scene.mesh.order == 2 and scene.nearly_incompressible() and scene.contact.form != "surface"
    forces, exact = state.forces(), state.forces(fine=True)
    noise = rounding(scene, state)
    told_force = row["contact.force_Pa_x_um"]
    scale = max(abs(told_force), abs(forces.up))
    if not bubble and abs(told_force - forces.up) > REPORTED * scale + noise:
        yield Fault("reported", f"force {told_force:.6g} Pa um, but {forces.up:.6g} follows from the fields")
    if abs(exact.up - forces.up) > COARSE * max(abs(exact.up), abs(forces.up)) + noise and not warned(result):
        text = f"force {forces.up:.4g} at the solver's points, {exact.up:.4g} Pa um between them too"
        yield Fault("contact mesh", text)
    yield from width_fits(scene, state, row.get("contact.half_width_um", math.nan), exact.depth_um)
    depth, most = (row.get(f"contact.{key}", math.nan) for key in ("max_depth_um", "max_pressure_Pa"))
    if scene.contact.form == "surface" and depth > 0:
        if abs(most - pressure(scene, np.array(depth))) > REPORTED * most:
            yield Fault("reported", f"pressure {most:.6g} Pa does not belong to depth {depth:.6g} um")
        off = abs(depth - max(exact.depth_um, 0.0))
        if off > COARSE * depth + 1e-13 * state.scene.radius_um:
            yield Fault("reported", f"depth {depth:.6g} um, but {exact.depth_um:.6g} follows from the fields")


def width_fits(scene: Scene, state: State, told_um: float, depth_um: float) -> Iterator[Fault]:
    """The half-width as reported is that of the outline, whatever the solver's points see of the contact."""
    if math.isnan(told_um):
        return
    half_um = state.touching_um() / (3 - state.copies)  # a half cell's is that of the modelled half
    deep = depth_um if scene.contact.form == "surface" else depth_um + scene.contact.volume_width_um
    allowed = COARSE + rounding_share(state, deep)
    if abs(told_um - half_um) > allowed * max(told_um, half_um):
        yield Fault("reported", f"half-width {told_um:.6g} um, but {half_um:.6g} follows from the fields")


def warned(result: Mapping[str, Any] | None) -> bool:
    """Whether the program itself says that its mesh misses the contact."""
    text = json.dumps((result or {}).get("model", {}).get("warnings", ""))
    return "contact" in text and "mesh" in text


def rounding(scene: Scene, state: State) -> float:
    """What rounding of positions changes in a contact force [Pa µm]: nothing beside a load that is worth its name."""
    position = 4e-16 * float(np.abs(state.X).max() + np.abs(state.u).max())
    return scene.contact.penalty_Pa_per_um * position * math.pi * scene.radius_um * 1e-3


def rounding_share(state: State, depth_um: float) -> float:
    """What rounding of the positions in a field file changes in a contact force that grows with the depth squared [-].

    Some last places of a position for its place on the element and for the obstacle's level set there.
    """
    position = 3e-15 * float(np.abs(state.X).max() + np.abs(state.u).max())
    return 2 * position / depth_um if depth_um > 0 else 0.0


def is_in_balance(scene: Scene, state: State, t_s: float) -> Iterator[Fault]:
    """Quasi-static: forces and moment of the obstacles against the weight at the time; the cell stays where it is."""
    load, forces = weight_per_area(scene) * state.area() * ramp(scene, t_s), state.forces()
    if load == 0:
        return
    printed = scene.contact.form == "volume-printed"  # not frictionless: it leans outward
    bubble = scene.mesh.order == 2 and scene.nearly_incompressible() and scene.contact.form != "surface"
    allowed = BALANCE + rounding_share(state, forces.depth_um)
    if abs(forces.up - load) > (0.05 if bubble else allowed) * load:
        yield Fault("balance", f"the obstacles bear {forces.up:.6g}, the load is {load:.6g} Pa um")
    if state.copies == 1 and not printed:
        if abs(forces.sideways) > allowed * load:
            yield Fault("sideways", f"{forces.sideways:.3g} Pa um, {forces.sideways / load:.3g} of the load")
        if abs(forces.moment) > allowed * load * scene.radius_um:
            share = forces.moment / load / scene.radius_um
            yield Fault("moment", f"{forces.moment:.3g} Pa um2, {share:.3g} of load times radius")
    touch = 0.0 if scene.contact.form == "surface" else -scene.contact.volume_width_um
    if not state.forces(fine=True).depth_um > touch:
        yield Fault("depth", f"loaded, and touches nothing: depth {forces.depth_um:.3g} um")
    moved = float(np.linalg.norm(state.u, axis=-1).max())
    if moved > FAR * scene.radius_um:
        yield Fault("moved", f"a quasi-static cell has moved {moved:.4g} um, its radius is {scene.radius_um:.4g} um")


def free_fall(scene: Scene, t_s: float) -> float:
    """How far a body falls whose load comes on by the ramp [µm]."""
    density = scene.cell.density_kg_m3 - scene.cell.medium_density_kg_m3
    g = density / scene.cell.density_kg_m3 * scene.load.gravity_m_s2 * 1e6 * scene.load.factor
    ramped = min(t_s, 2 * scene.load.half_ramp_s)
    x, w = np.polynomial.legendre.leggauss(12)
    at = (x + 1) / 2 * ramped
    early = float(np.sum(w * [(t_s - t) * ramp(scene, float(t)) for t in at])) * ramped / 2
    return g * (early + (t_s - ramped) ** 2 / 2)


def falls_freely(scene: Scene, state: State, t_s: float) -> Iterator[Fault]:
    """In the air: s = g t2/2, or what the ramp makes of it."""
    way = free_fall(scene, t_s)
    gap = scene.cell.gap_um if scene.pillar or scene.flat else math.inf
    reach = 0.0 if scene.contact.form == "surface" else scene.contact.volume_width_um
    if not way < 0.999 * (gap - reach):
        return
    allowed = IN_THE_AIR if scene.load.half_ramp_s == 0 else max(IN_THE_AIR, 5 * scene.time.rtol)
    if abs(state.fall() - way) > allowed * way:
        yield Fault("free fall", f"fell {state.fall():.8g} um, g t2/2 is {way:.8g} um")
