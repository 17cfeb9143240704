"""Process and measurement models of the robot's filter.

State, by index; the constants below name each element:

====== ============================================================================
0-2    roll, pitch, yaw of ``base_footprint`` in the map [rad], intrinsic z-y-x
3-5    bias of the gyro [rad/s]
6-8    position of ``base_footprint`` in the map [m]
9-10   forward speed, and lateral speed beyond what turning on a slope explains [m/s]
11-13  hard iron: magnetic field of the robot itself, in the base frame [uT]
14-15  time-correlated error of the satellite fixes, east and north [m]
16-17  bias of the accelerometer, forward and lateral [m/s2]
====== ============================================================================

Attitude and gyro bias come first: a sigma point differs from the mean in them only if it lies along
one of the first six rows of the covariance's Cholesky factor. Process and measurements are
affine in all other states, so that the points along the other rows need not be drawn; see
``ukf``. Of the 13 that are left, seven have sines of their own.

Process, for a gyro reading w and a step dt: attitude kinematics of z-y-x angles, position moved by
the speeds along the body's axes, first-order Gauss-Markov processes for lateral speed and satellite
error, random walks for all biases and the forward speed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.localization.ukf import (
    SigmaWeights,
    correct,
    correct_state,
    cross_covariance,
    draw_sigma_points,
    unscented_transform,
    wrap_angle,
)
from andabata.machine.proprioception import GRAVITY
from terrain.kernel import inlined_kernel, kernel

ROLL, PITCH, YAW = 0, 1, 2
GYRO_BIAS_X, GYRO_BIAS_Y, GYRO_BIAS_Z = 3, 4, 5
X, Y, Z = 6, 7, 8
SPEED, LATERAL_SPEED = 9, 10
HARD_IRON_X, HARD_IRON_Y, HARD_IRON_Z = 11, 12, 13
GNSS_EAST, GNSS_NORTH = 14, 15
ACCEL_BIAS_X, ACCEL_BIAS_Y = 16, 17

STATES = 18
"""Number of states."""

ATTITUDE = slice(ROLL, YAW + 1)
GYRO_BIAS = slice(GYRO_BIAS_X, GYRO_BIAS_Z + 1)
POSITION = slice(X, Z + 1)
HORIZONTAL = slice(X, Y + 1)
HARD_IRON = slice(HARD_IRON_X, HARD_IRON_Z + 1)
GNSS_ERROR = slice(GNSS_EAST, GNSS_NORTH + 1)
ACCEL_BIAS = slice(ACCEL_BIAS_X, ACCEL_BIAS_Y + 1)

ANGULAR = np.arange(STATES) <= YAW
"""True for states that are angles, shape (18,)."""

_ROWS = 6
"""Number of rows of the Cholesky factor that points are drawn along: the first ones, which change
attitude and gyro bias."""

_SIN_ROLL, _COS_ROLL, _SIN_PITCH, _COS_PITCH, _SIN_YAW, _COS_YAW, _CREEP, _TRIG_COLUMNS = range(8)
"""Columns of the table of a point's attitude, and their number."""

_ATTITUDE_ROWS = 3
"""Number of those that change the attitude, on which the magnetic field depends."""

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
    ]
)
"""States of the motion, which do not depend on the place on Earth: tilt, speeds, biases of gyro and
accelerometer. With a field from a model, magnetometer and fixes consider them (Schmidt 1966)."""

IMU, WHEELS, GRAVITY_UPDATE, COMPASS, GNSS, ZERO_RATE = range(6)
"""Rows of the table of counts, one per kind of measurement."""

SENSORS = ("imu", "wheels", "gravity", "compass", "gnss", "zero_rate")
"""Names of these rows."""

ACCEPTED, GATED, REJECTED = range(3)
"""Columns of the table of counts: accepted, beyond the gate, invalid."""

_STAMP, _GYRO, _FORCE = 0, 1, 4
"""First columns of an inertial row: stamp [s], angular velocity [rad/s], specific force [m/s2]."""

_LEFT, _RIGHT = 1, 2
"""Columns of an encoder row [rad/s]."""

