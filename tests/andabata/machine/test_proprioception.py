"""Proprioceptive sensors: ideal readings of known motions, and the configured errors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.geo_reference import GeoReference
from andabata.machine.proprioception import (
    GRAVITY,
    CompassConfig,
    EncoderConfig,
    GnssConfig,
    ImuConfig,
    Proprioception,
    ProprioceptionConfig,
)
from terrain.classes import SemanticClass
from terrain.objects import frustum

PERFECT = ProprioceptionConfig(
    imu=ImuConfig(
        gyro_noise=0,
        gyro_walk=0,
        gyro_bias=0,
        acceleration_noise=0,
        acceleration_walk=0,
        acceleration_bias=0,
    ),
    compass=CompassConfig(noise=0, hard_iron=0),
    encoders=EncoderConfig(counts=1 << 20),
    gnss=GnssConfig(noise=0, correlated_error=0, dropout=0, multipath_rate=0),
)


def poses(seconds=2.0, yaw_rate=0.0, speed=0.0, roll=0.0, pitch=0.0, wheels=(3.0, 3.0)):
    """Rows of a level or leaning robot that turns and drives on."""
    stamps = np.arange(1, round(seconds * 100) + 1) / 100
    yaw = yaw_rate * stamps
    rows = np.zeros((len(stamps), 10))
    rows[:, 0] = stamps
    turn = Rotation.from_euler("ZYX", np.column_stack([yaw, np.full_like(yaw, pitch), 0 * yaw]))
    turn = turn * Rotation.from_euler("x", roll)
    rows[:, 4:8] = turn.as_quat()
    steps = turn.apply([speed * 0.01, 0, 0])
    rows[:, 1:4] = np.cumsum(steps, axis=0)
    rows[:, 8:] = wheels
    return rows


def sampled(config=PERFECT, objects=(), seed=0, **motion):
    """Return the true rows of a motion and all readings of it."""
    rows = poses(**motion)
    sensors = Proprioception(config, GeoReference(), objects)
    start = Rotation.from_euler("ZYX", [0, motion.get("pitch", 0.0), motion.get("roll", 0.0)])
    sensors.reset(np.concatenate([np.zeros(3), start.as_quat()]), np.random.default_rng(seed))
    parts = [sensors.sample(rows[k : k + 10]) for k in range(0, len(rows), 10)]
    return rows, [np.concatenate(column) for column in zip(*parts, strict=True)]


def test_a_robot_at_rest_measures_gravity_alone():
    """At rest the specific force is gravity upwards, whatever the tilt."""
    _, (imu, _, _, _) = sampled(roll=0.1, pitch=-0.2)
    expected = Rotation.from_euler("ZYX", [0, -0.2, 0.1]).inv().apply([0, 0, GRAVITY])
    np.testing.assert_allclose(imu[:, 1:4], 0, atol=1e-9)
    np.testing.assert_allclose(imu[5:, 4:7], np.tile(expected, (len(imu) - 5, 1)), atol=1e-6)


def test_a_turning_robot_measures_its_yaw_rate_and_the_centripetal_acceleration():
    """On an arc the gyro reads the yaw rate, the accelerometer v * w to the left."""
    _, (imu, _, _, _) = sampled(yaw_rate=0.4, speed=0.5)
    np.testing.assert_allclose(imu[:, 3], 0.4, atol=1e-6)
    np.testing.assert_allclose(imu[5:, 5], 0.4 * 0.5, atol=2e-3)
    np.testing.assert_allclose(imu[5:, 6], GRAVITY, atol=1e-6)


def test_the_magnetometer_measures_the_field_of_the_place():
    """Turned into the map, readings are the place's field in tesla."""
    rows, (_, _, mag, _) = sampled(yaw_rate=0.4, pitch=0.1)
    back = Rotation.from_quat(rows[:, 4:8]).apply(mag[:, 1:4])
    np.testing.assert_allclose(
        back, np.tile(GeoReference().flux * 1e-6, (len(rows), 1)), atol=1e-12
    )


def test_encoders_measure_the_speed_of_each_side():
    """Each side has its own speed, left before right."""
    _, (_, encoders, _, _) = sampled(wheels=(2.0, -1.5))
    np.testing.assert_allclose(encoders[:, 1:].mean(axis=0), [2.0, -1.5], atol=1e-3)


def test_coarse_encoders_lose_nothing_in_the_long_run():
    """The remainder of a count is kept for the next tick."""
    config = PERFECT.model_copy(update={"encoders": EncoderConfig(counts=64)})
    _, (_, encoders, _, _) = sampled(config, seconds=20.0, wheels=(1.0, 1.0))
    assert len(np.unique(encoders[:, 1])) == 2
    assert encoders[:, 1].mean() == pytest.approx(1.0, abs=0.01)


