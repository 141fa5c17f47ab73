"""How a study tells of itself: counts, estimates, lines, the live display."""

import os
import pty
import re
import signal
import subprocess
import sys
import termios
from pathlib import Path

import pytest
from cli.fake_case import Progress
from cli.programs import ENVIRONMENT, FAKE, cases, program

from cellmech.runs.progress import LINE_EVERY_S, Plain, Quiet, duration, results_table


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


def at(share, step=1):
    """Where a case is after a share of its steps, whose number goes with the cube root of time."""
    return Progress("a", 18000.0 * share**3, 18000.0, step, 21)


SOLVED = {"status": "solved", "reason": "", "steps": 9, "wall_s": 12.345}


def test_counts_done_running_and_waiting(clock):
    tally = Quiet(["a", "b", "c"], served=2, groups=2, clock=clock)
    tally.started(0)
    tally.started(1)
    assert tally.state() == "2 of 5 cases done, 2 running, 1 waiting"
    tally.finished(1, SOLVED)
    assert tally.state().startswith("3 of 5 cases done, 1 running, 1 waiting")


def test_time_left_comes_from_the_running_cases_then_from_the_finished(clock):
    tally = Quiet(["a", "b", "c", "d"], served=0, groups=2, clock=clock)
    tally.started(0)
    tally.started(1)
    assert tally.left_s() is None
    clock.now = 10.0
    tally.progressed(0, at(0.25))
    tally.progressed(1, at(0.25))
    assert tally.left_s() == pytest.approx((30 + 30 + 40 + 40) / 2)
    clock.now = 20.0
    tally.finished(0, SOLVED)
    tally.started(2)
    assert tally.left_s() == pytest.approx((0 + 20 + 20) / 2)  # a case takes 20 s, as the first did
    clock.now = 60.0
    assert tally.left_s() == pytest.approx(20 / 2)  # overdue is not less than nothing


def test_time_left_of_a_case_that_goes_on_from_a_checkpoint_counts_what_is_done_here(clock):
    tally = Quiet(["a", "b"], served=0, groups=1, clock=clock)
    tally.started(0)
    tally.progressed(0, at(40 / 80, step=40))  # 39 steps are an earlier run's
    clock.now = 10.0
    tally.progressed(0, at(59 / 80, step=59))
    assert tally.left_s() == pytest.approx(10 * 21 / 20 + 40)  # 2 steps a second, 80 in all
    clock.now = 20.5
    tally.finished(0, SOLVED)
    assert tally.left_s() == pytest.approx(40)


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0 s"), (99.4, "99 s"), (100, "2 min"), (3599, "1 h 0 min"), (7800, "2 h 10 min")]
)
def test_duration(seconds, text):
    assert duration(seconds) == text


def test_plain_prints_the_ends_and_a_line_now_and_then(clock, capsys):
    lines = Plain(["a", "b"], served=0, groups=1, clock=clock)
    lines.started(0)
    for second in range(1, 26):
        clock.now = float(second)
        lines.progressed(0, at(second / 50))
        lines.tick()
    lines.finished(0, SOLVED)
    assert LINE_EVERY_S == 10
    where = "a: t = {} of 18000 s, step 1, Newton 21"
    assert capsys.readouterr().out.splitlines() == [
        "0 of 2 cases done, 1 running, 1 waiting, about 90 s left; " + where.format(144),
        "0 of 2 cases done, 1 running, 1 waiting, about 80 s left; " + where.format(1152),
        "[1/2] a: solved, 9 steps, 12.3 s",
    ]


def test_quiet_speaks_of_failures_only(clock, capsys):
    quiet = Quiet(["a", "b"], served=0, groups=1, clock=clock)
    for index, result in enumerate([SOLVED, {"status": "failed", "reason": "slides"}]):
        quiet.started(index)
        quiet.progressed(index, at(0.5))
        clock.now += 100.0
        quiet.tick()
        quiet.finished(index, result)
    assert tuple(capsys.readouterr()) == ("", "cellmech: b: failed: slides\n")


def test_results_table_lines_up():
    results = [
        {**SOLVED, "nucleus": {"J1_max": 2.0123456, "sigma_mises_max_Pa": 0.5}, "contact": {"max_depth_um": 1e-3}},
        {"status": "failed", "reason": "slides"},
    ]
    head, first, second, why = results_table(["neo-hookean", "b"], results).splitlines()
    assert first == "neo-hookean  solved             0.5  2.01235   -   -           0.001      9    12.3"
    assert len(head) == len(first) == len(second)
    assert second.split() == ["b", "failed", *"-------"]
    assert why == "b failed: slides"