_HORIZONTAL_SIGMA, _VERTICAL_SIGMA = 4, 5
"""Columns of a fix after stamp, x, y, z [m]."""

_STAMP_TOLERANCE = 1e-9
"""Largest difference of two stamps that count as the same instant [s]."""


class NoiseModel(NamedTuple):
    """Process and measurement noise, as standard deviations.

    Attributes:
        gyro: Process: noise density of the gyro [rad/sqrt(s)].
        gyro_bias_walk: Process: random walk of the gyro's bias [rad/s/sqrt(s)].
        position_walk: Process: horizontal error of dead reckoning [m/sqrt(s)].
        height_walk: Process: vertical error of dead reckoning [m/sqrt(s)].
        speed_walk: Process: random walk of the forward speed [m/s/sqrt(s)].
        lateral_speed: Process: stationary standard deviation of the lateral speed [m/s].
        lateral_speed_time: Process: correlation time of the lateral speed [s].
        hard_iron_walk: Process: random walk of the hard iron [uT/sqrt(s)].
        gnss_error: Process: stationary standard deviation of the correlated satellite error [m].
        gnss_error_time: Process: correlation time of that error [s].
        accel_bias_walk: Process: random walk of the accelerometer's bias [m/s2/sqrt(s)].
        wheel_speed: Measurement: forward speed by encoders [m/s].
        vibration: Measurement: acceleration other than gravity, horizontal; vertical is twice that
            [m/s2].
        mag: Measurement: an axis of the magnetometer [uT].
        zero_rate: Measurement: gyro reading at rest [rad/s].
    """

    gyro: float = 2e-4
    gyro_bias_walk: float = 2e-5
    position_walk: float = 0.01
    height_walk: float = 0.03
    speed_walk: float = 0.5
    lateral_speed: float = 0.012
    lateral_speed_time: float = 5.0
    hard_iron_walk: float = 0.001
    gnss_error: float = 0.25
    gnss_error_time: float = 60.0
    accel_bias_walk: float = 0.003
    wheel_speed: float = 0.05
    vibration: float = 0.75
    mag: float = 0.4
    zero_rate: float = 0.01


class BodyParameters(NamedTuple):
    """Parameters of the robot, and the magnetic field of the place.

    Attributes:
        wheel_radius: ``RobotModel.wheel_radius`` [m].
        creep: ``RobotModel.creep`` [m].
        creep_slope: ``RobotModel.creep_slope``.
        pivot: ``RobotModel.pivot`` [m].
        flux_east: Magnetic flux density to the east [uT].
        flux_north: Magnetic flux density to the north [uT].
        flux_up: Magnetic flux density upwards [uT].
        heading_only: True if the field is known only roughly. Magnetometer and fixes then correct
            heading, position and their own errors; tilt, speeds and biases depend on gravity, gyro
            and wheels alone, wherever on Earth the robot is.
        max_step: Longest step of a prediction [s]; longer gaps are rejected.
    """

    wheel_radius: float
    creep: float
    creep_slope: float
    pivot: float
    flux_east: float
    flux_north: float
    flux_up: float
    heading_only: bool = False
    max_step: float = 2.0


class Gates(NamedTuple):
    """Largest normalised innovations squared (NIS) that are accepted.

    Quantiles of the chi-square distribution at 0.999 with one and three degrees of freedom; for
    fixes, whose multipath is no noise, at 0.99 with three.

    Attributes:
        wheels: Gate of the forward speed by encoders.
        vector: Gate of gravity, magnetic field and gyro at rest.
        gnss: Gate of satellite fixes.
    """

    wheels: float = 10.83
    vector: float = 16.27
    gnss: float = 11.34


class Measurements(NamedTuple):
    """Measurements of a period, oldest first.

    Attributes:
        imu: Rows of stamp [s], angular velocity [rad/s], specific force [m/s2]; shape (k, 7).
        wheels: Rows of stamp [s], left, right wheel speed [rad/s]; shape (k, 3).
        mag: Rows of stamp [s], magnetic flux density in the base frame [uT]; shape (k, 4).
        gnss: Rows of stamp [s], x, y, z, horizontal and vertical sigma [m]; shape (k, 6).
    """

    imu: NDArray[np.float64]
    wheels: NDArray[np.float64]
    mag: NDArray[np.float64]
    gnss: NDArray[np.float64]


