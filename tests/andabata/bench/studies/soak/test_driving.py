"""Long drives and interrupts: growth, early ends and orphans are noticed."""

import subprocess
import sys

import pytest

from andabata.bench.studies.soak import driving
from andabata.bench.studies.soak.driving import (
    interrupted_drives_end,
    long_drives_keep_their_memory,
    loops_of_drives_end,
    orphans,
)


@pytest.fixture
def short_drives(monkeypatch):
    """Let each attempt end after a few seconds."""
    rules = driving.TerminationConfig(time_limit=5.0)
    monkeypatch.setattr(driving, "TerminationConfig", lambda: rules)


def test_driving_on_takes_no_more_memory(tmp_path, short_drives):
    """Some seconds of drives in two worlds."""
    outcome = long_drives_keep_their_memory(12, tmp_path)
    assert outcome.failures == ()
    assert outcome.trials >= 12


def test_growth_and_errors_are_noticed(tmp_path, monkeypatch, short_drives):
    """More than fifty megabytes after the warm-up, and a drive that raises."""
    memory = iter((100.0, 200.0))
    monkeypatch.setattr(driving, "_memory", lambda: next(memory))
    (failure,) = long_drives_keep_their_memory(1, tmp_path).failures
    assert failure == "memory: expected less, got 100 MB more"
    monkeypatch.setattr(driving, "_memory", lambda: 1.0)
    monkeypatch.setattr(driving, "run_trial", lambda *_: 1 / 0)
    assert "ZeroDivisionError" in long_drives_keep_their_memory(1, tmp_path).failures[0]


def test_loops_leave_nothing_open(tmp_path, monkeypatch):
    """A file that stays open in each loop, and an error, are noticed."""
    monkeypatch.setattr(driving, "_LOOP_PERIODS", 1)
    monkeypatch.setattr(driving, "_WARM_UP", 2)
    outcome = loops_of_drives_end(4, tmp_path)
    assert (outcome.trials, outcome.failures) == (4, ())
    numbers = iter((10, 12))
    monkeypatch.setattr(driving, "_open_files", lambda: next(numbers))
    (failure,) = loops_of_drives_end(3, tmp_path).failures
    assert failure == "expected no file to stay open, got 2 more"
    monkeypatch.setattr(driving, "_open_files", lambda: 1)
    sizes = iter((300.0, 360.0))
    monkeypatch.setattr(driving, "_memory", lambda: next(sizes))
    (failure,) = loops_of_drives_end(3, tmp_path).failures
    assert failure == "memory: expected less, got 60 MB more"
    monkeypatch.setattr(driving, "_memory", lambda: 300.0)
    monkeypatch.setattr(driving, "SimulatedRobot", lambda *_: 1 / 0)
    assert "ZeroDivisionError" in loops_of_drives_end(1, tmp_path).failures[0]


def started_as(code):
    """Return what starts a process of some code instead of a command."""

    def start(words):
        return subprocess.Popen(
            [sys.executable, "-c", code],
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    return start


_GOOD = "import signal, sys, time\n"
_GOOD += "for n in (2, 15): signal.signal(n, lambda *_: sys.exit(130))\n"


@pytest.mark.parametrize(
    ("code", "word"),
    [
        (f"{_GOOD}time.sleep(60)", ""),
        ("", "expected it to go on, it ended with 0"),
        ("import time\ntime.sleep(60)", "expected code 130"),
        (f"{_GOOD}import subprocess\nsubprocess.Popen(['sleep', '2'])\ntime.sleep(60)", "to stay"),
    ],
)
def test_ends_of_commands_are_judged(code, word, tmp_path, monkeypatch):
    """One that ends well passes; one that is over, has another code or leaves a process fails."""
    monkeypatch.setattr(driving, "_started", started_as(code))
    monkeypatch.setattr(driving, "_EARLIEST", 0.6)
    monkeypatch.setattr(driving, "_LATEST", 0.6)
    outcome = interrupted_drives_end(1, tmp_path)
    assert bool(outcome.failed) == bool(word)
    assert all(word in text for text in outcome.failures[:1])


def test_a_process_that_does_not_end_fails(tmp_path, monkeypatch):
    """It is killed, and its time named."""
    code = "import signal, time\nsignal.signal(2, signal.SIG_IGN)\ntime.sleep(60)"
    monkeypatch.setattr(driving, "_started", started_as(code))
    for name, value in (("_EARLIEST", 0.6), ("_LATEST", 0.6), ("_PATIENCE", 0.1)):
        monkeypatch.setattr(driving, name, value)
    assert "expected an end, got none in 0.2 s" in interrupted_drives_end(1, tmp_path).failures[0]


def test_processes_of_a_session_are_found():
    """Its leader, and nobody else's; none after their end."""
    with subprocess.Popen(["sleep", "60"], start_new_session=True) as process:
        assert orphans(process.pid) == [process.pid]
        process.kill()
    assert orphans(process.pid) == []
