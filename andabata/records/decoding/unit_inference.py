"""Inference of units and signs: which unit the numbers of a sensor are in, by their size.

| quantity | unit | condition on the median |
|---|---|---|
| acceleration, norm | m/s2, g, mg | 7.8 to 11.8, 0.8 to 1.2, 800 to 1200 |
| magnetic field, norm | T, uT, nT, mT, G, mG | 15 to 100 uT in that unit, G to 0.9 |
| magnetic field, else | a direction | 5th to 95th percentile of the norm within 30 % |
| angular velocity | rad/s, deg/s | the compass, else the wheels, turn by 0.5 to 2 of it |
| wheel speeds | rad/s, m/s, rpm, deg/s | the gyro turns by 0.45 to 2.2 of theirs |

Without turns of more than ``MIN_TURN`` the units of gyro and wheels cannot be inferred, and those
of the message types are assumed. A gyro faster than ``_MAX_YAW_RATE`` is in deg/s all the same. A
factor of the user outranks all of it. Numbers that fit no unit are refused.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from andabata.machine.proprioception import GRAVITY
from andabata.machine.robot import RobotModel
from andabata.records import topics
from andabata.records.decoding.accepted_types import JOINT_STATE
from andabata.records.decoding.row_history import RowHistory
from andabata.records.decoding.units import UNITS, UnitError, UnitFactors, units_of
from andabata.records.decoding.wheel_signs import (
    MIN_CORRELATION,
    MIN_TURN,
    is_force_negated,
    mirrored_side,
)
from andabata.records.decoding.wheel_zeros import MOST, zeros_between
from andabata.records.decoding.yaw_increments import YawIncrements, fitted_slope
from andabata.records.remarks import Remarks

Rows = NDArray[np.float64]

_GRAVITY_SHARE = (0.8, 1.2)
"""Bounds of the median acceleration, as a share of gravity."""

_EARTH_FIELD = (15e-6, 100e-6)
"""Bounds of the Earth's field with the robot's own disturbance [T]; undisturbed it is 22 to 67 uT.
"""

_MAX_GAUSS = 0.9
"""Largest norm that is taken as gauss; above, it is that of a unit vector."""

_UNIT_NORM = 1.1
"""Largest norm of a unit vector."""

_UNIT_SPREAD = 0.01
"""Largest spread of the norm of unit vectors, as a share of its median."""

_MAX_SPREAD = 0.3
"""Largest spread of the norm of a calibrated compass, as a share of its median."""

_COMPASS_BY_GYRO = (0.5, 2.0)
"""Bounds of the compass's turn as a share of the gyro's."""

_GYRO_BY_WHEELS = (0.45, 2.2)
"""Bounds of the gyro's turn as a share of the wheels', on any ground."""

_MAX_YAW_RATE = 5.0
"""Largest 95th percentile of a ground robot's angular velocity [rad/s]."""

_MAX_WHEEL_SPEED_SHARE = 3
"""Largest 95th percentile of wheel speeds, as a share of the robot's limit."""

_MOVING_SHARE = 0.1
"""Share of the median wheel speed from which the wheels turn."""

_STUCK_ROWS = 20
"""Number of rows equal to the bit from which a sensor counts as stuck."""