class Workspace(NamedTuple):
    """Buffers of the filter, allocated once.

    Attributes:
        points: Sigma points, shape (13, 18).
        deviations: Deviations of the points from the first, shape (13, 18).
        factor: First rows of the covariance's Cholesky factor, shape (6, 18).
        rest: Covariance of the points that are not drawn, shape (18, 18).
        rest_cross: Covariance of these points and their expected measurement, shape (3, 18).
        predicted: Expected measurement of each point, shape (13, 3).
        expected: Expected measurement, shape (3,).
        innovation: Measurement less expectation, shape (3,).
        S: Covariance of the innovation, shape (3, 3).
        cross: Covariance of state and expected measurement, shape (3, 18).
        gain: Kalman gain, shape (3, 18).
        trig: Sine and cosine of roll, pitch and yaw of each point, and its share of the creep,
            shape (13, 7).
        angular: ``ANGULAR``, as compiled code takes it.
    """

    points: NDArray[np.float64]
    deviations: NDArray[np.float64]
    factor: NDArray[np.float64]
    rest: NDArray[np.float64]
    rest_cross: NDArray[np.float64]
    predicted: NDArray[np.float64]
    expected: NDArray[np.float64]
    innovation: NDArray[np.float64]
    S: NDArray[np.float64]
    cross: NDArray[np.float64]
    gain: NDArray[np.float64]
    trig: NDArray[np.float64]
    angular: NDArray[np.bool_]

    @classmethod
    def allocate(cls) -> "Workspace":
        """Return new buffers."""
        n, p = STATES, 2 * _ROWS + 1
        return cls(
            points=np.zeros((p, n)),
            deviations=np.zeros((p, n)),
            factor=np.zeros((_ROWS, n)),
            rest=np.zeros((n, n)),
            rest_cross=np.zeros((3, n)),
            predicted=np.zeros((p, 3)),
            expected=np.zeros(3),
            innovation=np.zeros(3),
            S=np.zeros((3, 3)),
            cross=np.zeros((3, n)),
            gain=np.zeros((3, n)),
            trig=np.zeros((p, _TRIG_COLUMNS)),
            angular=ANGULAR.copy(),
        )


class FilterModel(NamedTuple):
    """All parameters of the filter.

    Attributes:
        body: Parameters of the robot, and the magnetic field.
        noise: Process and measurement noise.
        gates: Limits of the NIS.
        weights: Weights of the sigma points.
    """

    body: BodyParameters
    noise: NoiseModel
    gates: Gates
    weights: SigmaWeights


@kernel
def _fill_trigonometry(rows: int, body: BodyParameters, workspace: Workspace) -> None:
    """Fill the sines and cosines of each point's attitude, and its share of the creep.

    Args:
        rows: Number of rows of the Cholesky factor that points were drawn along.
        body: Parameters of the robot.
        workspace: Buffers of the filter.
    """
    points, trig = workspace.points, workspace.trig
    for k in range(2 * rows + 1):
        # Points along a row of the Cholesky factor have the angles before it of the mean.
        same = (k - 1) % rows if k > 0 else 0
        for a in range(3):
            if a < same:
                trig[k, 2 * a], trig[k, 2 * a + 1] = trig[0, 2 * a], trig[0, 2 * a + 1]
            else:
                trig[k, 2 * a] = np.sin(points[k, a])
                trig[k, 2 * a + 1] = np.cos(points[k, a])
        if same > ROLL:
            trig[k, _CREEP] = trig[0, _CREEP]
        else:
            trig[k, _CREEP] = np.tanh(trig[k, _SIN_ROLL] / body.creep_slope)


