"""Units judged by size: what a sense's numbers are in, before anything believes them.

| quantity | taken as | where the median is |
|---|---|---|
| acceleration, norm | m/s2, g, mg | 7.8 to 11.8, 0.8 to 1.2, 800 to 1200 |
| magnetic field, norm | T, uT, nT, mT, G, mG | 15 to 100 uT in that unit, G to 0.9 |
| magnetic field, else | a direction | 5th to 95th percentile of the norm within 30 % |
| angular velocity | rad/s, deg/s | the compass, else the wheels, turn by 0.5 to 2 of it |
| wheel speeds | rad/s, m/s, rpm, deg/s | the gyro turns by 0.45 to 2.2 of what they tell |

A robot that never turns by more than ``_TURN`` leaves gyro and wheels untold, and they are taken as
the message types say. A gyro that exceeds ``_FASTEST`` is in deg/s all the same. A user's factor
stands above all of it. What fits none is refused.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from andabata.machine.proprioception import GRAVITY
from andabata.machine.robot import RobotModel
from andabata.records import topics
from andabata.records.remarks import Remarks
from andabata.records.topics import Topic
from andabata.records.turning import Turning, slope

Rows = NDArray[np.float64]

QUANTITIES = ("acceleration", "angular_velocity", "magnetic_field", "wheels")
"""What a user may tell the unit of."""

UNITS: dict[str, dict[str, float]] = {
    "acceleration": {"m/s2": 1.0, "g": GRAVITY, "mg": GRAVITY / 1000},
    "angular_velocity": {"rad/s": 1.0, "deg/s": np.pi / 180},
    "magnetic_field": {
        "T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9, "G": 1e-4, "mG": 1e-7,
    },
    "wheels": {"rad/s": 1.0, "rpm": 2 * np.pi / 60, "deg/s": np.pi / 180},
}  # fmt: skip
"""Factors to SI; wheels in m/s take the wheel's radius too."""

_MOST_ROWS = 20_000
"""Rows of a sense by which it is judged: some minutes."""

_WEIGHT = (0.8, 1.2)
"""Share of gravity that accelerations have on average."""

_EARTH = (15e-6, 100e-6)
"""Strength of the Earth's field with what a robot adds or shields [T]; outside it is 22 to 67 uT.
"""

_MOST_GAUSS = 0.9
"""A norm above is that of a unit vector."""

_EVEN = 0.3
"""Spread of the norm, as a share of its median, of a compass that is calibrated."""

_TURN = 0.3
"""Root of the summed squares of the turns in windows by which gyro and wheels are told [rad]."""

_ALIKE = 0.8
"""Correlation from which two senses tell of the same turns."""

_SAME_TURN = (0.5, 2.0)
_SLIP = (0.45, 2.2)
"""Turn of the compass by the gyro's, and of the gyro by the wheels' on whatever ground."""

_FASTEST = 5.0
"""No ground robot turns faster for a twentieth of the time [rad/s]."""

_STUCK_ROWS = 20
"""Rows that must be equal to the bit to be called stuck."""


class UnitError(ValueError):
    """A sense whose unit can't be told.

    Attributes:
        topic: Of the sense.
        reason: What was expected and what came.
    """

    def __init__(self, topic: Topic, reason: str) -> None:
        super().__init__(f"{topic.ros1}: {reason}")
        self.topic, self.reason = topic, reason


@dataclass(frozen=True)
class SenseUnits:
    """Factors from the numbers of a session to SI.

    Attributes:
        acceleration: To m/s2.
        angular_velocity: To rad/s.
        magnetic_field: To T.
        wheels: To rad/s.
    """

    acceleration: float = 1.0
    angular_velocity: float = 1.0
    magnetic_field: float = 1.0
    wheels: float = 1.0

    def over(self, old: "SenseUnits", topic: Topic | None) -> "SenseUnits":
        """Return these units for the sense of a topic, or for all, and the old ones for others."""
        if topic is None:
            return self
        return replace(old, **{name: getattr(self, name) for name in _OF[topic]})


