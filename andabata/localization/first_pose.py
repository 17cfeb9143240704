"""Where a robot stands that nobody told."""

import numpy as np
from scipy.spatial.transform import Rotation

from andabata.machine.pose import Pose
from andabata.machine.senses import Senses
from andabata.machine.site import Site


def first_pose(senses: Senses, site: Site) -> Pose | None:
    """Return the pose of a robot at rest: tilt by gravity, heading by the compass, place by a fix.

    Args:
        senses: What it sensed while it stood.
        site: Where on Earth.

    Returns:
        The pose in the map, good to some metres and some ten degrees; None while one of the three
        senses has said nothing that is a number.
    """
    force = _mean(senses.imu, slice(4, 7))
    field = _mean(senses.field, slice(1, 4))
    place = _mean(senses.fixes, slice(1, 4))
    if force is None or field is None or place is None:
        return None
    roll = float(np.arctan2(force[1], force[2]))
    pitch = float(np.arctan2(-force[0], np.hypot(force[1], force[2])))
    level = Rotation.from_euler("ZYX", [0.0, pitch, roll]).apply(field)
    north = np.arctan2(site.flux[1], site.flux[0])
    yaw = float(north - np.arctan2(level[1], level[0]))
    pose = Pose.from_euler(site.to_map(place[None])[0], roll, pitch, yaw)
    if senses.antenna is None:
        return pose
    arm = Rotation.from_quat(pose.quaternion).apply(senses.antenna)
    return Pose(pose.position - arm, pose.quaternion)


def _mean(rows: np.ndarray | None, columns: slice) -> np.ndarray | None:
    """Return the mean of a sense's whole rows, None without any."""
    if rows is None:
        return None
    whole = rows[np.isfinite(rows).all(axis=1)]
    return whole[:, columns].mean(axis=0) if len(whole) else None
