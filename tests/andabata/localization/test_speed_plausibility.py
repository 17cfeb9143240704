"""Plausibility of the encoders' speed: jumps, starts, slip, collisions, slopes, gaps."""

import numpy as np
import pytest

from andabata.localization.filter_state import PITCH, STATES
from andabata.localization.plausibility import Doubt, Plausibility, SenseRows
from andabata.localization.sense_watch import LAGS, PlausibilityConfig, Wheel
from andabata.machine.proprioception import GRAVITY

RADIUS, TICK = 0.1, 0.01


def rows(stamps, robot, wheels, rng, pitch=0.0):
    """Return the rows of a period in which robot and wheels have some speeds [m/s].

    Args:
        stamps: Stamps of the rows [s].
        robot: Speed of the robot one tick before and at each of them.
        wheels: Speed by the wheels at each of them.
        rng: Source of noise.
        pitch: Pitch of the robot [rad], positive nose down.
    """
    imu = np.zeros((len(stamps), 7))
    imu[:, 4] = np.diff(robot) / TICK - GRAVITY * np.sin(pitch)
    imu[:, 6] = GRAVITY * np.cos(pitch)
    imu[:, 1:] += 0.003 * rng.standard_normal((len(stamps), 6))
    encoders = np.stack([stamps, wheels / RADIUS, wheels / RADIUS], axis=1)
    encoders[:, 1:] += 0.05 * rng.standard_normal((len(stamps), 2))
    imu[:, 0] = stamps
    return SenseRows(imu, encoders, np.empty((0, 4)))


def doubts(robot, wheels, pitch=0.0, change=lambda rows: rows):
    """Return the doubts after each period of a drive, and the check.

    Args:
        robot: Speed of the robot at each tick [m/s], shape (10 n + 1,).
        wheels: Speed by the wheels at each tick, of the same shape.
        pitch: Pitch [rad].
        change: Change of the rows.
    """
    rng, found = np.random.default_rng(0), []
    check = Plausibility(PlausibilityConfig(), Wheel(RADIUS, 0.17))
    x = np.zeros(STATES)
    x[PITCH] = pitch
    for first in range(0, len(robot) - 1, 10):
        ticks = slice(first + 1, first + 11)
        stamps = TICK * np.arange(first + 1, first + 11)
        given = change(rows(stamps, robot[first : first + 11], wheels[ticks], rng, pitch))
        check.believed(stamps[-1], first * TICK, given, x)
        found.append(dict(check.doubts))
    return found


def speeds(*parts):
    """Return the speed at each tick of parts of a speed [m/s] and a time [s]."""
    return np.concatenate([[parts[0][0]], *(np.full(round(time / TICK), v) for v, time in parts)])


def lagged(wheels, time):
    """Return the speed of a robot that follows its wheels with a time constant [s]."""
    robot = wheels.copy()
    for k in range(1, len(robot)):
        robot[k] = robot[k - 1] + (1 - np.exp(-TICK / time)) * (wheels[k] - robot[k - 1])
    return robot


@pytest.mark.parametrize("factor", [2.0, 0.5, 0.0, 10.0])
@pytest.mark.parametrize("pitch", [-0.3, 0.0, 0.3])
def test_a_scale_that_jumps_is_found_on_a_straight_way_at_one_speed(factor, pitch):
    """Within 0.3 s, uphill and downhill: the weight is no acceleration."""
    robot = speeds((0.6, 4.0))
    wheels = robot * np.where(np.arange(len(robot)) > 200, factor, 1.0)
    found = doubts(robot, wheels, pitch)
    assert not any(found[:20])
    assert found[22] == {"wheels": Doubt.JUMP}
    assert found[-1] == {"wheels": Doubt.JUMP}


@pytest.mark.parametrize("speed", [0.3, 0.7])
def test_a_scale_from_the_begin_is_found_at_a_start(speed):
    """Wheels of twice the speed gain twice as much; a slow start proves nothing."""
    robot = np.clip(3.0 * TICK * (np.arange(401) - 200), 0.0, speed)
    found = doubts(robot, 2 * robot)
    assert not any(found[:20])
    assert bool(found[-1]) == (speed > 0.4)


