"""Results on disk: records, archive, checkpoints, field files, and how accurate each number is.

It may import: the rooms from mechanics to cell.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cellmech.doors import door

if TYPE_CHECKING:  # what type checkers see of the names below
    from cellmech.results.accuracy import refinements
    from cellmech.results.records import CaseFolder, to_csv, write_whole
    from cellmech.results.result import Result, load

_HOMES = {
    "CaseFolder": "records",
    "Result": "result",
    "load": "result",
    "refinements": "accuracy",
    "to_csv": "records",
    "write_whole": "records",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
