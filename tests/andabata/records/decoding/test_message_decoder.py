"""Messages of every accepted type become rows in SI units."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.records import topics
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.units import UnitFactors
from andabata.records.decoding.unusable_message import UnusableMessageError
from tests.support import computed_bags
from tests.support.computed_bags import new
from tests.support.foreign_messages import decoded, header, odometry, twist, vector


@pytest.mark.parametrize(
    "message",
    [
        lambda: twist(0.3, 0.5),
        lambda: new("geometry_msgs/msg/TwistStamped", header=header(), twist=twist(0.3, 0.5)),
        lambda: new(
            "geometry_msgs/msg/TwistWithCovarianceStamped",
            header=header(),
            twist=new(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=twist(0.3, 0.5),
                covariance=np.zeros(36),
            ),
        ),
        lambda: odometry(0.3, 0.5),
    ],
)
def test_a_twist_turns_the_wheels_by_the_effective_track(message):
    """Every kind of twist gives the wheel speeds of skid-steer kinematics."""
    (row,), _ = decoded(topics.ENCODERS, message())
    half = 0.46 * 1.275 / 2
    np.testing.assert_allclose(row, [(0.3 - 0.5 * half) / 0.1, (0.3 + 0.5 * half) / 0.1])


def test_a_fast_twist_is_not_limited():
    """A measured twist may exceed the limits of commands."""
    (row,), _ = decoded(topics.ENCODERS, twist(5.0, 0.0))
    np.testing.assert_allclose(row, [50.0, 50.0])


def test_a_field_may_be_a_vector():
    """Vectors are read as magnetic fields, with or without a header."""
    vectors = new("geometry_msgs/msg/Vector3Stamped", header=header(), vector=vector(1, 2, 3))
    for message in (vectors, vector(1, 2, 3)):
        assert decoded(topics.MAG, message)[0] == [[1.0, 2.0, 3.0]]


def test_an_imu_without_a_measurement():
    """A missing angular velocity is an error, a missing acceleration is NaN."""
    imu = computed_bags.drive(0.01)[0].content
    none = np.array([-1.0] + [0.0] * 8)
    with pytest.raises(UnusableMessageError, match="expected an angular velocity, got none"):
        decoded(topics.IMU, replace(imu, angular_velocity_covariance=none))
    with pytest.raises(UnusableMessageError, match="angular velocity is not a number"):
        decoded(topics.IMU, replace(imu, angular_velocity=vector(np.nan)))
    (row,), remarks = decoded(topics.IMU, replace(imu, linear_acceleration_covariance=none))
    assert np.isfinite(row[:3]).all()
    assert np.isnan(row[3:]).all()
    assert "acceleration is not a number" in remarks[0]


def test_units_scale_their_own_columns():
    """The stamp is kept, and each factor meets its quantity alone."""
    decoder = MessageDecoder(units=UnitFactors(2.0, 3.0, 5.0, 7.0))
    assert decoder.scaled(topics.IMU, [1.0] * 7) == [1, 3, 3, 3, 2, 2, 2]
    assert decoder.scaled(topics.ENCODERS, [1.0] * 3) == [1, 7, 7]
    assert decoder.scaled(topics.MAG, [1.0] * 4) == [1, 5, 5, 5]
    assert decoder.scaled(topics.FIX, [1.0] * 5) == [1] * 5
    row = [1.0, 0.1, 0.2]
    assert MessageDecoder(units=UnitFactors()).scaled(topics.ENCODERS, row) is row


def test_components_keep_their_order():
    """Angular velocity comes before specific force, left before right."""
    imu = computed_bags.drive(0.01)[0].content
    imu = replace(imu, angular_velocity=vector(1, 2, 3), linear_acceleration=vector(4, 5, 6))
    assert decoded(topics.IMU, imu)[0] == [[1, 2, 3, 4, 5, 6]]
    wheels = new("andabata_msgs/msg/Wheels_speed", header=header(), left=1.0, right=2.0)
    assert decoded(topics.ENCODERS, wheels)[0] == [[1, 2]]
    with pytest.raises(UnusableMessageError, match="a wheel's speed is not a number"):
        decoded(topics.ENCODERS, replace(wheels, left=np.nan))
    with pytest.raises(UnusableMessageError, match="a speed is not a number"):
        decoded(topics.ENCODERS, twist(np.nan, 0.0))


def test_a_type_without_a_reader_is_refused():
    """The error names the accepted types."""
    with pytest.raises(UnusableMessageError, match=r"expected sensor_msgs/msg/Imu, got geometry"):
        decoded(topics.IMU, vector(1))
