"""The input: scene and study files, their rules and keys, and the place of the cell.

It may import: mechanics (moduli), solver (instants); neither NumPy nor DOLFINx.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cellmech.doors import door

if TYPE_CHECKING:  # what type checkers see of the names below
    from cellmech.scene.case import Case
    from cellmech.scene.files import read_scene
    from cellmech.scene.keys import put
    from cellmech.scene.parts import LAYER_NAMES
    from cellmech.scene.scene import Scene
    from cellmech.scene.studies import Study, load_study
    from cellmech.scene.toml_file import read_toml

_HOMES = {
    "Case": "case",
    "LAYER_NAMES": "parts",
    "Scene": "scene",
    "Study": "studies",
    "load_study": "studies",
    "put": "keys",
    "read_scene": "files",
    "read_toml": "toml_file",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
