"""One case from its scene to its result files."""

from __future__ import annotations

import platform
import resource
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import cellmech.fem.started  # noqa: F401 before all that it starts

# isort: split

import dolfinx
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from cellmech import __version__
from cellmech.causes import Reason
from cellmech.cell.additions import Additions
from cellmech.cell.cascade import begin_near
from cellmech.cell.description import describe_model
from cellmech.cell.layering import MeshPlan, mesh_plan
from cellmech.cell.observables import STRAINS, Observer
from cellmech.cell.placed import Placed
from cellmech.cell.setup import NONE, Setup
from cellmech.errors import SolveError
from cellmech.fem import fenicsx
from cellmech.results import checkpoint
from cellmech.results.field_files import write_fields
from cellmech.results.outline_file import write_outlines
from cellmech.results.records import CaseFolder, flatten
from cellmech.scene.case import Case
from cellmech.scene.files import scene_to_toml
from cellmech.scene.scene import Scene
from cellmech.solver import room
from cellmech.solver.acceptance import Refused
from cellmech.solver.ellipticity import Stability
from cellmech.solver.ellipticity_in_space import EllipticityInSpace, StabilityInSpace
from cellmech.solver.linear import needed_bytes
from cellmech.solver.resolution import UNTOLD, doubts, unbalanced
from cellmech.solver.schedule import Memory, Step
from cellmech.solver.simulation import Simulation

__all__ = ["Description", "MeshPlan", "Progress", "describe_case", "mesh_plan", "solve_case"]

OUT_OF_PLANE = (
    "waves that leave the plane, which no state here can show, lose ellipticity: {}: in space this state is not stable"
)
MEMORY_BASE_MB, MEMORY_PER_DOF_MB = 260.0, 0.012
FOLDED = 0.55  # least stretch of a membrane below which its surface folds: a half space creases at 0.54 (Biot 1963)
FOLDS = (
    "the membrane is squeezed to {least:.2g} of a length: it folds at the edge of the contact, which then may stick "
    "where a wider adhesion.range_um would let it move on; compare two ranges"
)
MESHED_AT_ONCE, COARSE = 1e6, 5e4  # unknowns up to which a case is described by its mesh, and of what stands in for it


@dataclass(frozen=True)
class Progress:
    """Progress of a case."""

    case: str
    t_s: float
    end_s: float
    step: int
    newton: int


@dataclass(frozen=True)
class Description:
    """The model of a case, and its size: exact, or estimated without a mesh, to some 10 %."""

    model: list[str]
    cells: int
    dofs: int
    memory_MB: float
    estimated: bool = False


def solve_case(
    case: Case,
    folder: CaseFolder,
    comm: MPI.Comm,
    plan: MeshPlan,
    report: Callable[[Progress], None],
    additions: Additions = NONE,
) -> dict[str, Any]:
    """Solve one case and write its files; the content of result.json is returned (collective on comm).

    A physical failure is a result too: status "failed", its reason, and the last good state.
    """
    with fenicsx.own_options(), ExitStack() as stack:
        try:
            return _solve(case, folder, comm, plan, report, additions, stack)
        except BaseException:
            if comm.size > 1:  # maybe on this rank alone, which must not wait for the others to free a solver
                stack.pop_all()
            raise


