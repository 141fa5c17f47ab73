"""Figures and tables of the paper from files on disk: `python -m cellmech.plots`."""

import sys

from cellmech.figures.plots import main

if __name__ == "__main__":
    sys.exit(main())
