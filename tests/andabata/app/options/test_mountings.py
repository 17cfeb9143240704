"""Mountings from options: metres, degrees, one a sensor."""

import numpy as np
import pytest

from andabata.app.options.mountings import (
    laser_mounting,
    mountings_in_words,
    read_mountings,
    with_height,
)
from andabata.configuration.settings import SettingsError
from andabata.configuration.usage import UsageError
from andabata.records.frames.sensor_pose import UNNAMED
from tests.support.edited_bags import turn


def test_six_numbers_are_a_pose_and_five_leave_the_height_open():
    """Without Z the height stays None; angles are roll, pitch and yaw in degrees."""
    found = read_mountings(["imu=1,2,3,0,0,90", "0.1,-0.2,0,0,0"])
    imu, bare = found["imu"], found[UNNAMED]
    assert (imu.x, imu.y, imu.z) == (1.0, 2.0, 3.0)
    np.testing.assert_allclose(imu.rotation.apply([1, 0, 0]), [0, 1, 0], atol=1e-12)
    assert (bare.x, bare.y, bare.z) == (0.1, -0.2, None)


@pytest.mark.parametrize(
    ("angles", "axis", "turned"),
    [("90,0,0", [0, 1, 0], [0, 0, 1]), ("0,90,0", [1, 0, 0], [0, 0, -1])],
)
def test_roll_turns_left_up_and_pitch_turns_forward_down(angles, axis, turned):
    """Roll is about x and pitch about y, in REP-103 axes."""
    rotation = read_mountings([f"imu=0,0,0,{angles}"])["imu"].rotation
    np.testing.assert_allclose(rotation.apply(axis), turned, atol=1e-12)


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["1,2"], "expected five numbers"),
        (["sonar=0,0,0,0,0"], "expected one of laser, imu, compass, gnss before the sign"),
        (["imu=0,0,0,0,0", "imu=1,0,0,0,0"], "expected imu once"),
        (["0,0,0,0,0", "1,0,0,0,0"], "expected the laser once"),
        (["0,0,0,0,361"], "expected yaw within 360 degrees, got 361"),
    ],
)
def test_wrong_mountings_are_usage_errors(texts, message):
    """A wrong count, an unknown or repeated sensor, or an angle too large is refused."""
    with pytest.raises(UsageError, match=message):
        read_mountings(texts)


def test_a_distance_out_of_bounds_is_refused():
    """A sensor 11 m ahead of the robot is an error that names the field."""
    with pytest.raises(SettingsError, match="x: input should be less than or equal to 10"):
        read_mountings(["11,0,0,0,0"])


def test_the_laser_stands_level_at_its_height_by_default():
    """The given mounting comes first, then `laser=` over the bare one, then the height."""
    assert laser_mounting({}, 0.9).z == 0.9
    given = read_mountings(["laser=0,0,0.5,0,10,0", "1,0,0,0,0"])
    assert laser_mounting(given, 0.9).z == 0.5
    np.testing.assert_allclose(np.rad2deg(laser_mounting(given, 0.9).pitch), 10.0)
    bare = laser_mounting(read_mountings(["1,2,30,0,-40"]), 0.9)
    found = (bare.x, bare.y, bare.z, np.rad2deg(bare.roll), np.rad2deg(bare.yaw))
    np.testing.assert_allclose(found, (1, 2, 0.9, 30, -40))


def test_the_height_stands_in_front_of_the_settings():
    """Settings come later, and so win; no height adds none."""
    assert with_height(["a=1"], 0.5) == ["robot.lidar_height=0.5", "a=1"]
    assert with_height(None, None) == []


def test_mountings_are_shown_in_metres_and_degrees():
    """A line a sensor: frame, pose and source."""
    pose = [0.1, -0.0, 0.72, 0.0, 0.0, np.pi / 2]
    frames = {
        "laser": {"frame": "lidar", "transform": pose, "source": "given"},
        "imu": {"frame": "", "transform": None, "source": "moving"},
    }
    assert mountings_in_words(frames).splitlines() == [
        "laser: frame lidar at 0.1,0,0.72,0,0,90 (given)",
        "imu: frame (none) at moves (moving)",
    ]


@pytest.mark.parametrize("pitch", [90, -90])
def test_a_pitch_of_90_degrees_keeps_its_rotation(pitch):
    """Upright mountings, whose angles are not unique, keep their rotation."""
    given = read_mountings([f"laser=0.1,0.2,0.3,30,{pitch},40"])
    found = laser_mounting(given, 0.72)
    apart = found.rotation.inv() * turn((30, pitch, 40))
    assert apart.magnitude() == pytest.approx(0, abs=1e-6)
    assert (found.x, found.y, found.z) == (0.1, 0.2, 0.3)


def test_angles_over_half_a_turn_are_wrapped():
    """270 degrees are -90; over 360 is an error."""
    (given,) = read_mountings(["0,0,0,0,270"]).values()
    assert given.z is None
    assert given.rotation.as_euler("ZYX", degrees=True)[0] == pytest.approx(-90)
    with pytest.raises(UsageError, match="yaw within 360 degrees, got 400"):
        read_mountings(["0,0,0,0,400"])