def _solve(
    case: Case,
    folder: CaseFolder,
    comm: MPI.Comm,
    plan: MeshPlan,
    report: Callable[[Progress], None],
    additions: Additions,
    stack: ExitStack,
) -> dict[str, Any]:
    """As `solve_case`; closing the stack frees the solver."""
    started, scene = time.perf_counter(), case.scene
    earlier_s = 0.0
    folder.write_text("scene.toml", scene_to_toml(scene))
    setup = Setup(scene, comm, plan, additions)
    run: Simulation | None = None
    stability: Stability | StabilityInSpace | None = None
    scalars: dict[str, Any] = {}
    series: list[tuple[float, str]] = []
    outcome: dict[str, Any] = {"status": "solved", "reason": "", "cause": ""}
    settled: float | None = None
    goes_on = scene.stability == "warn"
    in_doubt: dict[str, str] = {}  # what is in doubt of a saved state, of the last such state

    def look_for_doubts(when: str = "") -> None:
        assert run is not None
        found, missing = doubts(run, setup.centre[0] if setup.half else None), scalars["energy"]["balance_error"]
        if missing is not None and (told := unbalanced(missing, run.ledger.turnover * observer.layout.copies)):
            found["energy"] = told
        for key, text in found.items():
            in_doubt[key] = when + text
            folder.log(f"warning: {key}: {in_doubt[key]}")

    try:
        setup.refuse_without_equilibrium()
        run = setup.create_run(folder.log)
        stack.callback(run.close)
        for line in describe_model(setup, run).lines():
            folder.log(line)
        observer = Observer(run, setup.layout())
        assert run.acceptance is not None
        accepted = run.acceptance
        if (found := checkpoint.load(folder, setup.body.space)) is not None:
            memory, mine = found
            run.recall(memory)
            observer.peaks, series, earlier_s = mine["peaks"], mine["series"], mine["wall_s"]
            in_doubt = mine["in_doubt"]
            accepted.recall(mine["acceptance"])
            scalars, settled = observer.observe(run.t) | additions.observe(observer), run.rate()
            folder.log(f"goes on from the checkpoint at t = {run.t:.6g} s, step {run.totals.steps}")
        else:
            begin_near(setup, run, plan, additions, folder.log)

        def on_step(step: Step) -> None:
            nonlocal settled
            beyond = bool(accepted.beyond)
            if accepted.doubt:
                in_doubt["ellipticity"] = accepted.doubt
            scalars.clear()
            scalars.update(observer.observe(step.t_s) | additions.observe(observer))
            settled = run.rate()
            numbers = {"t_s": step.t_s, "dt_s": step.dt_s, "newton": step.newton, "error_estimate": step.error_estimate}
            numbers |= {"beyond_ellipticity": int(beyond)} if goes_on else {}
            folder.add_row({**numbers, "settled": settled, **flatten(scalars)})
            report(Progress(case.name, step.t_s, scene.time.end_s, run.totals.steps, run.totals.newton_iterations))
            if step.t_s in scene.output.times_s and step.t_s < scene.time.end_s:
                write_fields(folder, scene, observer, step.t_s, series, beyond)
                look_for_doubts(f"at t = {step.t_s:.6g} s ")
            folder.agree()

        def on_checkpoint(memory: Memory) -> None:
            wall_s = earlier_s + time.perf_counter() - started
            mine = {"peaks": observer.peaks, "series": series, "wall_s": wall_s}
            mine |= {"in_doubt": in_doubt, "acceptance": accepted.memory()}
            checkpoint.save(folder, setup.body.space, memory, mine)

        run.run(on_step, on_checkpoint)
        stability = accepted.stability
    except SolveError as error:
        stability = accepted.watch.look() if run is not None and run.totals.newton_iterations else None
        reason = str(error)
        if run is not None and not run.told:
            scalars, settled = {}, None
        if not isinstance(error, Refused) or error.found != stability:  # else it is what stopped the case
            reason += _last_good_state(run, scalars, stability)
        outcome = Reason(error.cause, reason).as_record()
        folder.log(f"failed: {reason}")
    in_space: StabilityInSpace | None = None
    if scalars and run is not None:
        if stability is not None and setup.kinematics.components == 2:
            in_space = EllipticityInSpace(run.body, run.state.u).find()
        if in_space is not None and in_space.lost and not (stability is not None and stability.lost):
            in_doubt["ellipticity in space"] = OUT_OF_PLANE.format(in_space)
            folder.log(f"warning: ellipticity in space: {in_doubt['ellipticity in space']}")
        if told := folds(scene, scalars["membrane"]["principal_stretch_min"]):
            in_doubt["folds"] = told
            folder.log(f"warning: folds: {told}")
        write_fields(folder, scene, observer, run.t, series, bool(accepted.beyond))
        write_outlines(folder, observer)
        look_for_doubts()
    folder.agree()
    extra = {} if in_space is None else {"in_space": in_space.as_dict()}
    result = _provenance(case, setup, run, comm, in_doubt)
    result |= outcome | {
        "settled": settled,
        "stability": None if stability is None else stability.as_dict() | extra,
        "wall_s": earlier_s + time.perf_counter() - started,
    }
    if goes_on:
        since = {} if run is None else accepted.beyond
        result["beyond_ellipticity"] = {"since_s": None, "load_amplitude": None} | since
    folder.log(f"{outcome['status']} in {result['wall_s']:.2f} s")
    return result | scalars


