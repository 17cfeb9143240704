"""Measurement models of the robot's filter, and the correction by each of them.

Speed of the wheels, gravity with centripetal acceleration, compass heading, satellite fix, and the
gyro at rest. Each correction returns the normalised innovation squared (NIS), NaN where the
covariance is not positive definite; beyond its gate nothing is changed.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_parameters import BodyParameters, FilterModel
from andabata.localization.filter_state import (
    ACCEL_BIAS_X,
    ACCEL_BIAS_Y,
    COMPASS_ERROR,
    GNSS_EAST,
    GNSS_NORTH,
    GYRO_BIAS_X,
    GYRO_BIAS_Y,
    GYRO_BIAS_Z,
    HARD_IRON_X,
    HARD_IRON_Y,
    LATERAL_SPEED,
    PITCH,
    ROLL,
    SLOPE_SLIP,
    SPEED,
    STATES,
    WHEEL_SCALE,
    X,
    Y,
    Z,
)
from andabata.localization.measurements import FORCE, GYRO, HORIZONTAL_SIGMA, VERTICAL_SIGMA
from andabata.localization.sigma_points import (
    COS_PITCH,
    COS_ROLL,
    COS_YAW,
    SIN_PITCH,
    SIN_ROLL,
    SIN_YAW,
    Workspace,
    draw_points,
    sliding_speed,
)
from andabata.localization.ukf import (
    add_remainder_to_covariance,
    add_remainder_to_cross,
    correct,
    correct_number,
    wrap_angle,
)
from andabata.machine.proprioception import GRAVITY
from terrain.kernel import borrowing_kernel, inlined_kernel

_LEAST_HORIZONTAL = 1.0
"""Least horizontal flux density of a compass that has a direction [uT]."""

Vector = tuple[float, float, float]


@borrowing_kernel
def _correct_by_moments(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    cross: NDArray[np.float64],
    S: NDArray[np.float64],
    variance: tuple[float, float, float],
    gate: float,
    workspace: Workspace,
) -> float:
    """Correct with a measurement whose innovation stands in the workspace.

    Args:
        x: State, changed in place, shape (20,).
        P: Covariance, changed in place, shape (20, 20).
        cross: Covariance of expected measurement and state, overwritten, shape (3, 20).
        S: Covariance of the expected measurement, overwritten, shape (3, 3).
        variance: Variance of each component of the measurement.
        gate: Largest NIS that is accepted.
        workspace: Buffers of the filter; ``innovation`` is filled, and overwritten.

    Returns:
        The NIS.
    """
    for a in range(3):
        S[a, a] += variance[a]
    return correct(x, P, workspace.angular, cross, S, workspace.innovation, gate)


@borrowing_kernel
def correct_wheels(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    speed: float,
    model: FilterModel,
    workspace: Workspace,
) -> float:
    """Correct with the forward speed by encoders [m/s] and return the NIS.

    Wheels read too fast by their scale, and on a climb by their slip: the reading exceeds the true
    speed by its share ``scale + slip sin(climb)``. At the estimated pitch, whose error is far
    below that of the slip, this is linear in the state, where the unscented transform is exact.

    Args:
        x: State, changed in place, shape (20,).
        P: Covariance, changed in place, shape (20, 20).
        speed: Forward speed [m/s].
        model: Parameters of the filter.
        workspace: Buffers of the filter.
    """
    cross = workspace.number
    # Pitch is positive nose down (REP 103).
    climb = -speed * np.sin(x[PITCH])
    for i in range(STATES):
        cross[i] = P[SPEED, i] + speed * P[WHEEL_SCALE, i] + climb * P[SLOPE_SLIP, i]
    s = cross[SPEED] + speed * cross[WHEEL_SCALE] + climb * cross[SLOPE_SLIP]
    expected = x[SPEED] + speed * x[WHEEL_SCALE] + climb * x[SLOPE_SLIP]
    variance, gate = model.noise.wheel_speed**2, model.gates.wheels
    return correct_number(x, P, workspace.angular, cross, s + variance, speed - expected, gate)


@borrowing_kernel
def correct_gravity(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    imu: NDArray[np.float64],
    model: FilterModel,
    workspace: Workspace,
) -> float:
    """Correct with a specific force, gravity plus centripetal acceleration, and return the NIS.

    Wheels on rough ground shake the reading, mostly vertically. Its length is no reason to weight
    it less: selecting quiet instants would bias gravity and tilt the estimate on every slope.

    Args:
        x: State, changed in place, shape (20,).
        P: Covariance, changed in place, shape (20, 20).
        imu: Inertial row: stamp, angular velocity [rad/s], specific force [m/s2], shape (7,).
        model: Parameters of the filter.
        workspace: Buffers of the filter.
    """
    body, transform, trig = model.body, workspace.gravity, workspace.trig
    points, remainder = transform.points, transform.remainder
    if not draw_points(x, P, 2, model, transform, trig):
        return np.nan
    # Rates of the mean: those of the linear part, and of the points that are not drawn.
    p0, q0 = imu[GYRO] - x[GYRO_BIAS_X], imu[GYRO + 1] - x[GYRO_BIAS_Y]
    r0 = imu[GYRO + 2] - x[GYRO_BIAS_Z]
    for k in range(len(points)):
        sr, cr = trig[k, SIN_ROLL], trig[k, COS_ROLL]
        sp, cp = trig[k, SIN_PITCH], trig[k, COS_PITCH]
        p = imu[GYRO] - points[k, GYRO_BIAS_X]
        q = imu[GYRO + 1] - points[k, GYRO_BIAS_Y]
        r = imu[GYRO + 2] - points[k, GYRO_BIAS_Z]
        # Specific force f = R' (0, 0, g) + w x v + bias, with v = (forward, lateral, 0), less the
        # linear part.
        forward, lateral = points[k, SPEED], points[k, LATERAL_SPEED]
        slid = sliding_speed(k, r, body, trig)
        remainder[k, 0] = -GRAVITY * sp - (r - r0) * lateral + r * slid
        remainder[k, 1] = GRAVITY * cp * sr + (r - r0) * forward
        remainder[k, 2] = GRAVITY * cp * cr + (p - p0) * lateral - p * slid - (q - q0) * forward
    rates = (p0, q0, r0)
    _apply_linear_force(P, rates, transform.cross)
    _apply_linear_force(transform.U, rates, transform.linear)
    add_remainder_to_cross(model.weights, transform)
    _apply_linear_force(transform.cross, rates, transform.covariance)
    add_remainder_to_covariance(model.weights, transform)
    linear = (
        x[ACCEL_BIAS_X] - r0 * x[LATERAL_SPEED],
        x[ACCEL_BIAS_Y] + r0 * x[SPEED],
        p0 * x[LATERAL_SPEED] - q0 * x[SPEED],
    )
    for a in range(3):
        expected = linear[a] + remainder[0, a] + transform.mean[a]
        workspace.innovation[a] = imu[FORCE + a] - expected
    variance, gate = model.noise.vibration**2, model.gates.vector
    variances = (variance, variance, 4 * variance)
    cross, S = transform.cross, transform.covariance
    return _correct_by_moments(x, P, cross, S, variances, gate, workspace)


@borrowing_kernel
def _apply_linear_force(
    rows: NDArray[np.float64], rates: tuple[float, float, float], out: NDArray[np.float64]
) -> None:
    """Apply the linear part of the specific force to rows, and write them as columns.

    Args:
        rows: Rows of the length of a state, shape (k, 20).
        rates: Angular velocity of the mean [rad/s].
        out: Buffer, shape (3, k).
    """
    p, q, r = rates
    for k in range(len(rows)):
        forward, lateral = rows[k, SPEED], rows[k, LATERAL_SPEED]
        out[0, k] = rows[k, ACCEL_BIAS_X] - r * lateral
        out[1, k] = rows[k, ACCEL_BIAS_Y] + r * forward
        out[2, k] = p * lateral - q * forward


@borrowing_kernel
def correct_heading(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    mag: NDArray[np.float64],
    model: FilterModel,
    workspace: Workspace,
) -> float:
    """Correct with the heading of a magnetic field and return the NIS, infinite if disturbed.

    The measurement is the bearing of the field from straight ahead, levelled by the estimated roll
    and pitch. What soft iron and motors add to it depends on heading and load and does not average
    out: it is a state of its own, and only the rest is white. All slopes are those of the expected
    field: slopes of the measured one would share its noise, and the hard iron would drift.

    Args:
        x: State, changed in place, shape (20,).
        P: Covariance, changed in place, shape (20, 20).
        mag: Row of stamp and flux density in the base frame [uT], shape (4,).
        model: Parameters of the filter.
        workspace: Buffers of the filter.
    """
    transform, trig, cross = workspace.compass, workspace.trig, workspace.number
    remainder, iron = transform.remainder, (x[HARD_IRON_X], x[HARD_IRON_Y])
    if not draw_points(x, P, 3, model, transform, trig):
        return np.nan
    measured = _levelled((mag[1], mag[2], mag[3]), trig)
    if _is_disturbed(measured, P[ROLL, ROLL] + P[PITCH, PITCH], model):
        return np.inf
    ahead, aside, _ = _levelled(_expected_field(0, model.body, iron, trig), trig)
    bearing = np.arctan2(aside, ahead)
    for k in range(len(remainder)):
        along, across, _ = _levelled(_expected_field(k, model.body, iron, trig), trig)
        remainder[k, 0] = wrap_angle(np.arctan2(across, along) - bearing)
    square = ahead * ahead + aside * aside
    sr, cr, sp, cp = trig[0, SIN_ROLL], trig[0, COS_ROLL], trig[0, SIN_PITCH], trig[0, COS_PITCH]
    slopes = (-aside * cp / square, (ahead * cr - aside * sp * sr) / square)
    _apply_linear_bearing(P, slopes, transform.cross)
    _apply_linear_bearing(transform.U, slopes, transform.linear)
    add_remainder_to_cross(model.weights, transform)
    _apply_linear_bearing(transform.cross, slopes, transform.covariance)
    add_remainder_to_covariance(model.weights, transform)
    expected = bearing - x[COMPASS_ERROR] + transform.mean[0]
    innovation = wrap_angle(np.arctan2(measured[1], measured[0]) - expected)
    for i in range(STATES):
        cross[i] = transform.cross[0, i]
    s = transform.covariance[0, 0] + model.noise.mag**2 / square
    return correct_number(x, P, workspace.angular, cross, s, innovation, model.gates.heading)


@inlined_kernel
def _expected_field(
    k: int, body: BodyParameters, iron: tuple[float, float], trig: NDArray[np.float64]
) -> Vector:
    """Return the field in the base of a point: that of the Earth, and hard iron [uT]."""
    sr, cr, sp, cp = trig[k, SIN_ROLL], trig[k, COS_ROLL], trig[k, SIN_PITCH], trig[k, COS_PITCH]
    sy, cy = trig[k, SIN_YAW], trig[k, COS_YAW]
    # Turned from the map into the base by yaw, pitch and roll in turn.
    ahead = cy * body.flux_east + sy * body.flux_north
    aside = cy * body.flux_north - sy * body.flux_east
    up = sp * ahead + cp * body.flux_up
    forward = cp * ahead - sp * body.flux_up
    return forward + iron[0], cr * aside + sr * up + iron[1], cr * up - sr * aside


@inlined_kernel
def _levelled(field: Vector, trig: NDArray[np.float64]) -> Vector:
    """Return a field of the base turned level by the mean's tilt: forward, left, up."""
    sr, cr, sp, cp = trig[0, SIN_ROLL], trig[0, COS_ROLL], trig[0, SIN_PITCH], trig[0, COS_PITCH]
    across = sr * field[1] + cr * field[2]
    return cp * field[0] + sp * across, cr * field[1] - sr * field[2], cp * across - sp * field[0]


