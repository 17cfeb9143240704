"""What the robot feels of itself is what really happens, plus the stated faults."""

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
    compass=CompassConfig(noise=0, iron=0),
    encoders=EncoderConfig(counts=1 << 20),
    gnss=GnssConfig(noise=0, wander=0, dropout=0, detour=0),
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


def felt(config=PERFECT, objects=(), seed=0, **motion):
    rows = poses(**motion)
    readings = Proprioception(config, GeoReference(), objects)
    start = Rotation.from_euler("ZYX", [0, motion.get("pitch", 0.0), motion.get("roll", 0.0)])
    readings.reset(np.concatenate([np.zeros(3), start.as_quat()]), np.random.default_rng(seed))
    parts = [readings.sample(rows[k : k + 10]) for k in range(0, len(rows), 10)]
    return rows, [np.concatenate(column) for column in zip(*parts, strict=True)]


def test_a_robot_at_rest_feels_gravity_alone():
    _, (imu, _, _, _) = felt(roll=0.1, pitch=-0.2)
    expected = Rotation.from_euler("ZYX", [0, -0.2, 0.1]).inv().apply([0, 0, GRAVITY])
    np.testing.assert_allclose(imu[:, 1:4], 0, atol=1e-9)
    np.testing.assert_allclose(imu[5:, 4:7], np.tile(expected, (len(imu) - 5, 1)), atol=1e-6)


def test_a_turning_robot_feels_its_turn_and_the_pull_inwards():
    _, (imu, _, _, _) = felt(yaw_rate=0.4, speed=0.5)
    np.testing.assert_allclose(imu[:, 3], 0.4, atol=1e-6)
    np.testing.assert_allclose(imu[5:, 5], 0.4 * 0.5, atol=2e-3)
    np.testing.assert_allclose(imu[5:, 6], GRAVITY, atol=1e-6)


def test_the_compass_sees_the_field_of_the_place():
    rows, (_, _, field, _) = felt(yaw_rate=0.4, pitch=0.1)
    back = Rotation.from_quat(rows[:, 4:8]).apply(field[:, 1:4])
    np.testing.assert_allclose(
        back, np.tile(GeoReference().flux * 1e-6, (len(rows), 1)), atol=1e-12
    )


def test_encoders_tell_the_speed_of_each_side():
    _, (_, encoders, _, _) = felt(wheels=(2.0, -1.5))
    np.testing.assert_allclose(encoders[:, 1:].mean(axis=0), [2.0, -1.5], atol=1e-3)


def test_coarse_encoders_lose_nothing_in_the_long_run():
    config = PERFECT.model_copy(update={"encoders": EncoderConfig(counts=64)})
    _, (_, encoders, _, _) = felt(config, seconds=20.0, wheels=(1.0, 1.0))
    assert len(np.unique(encoders[:, 1])) == 2
    assert encoders[:, 1].mean() == pytest.approx(1.0, abs=0.01)


def test_fixes_come_once_a_second_late_and_where_the_robot_was():
    rows, (_, _, _, fixes) = felt(seconds=5.5, speed=1.0)
    np.testing.assert_allclose(fixes[:, 0], [1, 2, 3, 4, 5], atol=1e-9)
    places = GeoReference().to_map(fixes[:, 1:4])
    np.testing.assert_allclose(places, rows[[99, 199, 299, 399, 499], 1:4], atol=1e-4)


def found(fixes):
    """Return those that the receiver had, not its word that it had none."""
    np.testing.assert_array_equal(np.isnan(fixes[:, 1]), np.isinf(fixes[:, 4]))
    return fixes[np.isfinite(fixes[:, 4])]


def test_the_error_of_fixes_is_a_metre_in_the_open():
    _, (_, _, _, fixes) = felt(ProprioceptionConfig(gnss=GnssConfig(detour=0)), seconds=900.0)
    assert len(fixes) == 899  # The last one is on its way.
    fixes = found(fixes)
    error = GeoReference().to_map(fixes[:, 1:4])[:, :2]
    assert np.sqrt((error**2).sum(axis=1).mean()) == pytest.approx(1.0, abs=0.1)
    assert 0.002 < 1 - len(fixes) / 900 < 0.03


def test_trees_shade_the_receiver():
    tree = frustum(SemanticClass.TRUNK, (1.0, 0.0, 0.0), (0.2, 0.2), 3.0)
    config = ProprioceptionConfig(gnss=GnssConfig(dropout=0.05, detour=0.02))
    _, (_, _, _, clear) = felt(config, seconds=900.0)
    _, (_, _, _, shaded) = felt(config, objects=(tree,), seconds=900.0)
    clear, shaded = found(clear), found(shaded)
    assert len(shaded) < 0.85 * len(clear)
    far = [
        (np.hypot(*GeoReference().to_map(f[:, 1:4])[:, :2].T) > 4).mean() for f in (clear, shaded)
    ]
    assert far[1] > 2 * far[0]


def test_biases_are_drawn_once_and_wander_slowly():
    _, (imu, _, _, _) = felt(ProprioceptionConfig(), seconds=60.0)
    first, last = imu[:1000, 1:4].mean(axis=0), imu[-1000:, 1:4].mean(axis=0)
    assert (np.abs(first) > 1e-4).all()
    assert np.abs(first - last).max() < 1e-3


def test_the_same_seed_feels_the_same():
    one, two, other = (felt(ProprioceptionConfig(), seed=s)[1] for s in (3, 3, 4))
    for a, b, c in zip(one, two, other, strict=True):
        np.testing.assert_array_equal(a, b)
        assert not np.array_equal(a, c) or len(a) == 0 or a.shape[1] == 3
