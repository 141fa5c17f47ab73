"""Locking as nu -> 0.5: P2 alone beside P2/P0 and the mixed form, on the Table 1 cell and on Cook's membrane.

All run through the same Newton's method, so that only the elements differ: a pressure that is quadratic in each element
passes through the law's own pressure at all six quadrature points, which is P2 alone to round-off, without P2's own
Newton iteration, which finds no equilibrium at nu = 0.499. Errors are against the mixed form on a finer mesh, of J1,
J2, J3 on q - q0. Processor times are of the solve, forms compiled before.

    python benchmarks/locking.py [--nu 0.45 0.49 ...] [--size 1.2 0.6] [--reference 0.3] [--out results/locking]
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI

from cellmech.cell.observables import Observer
from cellmech.cell.setup import Setup
from cellmech.fem.coefficients import material_fields
from cellmech.fem.domain import Domain
from cellmech.fem.jit import displacement_space, pressure_space
from cellmech.mechanics.balance import Body
from cellmech.mechanics.laws import neo_hookean
from cellmech.mechanics.materials import Material
from cellmech.mechanics.moduli import lame
from cellmech.runs.case import mesh_plan
from cellmech.scene.studies import load_study
from cellmech.solver.newton import Solver
from cellmech.solver.state import State

FORMS = {"P2": (False, 2), "P2/P0": (False, 0), "mixed": (True, 1)}  # bubble, degree of the pressure
COOK_NU, COOK_MU, COOK_SHEAR = 0.499, 422.5, 62.5  # [-], kPa, kPa
ABSOLUTE, SMALL = 1e-6, 1e-4  # where q - q0 is less than SMALL, its error is over SMALL: ABSOLUTE is 1 %
REST = {"J1": 2.0, "J2": 2.0, "J3": 1.0}


def cell(nu: float, size: float, form: str) -> dict[str, float]:
    """The end state of the Table 1 cell, neo-Hookean: its numbers, and what they took."""
    setup = set_up(nu, size, "mixed")
    bubble, degree = FORMS[form]
    mesh = setup.domain.mesh
    space = displacement_space(mesh, 2, bubble)
    setup.body = dataclasses.replace(
        setup.body, space=space, bcs=setup.symmetry(space), pressure_space=pressure_space(mesh, degree)
    )
    run = setup.create_run(lambda line: None)
    started = time.process_time()
    run.run(lambda step: None)
    cpu_s = time.process_time() - started
    run.close()
    if form == "P2":  # reports the stress of its displacement, as the program does where it is alone
        run.body = dataclasses.replace(run.body, materials=set_up(nu, size, "none").body.materials)
    result = Observer(run, setup.layout()).observe(run.t)
    numbers = {"penetration_um": result["contact"]["max_depth_um"]}
    for region in ("nucleus", "lamina"):
        for q in ("sigma_mises_max_Pa", "J1_max", "J2_max", "J3_max", "pressure_max_Pa", "pressure_mean_Pa"):
            numbers[f"{region}.{q}"] = result[region][q] - REST.get(q[:2], 0.0)
    cost = {"cells": setup.number_of_cells, "newton": run.totals.newton_iterations, "cpu_s": cpu_s}
    return cost | {"factorisations": run.totals.factorisations} | numbers


def set_up(nu: float, size: float, pressure: str) -> Setup:
    """The Table 1 cell, its end state asked for."""
    settings = {"cell.poisson": nu, "mesh.size_um": size, "mesh.order": 2, "mesh.pressure": pressure}
    settings |= {"time.history": "false"}
    study = load_study(None, [f"{key}={value}" for key, value in settings.items()])
    return Setup(study.cases[0].scene, MPI.COMM_SELF, mesh_plan(study.cases[0].scene))


def cook(n: int, form: str) -> dict[str, float]:
    """Cook's membrane (48, 44, 16 mm, plane strain, neo-Hookean, dead shear on the right): tip displacement [mm]."""
    domain = membrane(n)
    bubble, degree = FORMS[form]
    space = displacement_space(domain.mesh, 2, bubble)
    young = 2 * COOK_MU * (1 + COOK_NU)
    constants = dict(zip(("lmbda", "mu"), lame(young, COOK_NU), strict=True))
    held = fem.locate_dofs_topological(space, 1, domain.facet_tags.find(domain.facets["left"]))
    body = Body(
        domain,
        material_fields(domain, {"solid": Material(neo_hookean, constants, mixed=True)}),
        space,
        (fem.dirichletbc(fem.Function(space), held),),
        tractions={"right": (0.0, COOK_SHEAR)},
        pressure_space=pressure_space(domain.mesh, degree),
    )
    state, iterations = State(body), 0
    solver = Solver(body, state, force_scale=16 * COOK_SHEAR)
    started = time.process_time()
    for share in np.linspace(0.25, 1.0, 4):
        outcome = solver.solve(float(share))
        iterations += outcome.iterations
        if not outcome.converged:
            raise SystemExit(f"Cook's membrane, {form}, n = {n}: {outcome.reason}")
    cpu_s = time.process_time() - started
    solver.close()
    X = space.tabulate_dof_coordinates()
    tip = int(np.argmin(np.hypot(X[:, 0] - 48.0, X[:, 1] - 52.0)))
    return {"cells": 2 * n * n, "newton": iterations, "cpu_s": cpu_s, "tip_mm": float(state.u.x.array[2 * tip + 1])}


