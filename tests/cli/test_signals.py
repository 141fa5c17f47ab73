"""Ctrl-C and SIGTERM in the middle of a study: files in order, no traceback, no hang, and it goes on afterwards."""

import json
import os
import signal
import time
from pathlib import Path

import pytest
from cli.programs import FAKE, cases, end, start

HISTORY = Path("results/my/endless/history.csv")


def running(ranks=0, each=1):
    """A study that has solved a case and is in the middle of the next."""
    Path("my.toml").write_text(cases("a", "endless"))
    process = start("my.toml", "--ranks-per-case", each, ranks=ranks, program=(FAKE,))
    deadline = time.monotonic() + 60
    while not (HISTORY.exists() and Path("results/my/a/result.json").exists()):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    time.sleep(0.5)
    return process


def rows():
    header, *lines = HISTORY.read_text().splitlines()
    assert all(line.count(",") == header.count(",") for line in lines)
    return len(lines)


def in_order():
    """Finished cases are kept, nothing is half written, a case in the middle is none that could be served."""
    assert json.loads(Path("results/my/a/result.json").read_text())["status"] == "solved"
    assert not (HISTORY.parent / "result.json").exists()
    assert not list(Path("results").rglob(".partial-*"))


@pytest.mark.parametrize(("signum", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signal_ends_a_study_with_its_files_in_order(folder, signum, status):
    process = running()
    before = rows()
    process.send_signal(signum)
    outcome = end(process, seconds=10)
    assert outcome.status == status
    name = signal.Signals(signum).name
    assert outcome.err == f"cellmech: stopped by {name}; what is finished is kept, and the same command goes on\n"
    assert rows() > before  # the first row is written at once, the others not for some seconds
    in_order()


@pytest.mark.mpi
@pytest.mark.parametrize("each", [1, 2])
@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM])
def test_signal_to_mpirun_ends_all_ranks(folder, signum, each):
    process = running(ranks=2, each=each)
    process.send_signal(signum)
    outcome = end(process, seconds=20)
    assert outcome.status != 0  # Open MPI 4 makes it 1, whatever the ranks say
    assert "Traceback" not in outcome.err
    in_order()


@pytest.mark.mpi
@pytest.mark.parametrize("rank", [0, 1])
def test_signal_to_one_rank_ends_all(folder, rank):
    process = running(ranks=2, each=2)
    os.kill(children(process.pid)[rank], signal.SIGTERM)
    outcome = end(process, seconds=20)
    assert outcome.status == 143
    assert "Traceback" not in outcome.err
    in_order()


def children(process):
    return sorted(int(p) for p in Path(f"/proc/{process}/task/{process}/children").read_text().split())