def infer_units(
    history: RowHistory,
    robot: RobotModel,
    given: Mapping[str, float],
    remarks: Remarks,
    earth_field: float = 48e-6,
) -> UnitFactors:
    """Return the units of a session by its first readings, and remark on what is not SI.

    Args:
        history: First readings in the units in which they came.
        robot: Robot with the wheel radius and track.
        given: Factors to SI that the user gives, by quantity.
        remarks: Destination of remarks.
        earth_field: Strength of the Earth's field for a compass that holds a direction alone [T].

    Raises:
        UnitError: If a unit cannot be inferred, or a sensor is stuck.
    """
    imu, compass = history.array(topics.IMU), history.array(topics.MAG)
    wheels = _without_zeros(history.array(topics.ENCODERS))
    units = UnitFactors(**given)
    if imu is not None and "acceleration" not in given:
        units = replace(units, acceleration=_acceleration_factor(imu[:, 4:7], remarks))
    if compass is not None and "magnetic_field" not in given:
        factor = _field_factor(compass[:, 1:4], earth_field, remarks)
        units = replace(units, magnetic_field=factor)
    if imu is None:
        return units
    turns = YawIncrements.from_rows(imu, compass, wheels, robot)
    _refuse_stuck(turns, imu, compass, wheels)
    if "angular_velocity" not in given:
        units = replace(units, angular_velocity=_gyro_factor(turns, imu[:, 1:4], remarks))
    if wheels is None:
        return units
    units, wheels = _with_side_signs(units, imu, wheels, robot, remarks)
    turns = YawIncrements.from_rows(imu, compass, wheels, robot)
    turns = turns.scaled(units.angular_velocity, units.wheels)
    slope = fitted_slope(turns.wheels, turns.gyro, MIN_TURN, MIN_CORRELATION)
    if "acceleration" not in given and is_force_negated(slope, imu[:, 4:7]):
        text = "accelerations have the wrong sign: with it the gyro turns against the wheels"
        remarks.note(topics.IMU.ros1, f"{text}; they are reversed")
        units = replace(units, acceleration=-units.acceleration)
    if units.acceleration < 0:  # Yaw increments count about the vertical as it was measured.
        turns = turns.scaled(-1.0, 1.0)
    has_unit = "wheels" in given or not _is_unitless(history.kinds[topics.ENCODERS])
    sign = _wheel_sign(turns, wheels, "wheels" in given, remarks)
    size = _wheel_factor(turns, wheels, has_unit, robot, remarks)
    return replace(units, wheels=units.wheels * (sign * size))


def _without_zeros(wheels: Rows | None) -> Rows | None:
    """Return wheel speeds without damaged messages and the zeros of another publisher."""
    if wheels is None:
        return None
    wheels = wheels[np.abs(wheels[:, 1:3]).max(axis=1) < MOST]
    if not len(wheels):
        return wheels
    usual = float(np.nanmedian(np.abs(wheels[:, 1:3]).max(axis=1)))
    return wheels[~zeros_between(wheels, _MOVING_SHARE * usual)]


def _with_side_signs(
    units: UnitFactors, imu: Rows, wheels: Rows, robot: RobotModel, remarks: Remarks
) -> tuple[UnitFactors, Rows]:
    """Return units and wheel speeds with the sign of a side that is mounted mirrored.

    Args:
        units: Units so far, with that of the gyro.
        imu: Stamp, angular velocity and specific force, shape (k, 7).
        wheels: Stamp, left and right wheel speed, shape (k, 3).
        robot: Robot with the wheel radius and track.
        remarks: Destination of remarks.
    """
    turns, mirrored = (
        YawIncrements.from_rows(imu, None, rows, robot).scaled(units.angular_velocity, 1.0)
        for rows in (wheels, wheels * (1.0, 1.0, -1.0))
    )
    side = mirrored_side(turns, mirrored, wheels)
    if side is None:
        return units, wheels
    name = ("left", "right")[side]
    text = f"the {name} wheels turn backwards where the robot drives ahead, as the gyro shows"
    remarks.note(topics.ENCODERS.ros1, f"{text}: they are reversed")
    signs = {f"{name}_sign": -1.0}
    return replace(units, **signs), wheels * (1.0, 1.0 - 2.0 * (side == 0), 1.0 - 2.0 * (side == 1))


def _median_norm(vectors: Rows) -> tuple[float, float]:
    """Return the median norm of vectors, and the spread of nine tenths of the norms."""
    norms = np.linalg.norm(vectors[np.isfinite(vectors).all(axis=1)], axis=1)
    if not len(norms):
        return np.nan, np.nan
    low, middle, high = np.percentile(norms, [5, 50, 95])
    return float(middle), float(high - low)


def _acceleration_factor(vectors: Rows, remarks: Remarks) -> float:
    """Return the factor of accelerations to m/s2: at rest and on average they are gravity.

    Raises:
        UnitError: If they are gravity in no unit.
    """
    norm, _ = _median_norm(vectors)
    if np.isnan(norm):
        remarks.note(topics.IMU.ros1, "no accelerations: the tilt is the gyro's alone")
        return 1.0
    for name, factor in UNITS["acceleration"].items():
        if _GRAVITY_SHARE[0] < norm * factor / GRAVITY < _GRAVITY_SHARE[1]:
            if factor != 1.0:
                remarks.note(topics.IMU.ros1, f"accelerations of {norm:.4g} are taken as {name}")
            return factor
    without = " (gravity was subtracted)" if norm < 0.5 else ""
    raise UnitError(
        topics.IMU,
        f"expected accelerations around 9.8 m/s2, 1 g or 1000 mg, got {norm:.4g}{without}; map the "
        "topic of the raw ones, or give the factor: --unit acceleration=g or a number",
    )


