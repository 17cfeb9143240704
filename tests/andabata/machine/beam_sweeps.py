"""A turning, leaning drive, two sweeps of a laser, and the rays of their beams by scipy."""

import numpy as np
from scipy.spatial.transform import Rotation

from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.sensor_readings import Sweeps

HEIGHT = 0.7


def track(speed=0.5, rate=0.4):
    """Return two seconds of a turning, leaning drive."""
    poses = PoseTrack()
    for k in range(201):
        pose = Pose.from_euler(np.array([speed * k / 100, 0.2, 0.1]), 0.1, -0.2, rate * k / 100)
        poses.append(k / 100, pose.position, pose.quaternion)
    return poses


def sweeps(**fields):
    """Return two sweeps of three beams with ranges."""
    given = {
        "stamps": np.array([0.5, 1.0]),
        "head_angles": np.array([0.3, 1.1]),
        "head_rate": 1.5,
        "beam_period": 0.02,
        "elevations": np.array([-0.4, 0.9, 1.9], dtype=np.float32),
        "ranges": np.array([[2.0, np.inf, 5.0], [1.0, 3.0, 4.0]], dtype=np.float32),
    }
    return Sweeps(**(given | fields))


def expected_rays(poses):
    """Return origin and direction of every beam by rotations of scipy."""
    found = []
    for stamp, head in ((0.5, 0.3), (1.0, 1.1)):
        for j, tilt in enumerate((-0.4, 0.9, 1.9)):
            row = poses.at(np.array([stamp + 0.02 * j]))[0]
            angle = head + 1.5 * 0.02 * j
            # Zenith tilted towards the head's front, then turned with the head.
            beam = Rotation.from_euler("ZY", [angle, tilt]).apply([0, 0, 1])
            turn = Rotation.from_quat(row[3:])
            found.append([*(row[:3] + turn.apply([0, 0, HEIGHT])), *turn.apply(beam)])
    return np.array(found)
