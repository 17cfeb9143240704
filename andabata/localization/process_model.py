"""Process model of the robot's filter, and the prediction by it.

Process, for a gyro reading w and a step dt: attitude kinematics of z-y-x angles, position moved by
the speeds along the body's axes, first-order Gauss-Markov processes for lateral speed and satellite
error, random walks for all biases and the forward speed.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_parameters import FilterModel, NoiseModel
from andabata.localization.filter_state import (
    ACCEL_BIAS_X,
    GNSS_EAST,
    GNSS_NORTH,
    GYRO_BIAS_X,
    GYRO_BIAS_Y,
    GYRO_BIAS_Z,
    HARD_IRON_X,
    LATERAL_SPEED,
    PITCH,
    ROLL,
    SPEED,
    STATES,
    YAW,
    X,
    Y,
    Z,
)
from andabata.localization.measurements import GYRO
from andabata.localization.sigma_points import (
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
from andabata.localization.ukf import unscented_transform
from terrain.kernel import kernel


@kernel
def predict(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    imu: NDArray[np.float64],
    dt: float,
    model: FilterModel,
    workspace: Workspace,
) -> bool:
    """Predict state and covariance over a step, with a gyro reading as input.

    Args:
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
        imu: Inertial row, of which the angular velocity is used, shape (7,).
        dt: Length of the step [s].
        model: Parameters of the filter.
        workspace: Buffers of the filter.

    Returns:
        True if the covariance is positive definite; if not, nothing was changed.
    """
    body, noise, weights = model.body, model.noise, model.weights
    points, trig = workspace.points, workspace.trig
    if not draw_points(x, P, ROWS, model, workspace):
        return False
    for i in range(ROWS, STATES):
        if not find_rest(P, i, ROWS, workspace) > 0.0:
            return False
    # Decay of the two Gauss-Markov processes.
    lateral_decay = np.exp(-dt / noise.lateral_speed_time)
    gnss_decay = np.exp(-dt / noise.gnss_error_time)
    wx, wy, wz = imu[GYRO], imu[GYRO + 1], imu[GYRO + 2]
    for k in range(points.shape[0]):
        sr, cr = trig[k, SIN_ROLL], trig[k, COS_ROLL]
        sp, cp = trig[k, SIN_PITCH], trig[k, COS_PITCH]
        sy, cy = trig[k, SIN_YAW], trig[k, COS_YAW]
        # Body rates p, q, r: the gyro's reading less its bias.
        p = wx - points[k, GYRO_BIAS_X]
        q = wy - points[k, GYRO_BIAS_Y]
        r = wz - points[k, GYRO_BIAS_Z]
        # Position: the velocity in the base, rotated into the map.
        forward, lateral = points[k, SPEED], lateral_speed(k, r, body, workspace)
        level = cp * forward + sp * sr * lateral
        points[k, X] += dt * (cy * level - sy * cr * lateral)
        points[k, Y] += dt * (sy * level + cy * cr * lateral)
        points[k, Z] += dt * (-sp * forward + cp * sr * lateral)
        # Attitude: rates of the z-y-x angles from body rates (Euler's kinematic equations).
        horizontal_rate = sr * q + cr * r
        points[k, ROLL] += dt * (p + horizontal_rate * sp / cp)
        points[k, PITCH] += dt * (cr * q - sr * r)
        points[k, YAW] += dt * horizontal_rate / cp
        points[k, LATERAL_SPEED] *= lateral_decay
        points[k, GNSS_EAST] *= gnss_decay
        points[k, GNSS_NORTH] *= gnss_decay
    unscented_transform(points, weights, workspace.angular, x, workspace.deviations, P)
    _add_rest(P, dt, lateral_decay, gnss_decay, workspace)
    _add_process_noise(P, dt, lateral_decay, gnss_decay, noise)
    return True


@kernel
def _add_rest(
    P: NDArray[np.float64],
    dt: float,
    lateral_decay: float,
    gnss_decay: float,
    workspace: Workspace,
) -> None:
    """Add the covariance of the points that are not drawn to a predicted one, in place.

    They have the attitude and the yaw rate of the mean: the process is affine in their speeds.

    Args:
        P: Covariance of the points that are drawn, after the step, shape (18, 18).
        dt: Length of the step [s].
        lateral_decay: Decay of the lateral speed.
        gnss_decay: Decay of the satellite error.
        workspace: Buffers of the filter; ``rest`` is propagated.
    """
    rest, trig = workspace.rest, workspace.trig
    sr, cr, sp, cp = (
        trig[0, SIN_ROLL],
        trig[0, COS_ROLL],
        trig[0, SIN_PITCH],
        trig[0, COS_PITCH],
    )
    sy, cy = trig[0, SIN_YAW], trig[0, COS_YAW]
    # Metres along x, y and z per metre a second forward and to the left; see ``predict``.
    forward = (dt * cy * cp, dt * sy * cp, -dt * sp)
    lateral = (dt * (cy * sp * sr - sy * cr), dt * (sy * sp * sr + cy * cr), dt * cp * sr)
    n = len(rest)
    for a in range(3):
        for j in range(ROWS, n):
            rest[X + a, j] += forward[a] * rest[SPEED, j] + lateral[a] * rest[LATERAL_SPEED, j]
    for a in range(3):
        for i in range(ROWS, n):
            rest[i, X + a] += forward[a] * rest[i, SPEED] + lateral[a] * rest[i, LATERAL_SPEED]
    for j in range(ROWS, n):
        rest[LATERAL_SPEED, j] *= lateral_decay
        rest[GNSS_EAST, j] *= gnss_decay
        rest[GNSS_NORTH, j] *= gnss_decay
    for i in range(ROWS, n):
        rest[i, LATERAL_SPEED] *= lateral_decay
        rest[i, GNSS_EAST] *= gnss_decay
        rest[i, GNSS_NORTH] *= gnss_decay
        for j in range(ROWS, i + 1):
            P[i, j] += rest[i, j]
            P[j, i] = P[i, j]


@kernel
def _add_process_noise(
    P: NDArray[np.float64], dt: float, lateral_decay: float, gnss_decay: float, noise: NoiseModel
) -> None:
    """Add the process noise of a step [s] to a covariance, in place.

    Random walks add ``sigma^2 dt``; Gauss-Markov processes add ``sigma^2 (1 - decay^2)``, which
    keeps their stationary variance.
    """
    for a in range(3):
        P[ROLL + a, ROLL + a] += noise.gyro**2 * dt
        P[GYRO_BIAS_X + a, GYRO_BIAS_X + a] += noise.gyro_bias_walk**2 * dt
        P[X + a, X + a] += (noise.position_walk if a < 2 else noise.height_walk) ** 2 * dt
        P[HARD_IRON_X + a, HARD_IRON_X + a] += noise.hard_iron_walk**2 * dt
    P[SPEED, SPEED] += noise.speed_walk**2 * dt
    P[LATERAL_SPEED, LATERAL_SPEED] += noise.lateral_speed**2 * (1 - lateral_decay * lateral_decay)
    for a in range(2):
        P[GNSS_EAST + a, GNSS_EAST + a] += noise.gnss_error**2 * (1 - gnss_decay * gnss_decay)
        P[ACCEL_BIAS_X + a, ACCEL_BIAS_X + a] += noise.accel_bias_walk**2 * dt
