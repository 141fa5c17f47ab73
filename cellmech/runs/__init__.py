"""The programs: one case, a study, a sweep over ranks, the library, the command line and its messages.

It may import: every other room.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cellmech.doors import door

if TYPE_CHECKING:  # what type checkers see of the names below
    from cellmech.runs.case import solve_case
    from cellmech.runs.handout import Counter
    from cellmech.runs.library import solve
    from cellmech.runs.study import main
    from cellmech.runs.sweep import hand_out

_HOMES = {
    "Counter": "handout",
    "hand_out": "sweep",
    "main": "study",
    "solve": "library",
    "solve_case": "case",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