_OF = {
    topics.IMU: ("acceleration", "angular_velocity"),
    topics.MAG: ("magnetic_field",),
    topics.ENCODERS: ("wheels",),
}


@dataclass
class History:
    """The first rows of the senses of a session, in the units in which they came.

    Attributes:
        kinds: Message types by topic.
    """

    kinds: dict[Topic, str] = field(default_factory=dict)
    _rows: dict[Topic, list[list[float]]] = field(default_factory=dict)

    def add(self, topic: Topic, row: list[float], kind: str) -> None:
        """Remember a row: stamp [s] and numbers."""
        self.kinds[topic] = kind
        rows = self._rows.setdefault(topic, [])
        if len(rows) < _MOST_ROWS:
            rows.append(row)

    def rows(self, topic: Topic) -> int:
        """Return the number of rows of a sense."""
        return len(self._rows.get(topic, ()))

    def seconds(self, topic: Topic) -> float:
        """Return the time that the rows of a sense span [s]."""
        rows = self._rows.get(topic)
        return rows[-1][0] - rows[0][0] if rows else 0.0

    def only(self, topic: Topic) -> "History":
        """Return the history of one sense alone."""
        return History({topic: self.kinds[topic]}, {topic: self._rows[topic]})

    def array(self, topic: Topic) -> Rows | None:
        """Return the rows of a sense in order of time, shape (k, width), None without any."""
        rows = self._rows.get(topic)
        if not rows:
            return None
        found = np.array(rows, dtype=np.float64)
        return found[np.argsort(found[:, 0], kind="stable")]


def judge_history(
    history: History,
    robot: RobotModel,
    asked: Mapping[str, float],
    remarks: Remarks,
    earth: float = 48e-6,
) -> SenseUnits:
    """Return the units of a session by what was sensed, and remark on what is not SI.

    Args:
        history: What was sensed.
        robot: Wheel radius and track.
        asked: Factors that the user tells, by quantity.
        remarks: Where to write down what was found.
        earth: Strength of the Earth's field for a compass that tells a direction alone [T].

    Raises:
        UnitError: If a unit can't be told, or a sense is stuck.
    """
    imu, field_rows = history.array(topics.IMU), history.array(topics.MAG)
    wheels = history.array(topics.ENCODERS)
    units = SenseUnits(**asked)
    if imu is not None and "acceleration" not in asked:
        units = replace(units, acceleration=_acceleration(imu[:, 4:7], remarks))
    if field_rows is not None and "magnetic_field" not in asked:
        units = replace(units, magnetic_field=_magnetic(field_rows[:, 1:4], earth, remarks))
    if imu is None:
        return units
    turning = Turning.of(imu, field_rows, wheels, robot)
    _refuse_stuck(turning, imu, field_rows, wheels)
    if "angular_velocity" not in asked:
        units = replace(units, angular_velocity=_angular(turning, imu[:, 1:4], remarks))
    if wheels is not None:
        turning = turning.scaled(units.angular_velocity, units.wheels)
        factor = _wheels(turning, wheels, history.kinds[topics.ENCODERS], robot, asked, remarks)
        units = replace(units, wheels=units.wheels * factor)
    return units


def _median_norm(vectors: Rows) -> tuple[float, float]:
    """Return the median length of vectors and the spread of nine tenths of them."""
    norms = np.linalg.norm(vectors[np.isfinite(vectors).all(axis=1)], axis=1)
    if not len(norms):
        return np.nan, np.nan
    low, middle, high = np.percentile(norms, [5, 50, 95])
    return float(middle), float(high - low)


