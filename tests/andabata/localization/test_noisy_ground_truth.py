"""Localizer from ground truth: its errors have the configured spread and correlation."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.localization.localizer import Health
from andabata.localization.noisy_ground_truth import (
    NoisyGroundTruthConfig,
    NoisyGroundTruthLocalizer,
)
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings

ORIGIN = Pose(np.zeros(3), np.array([0, 0, 0, 1.0]))
EXACT = NoisyGroundTruthConfig(position_sigma=0, yaw_sigma=0, tilt_sigma=0)


def readings(end, ticks=10):
    """Return a period of a robot at rest at the origin that ends at a time [s]."""
    stamps = end - 0.1 + np.arange(1, ticks + 1) / 100
    rows = np.zeros((ticks, 8))
    rows[:, 0], rows[:, 7] = stamps, 1.0
    return SensorReadings(end, true_track=rows)


def errors(config, seconds, seed=0):
    """Return the errors of x, y [m] and yaw [rad] after each period, shape (k, 3)."""
    localizer = NoisyGroundTruthLocalizer(config, np.random.default_rng(seed))
    localizer.reset(ORIGIN, 0.0)
    found = []
    for step in range(1, round(seconds * 10) + 1):
        localizer.update(readings(step / 10))
        found.append([*localizer.pose.position[:2], localizer.pose.yaw])
    return np.array(found)


def test_without_errors_it_is_the_truth():
    """With sigma zero the pose is the true one, and health is always OK."""
    localizer = NoisyGroundTruthLocalizer(EXACT, np.random.default_rng(0))
    localizer.reset(ORIGIN, 0.0)
    localizer.update(readings(0.1))
    np.testing.assert_array_equal(localizer.pose.position, 0.0)
    assert localizer.health is Health.OK
    assert localizer.track.latest == pytest.approx(0.1)


def test_errors_of_attitude_turn_the_true_rotation():
    """Yaw, pitch and roll are scipy's, in this order, before the true rotation."""
    config = NoisyGroundTruthConfig(yaw_sigma=0.5, tilt_sigma=0.2)
    true = Rotation.from_euler("ZYX", [1.0, 0.2, -0.3])
    localizer = NoisyGroundTruthLocalizer(config, np.random.default_rng(6))
    localizer.reset(Pose(np.zeros(3), true.as_quat()), 0.0)
    yaw, roll, pitch = np.random.default_rng(6).standard_normal(5)[2:] * [0.5, 0.2, 0.2]
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]) * true
    np.testing.assert_allclose(localizer.pose.quaternion, expected.as_quat(), atol=1e-15)


def test_errors_have_their_spread_and_correlation_time():
    """Errors of position and heading are Gauss-Markov processes of the configured numbers."""
    config = NoisyGroundTruthConfig(
        position_sigma=0.4, position_time=2.0, yaw_sigma=0.05, yaw_time=1.0, tilt_sigma=0
    )
    found = errors(config, 600.0)
    for column, sigma, time in ((0, 0.4, 2.0), (1, 0.4, 2.0), (2, 0.05, 1.0)):
        error = found[:, column]
        assert error.std() == pytest.approx(sigma, rel=0.2)
        correlation = np.corrcoef(error[:-10], error[10:])[0, 1]
        assert correlation == pytest.approx(np.exp(-1.0 / time), abs=0.1)


def test_the_error_is_continuous_within_a_period():
    """Between two ticks the pose moves by a tenth of the period's change: it never jumps."""
    localizer = NoisyGroundTruthLocalizer(
        NoisyGroundTruthConfig(position_sigma=1.0, position_time=0.2), np.random.default_rng(0)
    )
    localizer.reset(ORIGIN, 0.0)
    localizer.update(readings(0.1))
    x = localizer.track.at(np.arange(11) / 100)[:, 0]
    np.testing.assert_allclose(np.diff(x), np.full(10, (x[-1] - x[0]) / 10), atol=1e-9)


@pytest.mark.parametrize("config", [EXACT, NoisyGroundTruthConfig(position_time=2.0)])
def test_several_periods_at_once_are_as_one_by_one(config):
    """Poses, draws and the errors that the next period begins with are the same bits."""
    periods = [readings(step / 10) for step in range(1, 40)]
    slow, fast = (NoisyGroundTruthLocalizer(config, np.random.default_rng(3)) for _ in range(2))
    for localizer in (slow, fast):
        localizer.reset(ORIGIN, 0.0)
    for period in periods:
        slow.update(period)
    ends, tracks = [p.stamp for p in periods], [p.true_track for p in periods]
    reset, draws = np.split(np.random.default_rng(3).standard_normal((40, 5)), [1])
    assert reset.shape == (1, 5)
    fast.follow(np.array(ends), np.array(tracks), draws)
    for found, expected in zip(fast.track.table, slow.track.table, strict=True):
        np.testing.assert_array_equal(found, expected)
    next_one = np.random.default_rng(5).standard_normal((1, 5))
    for localizer in (slow, fast):
        localizer.follow(np.array([4.0]), readings(4.0).true_track[None], next_one)
    np.testing.assert_array_equal(fast.pose.position, slow.pose.position)
    np.testing.assert_array_equal(fast.pose.quaternion, slow.pose.quaternion)


def test_readings_without_a_truth_are_an_error():
    """A record has no true track."""
    localizer = NoisyGroundTruthLocalizer(EXACT, np.random.default_rng(0))
    localizer.reset(ORIGIN, 0.0)
    with pytest.raises(ValueError, match="expected the true poses of the period"):
        localizer.update(SensorReadings(0.1))


def test_its_status_is_ok_with_the_covariance_of_its_own_errors():
    """Over many starts the errors of place and heading are as large as it says."""
    config = NoisyGroundTruthConfig(position_sigma=0.4, yaw_sigma=0.1)
    localizer = NoisyGroundTruthLocalizer(config, np.random.default_rng(0))
    errors = []
    for _ in range(2000):
        localizer.reset(Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0), 0.0)
        errors.append([*localizer.pose.position[:2], localizer.pose.yaw])
    status = localizer.status
    assert (status.health, status.causes) == (Health.OK, ())
    localizer.report(("laser: silent for 0.4 s",))
    assert localizer.health is Health.DEGRADED
    assert localizer.status.causes == ("laser: silent for 0.4 s",)
    localizer.reset(ORIGIN, 0.0)
    assert localizer.health is Health.OK
    expected = np.sqrt(np.diag(status.planar_covariance))
    np.testing.assert_allclose(np.std(errors, axis=0), expected, rtol=0.1)