def _field_factor(vectors: Rows, earth_field: float, remarks: Remarks) -> float:
    """Return the factor of a magnetic field to tesla.

    Raises:
        UnitError: If it is the Earth's in no unit, and no steady direction.
    """
    norm, spread = _median_norm(vectors)
    uneven = spread / norm if norm > 0 else np.inf
    unit_vector = _MAX_GAUSS < norm < _UNIT_NORM and uneven < _UNIT_SPREAD
    for name, factor in UNITS["magnetic_field"].items():
        plausible = _EARTH_FIELD[0] < norm * factor < _EARTH_FIELD[1]
        # 0.9 to 1 G is as large as a unit vector, and larger than any undisturbed field.
        if plausible and not (name == "G" and (norm > _MAX_GAUSS or unit_vector)):
            if factor != 1.0:
                remarks.note(topics.MAG.ros1, f"a field of {norm:.4g} is taken as {name}")
            return factor
    if np.isfinite(norm) and uneven < _MAX_SPREAD:
        remarks.note(
            topics.MAG.ros1,
            f"a field of {norm:.4g} is in no known unit: only its direction is used",
        )
        return earth_field / norm
    raise UnitError(
        topics.MAG,
        f"expected a field of 22 to 67 uT (or in T, nT, mT, G, mG, or a direction), got {norm:.4g} "
        f"with {100 * uneven:.0f} % of spread; calibrate the compass, or give the factor: --unit "
        "magnetic_field=uT or a number",
    )


def _refuse_stuck(
    turns: YawIncrements, imu: Rows, compass: Rows | None, wheels: Rows | None
) -> None:
    """Refuse a sensor that repeats the same numbers while two others measure a turn.

    Raises:
        UnitError: If there is such a sensor.
    """
    for topic, rows, others in (
        (topics.IMU, imu[:, :4], (turns.compass, turns.wheels)),
        (topics.MAG, compass, (turns.gyro, turns.wheels)),
        (topics.ENCODERS, wheels, (turns.gyro, turns.compass)),
    ):
        if rows is None or len(rows) < _STUCK_ROWS or (rows[1:, 1:] != rows[0, 1:]).any():
            continue
        if fitted_slope(*others, MIN_TURN, MIN_CORRELATION) is not None:
            values = ", ".join(f"{value:.4g}" for value in rows[0, 1:])
            raise UnitError(
                topic,
                f"expected numbers that change while the robot turns, got {values} in all of "
                f"{len(rows)} messages; the sensor or its driver is stuck, map another topic",
            )


def _gyro_factor(turns: YawIncrements, vectors: Rows, remarks: Remarks) -> float:
    """Return the factor of angular velocities to rad/s.

    Raises:
        UnitError: If the compass contradicts both units, or the gyro is too fast for both.
    """
    degree = UNITS["angular_velocity"]["deg/s"]
    compass_ratio = None
    # The compass turns the other way where it is mounted upside down: only the size counts.
    for name, other, bounds in (
        ("compass turns", turns.compass, _COMPASS_BY_GYRO),
        ("wheels turn", turns.wheels, _GYRO_BY_WHEELS),
    ):
        slope = fitted_slope(turns.gyro, other, MIN_TURN, MIN_CORRELATION)
        if slope is None:
            continue
        ratio = abs(slope)
        if bounds[0] < ratio < bounds[1]:
            return 1.0
        if bounds[0] < ratio / degree < bounds[1]:
            text = f"angular velocities are taken as deg/s: the {name} by {ratio:.3f} of them"
            remarks.note(topics.IMU.ros1, text)
            return degree
        if name.startswith("compass"):  # Wheels may have a unit of their own.
            compass_ratio = ratio
    if compass_ratio is not None:
        raise UnitError(
            topics.IMU,
            "expected angular velocities in rad/s or deg/s, got some of which the compass turns by"
            f" {compass_ratio:.3g}; give the factor: --unit angular_velocity=deg/s or a number",
        )
    return _gyro_factor_by_size(vectors, remarks)


