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


def sparse(stamp):
    """Return sweeps in one of five periods, no more than 0.3 s apart from the next."""
    return sweeps(stamp, noisy(stamp)) if round(stamp * 10) % 3 == 0 else nothing(stamp)


def test_a_laser_that_sends_few_sweeps_is_not_usable():
    """It is not silent; what arrives is still passed on."""
    monitor = healthy(seconds=6.0)
    assert not any(feed(monitor, sparse, 6.0, 2.0))
    assert not monitor.is_usable
    (cause,) = monitor.causes
    assert cause.startswith("laser: fewer usable readings than usual, by 61 %")
    assert monitor.update(sweeps(8.1, noisy(8.1)), TRACK).sweeps is not None
    feed(monitor, lambda t: sweeps(t, noisy(t)), 8.1, 2.0)
    assert monitor.is_usable
    assert monitor.causes == ()


def test_after_a_silence_the_first_ranges_are_usable():
    """What was not sent in it is no shortage."""
    monitor = healthy(seconds=6.0)
    feed(monitor, nothing, 6.0, 5.0)
    assert not monitor.is_usable
    feed(monitor, lambda t: sweeps(t, noisy(t)), 11.0, 0.1)
    assert monitor.is_usable


@pytest.mark.parametrize("value", [1e30, -1e30])
def test_impossible_ranges_do_not_count_and_go_no_further(value):
    """One of five, beside good ones."""
    monitor = healthy()

    def garbage(stamp):
        return sweeps(stamp, np.where(np.arange(5) == 2, value, noisy(stamp)))

    assert feed(monitor, garbage, 2.0, 0.5) == [False, False, False, True, True]
    assert monitor.causes == ("laser: silent for 0.5 s, what arrives is invalid",)
    assert monitor.update(garbage(2.6), TRACK).sweeps is None
    points = np.full((20, 3), -5.0, dtype=np.float32)
    assert monitor.update(SensorReadings(2.7, frames=(PointCloud(points, "sensor"),)), TRACK).frames
    points[:3] = value
    cloud = PointCloud(points, "sensor")
    assert not monitor.update(SensorReadings(2.8, frames=(cloud,)), TRACK).frames
    ranges = np.full(8, value, dtype=np.float32)
    assert monitor.update(SensorReadings(2.9, horizontal=ranges), TRACK).horizontal is None


def test_nothing_around_a_horizontal_scanner_is_passed_on():
    """No return at all is what it sees there."""
    monitor = LaserMonitor(LaserMonitorConfig())
    ranges = np.full(8, np.inf, dtype=np.float32)
    for k in range(1, 60):
        readings = monitor.update(SensorReadings(k / 10, horizontal=ranges), TRACK)
        assert readings.horizontal is not None
    assert monitor.is_usable


def test_ground_that_moves_all_at_once_stops_the_robot():
    """The sweeps are kept from the clouds, and the health says by how much they changed."""
    elevations = np.linspace(-2.35, 2.35, 401)
    with np.errstate(divide="ignore"):
        far = np.where(np.cos(elevations) < -0.1, -0.72 / np.cos(elevations), np.inf)
    monitor = LaserMonitor(LaserMonitorConfig())

    def sweep(k, scale):
        stamp = np.array([k / 10 - 0.025, k / 10])
        noise = np.random.default_rng(k).normal(0, 0.01, (2, 401))
        ranges = (scale * (far + noise)).astype(np.float32)
        return SensorReadings(k / 10, Sweeps(stamp, stamp, 1.0, 0.0, elevations, ranges))

    for k in range(1, 30):
        assert monitor.update(sweep(k, 1.0), TRACK).sweeps is not None
    assert monitor.update(sweep(30, 1.2), TRACK).sweeps is None
    assert not monitor.is_usable
    assert not monitor.is_silent
    (cause,) = monitor.causes
    assert cause.startswith("laser: ranges to the ground became longer all at once, by 0.2")
    assert monitor.update(sweep(31, 1.0), TRACK).sweeps is not None
    assert monitor.is_usable
