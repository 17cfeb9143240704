"""Drivetrain: latency, lag, wheel radius, effective track and slip, and what the encoders see."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.clock import CONTROL_PERIOD
from andabata.machine.drivetrain import Drivetrain
from andabata.machine.reality import TrueConstants
from andabata.machine.sensor_readings import WheelSpeeds

FORWARD = WheelSpeeds(3.0, 3.0)


def rows(left, right, nose_up=0.0):
    """Rows of a period with the plant's wheel speeds and a slope."""
    track = np.zeros((10, 10))
    track[:, 4:8] = Rotation.from_euler("ZYX", [0.7, -nose_up, 0.0]).as_quat()
    track[:, 8], track[:, 9] = left, right
    return track


def drivetrain(**constants):
    """Return the drivetrain of some constants."""
    made = Drivetrain()
    made.reset(TrueConstants(**constants))
    return made


def driven(made, command=FORWARD, periods=6):
    """Return the left wheels' speeds of some periods of one command."""
    return [made.targets(command).left for _ in range(periods)]


def test_the_believed_drivetrain_changes_nothing():
    """Commands reach the plant, and its wheels the encoders, as they are."""
    made, track = drivetrain(), rows(2.0, 3.0, nose_up=0.2)
    assert made.targets(FORWARD) is FORWARD
    assert made.turned(track) is track


def test_latency_shifts_commands():
    """Commands arrive after whole periods and a share: 0.15 s are one and a half."""
    np.testing.assert_allclose(driven(drivetrain(latency=0.1)), [0, 3, 3, 3, 3, 3])
    np.testing.assert_allclose(driven(drivetrain(latency=0.2)), [0, 0, 3, 3, 3, 3])
    np.testing.assert_allclose(driven(drivetrain(latency=0.15)), [0, 1.5, 3, 3, 3, 3])
    np.testing.assert_allclose(driven(drivetrain(latency=0.03)), [2.1, 3, 3, 3, 3, 3])


def test_wheels_follow_with_a_lag_of_first_order():
    """What is missing of a step decays by exp(-T / tau) in each period."""
    missing = 1 - np.array(driven(drivetrain(lag=0.2))) / 3.0
    np.testing.assert_allclose(missing, np.exp(-CONTROL_PERIOD / 0.2) ** np.arange(1, 7))


def test_a_reset_forgets_what_was_commanded():
    """After a reset the robot stands, and old commands do not arrive."""
    made = drivetrain(latency=0.2, lag=0.1)
    driven(made)
    made.reset(TrueConstants(latency=0.2, lag=0.1))
    assert driven(made, periods=2) == [0.0, 0.0]


def test_larger_wheels_drive_further_and_turn_as_commanded():
    """With a radius 3 % larger the body drives 3 % faster, and the encoders see the command."""
    made = drivetrain(wheel_radius=0.03)
    target = made.targets(WheelSpeeds(2.0, 3.0))
    np.testing.assert_allclose([target.left, target.right], [2.06, 3.09])
    np.testing.assert_allclose(made.turned(rows(target.left, target.right))[:, 8], 2.0)
    np.testing.assert_allclose(made.turned(rows(target.left, target.right))[:, 9], 3.0)


def test_a_wider_track_turns_the_body_less_and_drives_it_as_fast():
    """With a track 10 % wider the yaw rate is 1 / 1.1, the speed and the encoders are as before."""
    made = drivetrain(effective_track=0.1)
    target = made.targets(WheelSpeeds(2.0, 4.2))
    assert target.left + target.right == pytest.approx(6.2)
    assert target.right - target.left == pytest.approx(2.0)
    turned = made.turned(rows(target.left, target.right))
    np.testing.assert_allclose(turned[:, 8:], np.tile([2.0, 4.2], (10, 1)))


@pytest.mark.parametrize(("speed", "nose_up"), [(3.0, 0.26), (3.0, -0.26), (-3.0, 0.26)])
def test_wheels_slip_uphill_and_skid_downhill(speed, nose_up):
    """Encoders read (1 + 0.5 sin(climb)) of the true speed: 13 % more at 15 degrees."""
    made = drivetrain(slope_slip=0.5)
    turned = made.turned(rows(speed, speed, nose_up))
    climb = np.sin(nose_up) * np.sign(speed)
    np.testing.assert_allclose(turned[:, 8:], speed * (1 + 0.5 * climb))
    # The motors hold the wheels' speed: the body loses what they slip.
    assert made.targets(WheelSpeeds(speed, speed)).left == pytest.approx(speed / (1 + 0.5 * climb))


def test_the_rows_of_the_plant_stay_as_they_are():
    """Truth is not overwritten by what the encoders see."""
    made, track = drivetrain(wheel_radius=0.1), rows(2.0, 3.0)
    made.turned(track)
    np.testing.assert_array_equal(track, rows(2.0, 3.0))
