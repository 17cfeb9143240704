"""Filter over a period: predictions from inertial row to inertial row, corrections in between.

Dead reckoning, which no correction changes, advances with them.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_parameters import BodyParameters, FilterModel
from andabata.localization.filter_state import (
    ACCEL_BIAS_X,
    ACCEL_BIAS_Y,
    GYRO_BIAS_X,
    GYRO_BIAS_Y,
    GYRO_BIAS_Z,
    LATERAL_SPEED,
    PITCH,
    ROLL,
    SLOPE_SLIP,
    SPEED,
    WHEEL_SCALE,
)
from andabata.localization.measurement_models import (
    correct_gnss,
    correct_gravity,
    correct_heading,
    correct_wheels,
    correct_zero_rate,
)
from andabata.localization.measurements import (
    FORCE,
    GYRO,
    LEFT,
    MAX_GYRO_RATE,
    RIGHT,
    STAMP,
    STAMP_TOLERANCE,
    Measurements,
)
from andabata.localization.process_model import predict
from andabata.localization.sigma_points import Workspace
from andabata.localization.ukf import wrap_angle
from terrain.kernel import borrowing_kernel

IMU, WHEELS, GRAVITY_UPDATE, COMPASS, GNSS, ZERO_RATE = range(6)
"""Rows of the table of counts, one per kind of measurement."""

SENSORS = ("imu", "wheels", "gravity", "compass", "gnss", "zero_rate")
"""Names of these rows."""

ACCEPTED, GATED, REJECTED, DISTURBED = range(4)
"""Columns of the table of counts: accepted, beyond the gate, invalid, a field that is not the
Earth's."""

OUTCOMES = 4
"""Number of these columns."""

_CONSIDERED = np.array(
    [
        ROLL,
        PITCH,
        GYRO_BIAS_X,
        GYRO_BIAS_Y,
        GYRO_BIAS_Z,
        SPEED,
        LATERAL_SPEED,
        ACCEL_BIAS_X,
        ACCEL_BIAS_Y,
        WHEEL_SCALE,
        SLOPE_SLIP,
    ]
)
"""States of the motion, which do not depend on the place on Earth: tilt, speeds, biases of gyro and
accelerometer, errors of the wheels. With a field from a model, magnetometer and fixes consider them
(Schmidt 1966)."""


@borrowing_kernel
def _copy_belief(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    old_x: NDArray[np.float64],
    old_P: NDArray[np.float64],
) -> None:
    """Copy a state and its covariance to buffers."""
    for i in range(len(x)):
        old_x[i] = x[i]
        for j in range(len(x)):
            old_P[i, j] = P[i, j]


@borrowing_kernel
def _restore_considered(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    old_x: NDArray[np.float64],
    old_P: NDArray[np.float64],
) -> None:
    """Restore the considered states as they were before a correction, in place.

    Their covariance with the other states stays corrected: this is the consider filter of Schmidt
    (1966), in which a measurement does not correct some of the states that it depends on.
    """
    for i in _CONSIDERED:
        x[i] = old_x[i]
        for j in _CONSIDERED:
            P[i, j] = old_P[i, j]


@borrowing_kernel
def _count(counts: NDArray[np.int64], sensor: int, nis: float, gate: float) -> None:
    """Count a measurement as accepted, gated, disturbed if its NIS is infinite, else rejected."""
    if nis <= gate:
        counts[sensor, ACCEPTED] += 1
    elif nis == np.inf:
        counts[sensor, DISTURBED] += 1
    elif nis > gate:
        counts[sensor, GATED] += 1
    else:
        counts[sensor, REJECTED] += 1


@borrowing_kernel
def _is_finite(row: NDArray[np.float64]) -> bool:
    """Return true if all numbers of a row are finite."""
    finite = True
    for i in range(len(row)):
        finite = finite and bool(np.isfinite(row[i]))
    return finite


@borrowing_kernel
def _is_due(rows: NDArray[np.float64], k: int, now: float) -> bool:
    """Return true if there is a row k and its stamp is not after an instant [s], or is NaN."""
    return k < len(rows) and not rows[k, STAMP] > now + STAMP_TOLERANCE


@borrowing_kernel
def first_inertial(imu: NDArray[np.float64], begin: float = -np.inf, end: float = np.inf) -> int:
    """Return the index of the first valid inertial row of a time, or the number of rows.

    Args:
        imu: Inertial rows, shape (k, 7).
        begin: Stamp that the row has to come after [s].
        end: Latest stamp [s].
    """
    for i in range(len(imu)):
        if _is_inertial(imu[i]) and begin < imu[i, STAMP] <= end:
            return i
    return len(imu)


@borrowing_kernel
def _is_inertial(row: NDArray[np.float64]) -> bool:
    """Return true if an inertial row has a stamp and an angular velocity that a robot can have."""
    valid = bool(np.isfinite(row[STAMP]))
    for i in range(GYRO, FORCE):
        valid = valid and abs(row[i]) < MAX_GYRO_RATE
    return valid


