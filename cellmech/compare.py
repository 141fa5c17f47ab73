"""A study's numbers beside reference numbers: `python -m cellmech.compare STUDYDIR REFERENCE.toml`."""

import sys

from cellmech.figures.commands import compare_main

if __name__ == "__main__":
    sys.exit(compare_main())
