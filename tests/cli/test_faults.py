"""What else may happen to a study: two at once, a full or read-only disk, a rank that dies, files that decay."""

import errno
import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from cli.programs import ENVIRONMENT, FAKE, cases, end, program, start, tree
from cli.test_signals import children

from cellmech.results.archive import finished, is_final

REAL = "[mesh]\nsize_um = 5.0\n[time]\nrtol = 0.02\n"
COARSE = "[mesh]\nsize_um = 8.0\n[time]\nhistory = false\n"
ONE = Path("results/my/a")


def log():
    return (ONE / "run.log").read_text(encoding="utf-8")


@pytest.fixture
def solved(fake, folder):
    """A solved case; what it has is what a later run must have again."""
    Path("my.toml").write_text(cases("a"))
    fake("my.toml")
    return {name: (ONE / name).read_bytes() for name in ("history.csv", "scene.toml")}


@pytest.fixture
def small_disk(folder):
    """Mount a file system of our own as ./disk; `options` change it, such as "ro" or "size=64k"."""
    Path("disk").mkdir()

    def mount(options):
        done = subprocess.run(["mount", *options, "disk"], capture_output=True, text=True)
        if done.returncode:
            pytest.skip(f"no file system can be mounted here: {done.stderr.strip()}")

    mount(["-t", "tmpfs", "-o", "size=128k", "tmpfs"])
    yield lambda options: mount(["-o", f"remount,{options}"])
    subprocess.run(["umount", "disk"], check=True)


def two_at_once(*arguments, ranks=0):
    """A process in the middle of a case "last of 2", and a second one with these arguments that waits for it."""
    where = Path("results/my/last of 2")
    first = start("my.toml", program=(FAKE,))
    while not (where / "scene.toml").exists():
        assert first.poll() is None
        time.sleep(0.01)
    second = start("my.toml", *arguments, ranks=ranks, program=(FAKE,))
    assert second.stderr.readline() == f"cellmech: last of 2: waits for another process that is at work in {where}\n"
    Path("results/my/other").mkdir()
    Path("results/my/other/result.json").touch()  # for which the first one waits
    return first, second


def test_two_processes_in_one_folder_solve_each_case_once(folder):
    names = ("last of 2", "slow b", "slow c")
    Path("my.toml").write_text(cases(*names))
    assert [end(process).status for process in two_at_once()] == [0, 0]
    logs = [Path(f"results/my/{name}/run.log").read_text() for name in names]
    assert logs == ["law neo-hookean on 1\n"] * 3
    assert len(Path("results/my/summary.csv").read_text().splitlines()) == 4
    assert not list(Path("results").rglob(".partial-*"))


def test_results_folder_that_another_process_makes_at_the_same_time_is_shared(fake, folder, monkeypatch):
    ours = Path.mkdir

    def late(path, *arguments, **options):
        path.exists() or os.mkdir(path)
        ours(path, *arguments, **options)

    monkeypatch.setattr(Path, "mkdir", late)
    Path("my.toml").write_text(cases("a"))
    assert (fake("my.toml", "--out", "deep/er").status, fake.solved) == (0, ("a",))


def test_results_folder_that_another_process_removes_meanwhile_is_made_again(fake, folder, monkeypatch):
    """A refused command takes away what it has made."""
    ours, removed = Path.mkdir, []

    def taken_away(path, *arguments, **options):
        if path.name == "er" and not removed:
            removed.append(path.parent.rmdir())
        ours(path, *arguments, **options)

    monkeypatch.setattr(Path, "mkdir", taken_away)
    Path("my.toml").write_text(cases("a"))
    assert (fake("my.toml", "--out", "deep/er").status, fake.solved) == (0, ("a",))
    assert removed


def test_refused_folders_are_removed_but_for_what_another_process_has_put_there(fake, folder, monkeypatch):
    ours = Path.mkdir

    def full(path, *arguments, **options):
        if path.name == "two":
            Path("results/one/theirs").touch()
            raise OSError(errno.ENOSPC, "No space left on device")
        ours(path, *arguments, **options)

    monkeypatch.setattr(Path, "mkdir", full)
    for name in ("one", "two"):
        Path(f"{name}.toml").write_text(cases("a"))
    outcome = fake("one.toml", "two.toml")
    assert outcome.status == 2
    assert outcome.err.startswith("cellmech: error: --out: must be a folder that can be made and written to (No space")
    assert list(tree(Path("results"))) == ["one", "one/theirs"]


