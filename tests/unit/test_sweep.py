"""Cases over ranks, here on one; the same under mpirun is in tests/cli."""

import signal

import pytest
from locked_writes import locked_writes
from mpi4py import MPI

from cellmech.causes import Cause, Reason
from cellmech.errors import SolveError
from cellmech.results.archive import alone_in
from cellmech.results.sealed import sealed
from cellmech.runs import sweep as sweep_module
from cellmech.runs.handout import Counter
from cellmech.runs.interrupts import Interrupted, Interrupts
from cellmech.runs.job import Job
from cellmech.runs.sweep import hand_out, solve_jobs
from cellmech.scene.case import Case
from cellmech.scene.scene import Scene


class Watcher:
    def __init__(self):
        self.heard = []

    def started(self, index):
        self.heard.append(("started", index))

    def progressed(self, index, progress):
        self.heard.append(("progressed", index, progress))

    def finished(self, index, result):
        self.heard.append((result["status"], index))

    def tick(self):
        pass


@pytest.fixture
def sweep(tmp_path):
    """Solve cases of these names on one rank."""

    def run(solve, *names):
        jobs = [Job(n, Case(n, Scene()), tmp_path / n, None, f"key {n}", "source", (f"note {n}",)) for n in names]
        watcher = Watcher()
        with Interrupts() as interrupts:
            results = solve_jobs(jobs, solve, MPI.COMM_SELF, 1, watcher, interrupts)
        return results, watcher.heard

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # this process may ignore it
    yield run
    signal.signal(signal.SIGINT, before)


def test_counter_counts_and_a_group_gets_what_is_left():
    counter = Counter(MPI.COMM_SELF)
    assert [counter.take() for _ in range(3)] == [0, 1, 2]
    assert list(hand_out(6, counter, MPI.COMM_SELF)) == [3, 4, 5]
    assert list(hand_out(6, counter, MPI.COMM_SELF)) == []
    counter.close()


def test_cases_are_solved_told_of_and_recorded(sweep, tmp_path):
    def solve(case, folder, comm, plan, report):
        report(f"{case.name} moves")
        return {"status": "solved", "reason": "", "x": 1.5, "input_hash": "not its business"}

    results, heard = sweep(solve, "a", "b")
    assert heard == [
        ("started", 0), ("progressed", 0, "a moves"), ("solved", 0),
        ("started", 1), ("progressed", 1, "b moves"), ("solved", 1),
    ]  # fmt: skip
    expected = {
        "schema": 1,
        "case": "a",
        "status": "solved",
        "reason": "",
        "cause": "",
        "source_hash": "source",
        "input_hash": "key a",
    }
    assert results[0] == {**expected, "x": 1.5}
    assert (tmp_path / "a/result.json").read_text() == sealed({**results[0], "files": {}})
    assert (tmp_path / "b/run.log").read_text() == "note b\n"


@pytest.mark.parametrize(
    ("error", "reason", "cause", "traced"),
    [
        (SolveError(Reason(Cause.SLIDES, "slides")), "slides", "slides", False),
        (IndexError("a\n b"), "internal error: IndexError: a b", "internal", True),
        (AssertionError(), "internal error: AssertionError: ", "internal", True),
        (MemoryError(), "internal error: MemoryError: ", "internal", True),
        (MemoryError("no\n room"), "memory does not suffice: no room", "memory", True),
    ],
)
def test_error_of_a_case_is_its_result_and_the_next_goes_on(sweep, tmp_path, error, reason, cause, traced):
    def solve(case, folder, comm, plan, report):
        folder.add_row({"t_s": 1.0})
        folder.add_row({"t_s": 2.0})
        if case.name == "a":
            raise error
        return {"status": "solved", "reason": ""}

    results, heard = sweep(solve, "a", "b")
    assert [(result["status"], result["reason"]) for result in results] == [("failed", reason), ("solved", "")]
    assert (tmp_path / "a/result.json").read_text() == sealed(results[0])
    assert (results[0]["input_hash"], results[0]["cause"]) == ("key a", cause)
    assert ("Traceback" in (tmp_path / "a/run.log").read_text()) == traced
    assert (tmp_path / "a/history.csv").read_text() == "t_s\n1.0\n2.0\n"
    assert [what[0] for what in heard] == ["started", "failed", "started", "solved"]


def test_folder_is_kept_from_others_until_a_failure_is_written(sweep, tmp_path, monkeypatch):
    """Else a process that waits for it finds no result and solves the case again."""
    met = locked_writes(sweep_module, monkeypatch)

    def solve(case, folder, comm, plan, report):
        raise SolveError("slides")

    sweep(solve, "a")
    assert met == ["result.json"]
    with alone_in(tmp_path / "a"):
        pass


def test_disk_that_refuses_is_a_failure_of_the_case(sweep, tmp_path):
    (tmp_path / "a").write_text("a file in the folder's place")
    results, _ = sweep(lambda *arguments: {"status": "solved", "reason": ""}, "a", "b")
    assert [result["status"] for result in results] == ["failed", "solved"]
    assert results[0]["reason"].startswith("the disk refuses: File exists")
    assert "result.json cannot be written" in results[0]["reason"]


@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_the_sweep_with_the_history_on_disk(sweep, tmp_path, signum):
    def solve(case, folder, comm, plan, report):
        folder.add_row({"t_s": 1.0})
        folder.add_row({"t_s": 2.0})
        signal.raise_signal(signum)
        raise AssertionError("goes on after the signal")

    with pytest.raises(Interrupted, match=signal.Signals(signum).name):
        sweep(solve, "a", "b")
    assert (tmp_path / "a/history.csv").read_text() == "t_s\n1.0\n2.0\n"
    assert not (tmp_path / "a/result.json").exists()
    assert not (tmp_path / "b").exists()


def test_signal_whose_exception_is_lost_counts_at_the_next_step(sweep):
    def solve(case, folder, comm, plan, report):
        try:
            signal.raise_signal(signal.SIGTERM)
        except BaseException:
            pass  # what Python does in a destructor or a callback from C
        report("a step")
        raise AssertionError("goes on after the signal")

    with pytest.raises(Interrupted, match="SIGTERM"):
        sweep(solve, "a")


def test_signal_taken_by_a_library_is_taken_back_at_the_next_step(sweep):
    def solve(case, folder, comm, plan, report):
        before = signal.signal(signal.SIGINT, signal.SIG_DFL)  # as Gmsh does
        report("a step")
        assert signal.getsignal(signal.SIGINT) == before
        return {"status": "solved", "reason": ""}

    assert sweep(solve, "a")[0][0]["status"] == "solved"


def test_handlers_are_put_back_and_an_ignored_signal_stays_ignored():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        terminate = signal.getsignal(signal.SIGTERM)
        with Interrupts():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) is not terminate
        assert signal.getsignal(signal.SIGTERM) is terminate
    finally:
        signal.signal(signal.SIGINT, before)