@inlined_kernel
def _lateral_speed(k: int, yaw_rate: float, body: BodyParameters, workspace: Workspace) -> float:
    """Return the lateral speed of a point [m/s] that turns at a yaw rate [rad/s].

    A turning body creeps down a cross slope and turns about a point uphill of its middle, as the
    kinematic plant does.
    """
    trig = workspace.trig
    sliding = (
        abs(yaw_rate) * body.creep * trig[k, _CREEP] + yaw_rate * body.pivot * trig[k, _SIN_PITCH]
    )
    return workspace.points[k, LATERAL_SPEED] - sliding


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
    if not _draw_points(x, P, _ROWS, model, workspace):
        return False
    for i in range(_ROWS, STATES):
        if not _find_rest(P, i, _ROWS, workspace) > 0.0:
            return False
    # Decay of the two Gauss-Markov processes.
    lateral_decay = np.exp(-dt / noise.lateral_speed_time)
    gnss_decay = np.exp(-dt / noise.gnss_error_time)
    wx, wy, wz = imu[_GYRO], imu[_GYRO + 1], imu[_GYRO + 2]
    for k in range(points.shape[0]):
        sr, cr = trig[k, _SIN_ROLL], trig[k, _COS_ROLL]
        sp, cp = trig[k, _SIN_PITCH], trig[k, _COS_PITCH]
        sy, cy = trig[k, _SIN_YAW], trig[k, _COS_YAW]
        # Body rates p, q, r: the gyro's reading less its bias.
        p = wx - points[k, GYRO_BIAS_X]
        q = wy - points[k, GYRO_BIAS_Y]
        r = wz - points[k, GYRO_BIAS_Z]
        # Position: the velocity in the base, rotated into the map.
        forward, lateral = points[k, SPEED], _lateral_speed(k, r, body, workspace)
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
def _draw_points(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    rows: int,
    model: FilterModel,
    workspace: Workspace,
) -> bool:
    """Draw the sigma points along the first rows of the Cholesky factor, with their sines.

    Returns:
        True if the covariance is positive definite, as far as it is factorised.
    """
    factor, points = workspace.factor[:rows], workspace.points[: 2 * rows + 1]
    if not draw_sigma_points(x, P, model.weights.reach, factor, points):
        return False
    _fill_trigonometry(rows, model.body, workspace)
    return True


