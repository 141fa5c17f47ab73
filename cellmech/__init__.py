"""Cells settling on micropillars: large deformations, frictionless contact, and how accurate each number is.

From Python:

    import cellmech
    result = cellmech.solve(cellmech.Scene(title="Table 1"))
    result.number("lamina.sigma_mises_max_Pa")   # [Pa]
    result.plot("J1")

`Scene` is what a scene file says, `solve` solves one, `load` reads the folder of a case that was solved, by the command
line too, and `Result` is what both return. `Additions` are laws, obstacles and observables of one's own, `Material` and
`Invariants` what they are made of. Nothing is imported before it is used.
"""

from __future__ import annotations

import os
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cellmech.additions import Additions
    from cellmech.errors import CellmechError, InputError, MeshError, SolveError
    from cellmech.kinematics import Invariants
    from cellmech.library import solve
    from cellmech.materials import Material
    from cellmech.result import Result, load
    from cellmech.scene import Scene

__version__ = "0.1.0"

# Conda's compilers name the build data of conda's Python there. Ours would look for them as soon as anybody asks for a
# folder of its own, and find none.
if (_data := os.environ.get("_PYTHON_SYSCONFIGDATA_NAME")) and find_spec(_data) is None:
    del os.environ["_PYTHON_SYSCONFIGDATA_NAME"]

_HOMES = {
    "Additions": "additions",
    "CellmechError": "errors",
    "InputError": "errors",
    "Invariants": "kinematics",
    "Material": "materials",
    "MeshError": "errors",
    "Result": "result",
    "Scene": "scene",
    "SolveError": "errors",
    "load": "result",
    "solve": "library",
}
__all__ = [
    "Additions",
    "CellmechError",
    "InputError",
    "Invariants",
    "Material",
    "MeshError",
    "Result",
    "Scene",
    "SolveError",
    "load",
    "solve",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
