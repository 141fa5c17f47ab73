"""What a command that draws leaves: files, their names on the screen, an exit status."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from cellmech.console import say
from cellmech.figures.results import StudyResult
from cellmech.figures.table import Document


def draw_and_save(options: argparse.Namespace, draw: Any, *of: Any) -> int:
    """Save the figure that `draw` makes of these where the options say."""
    from cellmech.figures.style import save, styled

    with styled():
        for path in save(draw(*of), options.out, options.stem):
            say(str(path))
    return 0


def print_and_save(options: argparse.Namespace, document: Document) -> int:
    """Print a table, and save it where the options say."""
    document.save(options.out, options.stem)
    say(document.markdown())
    return 0


def complain(study: StudyResult) -> int:
    """Name the cases that are missing or failed; 1 when there are any."""
    complaint = study.complaint()
    if complaint:
        say(f"warning: {study.folder}: {complaint}", sys.stderr)
    return 1 if complaint else 0