def folds(scene: Scene, least: float | None) -> str:
    """What is in doubt of a cell that adheres, whose membrane has this least stretch [-]; "" where nothing is."""
    return FOLDS.format(least=least) if scene.adhesion is not None and least is not None and least < FOLDED else ""


def _last_good_state(
    run: Simulation | None, scalars: dict[str, Any], stability: Stability | StabilityInSpace | None
) -> str:
    """What the last accepted state, or else the last equilibrium on the way to the first, says about a failure."""
    if run is None or stability is None:
        return ""
    if run.totals.steps and not run.told:
        return f"; the state before (t = {run.t:.6g} s) is not saved: {UNTOLD}"
    text = "; in the last equilibrium before"
    if scalars:
        text = f"; in the last state, which is saved (t = {run.t:.6g} s), det F is {scalars['cell']['det_F_min']:.3g}"
        text += " at least and"
    return f"{text} {'ellipticity is lost' if stability.lost else 'the material is stable everywhere'}: {stability}"


def _provenance(
    case: Case, setup: Setup, run: Simulation | None, comm: MPI.Comm, found: Mapping[str, str]
) -> dict[str, Any]:
    """Origin and cost of a result; `found`: warnings of its last state."""
    quality, totals = setup.domain.quality, run.totals if run is not None else None
    return {
        "schema": 1,
        "case": case.name,
        "scene": case.scene.model_dump(mode="json", by_alias=True),
        "geometry": case.scene.cell.geometry,
        "rest": dict(zip(STRAINS, setup.kinematics.rest, strict=True)),
        "t_s": run.t if run is not None else 0.0,
        "steps": totals.steps if totals else 0,
        "rejected_steps": totals.rejected_steps + totals.failed_solves if totals else 0,
        "newton_iterations": totals.newton_iterations if totals else 0,
        "factorisations": totals.factorisations if totals else 0,
        "linear_iterations": totals.linear_iterations if totals else 0,
        "ranks": comm.size,
        "mesh_cells": setup.number_of_cells,
        "mesh_quality": {key: float(value) for key, value in quality.items()},
        "dofs": setup.dofs,
        "memory_MB": comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, op=MPI.MAX),
        "versions": versions(),
        "model": describe_model(setup, run, found).as_dict(),
    }


def versions() -> dict[str, str]:
    """Versions of everything that numbers come from."""
    petsc = ".".join(str(v) for v in PETSc.Sys.getVersion())
    return {
        "cellmech": __version__,
        "dolfinx": dolfinx.__version__,
        "petsc": petsc,
        "numpy": np.__version__,
        "python": platform.python_version(),
    }


def describe_case(case: Case, comm: MPI.Comm, plan: MeshPlan) -> Description:
    """The model of a case and its size, without solving anything (collective on comm).

    What would take minutes to mesh is not: its size is estimated, and its model is that of a coarse mesh.
    """
    cells, dofs, needed = Placed(case.scene, plan).expected_size()
    if dofs > MESHED_AT_ONCE:
        mesh = case.scene.mesh.model_copy(update={"size_um": case.scene.mesh.size_um * (dofs / COARSE) ** (1 / 3)})
        coarse = Setup(case.scene.model_copy(update={"mesh": mesh}), comm, plan)
        model = describe_model(coarse).lines()
        free = room.available_bytes(comm)
        if needed > free:
            model.append(f"warning: memory: it takes about {needed / 2**30:.3g} GiB; {free / 2**30:.3g} are free here")
        return Description(model, cells, dofs, needed / 2**20, estimated=True)
    setup = Setup(case.scene, comm, plan)
    in_plane_MB = MEMORY_BASE_MB * comm.size + MEMORY_PER_DOF_MB * setup.dofs
    return Description(
        model=describe_model(setup).lines(),
        cells=setup.number_of_cells,
        dofs=setup.dofs,
        memory_MB=in_plane_MB if setup.kinematics.components == 2 else needed_bytes(setup.body) / 2**20,
    )
