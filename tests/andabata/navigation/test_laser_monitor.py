"""Supervision of the laser: arrivals, repetitions, invalid ranges, the laser's own period."""

import numpy as np
import pytest

from andabata.machine.pose import PoseTrack
from andabata.machine.sensor_readings import SensorReadings, Sweeps
from andabata.navigation.laser_monitor import LaserMonitor, LaserMonitorConfig
from traversability.cloud import PointCloud

UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])


def driven(speed=0.3, until=60.0):
    """Return the track of a drive to the east at a speed [m/s]."""
    track = PoseTrack()
    stamps = np.arange(round(until * 10) + 1) / 10
    rows = np.zeros((len(stamps), 8))
    rows[:, 0], rows[:, 1], rows[:, 4:] = stamps, speed * stamps, UPRIGHT
    track.extend(rows)
    return track


TRACK, STANDING = driven(), driven(0.0)


def sweeps(stamp, ranges, head_rate=0.94):
    """Return readings with two sweeps of a turning head that end at a stamp."""
    stamps = stamp - np.array([0.05, 0.0])
    ranges = np.broadcast_to(ranges, (2, 5)).astype(np.float32)
    angles = head_rate * stamps
    return SensorReadings(stamp, Sweeps(stamps, angles, head_rate, 0.0, np.zeros(5), ranges))


def noisy(stamp):
    """Return ranges that no other stamp has."""
    return 3.0 + np.random.default_rng(round(stamp * 100)).normal(0, 0.01, (2, 5))


def feed(monitor, make, begin, seconds, track=TRACK, period=0.1):
    """Return silence after each period; ``make`` gives the readings of a stamp."""
    found = []
    for k in range(1, round(seconds / period) + 1):
        stamp = round(begin + k * period, 6)
        monitor.update(make(stamp), track)
        found.append(monitor.is_silent)
    return found


def healthy(begin=0.0, seconds=2.0):
    """Return a monitor of a laser that is well until then."""
    monitor = LaserMonitor(LaserMonitorConfig())
    assert not any(feed(monitor, lambda t: sweeps(t, noisy(t)), begin, seconds))
    return monitor


def nothing(stamp):
    """Return readings without a laser's."""
    return SensorReadings(stamp)


def test_silence_begins_after_the_timeout_and_ends_with_an_arrival():
    """0.3 s are accepted, 0.4 s are not; the cause tells the time."""
    monitor = healthy()
    assert feed(monitor, nothing, 2.0, 0.6) == [False, False, False, True, True, True]
    assert monitor.causes == ("laser: silent for 0.6 s",)
    assert feed(monitor, lambda t: sweeps(t, noisy(t)), 2.6, 0.1) == [False]
    assert monitor.causes == ()


def test_without_an_arrival_there_is_nothing_to_miss():
    """Before the first one, and after a reset."""
    monitor = LaserMonitor(LaserMonitorConfig())
    assert not any(feed(monitor, nothing, 0.0, 30.0))
    monitor = healthy()
    monitor.reset()
    assert not any(feed(monitor, nothing, 2.0, 30.0))


@pytest.mark.parametrize(("period", "last"), [(0.1, 3), (0.2, 6), (1.0, 30)])
def test_a_slow_laser_has_three_of_its_own_periods(period, last):
    """A turn a second is three seconds' patience; the setting is the least."""
    monitor = LaserMonitor(LaserMonitorConfig())
    every = round(period * 10)

    def make(stamp):
        return sweeps(stamp, noisy(stamp)) if round(stamp * 10) % every == 0 else nothing(stamp)

    assert not any(feed(monitor, make, 0.0, 10 * period))
    assert feed(monitor, nothing, 10 * period, 4.0).index(True) == last


def test_a_short_gap_of_a_fast_laser_does_not_teach_patience():
    """The usual time between arrivals is their median."""
    monitor = healthy()
    feed(monitor, nothing, 2.0, 2.0)
    feed(monitor, lambda t: sweeps(t, noisy(t)), 4.0, 0.3)
    assert feed(monitor, nothing, 4.3, 0.6).index(True) == 3


@pytest.mark.parametrize(
    ("value", "words"),
    [(np.nan, "what arrives is invalid"), (np.inf, "what arrives is invalid")],
)
def test_ranges_that_are_none_do_not_count(value, words):
    """No number, and no return at all: a laser sees the ground."""
    monitor = healthy()
    found = feed(monitor, lambda t: sweeps(t, np.full(5, value)), 2.0, 0.5)
    assert found == [False, False, False, True, True]
    assert monitor.causes == (f"laser: silent for 0.5 s, {words}",)


