"""Names of coordinate frames, and what each of them means, after REP-103 and REP-105.

The same table holds for ``scan``, ``bag replay`` and ``ros navigator``. Leading and trailing
slashes and a robot's prefix (``husky1/base_link``) change nothing; case does.

================== =================================================================================
frame of a message where its origin and axes are
================== =================================================================================
base_footprint     on the ground under the robot, fixed to its body; levelled only where /tf shows
                   that it turns against base_link, and in our own ``/3D_relative_cloud``
base_link          the same, unless /tf_static or /tf tells where base_footprint is
any other frame    a sensor's own: by ``--mounting``, else by /tf_static or /tf, else by what the
                   name says, else level at ``robot.lidar_height`` (a laser) or along the robot's
                   axes (IMU, compass) or over its middle (GNSS antenna)
os_lidar           Ouster's: x looks backwards
..._optical_frame  a camera's: z forward, x right, y down (REP-103)
..._ned            x forward, y right, z down (REP-103)
map, odom, world   fixed to the world: needs /tf, else the message is left out
================== =================================================================================

``--mounting SENSE=...`` overrides whatever frame the header names, the bare ``--mounting`` only a
laser's own frame.
"""

from typing import Literal

from scipy.spatial.transform import Rotation

Sense = Literal["laser", "imu", "compass", "gnss"]

SENSES: tuple[Sense, ...] = ("laser", "imu", "compass", "gnss")
"""Sensors that a mounting can be told of."""

BASES = ("base_footprint", "base_link")
"""Frames of the robot's body; the first is the one that is wanted."""

OWN_FRAMES = ("", "lidar", "sensor")
"""Frames of our own lasers, level at ``robot.lidar_height``: /tf never knew them."""

_WORLD_FRAMES = ("map", "world", "earth", "utm", "camera_init")


class FrameError(ValueError):
    """A frame whose place on the robot cannot be known."""


def clean(name: str) -> str:
    """Return a frame's name without slashes around it."""
    return name.strip().strip("/")


def local(name: str) -> str:
    """Return a frame's name without the robot's prefix."""
    return clean(name).rsplit("/", 1)[-1]


def prefix(name: str) -> str:
    """Return the robot's prefix of a frame's name, empty without one."""
    return clean(name).rpartition("/")[0]


def is_base(name: str) -> bool:
    """Return whether a frame is one of the robot's body."""
    return local(name) in BASES


def is_world(name: str) -> bool:
    """Return whether a frame does not move with the robot."""
    own = local(name)
    return own in _WORLD_FRAMES or own.startswith("odom") or own.endswith(("_odom", "_odom_frame"))


def rotation_by_name(name: str) -> tuple[Rotation, str] | None:
    """Return the rotation that a frame's name implies and the convention; None without one.

    Args:
        name: The frame.

    Returns:
        Rotation from the frame to axes that point forward, left and up, and what says so.
    """
    own = local(name)
    if own == "os_lidar":
        return Rotation.from_euler("Z", 180, degrees=True), "Ouster's x looks backwards"
    if own.endswith(("_optical_frame", "_optical")):
        turn = Rotation.from_euler("ZYX", [-90, 0, -90], degrees=True)
        return turn, "REP-103: z of a camera looks forward"
    if own.endswith("_ned"):
        return Rotation.from_euler("X", 180, degrees=True), "REP-103: z points down"
    return None
