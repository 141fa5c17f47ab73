"""What a case computes does not depend on what its process has solved before, nor on the ranks or the process."""

from pathlib import Path

import pytest
from cli.programs import end, start

pytestmark = pytest.mark.mpi

STUDY = """
[mesh]
size_um = 6
[time]
rtol = 0.5
end_s = 40
[load]
half_ramp_s = 40
[sweep]
"cell.law" = ["neo-hookean", "saint-venant"]
"layer.lamina.young_Pa" = [1000, 2000]
"""
REVERSED = """
import sys
from cellmech.runs import study, sweep
class Reversed(sweep.Counter):
    def take(self):
        number = super().take()
        return 1 - number if number < 2 else number
sweep.Counter = Reversed
sys.exit(study.main())
"""


def test_summary_is_equal_byte_for_byte_whoever_solves_in_which_order(folder):
    Path("my.toml").write_text(STUDY)
    runs = {
        "serial": [start("my.toml", "--out", "serial/my")],
        "ranks": [start("my.toml", "--out", "ranks/my", ranks=2)],
        "shards": [
            start("my.toml", "--out", "shards/my", "--shard", f"{i}/2", program=("-c", REVERSED)) for i in (1, 2)
        ],
    }
    outcomes = [end(process) for processes in runs.values() for process in processes]
    assert [(outcome.status, outcome.err) for outcome in outcomes] == [(0, "")] * 4
    assert ["[1/2] law=saint-venant" in outcome.out for outcome in outcomes] == [False, False, True, True]
    tables = {name: Path(name, "my/summary.csv").read_bytes() for name in runs}
    assert tables["serial"].count(b",solved,") == 4
    assert [name for name in runs if tables[name] != tables["serial"]] == []
