"""Drawing of the robot: the ellipse of its estimate."""

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.report.drive_frames import DriveFrame
from andabata.viewer.robot_drawing import estimate_lines


def level(x=0.0, y=0.0, yaw=0.0, roll=0.0, pitch=0.0):
    """Return a pose."""
    return Pose.from_euler(np.array([x, y, 0.0]), roll, pitch, yaw)


def test_the_ellipse_holds_two_standard_deviations():
    """Along the axes of the covariance, around the estimated place."""
    covariance = np.diag([0.25, 0.04, 0.01])
    frame = DriveFrame(level(), estimate=level(3.0, -1.0), covariance=covariance)
    rim = estimate_lines(frame, RobotModel())[8:-2, 0]
    reach = np.abs(rim[:, :2] - [3.0, -1.0]).max(axis=0)
    assert reach == pytest.approx([1.0, 0.4], abs=1e-5)