@pytest.mark.mpi
def test_disk_that_refuses_one_of_the_ranks_that_share_a_case_fails_the_case_alone(folder):
    Path("my.toml").write_text(cases("a", "b"))
    Path("results/my/a/history.csv").mkdir(parents=True)
    outcome = program("my.toml", "--ranks-per-case", 2, "--quiet", ranks=2, program=(FAKE,))
    assert outcome.status == 1
    assert "cellmech: a: failed: the disk refuses: Is a directory (" in outcome.err
    assert outcome.out == "my: 1 of 2 cases solved; summary.csv and a folder per case in results/my/\n"


@pytest.mark.mpi
def test_group_of_ranks_waits_for_another_process_and_takes_its_result(folder):
    Path("my.toml").write_text(cases("last of 2"))
    assert [end(process).status for process in two_at_once("--ranks-per-case", 2, ranks=2)] == [0, 0]
    assert json.loads(Path("results/my/last of 2/result.json").read_text())["ranks"] == 1


def test_disk_that_fills_up_fails_the_case_and_the_same_command_goes_on(small_disk):
    Path("my.toml").write_text(REAL)
    outcome = program("my.toml", "--out", "disk/out", "--quiet")
    assert outcome.status == 1
    assert outcome.err.startswith("cellmech: my: failed: the disk refuses: No space left on device")
    assert "Traceback" not in outcome.err
    assert not list(Path("disk").rglob(".partial-*")) and not Path("disk/out/my/fields.pvd").exists()
    small_disk("size=64m")
    outcome = program("my.toml", "--out", "disk/out", "--quiet")
    assert (outcome.status, outcome.err) == (0, "")
    assert json.loads(Path("disk/out/my/result.json").read_text())["status"] == "solved"


def test_temporary_folder_that_cannot_be_written_to_fails_the_case_and_the_same_command_goes_on(folder):
    Path("my.toml").write_text(COARSE)
    code = "import sys, tempfile; tempfile.tempdir = 'gone'; from cellmech.mesh import store; "
    code += "store.kept = lambda spec: None; from cellmech.study import main; sys.exit(main(sys.argv[1:]))"
    outcome = program("my.toml", "--quiet", program=("-c", code))
    assert (outcome.status, len(outcome.err.splitlines())) == (1, 1)
    assert outcome.err.startswith("cellmech: my: failed: the disk refuses: No such file or directory (")
    outcome = program("my.toml", "--check", program=("-c", code))
    assert (outcome.status, len(outcome.err.splitlines())) == (1, 1)
    assert outcome.err.startswith("cellmech: error: my: the disk refuses: No such file or directory (")
    assert program("my.toml", "--quiet").status == 0


def test_case_that_runs_out_of_memory_says_so_and_is_tried_again(folder):
    """With MUMPS allowed 1 MB."""
    Path("my.toml").write_text(COARSE)
    code = (
        "import sys; from cellmech import study; from cellmech.solver import newton; "
        "newton.OPTIONS['mat_mumps_icntl_23'] = 1; sys.exit(study.main())"
    )
    outcome = program("my.toml", "--quiet", program=("-c", code))
    assert (outcome.status, len(outcome.err.splitlines())) == (1, 1)
    assert outcome.err.startswith("cellmech: my: failed: memory does not suffice: no room to factorise the tangent (")
    assert program("my.toml", "--quiet").status == 0


def test_file_that_may_not_grow_fails_the_case(folder):
    """A quota looks alike, and this needs no rights."""
    Path("my.toml").write_text(REAL)
    code = "import resource, sys; from cellmech.study import main; "  # which starts MPI, with large files of its own
    code += "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000)); sys.exit(main(['my.toml', '--quiet']))"
    outcome = program(program=("-c", code))
    assert outcome.status == 1
    assert outcome.err.startswith("cellmech: my: failed: the disk refuses: File too large")
    assert len(outcome.err.splitlines()) == 1
    assert json.loads(Path("results/my/my/result.json").read_text())["status"] == "failed"
    assert not list(Path("results").rglob(".partial-*"))


def test_results_that_have_become_read_only_are_refused_and_kept(small_disk):
    Path("my.toml").write_text(cases("a", "b"))
    assert program("my.toml", "--out", "disk/out", "--only", "a", program=(FAKE,)).status == 0
    before = tree(Path("disk"))
    small_disk("ro")
    outcome = program("my.toml", "--out", "disk/out", program=(FAKE,))
    assert (outcome.status, outcome.out) == (2, "")
    assert outcome.err.startswith("cellmech: error: --out: must be")
    assert "disk/out" in outcome.err and len(outcome.err.splitlines()) == 1
    assert tree(Path("disk")) == before