@borrowing_kernel
def _end_of(imu: NDArray[np.float64], now: float, max_step: float) -> float:
    """Return the stamp of the last inertial row that is accepted after an instant [s]."""
    for i in range(len(imu)):
        if _is_inertial(imu[i]) and 0.0 < imu[i, STAMP] - now <= max_step:
            now = imu[i, STAMP]
    return now


@borrowing_kernel
def _next_row(rows: NDArray[np.float64], k: int, end: float) -> int:
    """Return the index of the first row from k on that is not ahead of the period's end [s]."""
    while k < len(rows) and rows[k, STAMP] > end + STAMP_TOLERANCE:
        k += 1
    return k


@borrowing_kernel
def _count_waiting(
    rows: NDArray[np.float64], sensor: int, end: float, max_lead: float, counts: NDArray[np.int64]
) -> int:
    """Return how many rows are ahead of a period's end [s]; those too far ahead are rejected."""
    waiting = 0
    for k in range(len(rows)):
        if rows[k, STAMP] > end + max_lead:
            counts[sensor, REJECTED] += 1
        elif rows[k, STAMP] > end + STAMP_TOLERANCE:
            waiting += 1
    return waiting


@borrowing_kernel
def _take_wheels(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    now: float,
    end: float,
    rows: NDArray[np.float64],
    first: int,
    model: FilterModel,
    workspace: Workspace,
    counts: NDArray[np.int64],
) -> tuple[int, bool]:
    """Correct with the encoder rows up to an instant.

    Args:
        x: State, changed in place, shape (20,).
        P: Covariance, changed in place, shape (20, 20).
        now: Stamp of the state [s].
        end: End of the period [s]; rows ahead of it are passed over.
        rows: Encoder rows that arrived, shape (k, 3).
        first: Index of the first row that was not taken yet.
        model: Parameters of the filter.
        workspace: Buffers of the filter.
        counts: Table of counts, changed in place.

    Returns:
        Index of the next row, and true if the last valid row says that the wheels stand still.
    """
    still = False
    first = _next_row(rows, first, end)
    while _is_due(rows, first, now):
        nis = np.nan
        if _is_finite(rows[first]):
            left, right = rows[first, LEFT], rows[first, RIGHT]
            speed = model.body.wheel_radius * (left + right) / 2
            still = left == 0.0 and right == 0.0
            nis = correct_wheels(x, P, speed, model, workspace)
        _count(counts, WHEELS, nis, model.gates.wheels)
        first = _next_row(rows, first + 1, end)
    return first, still


@borrowing_kernel
def _take_mag_or_gnss(
    sensor: int,
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    now: float,
    end: float,
    rows: NDArray[np.float64],
    first: int,
    model: FilterModel,
    workspace: Workspace,
    counts: NDArray[np.int64],
) -> int:
    """Correct with the rows of ``COMPASS`` or ``GNSS`` up to an instant; see ``_take_wheels``.

    Returns:
        Index of the next row.
    """
    gate = model.gates.heading if sensor == COMPASS else model.gates.gnss
    first = _next_row(rows, first, end)
    while _is_due(rows, first, now):
        nis = np.nan
        if _is_finite(rows[first]):
            if model.body.heading_only:
                _copy_belief(x, P, workspace.kept_state, workspace.kept_covariance)
            if sensor == COMPASS:
                nis = correct_heading(x, P, rows[first], model, workspace)
            else:
                nis = correct_gnss(x, P, rows[first], model, workspace)
            if model.body.heading_only:
                _restore_considered(x, P, workspace.kept_state, workspace.kept_covariance)
        _count(counts, sensor, nis, gate)
        first = _next_row(rows, first + 1, end)
    return first


@borrowing_kernel
def _take_imu(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    row: NDArray[np.float64],
    still: bool,
    model: FilterModel,
    workspace: Workspace,
    counts: NDArray[np.int64],
) -> None:
    """Correct with gravity and, while the wheels stand still, with the rates that are then zero."""
    # A bridged gap has no specific force, which is NaN there.
    if not _is_finite(row):
        return
    nis = correct_gravity(x, P, row, model, workspace)
    _count(counts, GRAVITY_UPDATE, nis, model.gates.vector)
    if still:
        nis = correct_zero_rate(x, P, row, model, workspace)
        _count(counts, ZERO_RATE, nis, model.gates.vector)


