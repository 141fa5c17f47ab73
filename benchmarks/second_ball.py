"""The settled neo-Hookean ball of Table 1 by a second code (NGSolve, `ngsolve_ball.py`) and by this package.

Turned about its axis and in space, both codes on a mesh of their own, each also on a coarser one. Every number that
both report is compared: means, totals and lengths have to agree within 0.5 %, largest and least values within 2 %, of
J1, J2, J3 and det F after taking off their values at rest, and where such a distance is below 1e-4, within 1e-6. What
is farther apart is "open" where one of the codes is itself not so sure, its two meshes being no nearer to each other,
and differs where both are sure; those of `SURE` have to agree. In space the largest J's and the least pressures are
open: on one element across a thin layer, and beside the lamina on the default mesh, the package's are too large.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import command
from ngsolve_ball import REGIONS, InSpace, Turned
from ngsolve_cell import Level
from ngsolve_quarter import Rings

REST = {"J1": 3.0, "J2": 3.0, "J3": 1.0, "det_F": 1.0}
MEAN, EXTREME, NEAR_REST = 0.5, 2.0, (1e-4, 1e-6)  # percent, percent, distance from rest and what is allowed there
EXTREMES = ("_max", "_min", "_p99")
SURE = ("_mean", "sigma_mises_max", "contact.", "energy.", "volume", "nucleus_shape.")
TABLES = (*REGIONS, "contact", "energy", "nucleus_shape", "shape_index")
SOLVERS = {
    "axisymmetric": (Turned, Level(far=1.0, near=0.1, lamina=0.1, order=3), Level(0.5, 0.1, 0.1, order=4)),
    "3d": (InSpace, Rings(8, 16, 4, (2, 1, 3, 1), order=3), Rings(8, 16, 4, (2, 1, 3, 1), order=4)),
}
MESHES = {  # the package's two: the default, and one that is fine enough
    "axisymmetric": ([], ["mesh.size_um=1.2"]),
    "3d": ([], ["mesh.size_um=2.4", "mesh.thin_layers=2"]),
}


def flat(table: dict[str, Any], name: str = "") -> dict[str, float]:
    """The numbers of a result.json, named "table.key"; of the centroid its height."""
    found: dict[str, float] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            found |= flat(value, f"{name}{key}.")
        elif isinstance(value, int | float):
            found[name + key] = value
        elif key == "centroid_um":
            found[name + key] = value[1]
    return found


def package(out: Path, geometry: str, settings: list[str]) -> dict[str, Any]:
    """Run the package's command line; its result.json."""
    scene = f'title = "Table 1"\n[cell]\ngeometry = "{geometry}"\n[time]\nhistory = false\n'
    result = command.solved(out / f"{geometry}-{'fine' if settings else 'default'}", scene, settings)
    if result["status"] != "solved":
        raise SystemExit(f"cellmech {geometry}: {result['reason']}")
    print(f"cellmech {geometry}: {result['mesh_cells']} elements, {result['dofs']} unknowns", flush=True)
    return result


def second(scene: dict[str, Any], geometry: str, level: Any) -> dict[str, float]:
    """The same numbers by NGSolve, with one line on what it took."""
    start = time.perf_counter()
    ball = SOLVERS[geometry][0](scene, level)
    steps = len(ball.solve(start_depth=1.0)) - 1
    report = ball.report()
    size = f"{ball.mesh.ne} elements of order {level.order}, {ball.space.ndof} unknowns"
    print(f"NGSolve {geometry}: {size}, {steps} Newton steps, {time.perf_counter() - start:.0f} s", flush=True)
    return {key: value for key, value in report.items() if isinstance(value, float)}


def rest(key: str) -> float:
    """Value at rest of a quantity of a region."""
    region, _, name = key.partition(".")
    return REST.get(name.rpartition("_")[0], 0.0) if region in REGIONS else 0.0


def used(key: str, value: float, reference: float) -> float:
    """Difference over what is allowed."""
    distance = abs(reference - rest(key))
    allowed = distance * (EXTREME if any(word in key for word in EXTREMES) else MEAN) / 100
    if rest(key) and distance < NEAR_REST[0]:
        allowed = NEAR_REST[1]
    return abs(value - reference) / allowed


def unsettled(key: str, alike: dict[str, tuple[float, float]]) -> bool:
    """Whether a code's own two meshes are farther apart than is allowed; of strains in a region, any of its largest.

    They come of the same places, and the largest J's of single nodes, whose error has a sign of its own.
    """
    region, name = key.split(".") if "." in key else ("", key)
    strains = [f"{region}.{word}" for word in ("J1_max", "J2_max", "J3_max", "pressure_min_Pa")]
    return any(max(alike[one]) > 1 for one in {key, *(strains if f"{region}.{name}" in strains else ())})


def compare(out: Path, geometry: str) -> list[list[Any]]:
    """Print a geometry's table; its rows."""
    coarse, fine = (package(out, geometry, settings) for settings in MESHES[geometry])
    ours, rough = flat(fine), flat(coarse)
    reference, first = (second(fine["scene"], geometry, level) for level in SOLVERS[geometry][:0:-1])
    rows: list[list[Any]] = []
    common = sorted(set(reference) & set(ours))
    alike = {k: (used(k, first[k], reference[k]), used(k, rough[k], ours[k])) for k in common}
    print(f"\n{geometry} (J, det F less their values at rest; apart: over what is allowed)")
    print(f"{'quantity':46}{'second code':>14}{'cellmech':>14}{'diff %':>9}{'apart':>8}  verdict  own meshes apart")
    for key in common:
        a, b = reference[key] - rest(key), ours[key] - rest(key)
        apart, own = used(key, ours[key], reference[key]), alike[key]
        unsure = unsettled(key, alike) and not any(word in key for word in SURE)
        verdict = "agrees" if apart <= 1 else "open" if unsure else "DIFFERS"
        c = rough[key] - rest(key)
        rows.append([geometry, key, a, b, c, 100 * (b / a - 1), 100 * (c / a - 1), verdict])
        print(f"{key:46}{a:14.6g}{b:14.6g}{100 * (b / a - 1):9.3f}{apart:8.2f}  {verdict:7}{own[0]:9.2f}{own[1]:8.2f}")
    left = sorted(key for key in set(ours) - set(reference) if key.split(".")[0] in TABLES)
    print(f"{geometry}: not in the second code: {', '.join(left)}")
    counted = {word: sum(row[-1] == word for row in rows) for word in ("agrees", "open", "DIFFERS")}
    print(f"{geometry}: " + ", ".join(f"{n} {word}" for word, n in counted.items()), flush=True)
    return rows