def _acceleration(vectors: Rows, remarks: Remarks) -> float:
    """Return the factor of accelerations to m/s2: at rest and on average they are gravity.

    Raises:
        UnitError: If they are none.
    """
    norm, _ = _median_norm(vectors)
    if np.isnan(norm):
        remarks.note(topics.IMU.ros1, "no accelerations: the tilt is the gyro's alone")
        return 1.0
    for name, factor in UNITS["acceleration"].items():
        if _WEIGHT[0] < norm * factor / GRAVITY < _WEIGHT[1]:
            if factor != 1.0:
                remarks.note(topics.IMU.ros1, f"accelerations of {norm:.4g} are taken as {name}")
            return factor
    without = " (gravity has been taken off)" if norm < 0.5 else ""
    raise UnitError(
        topics.IMU,
        f"expected accelerations around 9.8 m/s2, 1 g or 1000 mg, got {norm:.4g}{without}; map the "
        "topic of the raw ones, or tell the factor: --unit acceleration=g or a number",
    )


def _magnetic(vectors: Rows, earth: float, remarks: Remarks) -> float:
    """Return the factor of a magnetic field to tesla.

    Raises:
        UnitError: If it is none.
    """
    norm, spread = _median_norm(vectors)
    uneven = spread / norm if norm > 0 else np.inf
    unit_vector = _MOST_GAUSS < norm < 1.1 and uneven < 0.01
    for name, factor in UNITS["magnetic_field"].items():
        plain = _EARTH[0] < norm * factor < _EARTH[1]
        if plain and not (name == "G" and (norm > _MOST_GAUSS or unit_vector)):
            if factor != 1.0:
                remarks.note(topics.MAG.ros1, f"a field of {norm:.4g} is taken as {name}")
            return factor
    if np.isfinite(norm) and uneven < _EVEN:
        remarks.note(
            topics.MAG.ros1,
            f"a field of {norm:.4g} is in no known unit: only its direction is used",
        )
        return earth / norm
    raise UnitError(
        topics.MAG,
        f"expected a field of 22 to 67 uT (or in T, nT, mT, G, mG, or a direction), got {norm:.4g} "
        f"with {100 * uneven:.0f} % of spread; calibrate the compass, or tell the factor: --unit "
        "magnetic_field=uT or a number",
    )


def _refuse_stuck(turning: Turning, imu: Rows, compass: Rows | None, wheels: Rows | None) -> None:
    """Refuse a sense that repeats the same numbers while two others tell of a turn.

    Raises:
        UnitError: If there is such a one.
    """
    for topic, rows, others in (
        (topics.IMU, imu[:, :4], (turning.compass, turning.wheels)),
        (topics.MAG, compass, (turning.gyro, turning.wheels)),
        (topics.ENCODERS, wheels, (turning.gyro, turning.compass)),
    ):
        if rows is None or len(rows) < _STUCK_ROWS or (rows[1:, 1:] != rows[0, 1:]).any():
            continue
        if slope(*others, _TURN, _ALIKE) is not None:
            values = ", ".join(f"{value:.4g}" for value in rows[0, 1:])
            raise UnitError(
                topic,
                f"expected numbers that change while the robot turns, got {values} in all of "
                f"{len(rows)} messages; the sensor or its driver is stuck, map another topic",
            )


def _angular(turning: Turning, vectors: Rows, remarks: Remarks) -> float:
    """Return the factor of angular velocities to rad/s.

    Raises:
        UnitError: If the compass tells of turns that are neither.
    """
    degree = UNITS["angular_velocity"]["deg/s"]
    odd = None
    # The compass turns the other way where it is mounted upside down: only the size counts.
    for name, other, band in (
        ("compass turns", turning.compass, _SAME_TURN),
        ("wheels turn", turning.wheels, _SLIP),
    ):
        found = slope(turning.gyro, other, _TURN, _ALIKE)
        if found is None:
            continue
        size = abs(found)
        if band[0] < size < band[1]:
            return 1.0
        if band[0] < size / degree < band[1]:
            text = f"angular velocities are taken as deg/s: the {name} by {size:.3f} of them"
            remarks.note(topics.IMU.ros1, text)
            return degree
        if name.startswith("compass"):  # Wheels may have a unit of their own.
            odd = size
    if odd is not None:
        raise UnitError(
            topics.IMU,
            f"expected angular velocities in rad/s or deg/s, got some of which the compass turns by"
            f" {odd:.3g}; tell the factor: --unit angular_velocity=deg/s or a number",
        )
    fast = float(np.nanpercentile(np.linalg.norm(vectors, axis=1), 95))
    if fast > _FASTEST:
        if fast * degree > _FASTEST:
            raise UnitError(
                topics.IMU,
                f"expected angular velocities in rad/s or deg/s, got {fast:.4g}; tell the factor: "
                "--unit angular_velocity=deg/s or a number",
            )
        remarks.note(topics.IMU.ros1, f"angular velocities of {fast:.4g} are taken as deg/s")
        return degree
    return 1.0


