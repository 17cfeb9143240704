"""Measurement models of the robot's filter, and the correction by each of them.

Speed of the wheels, gravity with centripetal acceleration, magnetic field, satellite fix, and the
gyro at rest. Each correction returns the normalised innovation squared (NIS), NaN where the
covariance is not positive definite; beyond its gate nothing is changed.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_parameters import FilterModel
from andabata.localization.filter_state import (
    ACCEL_BIAS_X,
    ACCEL_BIAS_Y,
    GNSS_EAST,
    GNSS_NORTH,
    GYRO_BIAS_X,
    GYRO_BIAS_Y,
    GYRO_BIAS_Z,
    HARD_IRON_X,
    LATERAL_SPEED,
    SPEED,
    STATES,
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
    correct_state,
)
from andabata.machine.proprioception import GRAVITY
from terrain.kernel import borrowing_kernel


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
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
        cross: Covariance of expected measurement and state, overwritten, shape (3, 18).
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

    Args:
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
        speed: Forward speed [m/s].
        model: Parameters of the filter.
        workspace: Buffers of the filter.
    """
    variance, gate = model.noise.wheel_speed**2, model.gates.wheels
    return correct_state(x, P, workspace.angular, SPEED, speed, variance, gate, workspace.gain)


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
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
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
        rows: Rows of the length of a state, shape (k, 18).
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
def correct_mag(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    mag: NDArray[np.float64],
    model: FilterModel,
    workspace: Workspace,
) -> float:
    """Correct with a magnetic field and return the NIS.

    Args:
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
        mag: Row of stamp and flux density in the base frame [uT], shape (4,).
        model: Parameters of the filter.
        workspace: Buffers of the filter.
    """
    body, transform, trig = model.body, workspace.compass, workspace.trig
    remainder = transform.remainder
    if not draw_points(x, P, 3, model, transform, trig):
        return np.nan
    for k in range(len(remainder)):
        sr, cr = trig[k, SIN_ROLL], trig[k, COS_ROLL]
        sp, cp = trig[k, SIN_PITCH], trig[k, COS_PITCH]
        sy, cy = trig[k, SIN_YAW], trig[k, COS_YAW]
        # Field of the Earth turned into the base, by yaw, pitch and roll in turn. Hard iron is the
        # linear part.
        ahead = cy * body.flux_east + sy * body.flux_north
        aside = cy * body.flux_north - sy * body.flux_east
        up = sp * ahead + cp * body.flux_up
        remainder[k, 0] = cp * ahead - sp * body.flux_up
        remainder[k, 1] = cr * aside + sr * up
        remainder[k, 2] = cr * up - sr * aside
    _apply_hard_iron(P, transform.cross)
    _apply_hard_iron(transform.U, transform.linear)
    add_remainder_to_cross(model.weights, transform)
    _apply_hard_iron(transform.cross, transform.covariance)
    add_remainder_to_covariance(model.weights, transform)
    for a in range(3):
        expected = x[HARD_IRON_X + a] + remainder[0, a] + transform.mean[a]
        workspace.innovation[a] = mag[1 + a] - expected
    variance, gate = model.noise.mag**2, model.gates.vector
    variances = (variance, variance, variance)
    cross, S = transform.cross, transform.covariance
    return _correct_by_moments(x, P, cross, S, variances, gate, workspace)


@borrowing_kernel
def _apply_hard_iron(rows: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Write the hard iron of rows of the length of a state, shape (k, 18), as columns."""
    for k in range(len(rows)):
        for a in range(3):
            out[a, k] = rows[k, HARD_IRON_X + a]


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
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
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
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
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