def membrane(n: int) -> Domain:
    """n by n squares of the membrane, each cut in two."""
    mesh = dmesh.create_unit_square(MPI.COMM_SELF, n, n)
    x = mesh.geometry.x
    s, t = x[:, 0].copy(), x[:, 1].copy()
    x[:, 0], x[:, 1] = 48 * s, (44 + 16 * t) * s + 44 * t * (1 - s)
    mesh.topology.create_connectivity(1, 2)
    facets = {
        "left": dmesh.locate_entities(mesh, 1, lambda x: np.isclose(x[0], 0.0)),
        "right": dmesh.locate_entities(mesh, 1, lambda x: np.isclose(x[0], 48.0)),
    }
    numbers = {name: k for k, name in enumerate(facets, 1)}
    entities = np.concatenate(list(facets.values())).astype(np.int32)
    values = np.repeat(np.array(list(numbers.values()), dtype=np.int32), [len(f) for f in facets.values()])
    order = np.argsort(entities)
    cells = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32)
    tags = dmesh.meshtags(mesh, 2, cells, np.ones(len(cells), dtype=np.int32))
    return Domain(mesh, tags, dmesh.meshtags(mesh, 1, entities[order], values[order]), {"solid": 1}, numbers, {})


def error_percent(name: str, value: float, reference: float) -> float:
    """Of a number, signed; strains as differences from rest."""
    small = name.split(".")[-1][:2] in REST and abs(reference) < SMALL
    return 100 * (value - reference) / (SMALL if small else abs(reference))


def table(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Write rows as CSV, and as Markdown beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    cells = [[f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()] for row in rows]
    lines = [list(rows[0]), ["---"] * len(rows[0]), *cells]
    path.with_suffix(".md").write_text("".join(f"| {' | '.join(line)} |\n" for line in lines), encoding="utf-8")


def main() -> None:
    """Run, compare, print, and write cell.csv, cell.md, cook.csv, cook.md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nu", type=float, nargs="+", default=[0.45, 0.47, 0.48, 0.49, 0.499, 0.4999])
    parser.add_argument("--size", type=float, nargs="+", default=[1.2, 0.6], help="of the elements [um]")
    parser.add_argument("--reference", type=float, default=0.3, help="size of the elements of the reference [um]")
    parser.add_argument(
        "--cook", type=int, nargs="+", default=[4, 8, 16, 32], help="rows; the reference: twice the last"
    )
    parser.add_argument("--out", type=Path, default=Path("results/locking"))
    arguments = parser.parse_args()
    for form in FORMS:  # compile
        cell(0.45, 3.0, form)
        cook(2, form)
    rows = []
    for nu in arguments.nu:
        reference = cell(nu, arguments.reference, "mixed")
        for size in arguments.size:
            for form in FORMS:
                found = cell(nu, size, form)
                cost = {key: found[key] for key in ("cells", "newton", "factorisations", "cpu_s")}
                errors = {k: error_percent(k, v, reference[k]) for k, v in found.items() if k not in cost}
                rows.append({"nu": nu, "size_um": size, "form": form, **cost, **errors})
                print("  ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in rows[-1].items()))
                table(rows, arguments.out / "cell.csv")
    best = cook(2 * arguments.cook[-1], "mixed")["tip_mm"]
    tips = [{"n": n, "form": f, **cook(n, f)} for n in arguments.cook for f in FORMS]
    tips = [{**row, "tip_error_percent": error_percent("tip", row["tip_mm"], best)} for row in tips]
    table(tips, arguments.out / "cook.csv")
    print((arguments.out / "cook.md").read_text())


if __name__ == "__main__":
    main()
