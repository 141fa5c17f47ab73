"""The main job: `python -m cellmech.study` solves the cases of study files and keeps the results."""

import sys

from cellmech.runs.study import main

if __name__ == "__main__":
    sys.exit(main())