def test_fixes_are_of_whole_seconds_and_arrive_late():
    """Fixes have the position of their own whole second."""
    rows, (_, _, _, fixes) = sampled(seconds=5.5, speed=1.0)
    np.testing.assert_allclose(fixes[:, 0], [1, 2, 3, 4, 5], atol=1e-9)
    places = GeoReference().to_map(fixes[:, 1:4])
    np.testing.assert_allclose(places, rows[[99, 199, 299, 399, 499], 1:4], atol=1e-4)


def found(fixes):
    """Return the valid fixes, without the rows in which the receiver reports none."""
    np.testing.assert_array_equal(np.isnan(fixes[:, 1]), np.isinf(fixes[:, 4]))
    return fixes[np.isfinite(fixes[:, 4])]


def test_the_error_of_fixes_is_a_metre_in_the_open():
    """The horizontal error in the open is a metre, and few fixes are lost."""
    _, (_, _, _, fixes) = sampled(
        ProprioceptionConfig(gnss=GnssConfig(multipath_rate=0)), seconds=900.0
    )
    assert len(fixes) == 899  # The last one is on its way.
    fixes = found(fixes)
    error = GeoReference().to_map(fixes[:, 1:4])[:, :2]
    assert np.sqrt((error**2).sum(axis=1).mean()) == pytest.approx(1.0, abs=0.1)
    assert 0.002 < 1 - len(fixes) / 900 < 0.03


def test_trees_shade_the_receiver():
    """Near a tree more fixes are lost and more lie far off."""
    tree = frustum(SemanticClass.TRUNK, (1.0, 0.0, 0.0), (0.2, 0.2), 3.0)
    config = ProprioceptionConfig(gnss=GnssConfig(dropout=0.05, multipath_rate=0.02))
    _, (_, _, _, clear) = sampled(config, seconds=900.0)
    _, (_, _, _, shaded) = sampled(config, objects=(tree,), seconds=900.0)
    clear, shaded = found(clear), found(shaded)
    assert len(shaded) < 0.85 * len(clear)
    far = [
        (np.hypot(*GeoReference().to_map(f[:, 1:4])[:, :2].T) > 4).mean() for f in (clear, shaded)
    ]
    assert far[1] > 2 * far[0]


def test_biases_are_drawn_once_and_walk_slowly():
    """Turn-on biases are there and hardly change in a minute."""
    _, (imu, _, _, _) = sampled(ProprioceptionConfig(), seconds=60.0)
    first, last = imu[:1000, 1:4].mean(axis=0), imu[-1000:, 1:4].mean(axis=0)
    assert (np.abs(first) > 1e-4).all()
    assert np.abs(first - last).max() < 1e-3


def test_the_same_seed_gives_the_same_readings():
    """Readings are a function of the seed."""
    one, two, other = (sampled(ProprioceptionConfig(), seed=s)[1] for s in (3, 3, 4))
    for a, b, c in zip(one, two, other, strict=True):
        np.testing.assert_array_equal(a, b)
        assert not np.array_equal(a, c) or len(a) == 0 or a.shape[1] == 3


def stamps_of(parts):
    """Return the stamps of IMU, encoders and magnetometer."""
    return [part[:, 0] for part in parts[:3]]


def test_every_reading_has_the_stamp_of_its_own_tick():
    """IMU, encoders and magnetometer carry the very stamps of the true rows."""
    rows, parts = sampled(seconds=1.0)
    for stamps in stamps_of(parts):
        np.testing.assert_array_equal(stamps, rows[:, 0])


def test_the_gyro_reads_the_rotation_of_its_own_tick():
    """A rotation that begins at one tick is in the reading of that tick, not of the next."""
    rows = poses(seconds=0.2)
    rows[10:, 4:8] = Rotation.from_euler("z", 0.01).as_quat()
    sensors = Proprioception(PERFECT, GeoReference(), ())
    sensors.reset(np.array([0, 0, 0, 0, 0, 0, 1.0]), np.random.default_rng(0))
    imu = np.concatenate([sensors.sample(rows[:10]).imu, sensors.sample(rows[10:]).imu])
    expected = np.zeros(20)
    expected[10] = 0.01 / 0.01
    np.testing.assert_allclose(imu[:, 3], expected, atol=1e-9)


def test_a_fix_arrives_after_its_latency_and_not_before():
    """A fix of second 1 with a latency of 0.15 s comes with the period that ends at 1.2 s."""
    rows = poses(seconds=2.0)
    sensors = Proprioception(PERFECT, GeoReference(), ())
    sensors.reset(np.array([0, 0, 0, 0, 0, 0, 1.0]), np.random.default_rng(0))
    counts = [len(sensors.sample(rows[k : k + 10]).gnss) for k in range(0, 200, 10)]
    assert counts == [0] * 11 + [1] + [0] * 8


