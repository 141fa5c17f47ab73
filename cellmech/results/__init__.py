"""Results on disk: records, archive, checkpoints, field files, and how accurate each number is.

It may import: the rooms from mechanics to cell.
"""

from __future__ import annotations

from cellmech.doors import door

_HOMES = {
    "CaseFolder": "records",
    "Result": "result",
    "load": "result",
    "refinements": "accuracy",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
