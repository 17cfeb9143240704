"""Extrinsics of all sensors of a recording or a live graph, applied to their measurements."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.records.frames.ground_check import GroundCheck
from andabata.records.frames.mounting_checks import MountingChecks
from andabata.records.frames.names import (
    OWN_FRAMES,
    SENSORS,
    FrameError,
    Sensor,
    is_base,
    local_name,
    strip_slashes,
)
from andabata.records.frames.remarks import assumption_remarks, contradiction_remarks
from andabata.records.frames.sensor_pose import GivenMounting, SensorPose, raised, resolve_pose
from andabata.records.frames.transform import Transform
from andabata.records.frames.transform_tree import EXTRAPOLATION, TransformTree
from traversability.cloud import PointCloud


class PendingTransformError(FrameError):
    """Transforms that are not published yet."""


class Extrinsics:
    """Looks up the poses of sensors and transforms their measurements into the robot's axes.

    The accelerometer's lever arm is neglected: at 0.5 rad/s a metre of it adds 0.25 m/s2, a third
    of the vibration that the filter expects.

    Attributes:
        tree: Frames of the recording or of the graph.
        checks: Checks of the mountings against gravity, the magnetic field and the wheels.
    """

    def __init__(
        self,
        given: Mapping[str, GivenMounting] | None = None,
        tree: TransformTree | None = None,
    ) -> None:
        """Create extrinsics that no message has used yet.

        Args:
            given: Mountings that the user gives, by sensor or ``UNNAMED``.
            tree: Frames; None for an empty tree.
        """
        self.tree = tree or TransformTree()
        self.checks = MountingChecks()
        self._given = dict(given or {})
        self._cache: dict[tuple[Sensor, str], SensorPose] = {}
        self._version = self.tree.version
        self._used: dict[Sensor, SensorPose] = {}
        self._refusals: dict[str, None] = {}

    def pose_of(self, sensor: Sensor, frame: str) -> SensorPose:
        """Return the pose of a sensor by the frame of its messages.

        Args:
            sensor: Name of the sensor.
            frame: Frame of its messages.

        Raises:
            FrameError: If the pose is unknown.
        """
        if self._version != self.tree.version:
            self._cache.clear()
            self.checks = MountingChecks()  # Earlier measurements were rotated otherwise.
            self._version = self.tree.version
        key = sensor, strip_slashes(frame)
        if key not in self._cache:
            try:
                self._cache[key] = resolve_pose(*key, self._given, self.tree)
            except FrameError as error:
                self.note_refusal(sensor, error)
                raise
        self._used[sensor] = self._cache[key]
        return self._cache[key]

    def transform_cloud(self, cloud: PointCloud, clock_offset: float) -> PointCloud:
        """Return a laser's cloud in ``sensor``, ``base_link`` or ``base_footprint``.

        Args:
            cloud: Cloud in the frame of its message; with times where that frame moves.
            clock_offset: Time of the transforms minus that of the cloud's stamps [s].

        Raises:
            FrameError: If the frame's pose is unknown.
            PendingTransformError: If its transforms are not published yet.
        """
        pose = self.pose_of("laser", cloud.frame)
        if pose.is_identity:
            return replace(cloud, frame=pose.origin)
        transform = pose.transform
        if pose.moving is not None and len(cloud):
            stamps = np.zeros(len(cloud)) if cloud.stamps is None else cloud.stamps
            transform = raised(self._moving_at(pose.moving, stamps + clock_offset), pose.lift)
        points = transform.apply(cloud.points).astype(np.float32)
        return replace(cloud, points=points, frame=pose.origin)

    def _moving_at(self, moving: tuple[str, str], stamps: NDArray[np.float64]) -> Transform:
        """Return the transforms of a moving frame at n instants [s], shape (n,)."""
        last = self.tree.time_span(*moving)[1]
        if stamps.max() > last + EXTRAPOLATION:
            raise PendingTransformError(
                f"/tf: expected transforms from {moving[0]} to {moving[1]} until "
                f"{stamps.max():.3f} s, got them until {last:.3f} s"
            )
        return self.tree.lookup(*moving, stamps)

    def transform_row(self, sensor: Sensor, frame: str, numbers: Sequence[float]) -> list[float]:
        """Return a measurement in the robot's axes.

        Args:
            sensor: ``imu`` with angular velocity and specific force, ``compass`` with flux
                density, or ``gnss``, whose position on the robot is ``antenna``.
            frame: Frame of its message.
            numbers: Measured values; three or more.

        Raises:
            FrameError: If the frame's pose is unknown.
        """
        pose, row = self.pose_of(sensor, frame), list(numbers)
        if sensor != "gnss" and pose.transform.rotation.magnitude() != 0.0:
            for k in range(0, len(row) - 2, 3):
                row[k : k + 3] = pose.transform.rotation.apply(row[k : k + 3]).tolist()
        self.checks.add(sensor, row)
        return row

    @property
    def antenna(self) -> NDArray[np.float64] | None:
        """Position of the GNSS antenna in the base frame [m], shape (3,); None at its origin."""
        pose = self._used.get("gnss")
        if pose is None or not pose.transform.translation.any():
            return None
        return pose.transform.translation

    def head_pose(self, frame: str) -> tuple[NDArray[np.float64] | None, str]:
        """Return the pose of the rotating laser's head, and the frame of that pose.

        Args:
            frame: Frame of its sweeps, whose angles are those of the head's own plane.

        Returns:
            Position x, y, z [m] and quaternion x, y, z, w in the frame; None for level at the
            laser's height.

        Raises:
            FrameError: If the frame's pose is unknown.
        """
        if is_base(frame):  # The base is not the optical centre that ranges are measured from.
            frame = OWN_FRAMES[1]
        pose = self.pose_of("laser", frame)
        if pose.is_identity or pose.source == "name":
            return None, "sensor"
        transform = pose.transform
        if pose.moving is not None:  # /head_angle holds the rotation of the head itself.
            parent = self.tree.joint_parent(*pose.moving)
            transform = raised(self.tree.lookup(parent, pose.moving[1]), pose.lift)
        quaternion = transform.rotation.as_quat()
        return np.concatenate([transform.translation, quaternion]), pose.origin

    def ground_check(self, lidar_height: float) -> GroundCheck:
        """Return a check of the ground in the laser's clouds.

        Args:
            lidar_height: Height of a laser without a known pose [m].
        """
        pose = self._used.get("laser")
        if pose is None or pose.origin == "sensor":
            return GroundCheck(lidar_height)
        height = float(pose.transform.translation[2])
        labels = {"option": "--mounting", "name": f"frame {pose.frame}"}
        known = height > 0
        label = labels.get(pose.source, f"/{pose.source}")
        return GroundCheck(height if known else lidar_height, label, known)

    @property
    def is_settled(self) -> bool:
        """True if laser, IMU and compass have sent data and none of them lacks a transform."""
        sensors: tuple[Sensor, ...] = ("laser", "imu", "compass")
        for sensor in sensors:
            pose = self._used.get(sensor)
            if pose is None:
                return False
            pose = self.pose_of(sensor, pose.frame)  # Transforms may have come since.
            named = pose.source == "name" and not is_base(pose.frame)
            own = local_name(pose.frame) in OWN_FRAMES
            if named or (pose.source == "assumed" and not own):
                return False
        return True

    def note_refusal(self, sensor: Sensor, error: ValueError) -> None:
        """Note why a measurement is left out, the first reason of each sensor."""
        if not any(text.startswith(f"{sensor}: ") for text in self._refusals):
            self._refusals[f"{sensor}: {error}"] = None

    def verify(self) -> None:
        """Check the IMU's mounting against gravity.

        Raises:
            FrameError: If gravity contradicts it; the message names the option to give.
        """
        pose = self._used.get("imu")
        if pose is not None:
            self.checks.verify_gravity(pose.frame, pose.source, pose.transform.rotation)

    def as_dict(self, lidar_height: float) -> dict[str, Any]:
        """Return the poses of the sensors that sent data; see ``SensorPose.as_dict``."""
        return {
            sensor: self._used[sensor].as_dict(lidar_height)
            for sensor in SENSORS
            if sensor in self._used
        }

    @property
    def remarks(self) -> list[str]:
        """Remarks on the mountings, a line each."""
        lines = list(self._refusals)
        lines += [f"/tf: {text}" for text in self.tree.remarks]
        for sensor, pose in self._used.items():
            lines += assumption_remarks(sensor, pose, self.tree)
            lines += contradiction_remarks(sensor, pose, self.tree)
        return lines + self.checks.remarks

    @property
    def failures(self) -> list[str]:
        """Checks of the sensors against each other that failed, a line each."""
        return self.checks.failures
