"""Supervision of sensors: timeouts, inflation after long rejection, health."""

import numpy as np
import pytest

from andabata.localization.localizer import Health
from andabata.localization.sensor_monitor import SensorMonitor, health_of
from andabata.localization.ukf_config import UkfConfig

CONFIG = UkfConfig()
CERTAIN = np.eye(20) * 0.01


@pytest.mark.parametrize(
    ("sensor", "timeout"),
    [("imu", 0.1), ("wheels", 0.2), ("compass", 1.0), ("gnss", 6.0)],
)
def test_each_sensor_has_its_own_timeout(sensor, timeout):
    """A warning comes after the timeout, not at it; data end it."""
    monitor = SensorMonitor(CONFIG, 10.0)
    monitor.receive("imu", 10.0 if sensor == "imu" else 100.0)
    for name in {"wheels", "compass", "gnss"} - {sensor}:
        monitor.accept(name, 100.0)
    assert monitor.warnings(10.0 + timeout, CERTAIN) == ()
    (text,) = monitor.warnings(10.0 + timeout + 0.1, CERTAIN)
    assert text.startswith(f"{sensor}: ")
    assert f" for {timeout + 0.1:.1f} s" in text
    monitor.receive(sensor, 17.0)
    monitor.accept(sensor, 17.0) if sensor != "imu" else None
    assert monitor.warnings(17.0, CERTAIN) == ()


@pytest.mark.parametrize(
    ("period", "fixes", "limit"),
    [
        (1.0, 30, 2.3),  # One lost fix of a receiver of 1 Hz makes two seconds.
        (3.0, 30, 6.9),
        (0.2, 30, 1.0),
        (1.0, 2, 6.0),  # Not known yet.
    ],
)
def test_fixes_are_missed_by_the_periods_of_their_receiver(period, fixes, limit):
    """The silence that is accepted is some periods, at least a second; others' limits stay."""
    monitor = SensorMonitor(CONFIG, 0.0)
    last = 0.0
    for number in range(1, fixes + 1):
        if number % 10 == 5:  # One of ten is lost.
            continue
        last = number * period
        monitor.accept("gnss", last)
    for name in ("wheels", "compass"):
        monitor.accept(name, last + 100.0)
    monitor.receive("imu", last + 100.0)
    assert monitor.warnings(last + limit, CERTAIN) == ()
    (text,) = monitor.warnings(last + limit + 0.1, CERTAIN)
    assert text == f"gnss: not accepted for {limit + 0.1:.1f} s, no valid reading arrives"
    assert monitor.longest_gap(CONFIG.gnss_periods) == pytest.approx(limit)


def test_a_receiver_that_reports_no_fix_has_longer():
    """It is alive: near trees several fixes in a row are lost, and that is no fault yet."""
    monitor = SensorMonitor(CONFIG, 0.0)
    for second in range(1, 11):
        monitor.accept("gnss", float(second))
    for second in range(11, 15):
        monitor.report_no_fix(float(second))
        monitor.receive("imu", second + 0.4)
        for name in ("wheels", "compass"):
            monitor.accept(name, second + 0.4)
        texts = monitor.warnings(second + 0.4, CERTAIN)
        late = ("gnss: not accepted for 4.4 s, the receiver has no fix",)
        assert texts == (late if second == 14 else ())
    assert monitor.warnings(14.3, CERTAIN) == ()


def test_fixes_that_are_rejected_are_not_missed():
    """Multipath takes some seconds: those have the longer time."""
    monitor = SensorMonitor(CONFIG, 0.0)
    for second in range(1, 17):
        monitor.receive("imu", float(second))
        for name in ("wheels", "compass"):
            monitor.accept(name, float(second))
        (monitor.accept if second <= 10 else monitor.receive)("gnss", float(second))
        assert monitor.warnings(float(second), CERTAIN) == ()
    (text,) = monitor.warnings(16.1, CERTAIN)
    assert text == "gnss: not accepted for 6.1 s, what arrives contradicts the estimate"