@inlined_kernel
def _is_disturbed(field: Vector, tilt: float, model: FilterModel) -> bool:
    """Return true if a levelled field differs from that of the place by more than a robot adds.

    Its length and dip are compared as its horizontal and its vertical part; a field that is known
    roughly is only asked to have a direction.

    Args:
        field: Levelled field: forward, left, up [uT].
        tilt: Variance of roll and pitch together [rad2]: without an inertial unit the field is
            levelled badly.
        model: Parameters of the filter.
    """
    body, horizontal = model.body, np.hypot(field[0], field[1])
    if body.heading_only:
        return bool(horizontal < _LEAST_HORIZONTAL)
    level = np.hypot(body.flux_east, body.flux_north)
    limit = model.gates.field + 3 * np.sqrt(tilt) * np.hypot(level, body.flux_up)
    far = abs(horizontal - level) > limit or abs(field[2] - body.flux_up) > limit
    return bool(far or horizontal < _LEAST_HORIZONTAL)


@borrowing_kernel
def _apply_linear_bearing(
    rows: NDArray[np.float64], slopes: tuple[float, float], out: NDArray[np.float64]
) -> None:
    """Apply the linear part of the field's bearing to rows, and write them as a column.

    Args:
        rows: Rows of the length of a state, shape (k, 20).
        slopes: Change of the bearing by hard iron forward and to the left [rad/uT].
        out: Buffer, shape (1, k).
    """
    for k in range(len(rows)):
        iron = slopes[0] * rows[k, HARD_IRON_X] + slopes[1] * rows[k, HARD_IRON_Y]
        out[0, k] = iron - rows[k, COMPASS_ERROR]


