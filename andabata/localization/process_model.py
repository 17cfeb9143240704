"""Process model of the robot's filter, and the prediction by it.

Process, for a gyro reading w and a step dt: attitude kinematics of z-y-x angles, position moved by
the speeds along the body's axes, first-order Gauss-Markov processes for lateral speed, compass and
satellite error, random walks for all biases and the forward speed.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_parameters import BodyParameters, FilterModel, NoiseModel
from andabata.localization.filter_state import (
    ACCEL_BIAS_X,
    COMPASS_ERROR,
    GNSS_EAST,
    GNSS_NORTH,
    GYRO_BIAS_X,
    GYRO_BIAS_Y,
    GYRO_BIAS_Z,
    HARD_IRON_X,
    LATERAL_SPEED,
    PITCH,
    ROLL,
    SLOPE_SLIP,
    SPEED,
    STATES,
    WHEEL_SCALE,
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
    is_rest_positive,
    wrap_angle,
)
from terrain.kernel import borrowing_kernel, inlined_kernel

_MOVED = np.array([ROLL, PITCH, YAW, X, Y, Z])
"""States that the process moves; all others it keeps, or lets decay."""

Vector = tuple[float, float, float]


@borrowing_kernel
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
        x: State, changed in place, shape (20,).
        P: Covariance, changed in place, shape (20, 20).
        imu: Inertial row, of which the angular velocity is used, shape (7,).
        dt: Length of the step [s].
        model: Parameters of the filter.
        workspace: Buffers of the filter.

    Returns:
        True if the covariance is positive definite; if not, nothing was changed.
    """
    noise, transform, trig = model.noise, workspace.process, workspace.trig
    if not draw_points(x, P, 3, model, transform, trig):
        return False
    if not is_rest_positive(P, transform.U):
        return False
    # The linear part: attitude and position as they are, and the way by the speeds at the mean's
    # attitude. Points that are not drawn have that attitude.
    forward, lateral = _ways(0, dt, trig)
    _fill_remainder(imu, dt, forward, lateral, model.body, workspace)
    _apply_linear_part(P, forward, lateral, transform.cross)
    _apply_linear_part(transform.U, forward, lateral, transform.linear)
    add_remainder_to_cross(model.weights, transform)
    _apply_linear_part(transform.cross, forward, lateral, transform.covariance)
    add_remainder_to_covariance(model.weights, transform)
    cross, covariance = transform.cross, transform.covariance
    for a in range(3):
        x[X + a] += forward[a] * x[SPEED] + lateral[a] * x[LATERAL_SPEED]
    for a in range(6):
        i = _MOVED[a]
        x[i] += transform.remainder[0, a] + transform.mean[a]
        for j in range(STATES):
            P[i, j] = P[j, i] = cross[a, j]
    for a in range(6):
        for b in range(6):
            P[_MOVED[a], _MOVED[b]] = covariance[a, b]
    for i in (ROLL, PITCH, YAW):
        x[i] = wrap_angle(x[i])
    _decay(x, P, dt, LATERAL_SPEED, noise.lateral_speed, noise.lateral_speed_time)
    _decay(x, P, dt, COMPASS_ERROR, noise.compass_error, noise.compass_error_time)
    _decay(x, P, dt, GNSS_EAST, noise.gnss_error, noise.gnss_error_time)
    _decay(x, P, dt, GNSS_NORTH, noise.gnss_error, noise.gnss_error_time)
    _add_walks(P, dt, noise)
    return True


@inlined_kernel
def _ways(k: int, dt: float, trig: NDArray[np.float64]) -> tuple[Vector, Vector]:
    """Return the way in the map per m/s forward, and per m/s to the left, of a point [s].

    Args:
        k: Index of the point.
        dt: Length of the step [s].
        trig: Table of the points' attitude.
    """
    sr, cr, sp, cp = trig[k, SIN_ROLL], trig[k, COS_ROLL], trig[k, SIN_PITCH], trig[k, COS_PITCH]
    sy, cy = trig[k, SIN_YAW], trig[k, COS_YAW]
    return (
        (dt * cy * cp, dt * sy * cp, -dt * sp),
        (dt * (cy * sp * sr - sy * cr), dt * (sy * sp * sr + cy * cr), dt * cp * sr),
    )


