"""Names of coordinate frames and their meaning, after REP-103 and REP-105.

The same table holds for ``scan``, ``bag replay`` and ``ros navigator``. Leading and trailing
slashes and a namespace (``husky1/base_link``) change nothing; case does.

================== =================================================================================
frame of a message origin and axes
================== =================================================================================
base_footprint     on the ground under the robot, fixed to its body; levelled only where /tf shows
                   that it turns against base_link, and in our own ``/3D_relative_cloud``
base_link          the same, unless /tf_static or /tf places base_footprint
any other frame    the sensor's own: by ``--mounting``, else by /tf_static or /tf, else by its name,
                   else level at ``robot.lidar_height`` (a laser), along the robot's axes (IMU,
                   compass) or over the robot's middle (GNSS antenna)
os_lidar           Ouster's: x points backwards
..._optical_frame  a camera's: z forward, x right, y down (REP-103)
..._ned            x forward, y right, z down (REP-103)
map, odom, world   fixed to the world: needs /tf, else the message is refused
================== =================================================================================

``--mounting SENSOR=...`` overrides any frame of the header, the bare ``--mounting`` only the frame
of a laser that is not one of the body's.
"""

from typing import Literal

from scipy.spatial.transform import Rotation

Sensor = Literal["laser", "imu", "compass", "gnss"]

SENSORS: tuple[Sensor, ...] = ("laser", "imu", "compass", "gnss")
"""Sensors whose pose on the robot the user can give."""

BASES = ("base_footprint", "base_link")
"""Frames of the robot's body, the preferred one first."""

OWN_FRAMES = ("", "lidar", "sensor")
"""Frames of our own lasers, level at ``robot.lidar_height``; /tf does not hold them."""

_WORLD_FRAMES = ("map", "world", "earth", "utm", "camera_init")


class FrameError(ValueError):
    """A frame whose pose on the robot is unknown."""


def strip_slashes(name: str) -> str:
    """Return a frame's name without slashes around it."""
    return name.strip().strip("/")


def local_name(name: str) -> str:
    """Return a frame's name without its namespace."""
    return strip_slashes(name).rsplit("/", 1)[-1]


def namespace_of(name: str) -> str:
    """Return the namespace of a frame's name, empty without one."""
    return strip_slashes(name).rpartition("/")[0]


def is_base(name: str) -> bool:
    """Return whether a frame is one of the robot's body."""
    return local_name(name) in BASES


def is_world(name: str) -> bool:
    """Return whether a frame is fixed to the world."""
    own = local_name(name)
    return own in _WORLD_FRAMES or own.startswith("odom") or own.endswith(("_odom", "_odom_frame"))


def rotation_by_name(name: str) -> tuple[Rotation, str] | None:
    """Return the rotation that a frame's name implies by convention, None for other names.

    Args:
        name: Name of the frame.

    Returns:
        Rotation from the frame to axes that point forward, left and up, and the convention.
    """
    own = local_name(name)
    if own == "os_lidar":
        return Rotation.from_euler("Z", 180, degrees=True), "Ouster's x points backwards"
    if own.endswith(("_optical_frame", "_optical")):
        turn = Rotation.from_euler("ZYX", [-90, 0, -90], degrees=True)
        return turn, "REP-103: z of a camera points forward"
    if own.endswith("_ned"):
        return Rotation.from_euler("X", 180, degrees=True), "REP-103: z points down"
    return None
