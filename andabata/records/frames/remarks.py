"""Remarks on a sensor's pose: what was assumed, and where an option contradicts /tf."""

import numpy as np

from andabata.records.frames.names import OWN_FRAMES, FrameError, Sensor, is_base, rotation_by_name
from andabata.records.frames.sensor_pose import SensorPose, pose_by_tree
from andabata.records.frames.transform import MAX_SHIFT, MAX_TURN, mounting_numbers
from andabata.records.frames.transform_tree import TransformTree

_MOST_NAMES = 8
"""Number of known frames that a remark lists."""


def assumption_remarks(sensor: Sensor, pose: SensorPose, tree: TransformTree) -> list[str]:
    """Return what is assumed of a pose, at most one line.

    Args:
        sensor: Name of the sensor.
        pose: Pose that is used.
        tree: Frames of /tf_static and /tf.
    """
    if pose.source == "name" and not is_base(pose.frame):
        named = rotation_by_name(pose.frame)
        convention = named[1] if named else "its name"
        return [
            f"{sensor}: no transform to frame {pose.frame}; rotated as its name says ({convention})"
        ]
    if pose.source != "assumed" or pose.frame in OWN_FRAMES:
        return []
    known = "" if not tree.names else f"; /tf holds {', '.join(tree.names[:_MOST_NAMES])}"
    assumed = {
        "laser": "level at robot.lidar_height, x forward",
        "gnss": "over the middle of the robot",
    }.get(sensor, "along the robot's axes")
    return [
        f"{sensor}: the pose of frame {pose.frame} is unknown; assumed {assumed} "
        f"(--mounting {sensor}=X,Y,Z,ROLL,PITCH,YAW){known}"
    ]


def contradiction_remarks(sensor: Sensor, pose: SensorPose, tree: TransformTree) -> list[str]:
    """Return where the tree contradicts the user's option, at most one line; see above."""
    name = tree.find(pose.frame)
    if pose.source != "option" or name is None:
        return []
    try:
        other = pose_by_tree(sensor, pose.frame, name, tree)
    except FrameError:
        return []
    if other is None or other.moving or other.source == "name":
        return []
    difference = pose.transform.inverse @ other.transform
    # An option without a height leaves it to robot.lidar_height.
    shift = difference.translation[: 2 if pose.origin == "sensor" else 3]
    turn = difference.rotation.magnitude()
    if np.linalg.norm(shift) < MAX_SHIFT and turn < MAX_TURN:
        return []
    numbers = ",".join(f"{number:.3g}" for number in mounting_numbers(other.transform))
    return [f"{sensor}: --mounting is used; /{other.source} puts frame {pose.frame} at {numbers}"]