@inlined_kernel
def _find_rest(P: NDArray[np.float64], i: int, rows: int, workspace: Workspace) -> float:
    """Fill a row of the covariance of the points that are not drawn, ``P - U' U``.

    Args:
        P: Covariance, shape (18, 18).
        i: State whose row of ``rest`` is filled, ``rows`` or more.
        rows: Number of rows of the Cholesky factor ``U`` that points were drawn along.
        workspace: Buffers of the filter.

    Returns:
        Variance of the state in these points.
    """
    factor, rest = workspace.factor, workspace.rest
    for j in range(STATES):
        rest[i, j] = P[i, j]
    for k in range(rows):
        share = factor[k, i]
        for j in range(STATES):
            rest[i, j] -= share * factor[k, j]
    return float(rest[i, i])


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
        trig[0, _SIN_ROLL],
        trig[0, _COS_ROLL],
        trig[0, _SIN_PITCH],
        trig[0, _COS_PITCH],
    )
    sy, cy = trig[0, _SIN_YAW], trig[0, _COS_YAW]
    # Metres along x, y and z per metre a second forward and to the left; see ``predict``.
    forward = (dt * cy * cp, dt * sy * cp, -dt * sp)
    lateral = (dt * (cy * sp * sr - sy * cr), dt * (sy * sp * sr + cy * cr), dt * cp * sr)
    n = len(rest)
    for a in range(3):
        for j in range(_ROWS, n):
            rest[X + a, j] += forward[a] * rest[SPEED, j] + lateral[a] * rest[LATERAL_SPEED, j]
    for a in range(3):
        for i in range(_ROWS, n):
            rest[i, X + a] += forward[a] * rest[i, SPEED] + lateral[a] * rest[i, LATERAL_SPEED]
    for j in range(_ROWS, n):
        rest[LATERAL_SPEED, j] *= lateral_decay
        rest[GNSS_EAST, j] *= gnss_decay
        rest[GNSS_NORTH, j] *= gnss_decay
    for i in range(_ROWS, n):
        rest[i, LATERAL_SPEED] *= lateral_decay
        rest[i, GNSS_EAST] *= gnss_decay
        rest[i, GNSS_NORTH] *= gnss_decay
        for j in range(_ROWS, i + 1):
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
    if not _draw_points(x, P, _ROWS, model, workspace):
        return np.nan
    for k in range(points.shape[0]):
        sr, cr = trig[k, _SIN_ROLL], trig[k, _COS_ROLL]
        sp, cp = trig[k, _SIN_PITCH], trig[k, _COS_PITCH]
        p = imu[_GYRO] - points[k, GYRO_BIAS_X]
        q = imu[_GYRO + 1] - points[k, GYRO_BIAS_Y]
        r = imu[_GYRO + 2] - points[k, GYRO_BIAS_Z]
        # Specific force f = R' (0, 0, g) + w x v + bias, with v = (forward, lateral, 0).
        forward, lateral = points[k, SPEED], _lateral_speed(k, r, body, workspace)
        predicted[k, 0] = -GRAVITY * sp - r * lateral + points[k, ACCEL_BIAS_X]
        predicted[k, 1] = GRAVITY * cp * sr + r * forward + points[k, ACCEL_BIAS_Y]
        predicted[k, 2] = GRAVITY * cp * cr + p * lateral - q * forward
    _transform_measurement(_ROWS, model.weights, workspace)
    # Points that are not drawn have the rates of the mean: the rest is affine in speeds and biases.
    cross, S, rest = workspace.cross, workspace.S, workspace.rest
    for i in (SPEED, LATERAL_SPEED, ACCEL_BIAS_X, ACCEL_BIAS_Y):
        _find_rest(P, i, _ROWS, workspace)
    p, q = imu[_GYRO] - x[GYRO_BIAS_X], imu[_GYRO + 1] - x[GYRO_BIAS_Y]
    r = imu[_GYRO + 2] - x[GYRO_BIAS_Z]
    shown = workspace.rest_cross
    for i in range(_ROWS, STATES):
        shown[0, i] = rest[ACCEL_BIAS_X, i] - r * rest[LATERAL_SPEED, i]
        shown[1, i] = rest[ACCEL_BIAS_Y, i] + r * rest[SPEED, i]
        shown[2, i] = p * rest[LATERAL_SPEED, i] - q * rest[SPEED, i]
    for b in range(3):
        for i in range(_ROWS, STATES):
            cross[b, i] += shown[b, i]
        S[0, b] += shown[b, ACCEL_BIAS_X] - r * shown[b, LATERAL_SPEED]
        S[1, b] += shown[b, ACCEL_BIAS_Y] + r * shown[b, SPEED]
        S[2, b] += p * shown[b, LATERAL_SPEED] - q * shown[b, SPEED]
    variance = model.noise.vibration**2
    variances = (variance, variance, 4 * variance)
    return _correct_by_moments(x, P, imu[_FORCE:], variances, model.gates.vector, workspace)


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
    if not _draw_points(x, P, _ATTITUDE_ROWS, model, workspace):
        return np.nan
    for k in range(2 * _ATTITUDE_ROWS + 1):
        sr, cr = trig[k, _SIN_ROLL], trig[k, _COS_ROLL]
        sp, cp = trig[k, _SIN_PITCH], trig[k, _COS_PITCH]
        sy, cy = trig[k, _SIN_YAW], trig[k, _COS_YAW]
        # Field of the Earth turned into the base, by yaw, pitch and roll in turn, plus hard iron.
        ahead = cy * body.flux_east + sy * body.flux_north
        aside = cy * body.flux_north - sy * body.flux_east
        up = sp * ahead + cp * body.flux_up
        predicted[k, 0] = cp * ahead - sp * body.flux_up + points[k, HARD_IRON_X]
        predicted[k, 1] = cr * aside + sr * up + points[k, HARD_IRON_Y]
        predicted[k, 2] = cr * up - sr * aside + points[k, HARD_IRON_Z]
    _transform_measurement(_ATTITUDE_ROWS, model.weights, workspace)
    # Points that are not drawn have the attitude of the mean, and hard iron of their own.
    cross, S, rest = workspace.cross, workspace.S, workspace.rest
    for a in range(3):
        _find_rest(P, HARD_IRON_X + a, _ATTITUDE_ROWS, workspace)
        for i in range(_ATTITUDE_ROWS, STATES):
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
    horizontal, vertical = fix[_HORIZONTAL_SIGMA] ** 2, fix[_VERTICAL_SIGMA] ** 2
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
    return _correct_by_moments(x, P, imu[_GYRO:_FORCE], variances, model.gates.vector, workspace)


