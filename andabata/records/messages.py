"""Messages from what the robot senses and does, and back."""

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
"""Nanoseconds of a second."""

NO_FIX = -1
"""Status of a satellite receiver without a fix."""

UNKNOWN_COVARIANCE = 0
"""Type of a NavSatFix's covariance that says nothing."""


@dataclass(frozen=True)
class MessageBuilder:
    """Builds messages of ROS 1 or ROS 2.

    Attributes:
        ros: Which of the two.
        epoch_ns: Stamp of the simulation's zero [ns]; ROS 1 takes a zero stamp for none.
    """

    ros: Ros
    epoch_ns: int = 1_700_000_000 * NS

    def stamp_ns(self, seconds: float) -> int:
        """Return a stamp [ns] of a time [s]."""
        return self.epoch_ns + round(seconds * NS)

    def new(self, kind: str, **fields: object) -> RosMessage:
        """Return a message."""
        maker: Any = message_types(self.ros).types[kind]
        return maker(**fields)

    def header(self, seconds: float, frame: str) -> RosMessage:
        """Return a header."""
        second, rest = divmod(self.stamp_ns(seconds), NS)
        stamp = self.new("builtin_interfaces/msg/Time", sec=second, nanosec=rest)
        fields = {"stamp": stamp, "frame_id": frame}
        return self.new("std_msgs/msg/Header", **({"seq": 0} if self.ros == 1 else {}), **fields)

    def vector(self, xyz: NDArray[np.float64], kind: str = "Vector3") -> RosMessage:
        """Return a vector or a point."""
        x, y, z = (float(part) for part in xyz)
        return self.new(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)

    def quaternion(self, xyzw: NDArray[np.float64]) -> RosMessage:
        """Return a quaternion."""
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
        """Return one vertical sweep; angles are from the head's zenith, ``inf`` is no return."""
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
        """Return the virtual scan after REP-117: inf is free, NaN unknown."""
        ends = (float(bearings[0]), float(bearings[-1]))
        return self._scan(self.header(seconds, "base_footprint"), ends, scan.ranges, 0.0)

    def _scan(
        self,
        header: RosMessage,
        ends: tuple[float, float],
        ranges: NDArray[np.float32],
        step: float,
    ) -> RosMessage:
        """Return a laser scan."""
        return self.new(
            "sensor_msgs/msg/LaserScan",
            header=header,
            angle_min=ends[0],
            angle_max=ends[1],
            angle_increment=(ends[1] - ends[0]) / max(len(ranges) - 1, 1),
            time_increment=step,
            scan_time=0.0,
            range_min=0.0,
            range_max=100.0,
            ranges=np.ascontiguousarray(ranges, dtype=np.float32),
            intensities=np.zeros(0, dtype=np.float32),
        )

    def head(self, sweeps: Sweeps, k: int) -> RosMessage:
        """Return the head's angle at the begin of a sweep."""
        return self.new(
            "andabata_msgs/msg/LaserEvent",
            header=self.header(float(sweeps.stamps[k]), "base_link"),
            angle=float(sweeps.head_angles[k]),
            rate=float(sweeps.head_rate),
        )

    def imu(self, row: NDArray[np.float64]) -> RosMessage:
        """Return an inertial row; the orientation is said to be unknown."""
        none = np.zeros(9)
        none[0] = -1.0
        return self.new(
            "sensor_msgs/msg/Imu",
            header=self.header(float(row[0]), "base_link"),
            orientation=self.quaternion(np.array([0.0, 0.0, 0.0, 1.0])),
            orientation_covariance=none,
            angular_velocity=self.vector(row[1:4]),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self.vector(row[4:7]),
            linear_acceleration_covariance=np.zeros(9),
        )

    def wheels(self, kind: str, seconds: float, left: float, right: float) -> RosMessage:
        """Return wheel speeds, sensed or commanded [rad/s]."""
        header = self.header(seconds, "base_link")
        name = f"andabata_msgs/msg/{kind}"
        return self.new(name, header=header, left=float(left), right=float(right))

    def field(self, row: NDArray[np.float64]) -> RosMessage:
        """Return a compass row [T]."""
        return self.new(
            "sensor_msgs/msg/MagneticField",
            header=self.header(float(row[0]), "base_link"),
            magnetic_field=self.vector(row[1:4]),
            magnetic_field_covariance=np.zeros(9),
        )

    def fix(self, row: NDArray[np.float64]) -> RosMessage:
        """Return a satellite fix, or the receiver's word that it has none."""
        found = bool(np.isfinite(row[4]))
        status = self.new("sensor_msgs/msg/NavSatStatus", status=0 if found else NO_FIX, service=1)
        variances = [row[4], row[4], 4 * row[4]] if found else [0.0] * 3
        return self.new(
            "sensor_msgs/msg/NavSatFix",
            header=self.header(float(row[0]), "base_footprint"),
            status=status,
            latitude=float(row[1]),
            longitude=float(row[2]),
            altitude=float(row[3]),
            position_covariance=np.diag(variances).ravel(),
            position_covariance_type=2 if found else 0,
        )

    def twist(self, speed: float, yaw_rate: float) -> RosMessage:
        """Return a body twist [m/s, rad/s]."""
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
        """Return a pose in the map; ``covariance`` is of x, y [m] and yaw [rad]."""
        spread = np.zeros((6, 6))
        if covariance is not None:
            spread[np.ix_([0, 1, 5], [0, 1, 5])] = covariance
        zero = np.zeros(3)
        linear, angular = (zero, zero) if state is None else (state.linear, state.angular)
        twist = self.new(
            "geometry_msgs/msg/Twist", linear=self.vector(linear), angular=self.vector(angular)
        )
        return self.new(
            "nav_msgs/msg/Odometry",
            header=self.header(seconds, "map"),
            child_frame_id="base_footprint",
            pose=self.new(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=self.pose(pose),
                covariance=spread.ravel(),
            ),
            twist=self.new(
                "geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)
            ),
        )

    def initial(self, seconds: float, pose: Pose) -> RosMessage:
        """Return where the robot is told to start, in the map."""
        return self.new(
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            header=self.header(seconds, "map"),
            pose=self.new(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=self.pose(pose),
                covariance=np.zeros(36),
            ),
        )

    def goal(self, seconds: float, goal: NDArray[np.float64]) -> RosMessage:
        """Return a goal in the map."""
        pose = Pose(np.array([goal[0], goal[1], 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
        return self.new(
            "geometry_msgs/msg/PoseStamped",
            header=self.header(seconds, "map"),
            pose=self.pose(pose),
        )

    def transform(self, seconds: float, row: NDArray[np.float64], kind: str) -> RosMessage:
        """Return ``odom -> base_footprint``: x, y, z, quaternion, shape (7,)."""
        transform = self.new(
            "geometry_msgs/msg/Transform",
            translation=self.vector(row[:3]),
            rotation=self.quaternion(row[3:]),
        )
        stamped = self.new(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(seconds, "odom"),
            child_frame_id="base_footprint",
            transform=transform,
        )
        return self.new(kind, transforms=[stamped])

    def cloud(self, seconds: float, cloud: PointCloud) -> RosMessage:
        """Return a cloud with x, y and z."""
        data = np.ascontiguousarray(cloud.points, dtype="<f4").view(np.uint8).ravel()
        return self._cloud(self.header(seconds, cloud.frame), {"x": 7, "y": 7, "z": 7}, data)

    def frame(self, cloud: PointCloud) -> RosMessage:
        """Return a 3D laser's cloud with x, y, z and ``t``, nanoseconds after the header.

        Raises:
            ValueError: If its points have no times.
        """
        if cloud.stamps is None:
            raise ValueError("stamps: expected a time of each point, got none")
        begin = float(cloud.stamps.min(initial=np.inf)) if len(cloud) else 0.0
        rows = np.empty(len(cloud), dtype=[("xyz", "<f4", 3), ("t", "<u4")])
        rows["xyz"], rows["t"] = cloud.points, np.round((cloud.stamps - begin) * NS)
        fields = {"x": 7, "y": 7, "z": 7, "t": 6}
        return self._cloud(self.header(begin, "lidar"), fields, rows.view(np.uint8))

    def _cloud(
        self, header: RosMessage, fields: dict[str, int], data: NDArray[np.uint8]
    ) -> RosMessage:
        """Return a cloud whose points have some numbers of four bytes, by name and type."""
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
        """Return the robot's state in words; ``level`` is 0 ok, 1 warning, 2 error."""
        pairs = [
            self.new("diagnostic_msgs/msg/KeyValue", key=key, value=value)
            for key, value in values.items()
        ]
        status = self.new(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=level,
            name="andabata",
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
    receiver does not know it: NavSatFix writes that as type 0, as zeros or as NaN.
    """
    place = [float(message.latitude), float(message.longitude), float(message.altitude)]
    if int(message.status.status) <= NO_FIX:
        return [*place, np.inf]
    east, north = (float(message.position_covariance[k]) for k in (0, 4))
    if min(east, north) < 0:
        return [*place, min(east, north)]
    is_known = int(message.position_covariance_type) != UNKNOWN_COVARIANCE and east > 0 < north
    # An infinite variance is no statement either, and must not look like a missing fix.
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
