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
    HARD_IRON_Y,
    HARD_IRON_Z,
    LATERAL_SPEED,
    SPEED,
    STATES,
    X,
    Y,
    Z,
)
from andabata.localization.measurements import FORCE, GYRO, HORIZONTAL_SIGMA, VERTICAL_SIGMA
from andabata.localization.sigma_points import (
    ATTITUDE_ROWS,
    COS_PITCH,
    COS_ROLL,
    COS_YAW,
    ROWS,
    SIN_PITCH,
    SIN_ROLL,
    SIN_YAW,
    Workspace,
    draw_points,
    find_rest,
    lateral_speed,
)
from andabata.localization.ukf import SigmaWeights, correct, correct_state, cross_covariance
from andabata.machine.proprioception import GRAVITY
from terrain.kernel import kernel


@kernel
def _transform_measurement(rows: int, weights: SigmaWeights, workspace: Workspace) -> None:
    """Fill expectation and covariances of a measurement from ``predicted`` at each point.

    Args:
        rows: Number of rows of the Cholesky factor that points were drawn along.
        weights: Weights of the sigma points.
        workspace: Buffers of the filter; ``expected``, ``S`` and ``cross`` are filled, without what
            the points show that are not drawn.
    """
    predicted, S, expected = workspace.predicted, workspace.S, workspace.expected
    weight = weights.covariance[1]
    # Mean of the differences from point 0, and their moments about it; see ``unscented_transform``,
    # of which this is the case of three numbers without angles.
    a = b = c = aa = bb = cc = ab = ac = bc = 0.0
    for k in range(1, 2 * rows + 1):
        u, v = predicted[k, 0] - predicted[0, 0], predicted[k, 1] - predicted[0, 1]
        w = predicted[k, 2] - predicted[0, 2]
        a, b, c = a + u, b + v, c + w
        aa, bb, cc = aa + u * u, bb + v * v, cc + w * w
        ab, ac, bc = ab + u * v, ac + u * w, bc + v * w
    a, b, c = weight * a, weight * b, weight * c
    expected[0], expected[1] = predicted[0, 0] + a, predicted[0, 1] + b
    expected[2] = predicted[0, 2] + c
    about = weights.covariance.sum() - 2.0
    S[0, 0], S[1, 1] = weight * aa + about * a * a, weight * bb + about * b * b
    S[2, 2] = weight * cc + about * c * c
    S[0, 1] = S[1, 0] = weight * ab + about * a * b
    S[0, 2] = S[2, 0] = weight * ac + about * a * c
    S[1, 2] = S[2, 1] = weight * bc + about * b * c
    cross_covariance(workspace.factor[:rows], weights, predicted[: 2 * rows + 1], workspace.cross)


@kernel
def _correct_by_moments(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    z: NDArray[np.float64],
    variance: tuple[float, float, float],
    gate: float,
    workspace: Workspace,
) -> float:
    """Correct with a measurement whose expectation and covariances stand in the workspace.

    Args:
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
        z: Measurement, shape (3,).
        variance: Variance of each component of the measurement.
        gate: Largest NIS that is accepted.
        workspace: Buffers of the filter; ``expected``, ``S`` and ``cross`` are filled.

    Returns:
        The NIS.
    """
    S, innovation = workspace.S, workspace.innovation
    S[0, 0] += variance[0]
    S[1, 1] += variance[1]
    S[2, 2] += variance[2]
    innovation[0] = z[0] - workspace.expected[0]
    innovation[1] = z[1] - workspace.expected[1]
    innovation[2] = z[2] - workspace.expected[2]
    return correct(x, P, workspace.angular, workspace.cross, S, innovation, gate, workspace.gain)


@kernel
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