@pytest.mark.parametrize(("head_rate", "track"), [(0.94, TRACK), (0.94, STANDING), (0.0, TRACK)])
def test_equal_sweeps_do_not_count_while_head_or_robot_move(head_rate, track):
    """They are kept from the clouds, and silence counts from the last change."""
    monitor, same = healthy(), noisy(2.1)[0]
    found = feed(monitor, lambda t: sweeps(t, same, head_rate), 2.0, 0.6, track)
    assert found == [False, False, False, False, True, True]
    assert monitor.causes == ("laser: silent for 0.5 s, it repeats its last ranges",)
    assert monitor.update(sweeps(2.7, same, head_rate), track).sweeps is None
    assert monitor.update(sweeps(2.8, noisy(2.8), head_rate), track).sweeps is not None
    assert not monitor.is_silent


def test_a_laser_without_noise_may_repeat_itself_where_nothing_moves():
    """A simulated one, on a robot that stands, with a head that stands."""
    monitor, same = healthy(), noisy(2.1)[0]
    make = lambda t: sweeps(t, same, 0.0)  # noqa: E731 - as short as it is.
    assert not any(feed(monitor, make, 2.0, 5.0, STANDING))
    assert monitor.update(make(7.1), STANDING).sweeps is not None


def test_equal_blocks_of_sweeps_do_not_count_either():
    """Two sweeps that differ, again and again, of a robot that moves."""
    monitor, same = healthy(), noisy(2.1)
    assert feed(monitor, lambda t: sweeps(t, same), 2.0, 0.6).index(True) == 4
    monitor = healthy()
    assert not any(feed(monitor, lambda t: sweeps(t, same), 2.0, 2.0, STANDING))


def test_a_turn_of_the_robot_is_motion():
    """On the spot, by the heading of the track."""
    turning = PoseTrack()
    stamps = np.arange(0, 101) / 10
    rows = np.zeros((len(stamps), 8))
    rows[:, 0], rows[:, 6], rows[:, 7] = stamps, np.sin(0.2 * stamps), np.cos(0.2 * stamps)
    turning.extend(rows)
    monitor, same = healthy(), noisy(2.1)
    assert any(feed(monitor, lambda t: sweeps(t, same, 0.0), 2.0, 1.0, turning))


def test_measurements_of_long_ago_do_not_count():
    """A second is the limit."""
    monitor = healthy()

    def old(stamp):
        readings = sweeps(stamp, noisy(stamp))
        readings.sweeps.stamps[:] -= 1.1
        return readings

    assert feed(monitor, old, 2.0, 0.4)[-1]
    assert monitor.causes == ("laser: silent for 0.4 s, what arrives is old",)


def test_clouds_of_a_3d_laser_are_judged_alike():
    """Equal points of a robot that moves, and clouds without a point, do not count."""

    def cloud(stamp, points):
        frame = PointCloud(points.astype(np.float32), "sensor", np.full(len(points), stamp))
        return SensorReadings(stamp, frames=(frame,))

    def fresh(stamp):
        return cloud(stamp, np.random.default_rng(round(stamp * 10)).normal(size=(50, 3)))

    same = np.ones((50, 3))
    for make, track, silent in (
        (lambda t: cloud(t, same), TRACK, True),
        (lambda t: cloud(t, same), STANDING, False),
        (lambda t: cloud(t, same[:0]), STANDING, True),
    ):
        monitor = LaserMonitor(LaserMonitorConfig())
        assert not any(feed(monitor, fresh, 0.0, 2.0, track))
        assert feed(monitor, make, 2.0, 1.0, track)[-1] is silent


def test_a_horizontal_scanner_may_see_nothing():
    """Infinity all around is open ground, NaN all around is no scan."""
    for value, silent in ((np.inf, False), (np.nan, True), (2.0, True)):
        monitor = LaserMonitor(LaserMonitorConfig())
        ranges = np.full(32, value, np.float32)
        make = lambda t, ranges=ranges: SensorReadings(t, horizontal=ranges)  # noqa: E731
        assert any(feed(monitor, make, 0.0, 8.0)) is silent


def test_the_timeout_is_a_setting():
    """A second instead, and six of the laser's periods."""
    monitor = LaserMonitor(LaserMonitorConfig(timeout=1.0))
    feed(monitor, lambda t: sweeps(t, noisy(t)), 0.0, 2.0)
    assert feed(monitor, nothing, 2.0, 2.0).index(True) == 10
    monitor = LaserMonitor(LaserMonitorConfig(periods=6.0))
    feed(monitor, lambda t: sweeps(t, noisy(t)), 0.0, 2.0)
    assert feed(monitor, nothing, 2.0, 2.0).index(True) == 6