@kernel
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


@kernel
def _count(counts: NDArray[np.int64], sensor: int, nis: float, gate: float) -> None:
    """Count a measurement as accepted, gated or, if its NIS is NaN, rejected."""
    if nis <= gate:
        counts[sensor, ACCEPTED] += 1
    elif nis > gate:
        counts[sensor, GATED] += 1
    else:
        counts[sensor, REJECTED] += 1


@kernel
def _is_finite(row: NDArray[np.float64]) -> bool:
    """Return true if all numbers of a row are finite."""
    return bool(np.isfinite(row).all())


@kernel
def _take_wheels(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    now: float,
    rows: NDArray[np.float64],
    first: int,
    model: FilterModel,
    workspace: Workspace,
    counts: NDArray[np.int64],
) -> tuple[int, bool]:
    """Correct with the encoder rows up to an instant.

    Args:
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
        now: Stamp of the state [s].
        rows: Encoder rows of the period, shape (k, 3).
        first: Index of the first row that was not taken yet.
        model: Parameters of the filter.
        workspace: Buffers of the filter.
        counts: Table of counts, changed in place.

    Returns:
        Index of the next row, and true if the last valid row says that the wheels stand still.
    """
    still = False
    while first < len(rows) and not rows[first, _STAMP] > now + _STAMP_TOLERANCE:
        if _is_finite(rows[first]):
            left, right = rows[first, _LEFT], rows[first, _RIGHT]
            speed = model.body.wheel_radius * (left + right) / 2
            still = left == 0.0 and right == 0.0
            nis = correct_wheels(x, P, speed, model, workspace)
            _count(counts, WHEELS, nis, model.gates.wheels)
        else:
            counts[WHEELS, REJECTED] += 1
        first += 1
    return first, still


@kernel
def _take_mag(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    now: float,
    rows: NDArray[np.float64],
    first: int,
    model: FilterModel,
    workspace: Workspace,
    counts: NDArray[np.int64],
) -> int:
    """Correct with the magnetometer rows up to an instant; see ``_take_wheels``.

    Returns:
        Index of the next row.
    """
    old_x, old_P = x, P
    while first < len(rows) and not rows[first, _STAMP] > now + _STAMP_TOLERANCE:
        if _is_finite(rows[first]):
            if model.body.heading_only:
                old_x, old_P = x.copy(), P.copy()
            nis = correct_mag(x, P, rows[first], model, workspace)
            if model.body.heading_only:
                _restore_considered(x, P, old_x, old_P)
            _count(counts, COMPASS, nis, model.gates.vector)
        else:
            counts[COMPASS, REJECTED] += 1
        first += 1
    return first


@kernel
def _take_gnss(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    now: float,
    rows: NDArray[np.float64],
    first: int,
    model: FilterModel,
    workspace: Workspace,
    counts: NDArray[np.int64],
) -> int:
    """Correct with the satellite fixes up to an instant; see ``_take_wheels``.

    Returns:
        Index of the next row.
    """
    old_x, old_P = x, P
    while first < len(rows) and not rows[first, _STAMP] > now + _STAMP_TOLERANCE:
        if _is_finite(rows[first]):
            if model.body.heading_only:
                old_x, old_P = x.copy(), P.copy()
            nis = correct_gnss(x, P, rows[first], model, workspace)
            if model.body.heading_only:
                _restore_considered(x, P, old_x, old_P)
            _count(counts, GNSS, nis, model.gates.gnss)
        else:
            counts[GNSS, REJECTED] += 1
        first += 1
    return first