@borrowing_kernel
def _fill_remainder(
    imu: NDArray[np.float64],
    dt: float,
    forward: Vector,
    lateral: Vector,
    body: BodyParameters,
    workspace: Workspace,
) -> None:
    """Fill how each point's attitude and position change beyond the linear part.

    Args:
        imu: Inertial row.
        dt: Length of the step [s].
        forward: Way per m/s forward in the linear part [s].
        lateral: Way per m/s to the left in the linear part [s].
        body: Parameters of the robot.
        workspace: Buffers of the filter; the remainder of ``process`` is filled.
    """
    points, remainder, trig = workspace.process.points, workspace.process.remainder, workspace.trig
    for k in range(len(points)):
        sr, cr = trig[k, SIN_ROLL], trig[k, COS_ROLL]
        sp, cp = trig[k, SIN_PITCH], trig[k, COS_PITCH]
        # Body rates p, q, r: the gyro's reading less its bias.
        p = imu[GYRO] - points[k, GYRO_BIAS_X]
        q = imu[GYRO + 1] - points[k, GYRO_BIAS_Y]
        r = imu[GYRO + 2] - points[k, GYRO_BIAS_Z]
        # Attitude: rates of the z-y-x angles from body rates (Euler's kinematic equations).
        horizontal_rate = sr * q + cr * r
        remainder[k, 0] = dt * (p + horizontal_rate * sp / cp)
        remainder[k, 1] = dt * (cr * q - sr * r)
        remainder[k, 2] = dt * horizontal_rate / cp
        # Position: the velocity in the base, rotated into the map, less the linear part.
        ahead, aside = _ways(k, dt, trig)
        speed, lateral_speed = points[k, SPEED], points[k, LATERAL_SPEED]
        slid = sliding_speed(k, r, body, trig)
        for a in range(3):
            turned = (ahead[a] - forward[a]) * speed + (aside[a] - lateral[a]) * lateral_speed
            remainder[k, 3 + a] = turned - aside[a] * slid


@borrowing_kernel
def _apply_linear_part(
    rows: NDArray[np.float64], forward: Vector, lateral: Vector, out: NDArray[np.float64]
) -> None:
    """Apply the linear part to rows of the length of a state, and write them as columns.

    Args:
        rows: Rows, shape (k, 20).
        forward: Way per m/s forward [s].
        lateral: Way per m/s to the left [s].
        out: Buffer, shape (6, k).
    """
    for k in range(len(rows)):
        for a in range(3):
            out[a, k] = rows[k, ROLL + a]
            way = forward[a] * rows[k, SPEED] + lateral[a] * rows[k, LATERAL_SPEED]
            out[3 + a, k] = rows[k, X + a] + way


@inlined_kernel
def _decay(
    x: NDArray[np.float64], P: NDArray[np.float64], dt: float, i: int, sigma: float, time: float
) -> None:
    """Let a state of a first-order Gauss-Markov process decay over a step, in place.

    What it loses of its variance the process noise ``sigma^2 (1 - decay^2)`` gives back at the
    stationary standard deviation.

    Args:
        x: State, shape (20,).
        P: Covariance, shape (20, 20).
        dt: Length of the step [s].
        i: Index of the state.
        sigma: Stationary standard deviation.
        time: Correlation time [s].
    """
    factor = np.exp(-dt / time)
    x[i] *= factor
    for j in range(STATES):
        P[i, j] *= factor
        P[j, i] *= factor
    P[i, i] += sigma**2 * (1 - factor * factor)


@borrowing_kernel
def _add_walks(P: NDArray[np.float64], dt: float, noise: NoiseModel) -> None:
    """Add what random walks gain in a step [s], ``sigma^2 dt``, to a covariance, in place."""
    for a in range(3):
        P[ROLL + a, ROLL + a] += noise.gyro**2 * dt
        P[GYRO_BIAS_X + a, GYRO_BIAS_X + a] += noise.gyro_bias_walk**2 * dt
        P[X + a, X + a] += (noise.position_walk if a < 2 else noise.height_walk) ** 2 * dt
    P[SPEED, SPEED] += noise.speed_walk**2 * dt
    for a in range(2):
        P[HARD_IRON_X + a, HARD_IRON_X + a] += noise.hard_iron_walk**2 * dt
        P[ACCEL_BIAS_X + a, ACCEL_BIAS_X + a] += noise.accel_bias_walk**2 * dt
    P[WHEEL_SCALE, WHEEL_SCALE] += noise.wheel_scale_walk**2 * dt
    P[SLOPE_SLIP, SLOPE_SLIP] += noise.slope_slip_walk**2 * dt
