"""A study's results as one page: `python -m cellmech.report STUDYDIR`."""

import sys

from cellmech.figures.commands import report_main

if __name__ == "__main__":
    sys.exit(report_main())