@kernel
def run_period(
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    now: float,
    odometry: NDArray[np.float64],
    measurements: Measurements,
    model: FilterModel,
    workspace: Workspace,
    counts: NDArray[np.int64],
    track: NDArray[np.float64],
) -> tuple[float, int, bool]:
    """Filter one period: predict from inertial row to inertial row, and correct in between.

    Each measurement corrects the state at the first inertial row that is not older than it: at most
    10 ms late. Rows that are not finite, or whose stamps decrease, are rejected and counted.

    Args:
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
        now: Stamp of the state [s].
        odometry: Dead reckoning x, y, z [m] and yaw [rad], changed in place, shape (4,).
        measurements: Measurements of the period.
        model: Parameters of the filter.
        workspace: Buffers of the filter.
        counts: Table of counts by sensor, changed in place, shape (6, 3).
        track: Buffer of stamp [s], position [m] and quaternion in ``odom`` at each inertial row,
            shape (k, 8).

    Returns:
        New stamp of the state [s], number of rows of the track that were filled, and true if the
        covariance stayed positive definite.
    """
    imu = measurements.imu
    filled = 0
    next_wheels = next_mag = next_gnss = 0
    for i in range(len(imu)):
        dt = imu[i, _STAMP] - now
        is_valid = np.isfinite(imu[i, _STAMP]) and _is_finite(imu[i, _GYRO:_FORCE])
        if not is_valid or not 0.0 < dt <= model.body.max_step:
            counts[IMU, REJECTED] += 1
            continue
        if not predict(x, P, imu[i], dt, model, workspace):
            return now, filled, False
        now = imu[i, _STAMP]
        counts[IMU, ACCEPTED] += 1
        next_wheels, still = _take_wheels(
            x, P, now, measurements.wheels, next_wheels, model, workspace, counts
        )
        # A bridged gap has no specific force, which is NaN there.
        if _is_finite(imu[i]):
            nis = correct_gravity(x, P, imu[i], model, workspace)
            _count(counts, GRAVITY_UPDATE, nis, model.gates.vector)
            if still:
                nis = correct_zero_rate(x, P, imu[i], model, workspace)
                _count(counts, ZERO_RATE, nis, model.gates.vector)
        next_mag = _take_mag(x, P, now, measurements.mag, next_mag, model, workspace, counts)
        next_gnss = _take_gnss(x, P, now, measurements.gnss, next_gnss, model, workspace, counts)
        _advance_odometry(x, imu[i], dt, model.body, odometry)
        _write_pose(now, x, odometry, track[filled])
        filled += 1
    return now, filled, True


@kernel
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
        x: State after the step, shape (18,).
        imu: Inertial row, shape (7,).
        dt: Length of the step [s].
        body: Parameters of the robot.
        odometry: Dead reckoning x, y, z [m] and yaw [rad], changed in place, shape (4,).
    """
    sr, cr, sp, cp = np.sin(x[ROLL]), np.cos(x[ROLL]), np.sin(x[PITCH]), np.cos(x[PITCH])
    yaw_rate = imu[_GYRO + 2] - x[GYRO_BIAS_Z]
    horizontal_rate = sr * (imu[_GYRO + 1] - x[GYRO_BIAS_Y]) + cr * yaw_rate
    lateral = x[LATERAL_SPEED] - yaw_rate * body.pivot * sp
    lateral -= abs(yaw_rate) * body.creep * np.tanh(sr / body.creep_slope)
    odometry[3] = wrap_angle(odometry[3] + dt * horizontal_rate / cp)
    sy, cy = np.sin(odometry[3]), np.cos(odometry[3])
    level = cp * x[SPEED] + sp * sr * lateral
    odometry[0] += dt * (cy * level - sy * cr * lateral)
    odometry[1] += dt * (sy * level + cy * cr * lateral)
    odometry[2] += dt * (-sp * x[SPEED] + cp * sr * lateral)


@kernel
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
