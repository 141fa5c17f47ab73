"""What is asked for: scene and study files, their rules and keys, and where the cell stands.

It may import: mechanics (moduli), solver (instants); neither NumPy nor DOLFINx.
"""

from __future__ import annotations

from cellmech.doors import door

_HOMES = {
    "LAYER_NAMES": "parts",
    "Case": "case",
    "Scene": "scene",
    "Study": "studies",
    "load_study": "studies",
    "read_scene": "files",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