@pytest.mark.mpi
def test_case_folder_that_cannot_be_written_to_fails_its_case_on_all_ranks(folder):
    Path("my.toml").write_text(cases("a", "b"))
    Path("results/my/a/run.log").mkdir(parents=True)
    outcome = program("my.toml", "--ranks-per-case", 2, ranks=2, program=(FAKE,))
    assert outcome.status == 1
    assert outcome.err.count("cellmech: ") == 1  # mpirun has words of its own
    assert "cellmech: a: failed: the disk refuses: Is a directory (results/my/a/run.log)" in outcome.err
    assert json.loads(Path("results/my/b/result.json").read_text())["status"] == "solved"


def test_compiler_cache_that_cannot_be_written_to_is_named(folder, monkeypatch):
    Path("my.toml").write_text(COARSE)
    Path("cache").write_text("no folder")
    monkeypatch.setitem(ENVIRONMENT, "XDG_CACHE_HOME", "cache")
    why = "the disk refuses: cache/cellmech: compiled equations cannot be kept there (Not a directory). Name another pl"
    outcome = program("my.toml", "--check")
    assert (outcome.status, outcome.out, len(outcome.err.splitlines())) == (1, "", 1)
    assert outcome.err.startswith(f"cellmech: error: my: {why}")
    outcome = program("my.toml", "--quiet")
    assert (outcome.status, len(outcome.err.splitlines())) == (1, 1)
    assert outcome.err.startswith(f"cellmech: my: failed: {why}")
    assert not is_final(json.loads(Path("results/my/my/result.json").read_text()))


@pytest.mark.mpi
@pytest.mark.parametrize("rank", [0, 1])
def test_rank_that_dies_ends_the_job_and_the_checkpoint_holds(folder, rank):
    Path("my.toml").write_text(REAL)
    process = start("my.toml", "--ranks-per-case", 2, "--set", "time.rtol=1e-3", ranks=2)
    while not Path("results/my/my/checkpoint.npz").exists():
        assert process.poll() is None
        time.sleep(0.01)
    os.kill(children(process.pid)[rank], signal.SIGKILL)
    outcome = end(process, seconds=30)
    assert outcome.status not in (0, 2)
    assert "Traceback" not in outcome.err
    assert not Path("results/my/my/result.json").exists()
    assert program("my.toml", "--set", "time.rtol=1e-3", "--quiet").status == 0
    assert "goes on from the checkpoint" in Path("results/my/my/run.log").read_text()


def flip(path, place):
    """One bit of a file, which leaves a digit a digit."""
    content = bytearray(path.read_bytes())
    content[place % len(content)] ^= 1
    path.write_bytes(content)


DAMAGE = {
    "digit of result.json": (
        lambda: flip(ONE / "result.json", (ONE / "result.json").read_bytes().find(b"2.333")),
        "result.json",
    ),
    "result.json cut": (lambda: os.truncate(ONE / "result.json", 300), "result.json"),
    "digit of history.csv": (lambda: flip(ONE / "history.csv", -5), "history.csv is damaged"),
    "history.csv cut": (lambda: os.truncate(ONE / "history.csv", 40), "history.csv is damaged"),
    "history.csv gone": ((ONE / "history.csv").unlink, "history.csv cannot be read (No such file"),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_damaged_result_is_named_and_solved_anew(fake, solved, kind):
    harm, words = DAMAGE[kind]
    harm()
    outcome = fake("my.toml")
    assert (outcome.status, fake.solved) == (0, ("a",))
    assert words in log() and log().startswith(("result.json of an earlier run ", "of an earlier run "))
    assert {name: (ONE / name).read_bytes() for name in solved} == solved
    assert fake("my.toml").status == 0
    assert fake.solved == ()


def test_no_bit_of_a_result_can_change_unseen(solved):
    content = (ONE / "result.json").read_bytes()
    result = json.loads(content)
    assert finished(ONE, result["input_hash"]) == result
    for place in range(len(content)):
        flip(ONE / "result.json", place)
        notes = []
        found = finished(ONE, result["input_hash"], notes.append)
        assert found == result or (found is None and len(notes) == 1), place  # equal where white space has changed
        (ONE / "result.json").write_bytes(content)


@pytest.mark.parametrize("name", ["summary.csv", "timings.csv"])
def test_damaged_table_is_written_anew(fake, solved, name):
    path = ONE.parent / name
    before = path.read_bytes()
    path.write_bytes(b"\xff\x00,,,\n")
    assert fake("my.toml").status == 0
    assert (path.read_bytes(), fake.solved) == (before, ())


def test_damaged_result_is_not_taken_over_by_another_study(fake, solved):
    flip(ONE / "history.csv", -5)
    Path("two.toml").write_text(cases("x"))
    outcome = fake("two.toml")
    assert (outcome.status, fake.solved) == (0, ("x",))
    assert "taken over" not in outcome.out
