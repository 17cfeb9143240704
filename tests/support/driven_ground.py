"""A straight drive over level ground, with what lies on it, for labels by the robot's own way."""

import numpy as np

from andabata.datasets.drive_path import DrivePeriod
from andabata.machine.pose import Pose

SPEED = 0.3


def period(stamp, x, *, y=0.0, yaw=0.0, pitch=0.0, commanded=SPEED, wheels=SPEED, trusted=True):
    """Return a control period of a robot at a place."""
    pose = Pose.from_euler(np.array([x, y, 0.0]), 0.0, pitch, yaw)
    return DrivePeriod(stamp, pose, np.array([x, y]), commanded, wheels, trusted)


def straight(seconds, *, stop=np.inf, **words):
    """Return the periods of a drive along x that stands still from a time on [s]."""
    return [
        period(t, SPEED * min(t, stop), **words) for t in np.arange(1, round(seconds * 10) + 1) / 10
    ]


def level_ground(reach=4.0, step=0.05):
    """Return points of level ground around the robot [m], float32, shape (n, 3)."""
    axis = np.arange(-reach, reach, step) + step / 2
    x, y = np.meshgrid(axis, axis)
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]).astype(np.float32)


def raised(points, low, high, height):
    """Return points with those of a rectangle lifted: corners and height [m]."""
    inside = (points[:, :2] >= low).all(axis=1) & (points[:, :2] < high).all(axis=1)
    return np.where(inside[:, None], points + np.float32([0, 0, height]), points)
