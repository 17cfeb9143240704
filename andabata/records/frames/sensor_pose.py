"""Pose of one sensor on the robot, resolved from an option, /tf, its frame's name or a default."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from andabata.records.frames.names import (
    BASES,
    FrameError,
    Sensor,
    is_base,
    is_world,
    local_name,
    namespace_of,
    rotation_by_name,
)
from andabata.records.frames.transform import Transform, yaw_pitch_roll
from andabata.records.frames.transform_tree import TransformTree

Source = Literal["tf_static", "tf", "option", "name", "assumed"]

Origin = Literal["sensor", "base_link", "base_footprint"]

UNNAMED = ""
"""Key of the mounting that is given without a sensor: of a laser in a frame of its own."""


@dataclass(frozen=True)
class GivenMounting:
    """Mounting of a sensor as the user gives it.

    Attributes:
        x: Position forward of the base [m].
        y: Position left of the base [m].
        z: Height above the ground [m]; None for a laser at ``robot.lidar_height``.
        rotation: Rotation from the sensor to the base.
    """

    x: float
    y: float
    z: float | None
    rotation: Rotation


@dataclass(frozen=True)
class SensorPose:
    """Pose of a sensor on the robot.

    Attributes:
        frame: Frame of its messages.
        source: Source of the pose.
        origin: Frame that ``transform`` leads to: ``sensor`` (level at ``robot.lidar_height``),
            ``base_link`` (fixed to the body, on the ground) or ``base_footprint`` (levelled).
        transform: Transform from ``frame`` to ``origin``, where nothing moves.
        moving: Names of the frame and of its base in the tree, where the frame moves against it.
        lift: Height of that base above the ground [m].
    """

    frame: str
    source: Source
    origin: Origin
    transform: Transform
    moving: tuple[str, str] | None = None
    lift: float = 0.0

    @property
    def is_identity(self) -> bool:
        """True if it leaves measurements as they are, to the bit."""
        still = self.moving is None and not self.transform.translation.any()
        return still and self.transform.rotation.magnitude() == 0.0

    def as_dict(self, lidar_height: float) -> dict[str, Any]:
        """Return frame, transform to the base (x, y, z [m], roll, pitch, yaw [rad]) and source.

        Args:
            lidar_height: Height of the frame ``sensor`` above the ground [m].
        """
        x, y, z = self.transform.translation.tolist()
        up = lidar_height if self.origin == "sensor" else 0.0
        yaw, pitch, roll = yaw_pitch_roll(self.transform.rotation)
        numbers = [round(number, 6) for number in (x, y, z + up, roll, pitch, yaw)]
        return {
            "frame": self.frame,
            "transform": None if self.moving else numbers,
            "source": self.source,
        }


def resolve_pose(
    sensor: Sensor, frame: str, given: Mapping[str, GivenMounting], tree: TransformTree
) -> SensorPose:
    """Return the pose of a sensor after the table of ``andabata.records.frames.names``.

    Args:
        sensor: Name of the sensor.
        frame: Frame of its messages.
        given: Mountings that the user gives, by sensor or ``UNNAMED``.
        tree: Frames of /tf_static and /tf.

    Raises:
        FrameError: If the frame is fixed to the world, or the tree is faulty there.
    """
    option = given.get(sensor)
    if option is None and sensor == "laser" and not is_base(frame):
        option = given.get(UNNAMED)
    if option is not None:
        return _pose_of_option(sensor, frame, option)
    name = tree.find(frame)
    pose = None if name is None else pose_by_tree(sensor, frame, name, tree)
    if pose is not None:
        return pose
    if is_base(frame):
        return SensorPose(frame, "name", "base_link", Transform.identity())
    if is_world(frame):
        raise FrameError(
            f"frame {frame}: expected a frame of the robot, or /tf from it to base_link, got "
            "one that is fixed to the world"
        )
    origin: Origin = "sensor" if sensor == "laser" else "base_link"
    named = rotation_by_name(frame)
    if named is not None:
        return SensorPose(frame, "name", origin, Transform(named[0], np.zeros(3)))
    return SensorPose(frame, "assumed", origin, Transform.identity())


def _pose_of_option(sensor: Sensor, frame: str, given: GivenMounting) -> SensorPose:
    """Return a pose as the user gives it."""
    translation = np.array([given.x, given.y, given.z or 0.0])
    relative = sensor == "laser" and given.z is None
    transform = Transform(given.rotation, translation)
    return SensorPose(frame, "option", "sensor" if relative else "base_link", transform)


def pose_by_tree(sensor: Sensor, frame: str, name: str, tree: TransformTree) -> SensorPose | None:
    """Return the pose that the tree gives a frame, None where it is connected with no base.

    Args:
        sensor: Name of the sensor.
        frame: Frame of its messages.
        name: Name of that frame in the tree.
        tree: Frames of /tf_static and /tf.

    Raises:
        FrameError: If the path to the base is faulty, or moves under a sensor that must not.
    """
    base = tree.base_of(name)
    if base is None:
        return None
    levelled, lift = False, 0.0
    link = _body_under(base, tree)
    if link is not None:
        # A base_footprint that turns against the body is levelled, as REP-120 has it.
        levelled, lift = name == base, float(tree.lookup(link, base).translation[2])
        base = name if levelled else link
    if levelled:
        return SensorPose(frame, "tf", "base_footprint", Transform.identity())
    source: Source = "tf_static" if tree.is_static(name, base) else "tf"
    if name == base:
        source = "name" if local_name(base) == BASES[0] or lift == 0.0 else "tf"
    if tree.moving(name, base):
        if sensor != "laser":
            raise FrameError(
                f"frame {frame}: expected one that is fixed to {base}, got one that /tf moves"
            )
        return SensorPose(frame, source, "base_link", Transform.identity(), (name, base), lift)
    transform = raised(tree.lookup(name, base), lift)
    return SensorPose(frame, source, "base_link", transform)


def _body_under(base: str, tree: TransformTree) -> str | None:
    """Return the base_link that moves against a base_footprint, None where none does."""
    if local_name(base) != BASES[0]:
        return None
    link = "/".join(part for part in (namespace_of(base), BASES[1]) if part)
    moves = link in tree.names and tree.base_of(link) == base and tree.moving(link, base)
    return link if moves else None


def raised(transform: Transform, lift: float) -> Transform:
    """Return a transform whose target lies lower by ``lift`` [m]."""
    up = np.array([0.0, 0.0, lift])
    return replace(transform, translation=transform.translation + up)
