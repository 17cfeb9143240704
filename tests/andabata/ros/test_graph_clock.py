"""The time of a graph is the system's, or that of /clock, which may not run back."""

import threading
import time

import pytest

from andabata.records.messages import NS
from andabata.ros.graph import RosError
from andabata.ros.graph_clock import SimulatedClock, WallClock


def test_the_wall_clock_is_the_systems():
    """Its time is that since 1970, and a past time is not waited for."""
    clock = WallClock()
    before = time.time_ns()
    clock.sleep_until(before - NS)
    assert before <= clock.now_ns() <= time.time_ns()
    clock.sleep_until(before + NS // 50)
    assert clock.now_ns() >= before + NS // 50


def test_simulated_time_stands_between_messages():
    """It is 0 before the first one, and a sleep ends with the message that brings its time."""
    clock, woken = SimulatedClock(), []
    assert clock.now_ns() == 0
    clock.set(3 * NS)
    assert clock.now_ns() == 3 * NS
    clock.sleep_until(2 * NS)

    def sleep():
        clock.sleep_until(5 * NS)
        woken.append(clock.now_ns())

    thread = threading.Thread(target=sleep)
    thread.start()
    clock.set(4 * NS)
    clock.set(6 * NS)
    thread.join(10)
    assert woken == [6 * NS]


def test_time_that_runs_back_is_an_error():
    """A jump back before a sleep, too, ends it."""
    clock = SimulatedClock()
    clock.set(3 * NS)
    clock.set(1 * NS)
    with pytest.raises(RosError, match="jump back"):
        clock.sleep_until(4 * NS)
