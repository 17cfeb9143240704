"""Laws of angles and poses: wrapping, unit quaternions, rotations, and tracks between poses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from andabata.localization.ukf import wrap_angle
from andabata.machine.pose import Pose, PoseTrack, wrap
from tests.support.properties import law

angles = st.floats(-1e4, 1e4, allow_subnormal=False)
rolls = st.floats(-np.pi, np.pi, allow_subnormal=False)
pitches = st.floats(-1.5, 1.5, allow_subnormal=False)
places = st.tuples(*[st.floats(-1e4, 1e4, allow_subnormal=False)] * 3).map(np.array)


def is_same_direction(a, b):
    """Return True if two angles are the same direction."""
    return abs(np.sin((a - b) / 2)) < 1e-8


@law
@given(angles)
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(angle):
    """In (-pi, pi], and wrapped again it stays; the filter's own wrapping is the same."""
    found = wrap(angle)
    assert -np.pi < found <= np.pi
    assert is_same_direction(found, angle)
    assert wrap(found) == pytest.approx(found, abs=1e-12)
    assert is_same_direction(wrap_angle(angle), found)


@law
@given(places, rolls, pitches, rolls)
def test_a_pose_from_euler_angles_is_that_rotation(place, roll, pitch, yaw):
    """A unit quaternion, the rotation of scipy, the heading that was given, and a rigid motion."""
    pose = Pose.from_euler(place, roll, pitch, yaw)
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    assert np.linalg.norm(pose.quaternion) == pytest.approx(1.0)
    np.testing.assert_allclose(pose.matrix[:3, :3], expected, atol=1e-9)
    np.testing.assert_array_equal(pose.matrix[:3, 3], place)
    assert is_same_direction(pose.yaw, yaw)
    assert np.linalg.det(pose.matrix) == pytest.approx(1.0)


@law
@given(
    places,
    places,
    st.floats(0.01, 10.0, allow_subnormal=False),
    st.floats(0.0, 1.0, allow_subnormal=False),
    pitches,
    pitches,
)
def test_a_track_passes_through_its_poses_and_between_them(a, b, seconds, share, yaw, other):
    """At its stamps it has the poses, in between a place on the line and a heading between both."""
    track = PoseTrack()
    for stamp, place, heading in ((0.0, a, yaw), (seconds, b, other)):
        pose = Pose.from_euler(place, 0.0, 0.0, heading)
        track.append(stamp, pose.position, pose.quaternion)
    first, between, last = track.at(np.array([0.0, share * seconds, seconds]))
    np.testing.assert_allclose(first[:3], a, atol=1e-6)
    np.testing.assert_allclose(last[:3], b, atol=1e-6)
    np.testing.assert_allclose(between[:3], a + share * (b - a), atol=1e-5)
    assert np.linalg.norm(between[3:]) == pytest.approx(1.0)
    found = Pose(between[:3], between[3:]).yaw
    assert min(yaw, other) - 1e-6 <= found <= max(yaw, other) + 1e-6