@pytest.mark.parametrize(
    ("name", "columns"), [("b", 8), ("neo-hookean", 7), ("law=neo-hookean,lamina.young_Pa=100", 8)]
)
def test_results_table_fits_into_80_columns(name, columns):
    """What costs do not fit are in timings.csv; a long name has a line of its own."""
    values = {"J1_max": 2.00451, "J2_max": 2.00951, "J3_max": 1.0043, "sigma_mises_max_Pa": 5.4141}
    result = {**SOLVED, "nucleus": values, "contact": {"max_depth_um": 0.0164}}
    lines = results_table([name, "b"], [result, result], 80).splitlines()
    assert max(map(len, lines)) <= 80 and len(results_table([name], [result]).splitlines()) == 2
    own = [line for line in lines if line == name]
    assert len(own) == (len(name) > 20)
    assert len(lines[0].split()) == columns - bool(own)
    assert len({len(line) for line in lines if line not in (name, "b", "")}) == 1


OF_A_TERMINAL = ("COLUMNS", "LINES", "TTY_INTERACTIVE", "TTY_COMPATIBLE", "NO_COLOR", "FORCE_COLOR")  # rich asks these


def on_a_terminal(*command):
    """What a program prints on a terminal of 80 columns, whatever the one of the tests is."""
    master, slave = pty.openpty()
    termios.tcsetwinsize(slave, (24, 80))
    environment = {key: value for key, value in ENVIRONMENT.items() if key not in OF_A_TERMINAL} | {"TERM": "xterm"}
    process = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=slave, stderr=slave)
    os.close(slave)
    chunks = []
    try:
        while chunk := os.read(master, 4096):
            chunks.append(chunk)
    except OSError:  # the other side is closed
        pass
    os.close(master)
    return process.wait(timeout=60), b"".join(chunks).decode()


@pytest.mark.parametrize("launcher", [(), pytest.param(("mpirun", "-n", "2"), marks=pytest.mark.mpi)])
def test_terminal_gets_a_display_that_is_gone_at_the_end(folder, launcher):
    Path("my.toml").write_text(cases("[red]slow", "b"))
    status, text = on_a_terminal(*launcher, sys.executable, FAKE, "my.toml")
    assert status == 0
    assert re.search(r"[01] of 2 cases done, \d running, \d waiting", text)
    assert re.search(r"step \d, Newton \d", text)
    assert re.search(r"\[[12]/2\] \[red\]slow: solved, 5 steps", text)
    assert text.count("\x1b[?25l") == text.count("\x1b[?25h") == 1  # cursor hidden, and shown again
    assert "\x1b" not in text[text.index("largest values") :]


@pytest.mark.parametrize("term", ["xterm", "dumb"])
def test_terminal_that_is_closed_does_not_stop_a_study(folder, term):
    """Where SIGHUP is ignored, as after `disown`."""
    Path("my.toml").write_text(cases("slow", "b"))
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, FAKE, "my.toml"],
        env={**ENVIRONMENT, "TERM": term},
        stdin=subprocess.DEVNULL,
        stdout=slave,
        stderr=slave,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )
    os.close(slave)
    os.read(master, 1)  # it has begun to speak
    os.close(master)
    assert process.wait(timeout=120) == 0
    assert all(Path(f"results/my/{name}/result.json").exists() for name in ("slow", "b"))


def test_full_disk_below_standard_output_does_not_stop_a_study(folder):
    Path("my.toml").write_text(cases("a", "b"))
    with open("/dev/full", "w") as full:
        process = subprocess.run(
            [sys.executable, FAKE, "my.toml"], env=ENVIRONMENT, stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert (process.returncode, process.stderr) == (0, "")
    assert Path("results/my/b/result.json").exists()


@pytest.mark.parametrize("ranks", [0, pytest.param(2, marks=pytest.mark.mpi)])
def test_pipe_gets_plain_lines(folder, ranks):
    Path("my.toml").write_text(cases("a", "b"))
    outcome = program("my.toml", ranks=ranks, program=(FAKE,))
    assert outcome.status == 0
    assert "\x1b" not in outcome.out
    assert "[2/2] " in outcome.out
