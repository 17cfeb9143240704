"""Decoding of messages into readings: rows of numbers in SI units.

Messages of all ``accepted_types`` are read; any other type is refused by naming both. The unit of a
sensor is inferred by the size of its numbers (``unit_inference``): once for a recording, and as
soon as possible in a live session (``live_unit_inference``).
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel
from andabata.records import topics
from andabata.records.decoding.accepted_types import (
    JOINT_STATE,
    ODOMETRY,
    TWISTS,
    VECTOR,
    VECTOR_STAMPED,
    accepted_types,
    message_type,
)
from andabata.records.decoding.live_unit_inference import LiveUnitInference
from andabata.records.decoding.row_history import RowHistory
from andabata.records.decoding.unit_inference import infer_units
from andabata.records.decoding.units import UnitFactors
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.decoding.wheel_speeds import JointFacts, JointSpeeds, OdometryTwist
from andabata.records.messages import UNKNOWN_STATUS, fix_of
from andabata.records.remarks import Remarks
from andabata.records.topics import RosMessage, Topic

_GYRO = slice(1, 4)
_FORCE = slice(4, 7)
_WHEELS = slice(1, 3)
_LEFT, _RIGHT = slice(1, 2), slice(2, 3)
_FIELD = slice(1, 4)
"""Columns of the quantities in a row, whose first is the stamp."""

_NO_STATUS = f"the status was never set ({UNKNOWN_STATUS}): used by its numbers"


class MessageDecoder:
    """Decodes the messages of one recording or live session into rows in SI units.

    Attributes:
        remarks: Remarks on corrections and refusals.
        joints: Reader of joint states.
    """

    def __init__(
        self,
        robot: RobotModel | None = None,
        units: UnitFactors | None = None,
        remarks: Remarks | None = None,
        given: Mapping[str, float] | None = None,
        joints: JointFacts | None = None,
    ) -> None:
        """Create a decoder for a session.

        Args:
            robot: Robot whose wheel radius and track turn a twist into wheel speeds.
            units: Factors that were inferred from a whole recording; None infers them from the
                first readings.
            remarks: Destination of remarks.
            given: Factors to SI that the user gives, by quantity; see ``units``.
            joints: Facts about the joint states of a recording that was read before.
        """
        self._robot = robot or RobotModel()
        self.remarks = remarks if remarks is not None else Remarks()
        self._kinematics = SkidSteer(self._robot)
        self._units = units or UnitFactors()
        self._given = given or {}
        self.joints = JointSpeeds(self.remarks, topics.ENCODERS.ros1, joints)
        self._live = LiveUnitInference(self._infer, self._units) if units is None else None
        self.restart()

    @property
    def robot(self) -> RobotModel:
        """Robot that the readings are of."""
        return self._robot

    @property
    def is_live(self) -> bool:
        """True in a live session, whose readings are not known before they come."""
        return self._live is not None

    @property
    def units(self) -> UnitFactors:
        """Factors to SI; in a live session those of the sensors that were inferred so far."""
        return self._units if self._live is None else self._live.units

    def restart(self) -> None:
        """Forget earlier messages, as times count from another epoch; units are kept."""
        self.joints = JointSpeeds(self.remarks, topics.ENCODERS.ros1, self.joints.facts)
        self._odometry = OdometryTwist(self.remarks, topics.ENCODERS.ros1)
        if self._live is not None:
            self._live.restart()

    def rows(self, topic: Topic, message: RosMessage, stamp: float) -> list[list[float]]:
        """Return the rows of a message: stamp [s] and numbers as in ``SensorReadings``.

        There are none in a message without readings of the sensor, and in those by which a live
        session infers a unit.

        Args:
            topic: Topic of the message.
            message: Message to decode.
            stamp: Time of the message [s].

        Raises:
            UnusableMessageError: If the message cannot be used; its text is the reason.
        """
        raw = self.raw(topic, message, stamp)
        if raw is None:
            return []
        row = [stamp, *raw]
        if topic is topics.IMU and not np.isfinite(raw[3:]).all():
            self.remarks.count(topic.ros1, "the acceleration is not a number")
        if topic is topics.FIX and int(message.status.status) == UNKNOWN_STATUS:
            self.remarks.count(topic.ros1, _NO_STATUS, stamp)
        if self._live is not None and not self._live.accept(topic, row, message_type(message)):
            return []
        return [self.scaled(topic, row)]

    def raw(self, topic: Topic, message: RosMessage, stamp: float) -> list[float] | None:
        """Return the numbers of a message in its own unit, None without readings; see ``rows``.

        Raises:
            UnusableMessageError: If the message cannot be used.
        """
        kind = message_type(message)
        if topic is topics.FIX:
            return fix_of(message)
        if topic is topics.ENCODERS and kind == JOINT_STATE:
            return self.joints.speeds(message, stamp)
        if topic is topics.ENCODERS and kind in TWISTS:
            return self._wheels_of_twist(message, stamp)
        read = _READERS.get((topic, kind))
        if read is None:
            raise UnusableMessageError(f"expected {' or '.join(accepted_types(topic))}, got {kind}")
        return read(message)

    def scaled(self, topic: Topic, row: list[float]) -> list[float]:
        """Return a row in SI units; one that is in SI already is returned as it is."""
        units = self.units
        if topic is topics.IMU:
            row = _times(row, _GYRO, units.angular_velocity)
            return _times(row, _FORCE, units.acceleration)
        if topic is topics.ENCODERS:
            row = _times(row, _WHEELS, units.wheels)
            row = _times(row, _LEFT, units.left_sign)
            return _times(row, _RIGHT, units.right_sign)
        if topic is topics.MAG:
            return _times(row, _FIELD, units.magnetic_field)
        return row

    def _infer(self, history: RowHistory) -> UnitFactors:
        """Return the units of a session by its first readings, and remark on what is not SI."""
        return infer_units(history, self._robot, self._given, self.remarks)

    def _wheels_of_twist(self, message: RosMessage, stamp: float) -> list[float] | None:
        """Return wheel speeds of a body twist, by the effective track [rad/s].

        Raises:
            UnusableMessageError: If a speed is not a number.
        """
        if message_type(message) == ODOMETRY:
            twist = self._odometry.twist(message, stamp)
        else:
            part = message
            while hasattr(part, "twist"):
                part = part.twist
            twist = float(part.linear.x), float(part.angular.z)
        if twist is None:
            return None
        if not np.isfinite(twist).all():
            raise UnusableMessageError("a speed is not a number")
        wheels = self._kinematics.unlimited_wheel_speeds(*twist)
        return [wheels.left, wheels.right]


def _times(row: list[float], part: slice, factor: float) -> list[float]:
    """Return a row with a part of it multiplied; by 1 it stays as it is, to the bit."""
    if factor == 1.0:
        return row
    return [*row[: part.start], *(value * factor for value in row[part]), *row[part.stop :]]


def _vector(v: RosMessage, name: str) -> list[float]:
    """Return the components of a vector.

    Raises:
        UnusableMessageError: If one is not a number.
    """
    components = [float(v.x), float(v.y), float(v.z)]
    if not np.isfinite(components).all():
        raise UnusableMessageError(f"{name} is not a number")
    return components


def _is_missing(covariance: NDArray[np.float64]) -> bool:
    """Return whether a covariance marks a measurement as missing: its first element is -1."""
    return bool(len(covariance) and covariance[0] == -1.0)


def _imu(message: RosMessage) -> list[float]:
    """Return angular velocity and specific force; the orientation is not used.

    Raises:
        UnusableMessageError: If it has no angular velocity.
    """
    if _is_missing(message.angular_velocity_covariance):
        raise UnusableMessageError("expected an angular velocity, got none: its covariance is -1")
    angular_velocity = _vector(message.angular_velocity, "the angular velocity")
    if _is_missing(message.linear_acceleration_covariance):
        return [*angular_velocity, np.nan, np.nan, np.nan]  # The filter does without.
    force = message.linear_acceleration
    return [*angular_velocity, float(force.x), float(force.y), float(force.z)]


def _wheels(message: RosMessage) -> list[float]:
    """Return left and right wheel speed.

    Raises:
        UnusableMessageError: If one is not a number.
    """
    speeds = [float(message.left), float(message.right)]
    if not np.isfinite(speeds).all():
        raise UnusableMessageError("a wheel's speed is not a number")
    return speeds


_READERS: dict[tuple[Topic, str], Callable[[Any], list[float]]] = {
    (topics.IMU, topics.IMU.kind): _imu,
    (topics.ENCODERS, topics.ENCODERS.kind): _wheels,
    (topics.MAG, topics.MAG.kind): lambda m: _vector(m.magnetic_field, "the field"),
    (topics.MAG, VECTOR_STAMPED): lambda m: _vector(m.vector, "the field"),
    (topics.MAG, VECTOR): lambda m: _vector(m, "the field"),
}
