"""Conversion of readings, estimates and commands to messages, and back."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import Sweeps, VehicleState, WheelSpeeds
from andabata.records.topics import POINT_CLOUD, Ros, RosMessage, message_types
from traversability.cloud import PointCloud
from traversability.virtual_scan import VirtualScan

NS = 1_000_000_000
"""Number of nanoseconds of a second."""

NAME = "andabata"
"""Name of our status in a diagnostics message."""

NO_FIX = -1
"""Status of a satellite receiver without a fix."""

UNKNOWN_STATUS = -2
"""Status that a driver never set: the default of ROS 2's NavSatStatus."""

UNKNOWN_COVARIANCE, DIAGONAL_COVARIANCE = 0, 2
"""Covariance types of a NavSatFix: unknown, and diagonal known."""

UINT32, FLOAT32 = 6, 7
"""Data types of a PointField."""

_MAX_RANGE = 100.0
"""Largest range that a laser scan states [m]; no laser of ours measures as far."""

_UP_VARIANCE_RATIO = 4
"""Ratio of a fix's vertical to its horizontal variance (assumption)."""


@dataclass(frozen=True)
class MessageBuilder:
    """Builder of messages of ROS 1 or ROS 2.

    Attributes:
        ros: Version of ROS.
        epoch_ns: Stamp of the time 0 s [ns]; not zero, which ROS 1 takes for a missing stamp.
    """

    ros: Ros
    epoch_ns: int = 1_700_000_000 * NS

    def stamp_ns(self, seconds: float) -> int:
        """Return the stamp [ns] of a time [s]."""
        return self.epoch_ns + round(seconds * NS)

    def new(self, kind: str, **fields: object) -> RosMessage:
        """Return a message of a type, ``package/msg/Name``, with all its fields given."""
        maker: Any = message_types(self.ros).types[kind]
        return maker(**fields)

    def header(self, seconds: float, frame: str) -> RosMessage:
        """Return a header with the stamp of a time [s]."""
        second, rest = divmod(self.stamp_ns(seconds), NS)
        stamp = self.new("builtin_interfaces/msg/Time", sec=second, nanosec=rest)
        fields = {"stamp": stamp, "frame_id": frame}
        return self.new("std_msgs/msg/Header", **({"seq": 0} if self.ros == 1 else {}), **fields)

    def vector(self, xyz: NDArray[np.float64], kind: str = "Vector3") -> RosMessage:
        """Return a vector or a point, shape (3,)."""
        x, y, z = (float(part) for part in xyz)
        return self.new(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)

    def quaternion(self, xyzw: NDArray[np.float64]) -> RosMessage:
        """Return a quaternion x, y, z, w, shape (4,)."""
        x, y, z, w = (float(part) for part in xyzw)
        return self.new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def pose(self, pose: Pose) -> RosMessage:
        """Return a pose."""
        return self.new(
            "geometry_msgs/msg/Pose",
            position=self.vector(pose.position, "Point"),
            orientation=self.quaternion(pose.quaternion),
        )

    def sweep(self, sweeps: Sweeps, k: int) -> RosMessage:
        """Return the k-th sweep as a laser scan.

        Angles count from the head's zenith [rad]; ``inf`` stands for no return.
        """
        angles = sweeps.elevations if sweeps.elevations.ndim == 1 else sweeps.elevations[k]
        return self._scan(
            self.header(float(sweeps.stamps[k]), "lidar"),
            (float(angles[0]), float(angles[-1])),
            sweeps.ranges[k],
            sweeps.beam_period,
        )

    def virtual_scan(
        self, seconds: float, scan: VirtualScan, bearings: NDArray[np.float64]
    ) -> RosMessage:
        """Return the virtual scan after REP-117: ``inf`` is free, NaN unknown.

        Args:
            seconds: Time of the scan [s].
            scan: The virtual scan.
            bearings: Bearings of its sectors [rad], shape (n_sectors,), evenly spaced.
        """
        ends = (float(bearings[0]), float(bearings[-1]))
        return self._scan(self.header(seconds, "base_footprint"), ends, scan.ranges, 0.0)

    def _scan(
        self,
        header: RosMessage,
        ends: tuple[float, float],
        ranges: NDArray[np.float32],
        step: float,
    ) -> RosMessage:
        """Return a laser scan.

        Args:
            header: Header of the message.
            ends: Angles of the first and the last beam [rad].
            ranges: Ranges [m], shape (n_beams,).
            step: Time between two beams [s].
        """
        return self.new(
            "sensor_msgs/msg/LaserScan",
            header=header,
            angle_min=ends[0],
            angle_max=ends[1],
            angle_increment=(ends[1] - ends[0]) / max(len(ranges) - 1, 1),
            time_increment=step,
            scan_time=0.0,
            range_min=0.0,
            range_max=_MAX_RANGE,
            ranges=np.ascontiguousarray(ranges, dtype=np.float32),
            intensities=np.zeros(0, dtype=np.float32),
        )

    def head(self, sweeps: Sweeps, k: int) -> RosMessage:
        """Return the head's angle [rad] and rate [rad/s] at the begin of the k-th sweep."""
        return self.new(
            "andabata_msgs/msg/LaserEvent",
            header=self.header(float(sweeps.stamps[k]), "base_link"),
            angle=float(sweeps.head_angles[k]),
            rate=float(sweeps.head_rate),
        )

    def imu(self, row: NDArray[np.float64]) -> RosMessage:
        """Return an inertial reading; a first covariance of -1 marks the orientation as unknown.

        Args:
            row: Time [s], angular velocity [rad/s], specific force [m/s2], shape (7,).
        """
        unknown = np.zeros(9)
        unknown[0] = -1.0
        return self.new(
            "sensor_msgs/msg/Imu",
            header=self.header(float(row[0]), "base_link"),
            orientation=self.quaternion(np.array([0.0, 0.0, 0.0, 1.0])),
            orientation_covariance=unknown,
            angular_velocity=self.vector(row[1:4]),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self.vector(row[4:7]),
            linear_acceleration_covariance=np.zeros(9),
        )

    def wheels(self, kind: str, seconds: float, left: float, right: float) -> RosMessage:
        """Return wheel speeds [rad/s]; ``kind`` is Wheels_speed (measured) or Wheels_cmd."""
        header = self.header(seconds, "base_link")
        name = f"andabata_msgs/msg/{kind}"
        return self.new(name, header=header, left=float(left), right=float(right))

    def field(self, row: NDArray[np.float64]) -> RosMessage:
        """Return a magnetic reading: time [s] and field [T], shape (4,)."""
        return self.new(
            "sensor_msgs/msg/MagneticField",
            header=self.header(float(row[0]), "base_link"),
            magnetic_field=self.vector(row[1:4]),
            magnetic_field_covariance=np.zeros(9),
        )

    def fix(self, row: NDArray[np.float64]) -> RosMessage:
        """Return a satellite fix; one without a finite variance has the status NO_FIX.

        Args:
            row: Time [s], latitude, longitude [deg], altitude [m], variance [m2], shape (5,).
        """
        is_fix = bool(np.isfinite(row[4]))
        status = self.new("sensor_msgs/msg/NavSatStatus", status=0 if is_fix else NO_FIX, service=1)
        up = _UP_VARIANCE_RATIO * row[4]
        variances = [row[4], row[4], up] if is_fix else [0.0] * 3
        return self.new(
            "sensor_msgs/msg/NavSatFix",
            header=self.header(float(row[0]), "base_footprint"),
            status=status,
            latitude=float(row[1]),
            longitude=float(row[2]),
            altitude=float(row[3]),
            position_covariance=np.diag(variances).ravel(),
            position_covariance_type=DIAGONAL_COVARIANCE if is_fix else UNKNOWN_COVARIANCE,
        )

    def twist(self, speed: float, yaw_rate: float) -> RosMessage:
        """Return a body twist of a speed [m/s] and a yaw rate [rad/s]."""
        return self.new(
            "geometry_msgs/msg/Twist",
            linear=self.vector(np.array([speed, 0.0, 0.0])),
            angular=self.vector(np.array([0.0, 0.0, yaw_rate])),
        )

    def odometry(
        self,
        seconds: float,
        pose: Pose,
        covariance: NDArray[np.float64] | None = None,
        state: VehicleState | None = None,
    ) -> RosMessage:
        """Return a pose in the map.

        Args:
            seconds: Time of the pose [s].
            pose: Pose of ``base_footprint``.
            covariance: Covariance of x, y, z [m], roll, pitch, yaw [rad], shape (6, 6); None for
                zeros, which stand for an unknown one.
            state: State with the velocities; None for zeros.
        """
        zero = np.zeros(3)
        linear, angular = (zero, zero) if state is None else (state.linear, state.angular)
        twist = self.new(
            "geometry_msgs/msg/Twist", linear=self.vector(linear), angular=self.vector(angular)
        )
        return self.new(
            "nav_msgs/msg/Odometry",
            header=self.header(seconds, "map"),
            child_frame_id="base_footprint",
            pose=self.pose_with_covariance(pose, covariance),
            twist=self.new(
                "geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)
            ),
        )

    def pose_with_covariance(
        self, pose: Pose, covariance: NDArray[np.float64] | None = None
    ) -> RosMessage:
        """Return a pose with its covariance; see ``odometry``."""
        full = np.zeros((6, 6)) if covariance is None else covariance
        return self.new(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=self.pose(pose),
            covariance=np.array(full, dtype=np.float64).ravel(),
        )

    def stamped_pose(
        self, seconds: float, pose: Pose, covariance: NDArray[np.float64] | None = None
    ) -> RosMessage:
        """Return a pose in the map with its covariance; see ``odometry``."""
        return self.new(
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            header=self.header(seconds, "map"),
            pose=self.pose_with_covariance(pose, covariance),
        )

    def goal(self, seconds: float, goal: NDArray[np.float64]) -> RosMessage:
        """Return a goal in the map [m], shape (2,)."""
        pose = Pose(np.array([goal[0], goal[1], 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
        return self.new(
            "geometry_msgs/msg/PoseStamped",
            header=self.header(seconds, "map"),
            pose=self.pose(pose),
        )

    def places(self, seconds: float, places: NDArray[np.float64]) -> RosMessage:
        """Return places in the map [m], shape (k, 3), as poses without a turn."""
        upright = np.array([0.0, 0.0, 0.0, 1.0])
        return self.new(
            "geometry_msgs/msg/PoseArray",
            header=self.header(seconds, "map"),
            poses=[self.pose(Pose(place, upright)) for place in places],
        )

    def transform(self, seconds: float, row: NDArray[np.float64], kind: str) -> RosMessage:
        """Return the transform ``odom -> base_footprint``.

        Args:
            seconds: Time of the transform [s].
            row: Position x, y, z [m] and quaternion x, y, z, w, shape (7,).
            kind: Message type, which differs between ROS 1 and ROS 2.
        """
        stamped = self.stamped_transform(seconds, ("odom", "base_footprint"), row)
        return self.new(kind, transforms=[stamped])

    def stamped_transform(
        self, seconds: float, frames: tuple[str, str], row: NDArray[np.float64]
    ) -> RosMessage:
        """Return a transform from parent to child, as in ``transform``, without its list."""
        transform = self.new(
            "geometry_msgs/msg/Transform",
            translation=self.vector(row[:3]),
            rotation=self.quaternion(row[3:]),
        )
        return self.new(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(seconds, frames[0]),
            child_frame_id=frames[1],
            transform=transform,
        )

    def cloud(self, seconds: float, cloud: PointCloud) -> RosMessage:
        """Return a cloud with the fields x, y and z."""
        data = np.ascontiguousarray(cloud.points, dtype="<f4").view(np.uint8).ravel()
        return self._cloud(self.header(seconds, cloud.frame), dict.fromkeys("xyz", FLOAT32), data)

    def frame(self, cloud: PointCloud) -> RosMessage:
        """Return a 3D laser's cloud with x, y, z and ``t``, nanoseconds after the header's stamp.

        Raises:
            ValueError: If its points have no stamps.
        """
        if cloud.stamps is None:
            raise ValueError(
                "stamps: expected a time of each point, got none; give the cloud stamps"
            )
        begin = float(cloud.stamps.min(initial=np.inf)) if len(cloud) else 0.0
        rows = np.empty(len(cloud), dtype=[("xyz", "<f4", 3), ("t", "<u4")])
        rows["xyz"], rows["t"] = cloud.points, np.round((cloud.stamps - begin) * NS)
        fields = {**dict.fromkeys("xyz", FLOAT32), "t": UINT32}
        return self._cloud(self.header(begin, "lidar"), fields, rows.view(np.uint8))

    def _cloud(
        self, header: RosMessage, fields: dict[str, int], data: NDArray[np.uint8]
    ) -> RosMessage:
        """Return a cloud.

        Args:
            header: Header of the message.
            fields: Data types of the points' fields by name, each of four bytes.
            data: Bytes of all points, shape (n_points * 4 * n_fields,).
        """
        step = 4 * len(fields)
        return self.new(
            POINT_CLOUD,
            header=header,
            height=1,
            width=len(data) // step,
            fields=[
                self.new("sensor_msgs/msg/PointField", name=name, offset=4 * k, datatype=t, count=1)
                for k, (name, t) in enumerate(fields.items())
            ],
            is_bigendian=False,
            point_step=step,
            row_step=len(data),
            data=data,
            is_dense=True,
        )

    def diagnostics(
        self, seconds: float, level: int, message: str, values: dict[str, str]
    ) -> RosMessage:
        """Return the robot's health.

        Args:
            seconds: Time of the message [s].
            level: 0 for ok, 1 for a warning, 2 for an error.
            message: Health and complaints in words.
            values: Further facts by key.
        """
        pairs = [
            self.new("diagnostic_msgs/msg/KeyValue", key=key, value=value)
            for key, value in values.items()
        ]
        status = self.new(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=level,
            name=NAME,
            message=message,
            hardware_id="",
            values=pairs,
        )
        header = self.header(seconds, "")
        return self.new("diagnostic_msgs/msg/DiagnosticArray", header=header, status=[status])


def sweep_angles(message: RosMessage) -> NDArray[np.float32]:
    """Return the angle of each beam of a laser scan [rad], float32, shape (b,)."""
    low, high = float(message.angle_min), float(message.angle_max)
    return np.linspace(low, high, len(message.ranges)).astype(np.float32)


def fix_of(message: RosMessage) -> list[float]:
    """Return latitude, longitude [deg], altitude [m] and variance [m2] of a satellite fix.

    The variance is the larger of east's and north's, infinite without a fix, and NaN where the
    receiver does not know it: NavSatFix writes that as type 0, as zeros or as NaN. A fix whose
    status was never set counts by its numbers.
    """
    place = [float(message.latitude), float(message.longitude), float(message.altitude)]
    status = int(message.status.status)
    if status <= NO_FIX and status != UNKNOWN_STATUS:
        return [*place, np.inf]
    east, north = (float(message.position_covariance[k]) for k in (0, 4))
    if min(east, north) < 0:
        return [*place, min(east, north)]
    is_known = int(message.position_covariance_type) != UNKNOWN_COVARIANCE and east > 0 < north
    # An infinite variance is unknown, too, and must not be taken for a missing fix.
    return [*place, max(east, north) if is_known and np.isfinite(max(east, north)) else np.nan]


def header_ns(message: RosMessage) -> int:
    """Return the stamp of a message's header [ns]."""
    stamp = message.header.stamp
    return int(stamp.sec) * NS + int(stamp.nanosec)


def pose_of(message: RosMessage) -> Pose:
    """Return the pose of a pose message."""
    p, q = message.position, message.orientation
    return Pose(np.array([p.x, p.y, p.z]), np.array([q.x, q.y, q.z, q.w]))


def wheel_speeds_of(message: RosMessage) -> WheelSpeeds:
    """Return the wheel speeds of a command."""
    return WheelSpeeds(float(message.left), float(message.right))
