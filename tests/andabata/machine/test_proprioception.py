"""Proprioceptive sensors: ideal readings of known motions, and the configured errors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.geo_reference import GeoReference
from andabata.machine.gnss_receiver import GnssConfig
from andabata.machine.proprioception import (
    GRAVITY,
    CompassConfig,
    EncoderConfig,
    ImuConfig,
    Proprioception,
    ProprioceptionConfig,
)
from andabata.machine.reality import AS_BELIEVED, TrueConstants
from andabata.machine.robot import RobotModel

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


def sampled(config=PERFECT, seed=0, constants=AS_BELIEVED, **motion):
    """Return the true rows of a motion and all readings of it."""
    rows = poses(**motion)
    sensors = Proprioception(config, GeoReference(), (), RobotModel())
    start = Rotation.from_euler("ZYX", [0, motion.get("pitch", 0.0), motion.get("roll", 0.0)])
    sensors.reset(
        np.concatenate([np.zeros(3), start.as_quat()]), np.random.default_rng(seed), constants
    )
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
    sensors = Proprioception(PERFECT, GeoReference(), (), RobotModel())
    sensors.reset(np.array([0, 0, 0, 0, 0, 0, 1.0]), np.random.default_rng(0))
    imu = np.concatenate([sensors.sample(rows[:10]).imu, sensors.sample(rows[10:]).imu])
    expected = np.zeros(20)
    expected[10] = 0.01 / 0.01
    np.testing.assert_allclose(imu[:, 3], expected, atol=1e-9)


def test_a_robot_in_free_fall_measures_no_force():
    """Gravity points down: an acceleration of -g upwards cancels the reading."""
    rows = poses(seconds=1.0)
    rows[:, 3] = -0.5 * GRAVITY * rows[:, 0] ** 2
    sensors = Proprioception(PERFECT, GeoReference(), (), RobotModel())
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


def test_noise_densities_become_the_noise_of_a_tick():
    """White noise of a tick is the density divided by the root of the tick."""
    imu = ImuConfig(gyro_bias=0, gyro_walk=0, acceleration_bias=0, acceleration_walk=0)
    _, (inertial, _, _, _) = sampled(PERFECT.model_copy(update={"imu": imu}), seconds=60.0)
    assert inertial[:, 1:4].std() == pytest.approx(imu.gyro_noise * 10, rel=0.05)
    assert inertial[5:, 4:6].std() == pytest.approx(imu.acceleration_noise * 10, rel=0.05)


def headings(mag):
    """Return the heading that each reading of a level robot means [rad]."""
    return np.arctan2(mag[:, 1], mag[:, 2]) - np.deg2rad(GeoReference().declination_deg)


def test_soft_iron_stretches_the_field_and_errs_twice_a_turn():
    """A compass stretched by 6 % along the body errs by 0.03 sin(2 heading), at most 1.7 deg."""
    stretched = TrueConstants(soft_iron=((0.06, 0.0, 0.0), (0.0,) * 3, (0.0,) * 3))
    _, (_, _, mag, _) = sampled(yaw_rate=np.pi / 2, seconds=4.0, constants=stretched)
    _, (_, _, exact, _) = sampled(yaw_rate=np.pi / 2, seconds=4.0)
    np.testing.assert_allclose(mag[:, 1], 1.06 * exact[:, 1])
    np.testing.assert_array_equal(mag[:, 2:], exact[:, 2:])
    error, twice = headings(mag) - headings(exact), np.sin(2 * headings(exact))
    error = (error + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(error, 0.03 * twice, atol=1.5e-3)


def test_soft_iron_mixes_axes_by_rows():
    """An element of row a and column b adds the field along b to the reading along a."""
    mixed = TrueConstants(soft_iron=((0.0, 0.0, 0.1), (0.0,) * 3, (0.0,) * 3))
    _, (_, _, mag, _) = sampled(seconds=0.2, constants=mixed)
    _, (_, _, exact, _) = sampled(seconds=0.2)
    np.testing.assert_allclose(mag[:, 1] - exact[:, 1], 0.1 * exact[:, 3])


@pytest.mark.parametrize(("wheels", "share"), [((0.0, 0.0), 0.0), ((3.0, -3.0), 1), ((9, 9), 1)])
def test_the_motors_field_grows_with_the_wheels_speed_up_to_cruising(wheels, share):
    """Wheels at rest have no field, those at cruising speed and beyond all of it."""
    motors = TrueConstants(motor_field=(1.0, -2.0, 0.5))
    _, (_, _, mag, _) = sampled(seconds=0.2, wheels=wheels, constants=motors)
    _, (_, _, exact, _) = sampled(seconds=0.2, wheels=wheels)
    found = (mag[:, 1:] - exact[:, 1:]) * 1e6
    np.testing.assert_allclose(found, share * np.tile([1.0, -2.0, 0.5], (20, 1)), atol=1e-9)


def test_half_the_cruising_speed_has_half_the_field():
    """The field is proportional to the mean speed of both sides, whatever their directions."""
    motors = TrueConstants(motor_field=(1.0, 0.0, 0.0))
    _, (_, _, mag, _) = sampled(seconds=0.1, wheels=(-1.0, 2.0), constants=motors)
    _, (_, _, exact, _) = sampled(seconds=0.1, wheels=(-1.0, 2.0))
    np.testing.assert_allclose((mag[:, 1] - exact[:, 1]) * 1e6, 0.5, atol=1e-9)


def test_a_tilted_inertial_unit_reads_gravity_and_turns_in_its_own_axes():
    """Nose down by 0.1 rad, a level robot's unit reads gravity forward and a turn as a roll."""
    tilted = TrueConstants(imu_tilt=(0.0, 0.1, 0.0))
    _, (imu, _, _, _) = sampled(yaw_rate=0.4, constants=tilted)
    force = [-GRAVITY * np.sin(0.1), 0.0, GRAVITY * np.cos(0.1)]
    np.testing.assert_allclose(imu[5:, 4:], np.tile(force, (len(imu) - 5, 1)), atol=1e-6)
    np.testing.assert_allclose(imu[:, 1], -0.4 * np.sin(0.1), atol=1e-9)
    np.testing.assert_allclose(imu[:, 3], 0.4 * np.cos(0.1), atol=1e-9)


def test_true_constants_move_no_noise():
    """What differs of compass and inertial unit leaves the noise of all sensors as it is."""
    config, motors = ProprioceptionConfig(), TrueConstants(motor_field=(1.0, 0.0, 0.0))
    _, ideal = sampled(config, seconds=3.0)
    _, real = sampled(config, seconds=3.0, constants=motors)
    for k in (0, 1, 3):
        np.testing.assert_array_equal(ideal[k], real[k])
    np.testing.assert_allclose((real[2] - ideal[2])[:, 1] * 1e6, 1.0, atol=1e-9)