def _wheels(
    turning: Turning,
    rows: Rows,
    kind: str,
    robot: RobotModel,
    asked: Mapping[str, float],
    remarks: Remarks,
) -> float:
    """Return the factor of wheel speeds to rad/s, and say where they turn the other way.

    Raises:
        UnitError: If the gyro tells of turns that fit no unit.
    """
    name = topics.ENCODERS.ros1
    found = slope(turning.wheels, turning.gyro, _TURN, _ALIKE)
    backwards = found is not None and found < 0 and float(np.nanmean(rows[:, 1:3])) < 0
    sign = -1.0 if backwards and "wheels" not in asked else 1.0
    if found is not None and found < 0:
        how = (
            "they are counted backwards and turned round"
            if backwards
            else "left and right are swapped (only their mean is used)"
        )
        remarks.note(name, f"the wheels tell of turns against the gyro's: {how}")
    told = "wheels" in asked or not _names_no_unit(kind)
    if found is None:
        fast = float(np.nanpercentile(np.abs(rows[:, 1:3]), 95))
        if not told and fast > 3 * robot.max_wheel_speed:
            raise UnitError(
                topics.ENCODERS,
                f"expected wheel speeds in rad/s up to {robot.max_wheel_speed:.4g}, got {fast:.4g};"
                " tell the factor: --unit wheels=rpm or a number",
            )
        return 1.0
    units = {**UNITS["wheels"], "m/s": 1 / robot.wheel_radius}
    fitting = [u for u, factor in units.items() if _SLIP[0] < abs(found) / factor < _SLIP[1]]
    if "rad/s" in fitting:
        return sign
    if told or not fitting:
        text = f"the gyro turns by {abs(found):.3g} of what the wheels tell"
        if told:
            remarks.note(name, f"{text}; --robot and --set robot.wheel_radius tell of the body")
            return sign
        raise UnitError(
            topics.ENCODERS,
            f"expected wheel speeds in rad/s, m/s, rpm or deg/s, but {text}; tell the factor: "
            "--unit wheels=rpm or a number",
        )
    remarks.note(
        name, f"wheel speeds are taken as {fitting[0]}: the gyro turns by {abs(found):.3g} of them"
    )
    return sign * units[fitting[0]]


def _names_no_unit(kind: str) -> bool:
    """Return whether a type of message leaves room for another unit: a twist is in m/s."""
    return kind in (topics.ENCODERS.kind, "sensor_msgs/msg/JointState")


def factor_of(quantity: str, unit: str, robot: RobotModel) -> float:
    """Return the factor to SI of a unit's name, or of a number.

    Raises:
        ValueError: If there is no such quantity or unit.
    """
    if quantity not in QUANTITIES:
        raise ValueError(f"--unit: expected one of {', '.join(QUANTITIES)}, got {quantity}")
    known = dict(UNITS[quantity])
    if quantity == "wheels":
        known["m/s"] = 1 / robot.wheel_radius
    if unit in known:
        return known[unit]
    try:
        factor = float(unit)
    except ValueError:
        factor = np.nan
    if not (np.isfinite(factor) and factor > 0):
        raise ValueError(
            f"--unit {quantity}: expected one of {', '.join(known)} or a positive factor to SI, "
            f"got {unit}"
        )
    return factor
