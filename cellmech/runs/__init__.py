"""What a user starts: one case, a study, a sweep over ranks, the library, the command line and its messages.

It may import: every other room.
"""

from __future__ import annotations

from cellmech.doors import door

_HOMES = {
    "main": "study",
    "solve": "library",
    "solve_case": "case",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