def test_a_robot_in_free_fall_measures_no_force():
    """Gravity points down: an acceleration of -g upwards cancels the reading."""
    rows = poses(seconds=1.0)
    rows[:, 3] = -0.5 * GRAVITY * rows[:, 0] ** 2
    sensors = Proprioception(PERFECT, GeoReference(), ())
    sensors.reset(np.array([0, 0, 0, 0, 0, 0, 1.0]), np.random.default_rng(0))
    imu = sensors.sample(rows).imu
    np.testing.assert_allclose(imu[5:, 4:7], 0, atol=1e-6)


def test_the_hard_iron_stays_with_the_robot():
    """The robot's own field is constant in the base frame and has the configured spread."""
    config = PERFECT.model_copy(update={"compass": CompassConfig(noise=0, hard_iron=2.0)})
    offsets = []
    for seed in range(60):
        rows, (_, _, mag, _) = sampled(config, seed=seed, seconds=0.2, yaw_rate=2.0)
        field = Rotation.from_quat(rows[:, 4:8]).inv().apply(GeoReference().flux)
        offset = mag[:, 1:4] * 1e6 - field
        np.testing.assert_allclose(offset, np.tile(offset[0], (len(rows), 1)), atol=1e-6)
        offsets.append(offset[0])
    assert np.std(offsets) == pytest.approx(2.0, rel=0.2)
    assert abs(np.mean(offsets)) < 0.5


def fix_errors(gnss, seconds=3000.0):
    """Return the horizontal errors of one fix per second of a robot at rest [m], shape (k, 2)."""
    _, (_, _, _, fixes) = sampled(ProprioceptionConfig(gnss=gnss), seconds=seconds)
    return GeoReference().to_map(fixes[:, 1:4])[:, :2]


def test_the_correlated_error_of_fixes_has_its_spread_and_its_correlation_time():
    """Without white noise the error is a Gauss-Markov process of the configured numbers."""
    gnss = GnssConfig(
        noise=0, correlated_error=0.5, correlation_time=10.0, dropout=0, multipath_rate=0
    )
    error = fix_errors(gnss)
    assert error.std() == pytest.approx(0.5, rel=0.2)
    for lag in (1, 5):
        expected = np.exp(-lag / 10.0)
        for axis in error.T:
            assert np.corrcoef(axis[:-lag], axis[lag:])[0, 1] == pytest.approx(expected, abs=0.12)


def test_the_white_noise_of_fixes_is_independent():
    """Without correlated error neighbouring errors are independent, of the configured spread."""
    gnss = GnssConfig(noise=0.6, correlated_error=0, dropout=0, multipath_rate=0)
    error = fix_errors(gnss)
    assert error.std() == pytest.approx(0.6, rel=0.05)
    assert abs(np.corrcoef(error[:-1, 0], error[1:, 0])[0, 1]) < 0.06


def test_multipath_is_an_offset_that_lasts_its_mean_time():
    """Multipath shifts fixes by a constant for some seconds, and then they are right again."""
    gnss = GnssConfig(noise=0, correlated_error=0, dropout=0, multipath_rate=0.1, multipath_time=5)
    error = fix_errors(gnss)
    off = np.hypot(*error.T) > 1e-3
    assert off.mean() == pytest.approx(0.1 * 5 / (1 + 0.1 * 5), abs=0.08)
    begins = np.flatnonzero(off[1:] & ~off[:-1]) + 1
    spans = [int(np.argmin(off[b:])) or len(off) - b for b in begins]
    assert np.mean(spans) == pytest.approx(5.0, rel=0.25)
    both = off[1:] & off[:-1]
    np.testing.assert_allclose(error[1:][both], error[:-1][both], atol=1e-3)


def test_a_receiver_reports_its_variance_without_multipath():
    """The reported variance is that of white and correlated error together."""
    gnss = GnssConfig(dropout=0)
    _, (_, _, _, fixes) = sampled(ProprioceptionConfig(gnss=gnss), seconds=20.0)
    np.testing.assert_allclose(fixes[:, 4], gnss.noise**2 + gnss.correlated_error**2)


def test_noise_densities_become_the_noise_of_a_tick():
    """White noise of a tick is the density divided by the root of the tick."""
    imu = ImuConfig(gyro_bias=0, gyro_walk=0, acceleration_bias=0, acceleration_walk=0)
    _, (inertial, _, _, _) = sampled(PERFECT.model_copy(update={"imu": imu}), seconds=60.0)
    assert inertial[:, 1:4].std() == pytest.approx(imu.gyro_noise * 10, rel=0.05)
    assert inertial[5:, 4:6].std() == pytest.approx(imu.acceleration_noise * 10, rel=0.05)
