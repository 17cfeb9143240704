"""Readings decoded: a message of any type that tells a sense becomes a row of numbers in SI units.

| sense | types |
|---|---|
| IMU | ``Imu`` |
| wheels | ``Wheels_speed``, ``JointState``, ``Odometry``, ``Twist`` and its stamped kinds |
| compass | ``MagneticField``, ``Vector3Stamped``, ``Vector3`` |

A name with any other type is refused by naming both. The unit of a sense is judged by its size
(``sense_units``): once for a recording, and as soon as it can be told in a live session.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel
from andabata.records import topics
from andabata.records.messages import fix_of
from andabata.records.remarks import Remarks
from andabata.records.row_error import RowError
from andabata.records.sense_units import (
    History,
    SenseUnits,
    UnitError,
    judge_history,
)
from andabata.records.topics import POINT_CLOUD, RosMessage, Topic, message_types
from andabata.records.wheel_decoding import Joints, TwistOfOdometry

OLD_POINT_CLOUD = "sensor_msgs/msg/PointCloud"

_JOINTS = "sensor_msgs/msg/JointState"

_ODOMETRY = "nav_msgs/msg/Odometry"

_TWISTS = (
    _ODOMETRY,
    "geometry_msgs/msg/TwistStamped",
    "geometry_msgs/msg/TwistWithCovarianceStamped",
    "geometry_msgs/msg/Twist",
)

ACCEPTED: Mapping[Topic, tuple[str, ...]] = {
    topics.IMU: (topics.IMU.kind,),
    topics.ENCODERS: (topics.ENCODERS.kind, _JOINTS, *_TWISTS),
    topics.MAG: (
        topics.MAG.kind,
        "geometry_msgs/msg/Vector3Stamped",
        "geometry_msgs/msg/Vector3",
    ),
}
"""Types that tell a sense, ours first; every other topic has the one of its definition."""

_NAMES = {
    topics.IMU: "imu",
    topics.ENCODERS: "wheels",
    topics.MAG: "field",
    topics.FIX: "fix",
}
"""Readings that come as rows, by what ``SensorDecoder`` calls them."""

_FIRST_ROWS = 25
"""A live session judges a sense by so many rows, which are not used otherwise."""

_FIRST_SECONDS = 1.0
"""Or by what came in so long a time, of a slow sense [s]."""

_RECONSIDER = 10.0
"""A live session compares its senses after so long, and after twice as long each time [s]."""


def accepted_types(topic: Topic) -> tuple[str, ...]:
    """Return the types by which a topic may come, as ``package/msg/Name``."""
    if topic in ACCEPTED:
        return ACCEPTED[topic]
    own = (topic.kind,) if topic.kind1 is None else (topic.kind, topic.kind1)
    return (*own, OLD_POINT_CLOUD) if topic.kind == POINT_CLOUD else own


def type_of(message: RosMessage) -> str:
    """Return the type of a message, as ``package/msg/Name``."""
    return str(getattr(message, "__msgtype__", type(message).__name__))


def row_name(topic: Topic) -> str | None:
    """Return what ``SensorDecoder`` calls the sense of a topic, None where it has no rows."""
    return _NAMES.get(topic)


def as_point_cloud2(message: RosMessage) -> RosMessage:
    """Return a cloud as a PointCloud2: the older PointCloud with its channels as fields.

    Raises:
        RowError: If a channel has another number of values than there are points.
    """
    if type_of(message) != OLD_POINT_CLOUD:
        return message
    store = message_types(1)
    count = len(message.points)
    columns = [np.array([[p.x, p.y, p.z] for p in message.points], np.float32).reshape(-1, 3)]
    names = ["x", "y", "z"]
    for channel in message.channels:
        if len(channel.values) != count:
            raise RowError(f"channel {channel.name}: expected a value for each point")
        names.append(str(channel.name))
        columns.append(np.asarray(channel.values, dtype=np.float32).reshape(-1, 1))
    data = np.ascontiguousarray(np.hstack(columns), dtype="<f4").view(np.uint8).ravel()
    field: Any = store.types["sensor_msgs/msg/PointField"]
    kind: Any = store.types[POINT_CLOUD]
    return kind(
        header=message.header,
        height=1,
        width=count,
        fields=[field(name=n, offset=4 * k, datatype=7, count=1) for k, n in enumerate(names)],
        is_bigendian=False,
        point_step=4 * len(names),
        row_step=len(data),
        data=data,
        is_dense=True,
    )


class MessageDecoder:
    """Turns the messages of one recording or live session into rows in SI units.

    Attributes:
        remarks: What was taken otherwise than it says, and what was left out.
        units: Factors to SI; in a live session those of the senses that were judged so far.
        joints: Reader of joint states.
    """

    def __init__(
        self,
        robot: RobotModel | None = None,
        units: SenseUnits | None = None,
        remarks: Remarks | None = None,
        asked: Mapping[str, float] | None = None,
    ) -> None:
        """Begin a session.

        Args:
            robot: Wheel radius and track, for wheels that are told as a twist.
            units: As judged by a whole recording; None judges them by what comes first.
            remarks: Where to write down what was found.
            asked: Factors to SI that the user tells, by quantity; see ``sense_units``.
        """
        self._robot = robot or RobotModel()
        self.remarks = remarks if remarks is not None else Remarks()
        self._kinematics = SkidSteer(self._robot)
        self.units = units or SenseUnits()
        self._asked = asked or {}
        self._live = _LiveJudge(self) if units is None else None
        self.restart()

    def restart(self) -> None:
        """Forget what came before, since times are counted anew; units stay as they were judged."""
        self.joints = Joints(self.remarks, topics.ENCODERS.ros1)
        self._odometry = TwistOfOdometry(self.remarks, topics.ENCODERS.ros1)
        if self._live is not None:
            self._live.restart()

    def rows(self, topic: Topic, message: RosMessage, stamp: float) -> list[list[float]]:
        """Return the rows that a message gives: stamp [s] and numbers as ``SensorReadings`` wants them.

        None come of a message that says nothing of the sense, and of those by which a live session
        judges a unit.

        Raises:
            RowError: If the message can't be used; the error names the reason.
        """
        raw = self.raw(topic, message, stamp)
        if raw is None:
            return []
        row = [stamp, *raw]
        if topic is topics.IMU and not np.isfinite(raw[3:]).all():
            self.remarks.count(topic.ros1, "the acceleration is not a number")
        if self._live is not None and not self._live.take(topic, row, type_of(message)):
            return []
        return [self.scaled(topic, row)]

    def raw(self, topic: Topic, message: RosMessage, stamp: float) -> list[float] | None:
        """Return the numbers of a message in its own unit, None where it says nothing.

        Raises:
            RowError: If the message can't be used.
        """
        kind = type_of(message)
        if topic is topics.FIX:
            return fix_of(message)
        if topic is topics.ENCODERS and kind == _JOINTS:
            return self.joints.speeds(message, stamp)
        if topic is topics.ENCODERS and kind in _TWISTS:
            return self._wheels_of_twist(message, stamp)
        read = _READERS.get((topic, kind))
        if read is None:
            raise RowError(f"expected {' or '.join(accepted_types(topic))}, got {kind}")
        return read(message)

    def scaled(self, topic: Topic, row: list[float]) -> list[float]:
        """Return a row in SI units; a sense that has them already is not touched."""
        units = self.units
        if topic is topics.IMU:
            turn, force = units.angular_velocity, units.acceleration
            row = _times(row, slice(1, 4), turn)
            return _times(row, slice(4, 7), force)
        if topic is topics.ENCODERS:
            return _times(row, slice(1, 3), units.wheels)
        if topic is topics.MAG:
            return _times(row, slice(1, 4), units.magnetic_field)
        return row

    def judge(self, history: History) -> SenseUnits:
        """Return the units of a session by what was sensed, and remark on what is not SI.

        Raises:
            UnitError: If a unit can't be told.
        """
        return judge_history(history, self._robot, self._asked, self.remarks)

    def _wheels_of_twist(self, message: RosMessage, stamp: float) -> list[float] | None:
        """Return wheel speeds [rad/s] of a body twist, by the effective track.

        Raises:
            RowError: If it is no number.
        """
        if type_of(message) == _ODOMETRY:
            twist = self._odometry.twist(message, stamp)
        else:
            part = message
            while hasattr(part, "twist"):
                part = part.twist
            twist = float(part.linear.x), float(part.angular.z)
        if twist is None:
            return None
        if not np.isfinite(twist).all():
            raise RowError("a speed is not a number")
        wheels = self._kinematics.unlimited_wheel_speeds(*twist)
        return [wheels.left, wheels.right]


class _LiveJudge:
    """Judges the units of a live session by what comes first, and again when it has turned."""

    def __init__(self, decoder: MessageDecoder) -> None:
        self._decoder = decoder
        self._judged: set[Topic] = set()
        self._refused: dict[Topic, str] = {}
        self.restart()

    def restart(self) -> None:
        """Begin a new history; what was judged stays."""
        self._history = History()
        self._next = _RECONSIDER

    def take(self, topic: Topic, row: list[float], kind: str) -> bool:
        """Return whether a row may be used: its sense has been judged.

        Raises:
            RowError: If its sense is refused.
        """
        if topic not in ACCEPTED:
            return True
        self._history.add(topic, row, kind)
        if topic not in self._judged:
            self._judge(topic)
            return False
        if topic in self._refused:
            raise RowError(self._refused[topic])
        if topic is topics.IMU and self._history.seconds(topic) > self._next:
            self._next *= 2
            self._judge(None)
        return True

    def _judge(self, topic: Topic | None) -> None:
        """Judge one sense, or all of them, where there is enough of them."""
        history = self._history
        if topic is not None:
            few = history.rows(topic) < _FIRST_ROWS
            if few and (history.seconds(topic) < _FIRST_SECONDS or history.rows(topic) < 3):
                return
            self._judged.add(topic)
            history = history.only(topic)
        try:
            self._decoder.units = self._decoder.judge(history).over(self._decoder.units, topic)
        except UnitError as error:
            self._refused[error.topic] = error.reason


def _times(row: list[float], part: slice, factor: float) -> list[float]:
    """Return a row with a part of it multiplied; by 1 it stays as it is, to the bit."""
    if factor == 1.0:
        return row
    return [*row[: part.start], *(value * factor for value in row[part]), *row[part.stop :]]


def _vector(v: RosMessage, what: str) -> list[float]:
    """Return a vector.

    Raises:
        RowError: If it is no number.
    """
    found = [float(v.x), float(v.y), float(v.z)]
    if not np.isfinite(found).all():
        raise RowError(f"{what} is not a number")
    return found


def _missing(covariance: NDArray[np.float64]) -> bool:
    """Return whether a message says that it has no such measurement: a covariance of -1."""
    return bool(len(covariance) and covariance[0] == -1.0)


def _imu(message: RosMessage) -> list[float]:
    """Return angular velocity and specific force; its orientation is not used.

    Raises:
        RowError: If it has no angular velocity.
    """
    if _missing(message.angular_velocity_covariance):
        raise RowError("it says that it has no angular velocity (covariance -1)")
    turn = _vector(message.angular_velocity, "the angular velocity")
    if _missing(message.linear_acceleration_covariance):
        return [*turn, np.nan, np.nan, np.nan]  # The filter does without.
    force = message.linear_acceleration
    return [*turn, float(force.x), float(force.y), float(force.z)]


def _wheels(message: RosMessage) -> list[float]:
    found = [float(message.left), float(message.right)]
    if not np.isfinite(found).all():
        raise RowError("a wheel's speed is not a number")
    return found


_READERS: dict[tuple[Topic, str], Callable[[Any], list[float]]] = {
    (topics.IMU, topics.IMU.kind): _imu,
    (topics.ENCODERS, topics.ENCODERS.kind): _wheels,
    (topics.MAG, topics.MAG.kind): lambda m: _vector(m.magnetic_field, "the field"),
    (topics.MAG, "geometry_msgs/msg/Vector3Stamped"): lambda m: _vector(m.vector, "the field"),
    (topics.MAG, "geometry_msgs/msg/Vector3"): lambda m: _vector(m, "the field"),
}
