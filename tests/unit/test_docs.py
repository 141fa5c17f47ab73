"""Documents that name tests name ones that exist."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_faults_name_tests_that_exist():
    rows = [row for row in (ROOT / "docs/faults.md").read_text(encoding="utf-8").splitlines() if row.startswith("| ")]
    assert len(rows) > 20
    for row in rows[1:]:
        file, name = re.fullmatch(r"`([\w/.]+)::(test_\w+)`", row.split("|")[-2].strip()).groups()
        assert re.search(rf"^ *def {name}\(", (ROOT / "tests" / file).read_text(encoding="utf-8"), re.MULTILINE), row
