"""Stands in for cellmech.runs.case where the command line is tested, not the mechanics; run as a program it is a study.

A case's name says what it does: see `solve_case`. Everything else about it follows from its scene.
"""

import sys
import time
from dataclasses import dataclass

from mpi4py import MPI

from cellmech.errors import MeshError
from cellmech.runs import sweep
from cellmech.runs.study import main
from cellmech.scene.files import scene_to_toml

STEPS = 5
solved = []  # names, in this process


@dataclass(frozen=True)
class Plan:
    text: str

    def key(self):
        return self.text


@dataclass(frozen=True)
class Progress:
    case: str
    t_s: float
    end_s: float
    step: int
    newton: int


@dataclass(frozen=True)
class Description:
    model: list
    cells: int
    dofs: int
    memory_MB: float
    estimated: bool = False


def mesh_plan(scene):
    return Plan(scene.cell.law)


def describe_case(case, comm, plan):
    if case.name == "mesh":
        raise MeshError("an element is turned inside out")
    return Description([f"law: {case.scene.cell.law}", f"layers: {plan.text}"], 1234, 5678, 90.0)


def solve_case(case, folder, comm, plan, report):
    begun = time.perf_counter()
    solved.append(case.name)
    folder.write_text("scene.toml", scene_to_toml(case.scene))
    folder.log(f"law {case.scene.cell.law} on {comm.size}")
    if case.name == "mesh":
        raise MeshError("an element is turned inside out")
    if case.name == "bug":
        raise ZeroDivisionError("one\nover nothing")
    if case.name == "bug-on-one-rank" and comm.rank == 1:
        sweep.GRACE_S = 1.0  # to be waited out: nobody else runs into it
        raise ZeroDivisionError("one\nover nothing")
    if case.name.startswith("last of "):
        wait_for_others(folder.path.parent, int(case.name.removeprefix("last of ")) - 1)
    steps = 10**6 if case.name == "endless" else STEPS
    for step in range(1, steps + 1):
        comm.Barrier()
        folder.add_row({"t_s": 10.0 * step, "newton": 3, "cell.J1_max": 2.0 + 0.1 * step, "contact.force": None})
        report(Progress(case.name, 10.0 * step, 10.0 * STEPS, step, 3 * step))
        time.sleep(0.05 if case.name == "endless" else 0.2 if "slow" in case.name else 0.002)
    status, reason = ("failed", "no equilibrium beyond t = 40 s") if case.name == "fails" else ("solved", "")
    force = float("nan") if case.name == "nan" else 15.5 * case.scene.load.factor
    return {
        "schema": 1,
        "case": case.name,
        "status": status,
        "reason": reason,
        "scene": case.scene.model_dump(mode="json", by_alias=True),
        "steps": steps,
        "newton_iterations": 3 * steps,
        "ranks": comm.size,
        "versions": {"world rank": MPI.COMM_WORLD.rank},
        "memory_MB": 100.0 + time.perf_counter() % 1.0,
        "wall_s": time.perf_counter() - begun,
        "nucleus": {
            "J1_max": 2.0 + case.scene.load.factor / 3,
            "J1_max_at_um": [0.5, -4.0],
            "sigma_mises_max_Pa": 0.75,
        },
        "contact": {"force_Pa_x_um": force, "max_depth_um": None},
    }


def wait_for_others(study, count):
    deadline = time.monotonic() + 60
    while len(list(study.glob("*/result.json"))) < count:
        assert time.monotonic() < deadline
        time.sleep(0.01)


if __name__ == "__main__":
    sys.exit(main(load=lambda: sys.modules["__main__"]))
