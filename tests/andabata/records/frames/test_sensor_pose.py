"""Poses of sensors: options, their default height, and angles."""

import numpy as np
import pytest

from andabata.records.frames.sensor_pose import (
    UNNAMED,
    GivenMounting,
    resolve_pose,
)
from andabata.records.frames.transform_tree import TransformTree
from tests.support.edited_bags import turn


@pytest.mark.parametrize(
    ("sensor", "z", "origin"),
    [("laser", None, "sensor"), ("laser", 0.5, "base_link"), ("imu", None, "base_link")],
)
def test_only_a_laser_without_a_height_is_at_the_laser_height(sensor, z, origin):
    """Other options count from the ground."""
    given = {sensor: GivenMounting(0.1, 0.2, z, turn((0, 0, 90)))}
    pose = resolve_pose(sensor, "x", given, TransformTree())
    assert (pose.source, pose.origin) == ("option", origin)
    np.testing.assert_allclose(pose.transform.translation, [0.1, 0.2, z or 0.0])
    height = 0.72 if origin == "sensor" else (z or 0.0)
    expected = [0.1, 0.2, height, 0, 0, round(np.pi / 2, 6)]
    assert pose.as_dict(0.72)["transform"] == pytest.approx(expected)


def test_the_unnamed_option_is_a_lasers_alone():
    """An IMU keeps its assumed pose."""
    given = {UNNAMED: GivenMounting(0.1, 0.0, None, turn((0, 0, 0)))}
    assert resolve_pose("laser", "x", given, TransformTree()).source == "option"
    assert resolve_pose("laser", "base_link", given, TransformTree()).source == "name"
    assert resolve_pose("imu", "x", given, TransformTree()).source == "assumed"
