"""Figures and tables from files on disk; nothing is solved.

It may import: scene, results.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cellmech.doors import door

if TYPE_CHECKING:  # what type checkers see of the names below
    from cellmech.figures.commands import path_there, run_command, say, write_text
    from cellmech.figures.comparison import Comparison, Pair, compare, how_far, median_ratio, outside_bars
    from cellmech.figures.embedded import Picture, embed
    from cellmech.figures.markup import markdown_html
    from cellmech.figures.page import Runs, Shown, Tile, duration, environment, report, runs_of
    from cellmech.figures.reference import Reference, References, read_references
    from cellmech.figures.results import StudyResult, read_all, read_planned, read_study
    from cellmech.figures.section import NONE, TONES, Row, Section, plain, signal, significant, tone_of, verdict, yes
    from cellmech.figures.style import (
        FAULT_COLOUR,
        LAWS,
        PAPER,
        QUANTITIES,
        SMALL,
        TINY,
        Quantity,
        printed,
        provenance,
        save,
        styled,
    )

_HOMES = {
    "Comparison": "comparison",
    "FAULT_COLOUR": "style",
    "LAWS": "style",
    "NONE": "section",
    "PAPER": "style",
    "Pair": "comparison",
    "Picture": "embedded",
    "QUANTITIES": "style",
    "Quantity": "style",
    "Reference": "reference",
    "References": "reference",
    "Row": "section",
    "Runs": "page",
    "SMALL": "style",
    "Section": "section",
    "Shown": "page",
    "StudyResult": "results",
    "TINY": "style",
    "TONES": "section",
    "Tile": "page",
    "compare": "comparison",
    "duration": "page",
    "embed": "embedded",
    "environment": "page",
    "how_far": "comparison",
    "markdown_html": "markup",
    "median_ratio": "comparison",
    "outside_bars": "comparison",
    "path_there": "commands",
    "plain": "section",
    "printed": "style",
    "provenance": "style",
    "read_all": "results",
    "read_planned": "results",
    "read_references": "reference",
    "read_study": "results",
    "report": "page",
    "run_command": "commands",
    "runs_of": "page",
    "save": "style",
    "say": "commands",
    "signal": "section",
    "significant": "section",
    "styled": "style",
    "tone_of": "section",
    "verdict": "section",
    "write_text": "commands",
    "yes": "section",
}
__all__ = list(_HOMES)
__getattr__ = door(__name__, _HOMES)