def test_a_fix_out_of_reach_is_told_until_one_is_accepted():
    """Also while the robot drives as far as the fix is off: it did not jump with it."""
    monitor = SensorMonitor(CONFIG, 0.0)
    monitor.accept("gnss", 0.0)
    monitor.add_offset(np.array([15.9, 0.0]))
    assert monitor.warnings(0.05, CERTAIN) == ()
    monitor.add_offset(np.array([16.1, 0.0]))
    monitor.drive(5.0)
    monitor.add_offset(np.array([0.0, 17.0]))
    (text,) = monitor.warnings(0.05, CERTAIN)
    assert text == "gnss: off by 17 m, farther than the robot can have driven"
    monitor.accept("gnss", 0.05)
    assert monitor.warnings(0.05, CERTAIN) == ()


def test_rejected_data_inflate_the_covariance_and_each_time_twice_as_much():
    """After the inflation time of rejected data the factors are 1, 2, 4; acceptance resets."""
    monitor = SensorMonitor(CONFIG, 0.0)
    found = {}
    for step in range(1, 500):
        now = step / 10
        monitor.receive("compass", now)
        if (factor := monitor.inflation("compass", now)) is not None:
            found[now] = factor
    assert list(found.values()) == [1.0, 2.0, 4.0]
    np.testing.assert_allclose(list(found), [15.1, 30.2, 45.3], atol=0.11)
    monitor.accept("compass", 50.0)
    monitor.receive("compass", 65.1)
    assert monitor.inflation("compass", 65.1) == 1.0


def test_a_silent_sensor_inflates_nothing():
    """Without data there is nothing to doubt the filter for."""
    monitor = SensorMonitor(CONFIG, 0.0)
    assert monitor.inflation("gnss", 100.0) is None


@pytest.mark.parametrize(
    ("step", "offset", "due"),
    [(0.0, 7.0, 45.0), (0.5, 7.0, 15.0), (0.0, 20.0, 15.0)],
)
def test_fixes_off_by_a_constant_are_waited_out(step, offset, due):
    """Near, constant offsets look like multipath; growing or far ones do not."""
    monitor = SensorMonitor(CONFIG, 0.0)
    for second in range(1, 60):
        monitor.add_offset(np.array([offset + step * second, 0.0]))
        monitor.receive("gnss", float(second))
        if monitor.inflation("gnss", float(second)) is not None:
            break
    assert second == due + 1


@pytest.mark.parametrize(
    ("east", "north", "both", "yaw", "expected"),
    [
        (10.0, 0.1, 0.0, 0.01, ("position: uncertain by 3.2 m, limit 3 m",)),
        (5.0, 5.0, 4.9, 0.01, ("position: uncertain by 3.1 m, limit 3 m",)),
        (8.9, 0.1, 0.0, 0.01, ()),
        (0.1, 0.1, 0.0, 0.16, ("heading: uncertain by 23 degrees, limit 20",)),
    ],
)
def test_a_large_uncertainty_is_a_warning(east, north, both, yaw, expected):
    """The longest axis of the error ellipse and the heading have their limits."""
    P = CERTAIN.copy()
    P[6, 6], P[7, 7], P[6, 7], P[7, 6], P[2, 2] = east, north, both, both, yaw
    assert SensorMonitor(CONFIG, 0.0).warnings(0.0, P) == expected


@pytest.mark.parametrize("sensor", ["wheels", "compass", "gnss"])
def test_a_sensor_that_is_not_believed_is_not_called_silent(sensor):
    """What arrives contradicts the estimate; without anything there is nothing to contradict it."""
    monitor = SensorMonitor(CONFIG, 0.0)
    for name in ("imu", "wheels", "compass", "gnss"):
        monitor.receive(name, 20.0)
    for name in {"wheels", "compass", "gnss"} - {sensor}:
        monitor.accept(name, 20.0)
    (text,) = monitor.warnings(20.0, CERTAIN)
    assert text == f"{sensor}: not accepted for 20.0 s, what arrives contradicts the estimate"
    later = dict(text.split(": ") for text in monitor.warnings(40.0, CERTAIN))
    silent = "silent for 40.0 s" if sensor == "wheels" else "not accepted for 40.0 s, no valid"
    assert later[sensor].startswith(silent)
    assert later["imu"] == "silent for 20.0 s"