@kernel
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
    body = model.body
    points, trig, predicted = workspace.points, workspace.trig, workspace.predicted
    if not draw_points(x, P, ROWS, model, workspace):
        return np.nan
    for k in range(points.shape[0]):
        sr, cr = trig[k, SIN_ROLL], trig[k, COS_ROLL]
        sp, cp = trig[k, SIN_PITCH], trig[k, COS_PITCH]
        p = imu[GYRO] - points[k, GYRO_BIAS_X]
        q = imu[GYRO + 1] - points[k, GYRO_BIAS_Y]
        r = imu[GYRO + 2] - points[k, GYRO_BIAS_Z]
        # Specific force f = R' (0, 0, g) + w x v + bias, with v = (forward, lateral, 0).
        forward, lateral = points[k, SPEED], lateral_speed(k, r, body, workspace)
        predicted[k, 0] = -GRAVITY * sp - r * lateral + points[k, ACCEL_BIAS_X]
        predicted[k, 1] = GRAVITY * cp * sr + r * forward + points[k, ACCEL_BIAS_Y]
        predicted[k, 2] = GRAVITY * cp * cr + p * lateral - q * forward
    _transform_measurement(ROWS, model.weights, workspace)
    # Points that are not drawn have the rates of the mean: the rest is affine in speeds and biases.
    cross, S, rest = workspace.cross, workspace.S, workspace.rest
    for i in (SPEED, LATERAL_SPEED, ACCEL_BIAS_X, ACCEL_BIAS_Y):
        find_rest(P, i, ROWS, workspace)
    p, q = imu[GYRO] - x[GYRO_BIAS_X], imu[GYRO + 1] - x[GYRO_BIAS_Y]
    r = imu[GYRO + 2] - x[GYRO_BIAS_Z]
    shown = workspace.rest_cross
    for i in range(ROWS, STATES):
        shown[0, i] = rest[ACCEL_BIAS_X, i] - r * rest[LATERAL_SPEED, i]
        shown[1, i] = rest[ACCEL_BIAS_Y, i] + r * rest[SPEED, i]
        shown[2, i] = p * rest[LATERAL_SPEED, i] - q * rest[SPEED, i]
    for b in range(3):
        for i in range(ROWS, STATES):
            cross[b, i] += shown[b, i]
        S[0, b] += shown[b, ACCEL_BIAS_X] - r * shown[b, LATERAL_SPEED]
        S[1, b] += shown[b, ACCEL_BIAS_Y] + r * shown[b, SPEED]
        S[2, b] += p * shown[b, LATERAL_SPEED] - q * shown[b, SPEED]
    variance = model.noise.vibration**2
    variances = (variance, variance, 4 * variance)
    return _correct_by_moments(x, P, imu[FORCE:], variances, model.gates.vector, workspace)


@kernel
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
    body = model.body
    points, trig, predicted = workspace.points, workspace.trig, workspace.predicted
    if not draw_points(x, P, ATTITUDE_ROWS, model, workspace):
        return np.nan
    for k in range(2 * ATTITUDE_ROWS + 1):
        sr, cr = trig[k, SIN_ROLL], trig[k, COS_ROLL]
        sp, cp = trig[k, SIN_PITCH], trig[k, COS_PITCH]
        sy, cy = trig[k, SIN_YAW], trig[k, COS_YAW]
        # Field of the Earth turned into the base, by yaw, pitch and roll in turn, plus hard iron.
        ahead = cy * body.flux_east + sy * body.flux_north
        aside = cy * body.flux_north - sy * body.flux_east
        up = sp * ahead + cp * body.flux_up
        predicted[k, 0] = cp * ahead - sp * body.flux_up + points[k, HARD_IRON_X]
        predicted[k, 1] = cr * aside + sr * up + points[k, HARD_IRON_Y]
        predicted[k, 2] = cr * up - sr * aside + points[k, HARD_IRON_Z]
    _transform_measurement(ATTITUDE_ROWS, model.weights, workspace)
    # Points that are not drawn have the attitude of the mean, and hard iron of their own.
    cross, S, rest = workspace.cross, workspace.S, workspace.rest
    for a in range(3):
        find_rest(P, HARD_IRON_X + a, ATTITUDE_ROWS, workspace)
        for i in range(ATTITUDE_ROWS, STATES):
            cross[a, i] += rest[HARD_IRON_X + a, i]
        for b in range(3):
            S[a, b] += rest[HARD_IRON_X + a, HARD_IRON_X + b]
    variance = model.noise.mag**2
    variances = (variance, variance, variance)
    return _correct_by_moments(x, P, mag[1:], variances, model.gates.vector, workspace)


@kernel
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
    cross, S, expected = workspace.cross, workspace.S, workspace.expected
    # With H the sum of position and error: cross = P H', S = H P H'.
    for i in range(STATES):
        cross[0, i] = P[X, i] + P[GNSS_EAST, i]
        cross[1, i] = P[Y, i] + P[GNSS_NORTH, i]
        cross[2, i] = P[Z, i]
    for j in range(3):
        S[0, j] = cross[j, X] + cross[j, GNSS_EAST]
        S[1, j] = cross[j, Y] + cross[j, GNSS_NORTH]
        S[2, j] = cross[j, Z]
    expected[0], expected[1] = x[X] + x[GNSS_EAST], x[Y] + x[GNSS_NORTH]
    expected[2] = x[Z]
    horizontal, vertical = fix[HORIZONTAL_SIGMA] ** 2, fix[VERTICAL_SIGMA] ** 2
    variances = (horizontal, horizontal, vertical)
    return _correct_by_moments(x, P, fix[1:4], variances, model.gates.gnss, workspace)


@kernel
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
        workspace.expected[a] = x[GYRO_BIAS_X + a]
    variance = model.noise.zero_rate**2
    variances = (variance, variance, variance)
    return _correct_by_moments(x, P, imu[GYRO:FORCE], variances, model.gates.vector, workspace)
