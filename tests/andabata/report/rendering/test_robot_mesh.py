"""Mesh of a robot: its size, its pose, wheels and head that turn."""

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.report.rendering.robot_mesh import robot_mesh

ROBOT = RobotModel()
ORIGIN = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)
HEAD = np.array([235, 120, 30])


def points(mesh):
    """Return the corners in a row, shape (n, 3)."""
    return mesh.corners.reshape(-1, 3)


def test_a_robot_stands_on_its_wheels_and_has_its_size():
    """The lowest point is on the ground, the body as long and wide as the robot."""
    low, high = (
        points(robot_mesh(ROBOT, ORIGIN)).min(axis=0),
        points(robot_mesh(ROBOT, ORIGIN)).max(axis=0),
    )
    assert low[2] == pytest.approx(0.0, abs=1e-9)
    assert high[0] - low[0] == pytest.approx(ROBOT.length, abs=0.05)
    assert high[1] - low[1] == pytest.approx(ROBOT.width, abs=0.05)
    assert ROBOT.lidar_height < high[2] < ROBOT.lidar_height + 0.15


def test_it_moves_with_its_pose():
    """All corners are moved and turned alike."""
    pose = Pose.from_euler(np.array([5.0, -2.0, 1.0]), 0.0, 0.0, np.pi / 2)
    x, y, z = points(robot_mesh(ROBOT, ORIGIN)).T
    moved = points(robot_mesh(ROBOT, pose))
    np.testing.assert_allclose(moved, np.stack([5 - y, -2 + x, 1 + z], axis=1), atol=1e-9)


def test_the_head_turns_and_the_body_stays():
    """A quarter of a turn takes what looks ahead to the left; nothing below the mast moves."""
    straight, turned = (robot_mesh(ROBOT, ORIGIN, head) for head in (0.0, np.pi / 2))
    changed = (straight.corners != turned.corners).any(axis=(1, 2))
    assert changed.any()
    assert straight.corners[changed][..., 2].min() > ROBOT.lidar_height - 0.1
    x, y, z = straight.corners[changed].reshape(-1, 3).T
    found = turned.corners[changed].reshape(-1, 3)
    np.testing.assert_allclose(found, np.stack([-y, x, z], axis=1), atol=1e-9)


def test_wheels_roll_forward_each_side_by_its_own_angle():
    """The front of the left wheels goes down; the right ones stay."""
    still, rolled = (robot_mesh(ROBOT, ORIGIN, spins=spins) for spins in ((0, 0), (0.2, 0)))
    changed = (still.corners != rolled.corners).any(axis=(1, 2))
    assert still.corners[changed][..., 1].min() > 0
    before, after = points(still), points(rolled)
    front = np.argmax(before[:, 0] * (before[:, 1] > 0.2) * (before[:, 2] < 0.11))
    assert after[front, 2] < before[front, 2]


def test_the_sun_lights_what_faces_it():
    """No two faces of the head turned apart have one brightness; colours stay within bounds."""
    mesh = robot_mesh(ROBOT, ORIGIN)
    assert mesh.colours.min() >= 0
    assert len(np.unique(mesh.colours, axis=0)) > 12
