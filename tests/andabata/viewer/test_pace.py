"""Pace of a watched drive: real time by a clock, pauses and single steps."""

import math
import threading

import pytest

from andabata.viewer.pace import Pace


def started(pace, count):
    """Return a thread that waits for a number of steps, and the list of those that passed."""
    passed = []

    def run():
        for number in range(count):
            pace.wait(0.1)
            passed.append(number)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread, passed


def test_an_infinite_speed_waits_for_nothing():
    """A thousand steps pass although the clock stands still."""
    pace = Pace(math.inf, now=lambda: 0.0)
    for _ in range(1000):
        pace.wait(0.1)


def test_steps_are_due_a_period_over_the_speed_apart():
    """With a clock that goes on by itself, the next step is due where the last one was and more."""
    clock = iter([0.0, 0.0, 0.05, 0.05, 0.1, 0.1])
    pace = Pace(2.0, now=lambda: next(clock))
    for due in (0.05, 0.1, 0.15):
        pace.wait(0.1)
        assert pace._due == pytest.approx(due)


def test_a_drive_that_is_late_does_not_rush_to_catch_up():
    """After ten seconds of something else, the next step is due a period from now."""
    times = [0.0]
    pace = Pace(1.0, now=lambda: times[0])
    pace.wait(0.1)
    times[0] = 10.0
    pace.wait(0.1)
    assert pace._due == pytest.approx(10.1)


def test_a_paused_drive_goes_on_by_single_steps_and_by_play():
    """Nothing passes in a pause; a step lets one through, playing all."""
    pace = Pace(math.inf, is_paused=True)
    pace.step()
    pace.step()
    thread, passed = started(pace, 2)
    thread.join(10)
    assert passed == [0, 1]
    thread, passed = started(pace, 50)
    assert pace.is_paused
    assert not passed
    pace.play()
    thread.join(10)
    assert len(passed) == 50


def test_a_step_pauses_a_drive_that_plays():
    """After the step that it lets through, the drive waits."""
    pace = Pace(math.inf)
    pace.step()
    pace.wait(0.1)
    assert pace.is_paused


def test_a_closed_pace_lets_everything_pass():
    """Closing wakes a drive that waits in a pause."""
    pace = Pace(1.0, is_paused=True)
    thread, passed = started(pace, 5)
    pace.close()
    thread.join(10)
    assert len(passed) == 5


def test_a_nudge_ends_one_wait():
    """It wakes a player in a pause, once."""
    pace = Pace(1.0, is_paused=True)
    pace.nudge()
    pace.wait(0.1)
    thread, passed = started(pace, 1)
    assert not passed
    pace.close()
    thread.join(10)


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan])
def test_a_speed_has_to_be_above_zero(speed):
    """Others are refused."""
    with pytest.raises(ValueError, match="speed: expected above 0"):
        Pace().set_speed(speed)