@pytest.mark.parametrize(
    ("warnings", "health"),
    [
        ((), Health.OK),
        (("imu: silent for 1.0 s",), Health.DEGRADED),
        (("gnss: not accepted for 9.0 s", "compass: not accepted for 9.0 s"), Health.DEGRADED),
        (("imu: silent for 1.0 s", "wheels: silent for 1.0 s"), Health.LOST),
        (("position: uncertain by 4.0 m",), Health.LOST),
        (("heading: uncertain by 40 degrees",), Health.DISORIENTED),
        (("heading: uncertain by 40 degrees", "imu: silent for 1.0 s"), Health.LOST),
        (("heading: uncertain by 40 degrees", "gnss: not accepted for 9 s"), Health.DISORIENTED),
    ],
)
def test_health_follows_the_warnings(warnings, health):
    """Lost is without position, or both IMU and wheels; without a heading there is a way out."""
    assert health_of(warnings) is health


def test_without_fixes_a_robot_without_a_heading_is_lost():
    """Nothing would tell its heading, however far it creeps."""
    assert health_of(("heading: uncertain by 40 degrees",), has_fixes=False) is Health.LOST
    assert health_of((), has_fixes=False) is Health.OK


@pytest.mark.parametrize(("way", "due"), [(0.0, 300.0), (400.0, 15.0)])
def test_fixes_out_of_reach_are_not_followed(way, due):
    """700 m off after a way of some metres is no place to be, for minutes; after 400 m it may."""
    monitor = SensorMonitor(CONFIG, 0.0)
    monitor.accept("gnss", 0.0)
    monitor.drive(-way)
    for second in range(1, 400):
        monitor.add_offset(np.array([700.0 + 0.1 * second, 0.0]))
        monitor.receive("gnss", float(second))
        if monitor.inflation("gnss", float(second)) is not None:
            break
    assert second == due + 1


def test_only_fixes_that_arrive_and_are_rejected_contradict():
    """Silence is no contradiction, nor are fixes that were accepted a moment ago."""
    monitor = SensorMonitor(CONFIG, 0.0)
    assert not monitor.contradicts_fixes(20.0)
    monitor.receive("gnss", 20.0)
    assert monitor.contradicts_fixes(20.0)
    monitor.accept("gnss", 20.0)
    assert not monitor.contradicts_fixes(21.0)


def test_an_impossible_fix_is_named_at_once_until_a_good_one():
    """From the first on; it is told before all else of the receiver."""
    monitor = SensorMonitor(CONFIG, 0.0)
    for stamp in (10.0, 11.0):
        monitor.report_impossible_fix(stamp)
    monitor.receive("imu", 12.0)
    for name in ("wheels", "compass"):
        monitor.accept(name, 12.0)
    assert monitor.warnings(12.0, CERTAIN) == (
        "gnss: sends numbers that no fix can have, for 2.0 s",
    )
    monitor.accept("gnss", 12.0)
    assert monitor.warnings(12.0, CERTAIN) == ()


def test_warnings_of_arrivals_give_way_to_others_of_their_sensor():
    """One text for each sensor, whoever has it."""
    monitor = SensorMonitor(CONFIG, 10.0)
    monitor.receive("imu", 10.1)
    for name in ("wheels", "gnss"):
        monitor.accept(name, 12.0)
    arrivals = {"imu": "imu: few", "wheels": "wheels: few", "compass": "compass: few"}
    found = monitor.warnings(11.0, CERTAIN, ("compass",), arrivals)
    assert found == ("imu: silent for 0.9 s", "wheels: few")