@borrowing_kernel
def run_period(
    beliefs: NDArray[np.void],
    now: float,
    odometry: NDArray[np.float64],
    measurements: Measurements,
    models: NDArray[np.void],
    workspaces: NDArray[np.void],
    track: NDArray[np.float64],
) -> tuple[float, int, int, bool]:
    """Filter one period: predict from inertial row to inertial row, and correct in between.

    Each measurement corrects the state at the first inertial row that is not older than it: at most
    10 ms late. Fixes of the instant at which the period begins correct before. Rows that are not
    finite, or whose stamps decrease, are rejected and counted. On a live robot each sensor has its
    own latency: rows ahead of the last inertial row are passed over, to wait for the next period.
    Those further ahead than ``max_lead`` are rejected.

    Args:
        beliefs: Record of a ``Belief``, changed in place.
        now: Stamp of the state [s].
        odometry: Dead reckoning x, y, z [m] and yaw [rad], changed in place, shape (4,).
        measurements: Measurements that arrived.
        models: Record of the ``FilterModel``.
        workspaces: Record of the ``Workspace``.
        track: Buffer of stamp [s], position [m] and quaternion in ``odom`` at each inertial row,
            shape (k, 8).

    Returns:
        New stamp of the state [s], number of rows of the track that were filled, number of rows
        that wait, and true if the covariance stayed positive definite and the state finite.
    """
    x, P, counts = beliefs[0].x, beliefs[0].P, beliefs[0].counts
    model, workspace = models[0], workspaces[0]
    imu, wheels, mag, gnss = measurements
    end = _end_of(imu, now, model.body.max_step)
    waiting = _count_waiting(wheels, WHEELS, end, model.max_lead, counts)
    waiting += _count_waiting(mag, COMPASS, end, model.max_lead, counts)
    waiting += _count_waiting(gnss, GNSS, end, model.max_lead, counts)
    filled = 0
    next_wheels = next_mag = 0
    # A late fix of the very instant at which the period begins: the state is still that of then.
    next_gnss = _take_mag_or_gnss(GNSS, x, P, now, end, gnss, 0, model, workspace, counts)
    for i in range(len(imu)):
        dt = imu[i, STAMP] - now
        if not _is_inertial(imu[i]) or not 0.0 < dt <= model.body.max_step:
            counts[IMU, REJECTED] += 1
            continue
        if not predict(x, P, imu[i], dt, model, workspace):
            return now, filled, waiting, False
        now = imu[i, STAMP]
        counts[IMU, ACCEPTED] += 1
        next_wheels, still = _take_wheels(
            x, P, now, end, wheels, next_wheels, model, workspace, counts
        )
        _take_imu(x, P, imu[i], still, model, workspace, counts)
        next_mag = _take_mag_or_gnss(
            COMPASS, x, P, now, end, mag, next_mag, model, workspace, counts
        )
        next_gnss = _take_mag_or_gnss(
            GNSS, x, P, now, end, gnss, next_gnss, model, workspace, counts
        )
        _advance_odometry(x, imu[i], dt, model.body, odometry)
        _write_pose(now, x, odometry, track[filled])
        filled += 1
    return now, filled, waiting, _is_finite(x)


@borrowing_kernel
def _advance_odometry(
    x: NDArray[np.float64],
    imu: NDArray[np.float64],
    dt: float,
    body: BodyParameters,
    odometry: NDArray[np.float64],
) -> None:
    """Advance dead reckoning by a step: it follows gyro and wheels and never jumps.

    The process is that of ``predict``, with a yaw of its own that no correction changes.

    Args:
        x: State after the step, shape (20,).
        imu: Inertial row, shape (7,).
        dt: Length of the step [s].
        body: Parameters of the robot.
        odometry: Dead reckoning x, y, z [m] and yaw [rad], changed in place, shape (4,).
    """
    sr, cr, sp, cp = np.sin(x[ROLL]), np.cos(x[ROLL]), np.sin(x[PITCH]), np.cos(x[PITCH])
    yaw_rate = imu[GYRO + 2] - x[GYRO_BIAS_Z]
    horizontal_rate = sr * (imu[GYRO + 1] - x[GYRO_BIAS_Y]) + cr * yaw_rate
    lateral = x[LATERAL_SPEED] - yaw_rate * body.pivot * sp
    lateral -= abs(yaw_rate) * body.creep * np.tanh(sr / body.creep_slope)
    odometry[3] = wrap_angle(odometry[3] + dt * horizontal_rate / cp)
    sy, cy = np.sin(odometry[3]), np.cos(odometry[3])
    level = cp * x[SPEED] + sp * sr * lateral
    odometry[0] += dt * (cy * level - sy * cr * lateral)
    odometry[1] += dt * (sy * level + cy * cr * lateral)
    odometry[2] += dt * (-sp * x[SPEED] + cp * sr * lateral)


@borrowing_kernel
def _write_pose(
    now: float, x: NDArray[np.float64], odometry: NDArray[np.float64], row: NDArray[np.float64]
) -> None:
    """Write stamp, position and quaternion x, y, z, w of dead reckoning to a row of the track."""
    sr, cr = np.sin(x[ROLL] / 2), np.cos(x[ROLL] / 2)
    sp, cp = np.sin(x[PITCH] / 2), np.cos(x[PITCH] / 2)
    sy, cy = np.sin(odometry[3] / 2), np.cos(odometry[3] / 2)
    row[0] = now
    for a in range(3):
        row[1 + a] = odometry[a]
    row[4] = sr * cp * cy - cr * sp * sy
    row[5] = cr * sp * cy + sr * cp * sy
    row[6] = cr * cp * sy - sr * sp * cy
    row[7] = cr * cp * cy + sr * sp * sy