@pytest.mark.parametrize("time", [0.02, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("speed", [-0.6, 0.6])
def test_wheels_that_slip_until_the_robot_follows_are_believed(time, speed):
    """Starts, stops and reversals by steps, which the robot follows in some tenths of a second."""
    assert time <= LAGS[-1]
    wheels = speeds((0.0, 1.0), (speed, 1.5), (-speed, 0.5), (speed, 0.5), (0.0, 1.0))
    assert not any(doubts(lagged(wheels, time), wheels))


def test_wheels_that_spin_on_are_doubted_until_they_have_grip():
    """A robot that stays behind its wheels for a second: they do not tell its speed."""
    robot, wheels = speeds((0.3, 5.0)), speeds((0.3, 2.0), (0.6, 1.0), (0.3, 2.0))
    found = doubts(robot, wheels)
    assert not any(found[:20] + found[34:])
    assert all(found[22:29])


def test_a_collision_is_no_fault_of_the_wheels():
    """The robot stops and its wheels do not: its speed changes, and not theirs."""
    robot, wheels = speeds((0.5, 2.0), (0.0, 2.0)), speeds((0.5, 4.0))
    assert not any(doubts(robot, wheels))


def without(field, columns, value):
    """Return a change that puts a value in some columns."""

    def change(given):
        wrong = getattr(given, field).copy()
        wrong[:, columns] = value
        return given._replace(**{field: wrong})

    return change


def test_what_the_accelerometer_cannot_feel_proves_nothing():
    """Without numbers, rows, its own weight, or with old stamps it convicts nobody."""
    robot = speeds((0.5, 4.0))
    wheels = robot * np.where(np.arange(len(robot)) > 200, 2.0, 1.0)

    def late(given):
        old = given.imu.copy()
        old[:, 0] -= 0.3
        return given._replace(imu=old)

    def weightless(given):
        return given._replace(imu=given.imu * np.array([1, 1, 1, 1, 1, 1, 0.7]))

    for change in (
        without("imu", slice(4, 7), np.nan),
        without("wheels", slice(1, 3), np.nan),
        late,
        lambda given: given._replace(imu=given.imu[:0]),
        lambda given: given._replace(imu=given.imu[:3]),
        lambda given: given._replace(wheels=given.wheels[:0]),
    ):
        assert not any(doubts(robot, wheels, change=change))
    assert all("wheels" not in found for found in doubts(robot, wheels, change=weightless))


def test_a_gap_ends_the_comparison_and_the_next_begins_after_it():
    """A jump in a gap is not seen; one after it is."""
    robot = speeds((0.5, 6.0))
    ticks = np.arange(len(robot))
    wheels = robot * np.where((ticks > 205) & (ticks < 400), 2.0, 1.0)

    def gap(given):
        is_gap = 2.0 < given.imu[-1, 0] < 2.15
        return given._replace(imu=given.imu[:2]) if is_gap else given

    found = doubts(robot, wheels, change=gap)
    assert not any(found[:40])
    assert found[42] == {"wheels": Doubt.JUMP}


def stepped(size, time=2.0):
    """Return the speeds of a robot that drives on, and of wheels that step at a time [m/s]."""
    robot = speeds((0.3, 4.0))
    return robot, robot + size * (np.arange(len(robot)) > time / TICK)


@pytest.mark.parametrize("size", [0.2, -0.2])
@pytest.mark.parametrize("pitch", [-0.3, 0.0, 0.3])
def test_a_step_from_row_to_row_that_nobody_feels_is_found(size, pitch):
    """Half a second after it, also where it is too small for the change over some time."""
    found = doubts(*stepped(size), pitch)
    assert not any(found[:25])
    assert found[25] == found[-1] == {"wheels": Doubt.JUMP}


def test_a_step_that_comes_back_ends_its_doubt():
    """The wheels tell the robot's speed again."""
    robot = speeds((0.3, 5.0))
    wheels = speeds((0.3, 1.0), (0.5, 2.0), (0.3, 2.0))
    found = doubts(robot, wheels)
    assert found[29] == {"wheels": Doubt.JUMP}
    assert not any(found[36:])


@pytest.mark.parametrize("size", [0.1, -0.15])
def test_a_small_step_proves_nothing(size):
    """An error of the pitch on rough ground is as large."""
    assert not any(doubts(*stepped(size)))


@pytest.mark.parametrize("error", [-0.03, 0.03])
@pytest.mark.parametrize("time", [0.01, 0.1])
def test_a_step_by_command_is_believed_although_the_pitch_is_wrong(error, time):
    """The drift of the integrated acceleration is no part of the step."""

    def tilted(given):
        imu = given.imu.copy()
        imu[:, 4] += GRAVITY * error
        return given._replace(imu=imu)

    wheels = speeds((0.3, 2.0), (0.6, 2.0))
    assert not any(doubts(lagged(wheels, time), wheels, change=tilted))