def _gyro_factor_by_size(vectors: Rows, remarks: Remarks) -> float:
    """Return the factor to rad/s of a gyro that nothing is compared with.

    Raises:
        UnitError: If it is too fast in either unit.
    """
    degree = UNITS["angular_velocity"]["deg/s"]
    fast = float(np.nanpercentile(np.linalg.norm(vectors, axis=1), 95))
    if not fast > _MAX_YAW_RATE:  # NaN, of a gyro without a number, is no reason to convert.
        return 1.0
    if fast * degree > _MAX_YAW_RATE:
        raise UnitError(
            topics.IMU,
            f"expected angular velocities in rad/s or deg/s, got {fast:.4g}; give the factor: "
            "--unit angular_velocity=deg/s or a number",
        )
    remarks.note(topics.IMU.ros1, f"angular velocities of {fast:.4g} are taken as deg/s")
    return degree


def _wheel_sign(turns: YawIncrements, rows: Rows, is_given: bool, remarks: Remarks) -> float:
    """Return -1 for wheels that count backwards, else 1; swapped sides are only remarked on.

    Args:
        turns: Yaw increments, gyro and wheels in SI.
        rows: Stamp, left and right wheel speed, shape (k, 3).
        is_given: True if the user gives the factor, sign included.
        remarks: Destination of remarks.
    """
    slope = fitted_slope(turns.wheels, turns.gyro, MIN_TURN, MIN_CORRELATION)
    if slope is None or slope >= 0:
        return 1.0
    backwards = float(np.nanmean(rows[:, 1:3])) < 0
    action = (
        "they are counted backwards and reversed"
        if backwards
        else "left and right are swapped (only their mean is used)"
    )
    text = f"the wheels turn against the gyro: {action}"
    remarks.note(topics.ENCODERS.ros1, text)
    return -1.0 if backwards and not is_given else 1.0


def _wheel_factor(
    turns: YawIncrements, rows: Rows, has_unit: bool, robot: RobotModel, remarks: Remarks
) -> float:
    """Return the factor of wheel speeds to rad/s, without its sign.

    Args:
        turns: Yaw increments, gyro and wheels in SI.
        rows: Stamp, left and right wheel speed, shape (k, 3).
        has_unit: True if the user or the message type names the unit.
        robot: Robot with the wheel radius and track.
        remarks: Destination of remarks.

    Raises:
        UnitError: If the gyro's turns fit no unit, or the wheels are too fast.
    """
    slope = fitted_slope(turns.wheels, turns.gyro, MIN_TURN, MIN_CORRELATION)
    if slope is None:
        fast = float(np.nanpercentile(np.abs(rows[:, 1:3]), 95))
        if not has_unit and fast > _MAX_WHEEL_SPEED_SHARE * robot.max_wheel_speed:
            raise UnitError(
                topics.ENCODERS,
                f"expected wheel speeds in rad/s up to {robot.max_wheel_speed:.4g}, got {fast:.4g};"
                " give the factor: --unit wheels=rpm or a number",
            )
        return 1.0
    ratio = abs(slope)
    fitting = {
        unit: factor
        for unit, factor in units_of("wheels", robot).items()
        if _GYRO_BY_WHEELS[0] < ratio / factor < _GYRO_BY_WHEELS[1]
    }
    if "rad/s" in fitting:
        return 1.0
    name, text = topics.ENCODERS.ros1, f"the gyro turns by {ratio:.3g} of what the wheels report"
    if has_unit:
        remarks.note(name, f"{text}; check the body: --robot and --set robot.wheel_radius")
        return 1.0
    if not fitting:
        raise UnitError(
            topics.ENCODERS,
            f"expected wheel speeds in rad/s, m/s, rpm or deg/s, but {text}; give the factor: "
            "--unit wheels=rpm or a number",
        )
    unit, factor = next(iter(fitting.items()))
    remarks.note(name, f"wheel speeds are taken as {unit}: the gyro turns by {ratio:.3g} of them")
    return factor


def _is_unitless(kind: str) -> bool:
    """Return whether a message type leaves the unit of wheel speeds open: a twist is in m/s."""
    return kind in (topics.ENCODERS.kind, JOINT_STATE)