@borrowing_kernel
def correct_gnss(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    fix: NDArray[np.float64],
    model: FilterModel,
    workspace: Workspace,
) -> float:
    """Correct with a satellite fix and return the NIS.

    The measurement, position plus correlated error, is linear in the state: its moments follow from
    the covariance, and no points have to be drawn.

    Args:
        x: State, changed in place, shape (20,).
        P: Covariance, changed in place, shape (20, 20).
        fix: Row of stamp, x, y, z, horizontal and vertical sigma [m], shape (6,).
        model: Parameters of the filter.
        workspace: Buffers of the filter.
    """
    cross, S = workspace.cross, workspace.S
    # With H the sum of position and error: cross = P H', S = H P H'.
    for i in range(STATES):
        cross[0, i] = P[X, i] + P[GNSS_EAST, i]
        cross[1, i] = P[Y, i] + P[GNSS_NORTH, i]
        cross[2, i] = P[Z, i]
    for j in range(3):
        S[0, j] = cross[j, X] + cross[j, GNSS_EAST]
        S[1, j] = cross[j, Y] + cross[j, GNSS_NORTH]
        S[2, j] = cross[j, Z]
    innovation = workspace.innovation
    innovation[0] = fix[1] - (x[X] + x[GNSS_EAST])
    innovation[1] = fix[2] - (x[Y] + x[GNSS_NORTH])
    innovation[2] = fix[3] - x[Z]
    horizontal, vertical = fix[HORIZONTAL_SIGMA] ** 2, fix[VERTICAL_SIGMA] ** 2
    variances = (horizontal, horizontal, vertical)
    return _correct_by_moments(x, P, cross, S, variances, model.gates.gnss, workspace)


@borrowing_kernel
def correct_zero_rate(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    imu: NDArray[np.float64],
    model: FilterModel,
    workspace: Workspace,
) -> float:
    """Correct the gyro's bias with a reading at rest (zero angular rate update); return the NIS.

    Args:
        x: State, changed in place, shape (20,).
        P: Covariance, changed in place, shape (20, 20).
        imu: Inertial row while the wheels stand still, shape (7,).
        model: Parameters of the filter.
        workspace: Buffers of the filter.
    """
    for a in range(3):
        for i in range(STATES):
            workspace.cross[a, i] = P[GYRO_BIAS_X + a, i]
        for b in range(3):
            workspace.S[a, b] = P[GYRO_BIAS_X + a, GYRO_BIAS_X + b]
        workspace.innovation[a] = imu[GYRO + a] - x[GYRO_BIAS_X + a]
    variance, gate = model.noise.zero_rate**2, model.gates.vector
    variances = (variance, variance, variance)
    return _correct_by_moments(x, P, workspace.cross, workspace.S, variances, gate, workspace)
