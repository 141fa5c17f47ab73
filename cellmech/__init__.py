"""Cells settling on micropillars: large deformations, frictionless contact, and how accurate each number is.

From Python:

    import cellmech
    result = cellmech.solve(cellmech.Scene(title="Table 1"))
    result.number("lamina.sigma_mises_max_Pa")   # [Pa]
    result.plot("J1")

`Scene` is what a scene file says, `solve` solves one, `load` reads the folder of a case that was solved, by the command
line too, and `Result` is what both return. `fit` finds values of keys at which numbers come nearest to others.
`Additions` are laws, obstacles and observables of one's own, `Material` and `Invariants` what they are made of.
`Cause` is why a case has no solution. Nothing is imported before it is used.
"""

from __future__ import annotations

import os
from importlib.util import find_spec
from typing import TYPE_CHECKING

from cellmech.doors import door

if TYPE_CHECKING:
    from cellmech.causes import Cause
    from cellmech.cell.additions import Additions
    from cellmech.errors import CellmechError, InputError, MeshError, SolveError
    from cellmech.mechanics.invariants import Invariants
    from cellmech.mechanics.materials import Material
    from cellmech.runs.fit import fit
    from cellmech.runs.library import Result, load, solve
    from cellmech.scene.scene import Scene

__version__ = "0.1.0"

# Conda's compilers name the build data of conda's Python there. Ours would look for them as soon as anybody asks for a
# folder of its own, and find none.
if (_data := os.environ.get("_PYTHON_SYSCONFIGDATA_NAME")) and find_spec(_data) is None:
    del os.environ["_PYTHON_SYSCONFIGDATA_NAME"]

_HOMES = {
    "Additions": "cell.additions",
    "Cause": "causes",
    "CellmechError": "errors",
    "InputError": "errors",
    "Invariants": "mechanics.invariants",
    "Material": "mechanics.materials",
    "MeshError": "errors",
    "Result": "runs.library",
    "Scene": "scene.scene",
    "SolveError": "errors",
    "fit": "runs.fit",
    "load": "runs.library",
    "solve": "runs.library",
}
__all__ = [
    "Additions",
    "Cause",
    "CellmechError",
    "InputError",
    "Invariants",
    "Material",
    "MeshError",
    "Result",
    "Scene",
    "SolveError",
    "fit",
    "load",
    "solve",
]
__getattr__ = door(__name__, _HOMES)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
