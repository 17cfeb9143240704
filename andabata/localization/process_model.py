"""The robot's model: the state, how it moves, and what each sensor is expected to say of it.

The state, by index:

====== ============================================================================
0-2    roll, pitch, yaw of ``base_footprint`` in the map [rad], intrinsic z-y-x
3-5    bias of the gyro [rad/s]
6-8    position of ``base_footprint`` in the map [m]
9-10   forward speed, and sideways speed beyond what turning on a slope explains [m/s]
11-13  magnetic field that the robot itself makes, in the base frame [uT]
14-15  wandering error of the satellite fixes, east and north [m]
16-17  bias of the accelerometer, forward and sideways [m/s2]
====== ============================================================================

The attitude comes first: of the 37 sigma points only seven differ in it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.localization.ukf import (
    Spread,
    combine_points,
    correct,
    correct_one,
    cross_points,
    draw_points,
    turn_of,
)
from andabata.machine.proprioception import GRAVITY
from terrain.kernel import kernel

STATES = 18
ANGULAR = np.array([True] * 3 + [False] * 15)
_ATTITUDES = 3
"""The first columns of the Cholesky factor, those that move the attitude."""

IMU, WHEELS, GRAVITY_SENSE, COMPASS, FIX, REST = range(6)
"""Sensors, each with a row of counts."""

SENSORS = ("imu", "wheels", "gravity", "compass", "gnss", "rest")


class Noise(NamedTuple):
    """Numbers of the model, all of them standard deviations.

    Attributes:
        turn: Gyro noise [rad/sqrt(s)].
        bias_walk: Of the gyro's bias [rad/s/sqrt(s)].
        slip: Horizontal position error that dead reckoning gathers [m/sqrt(s)].
        heave: Vertical one [m/sqrt(s)].
        push: Random walk of the forward speed [m/s/sqrt(s)].
        drift: Sideways speed in the long run [m/s].
        drift_time: Its correlation time [s].
        iron_walk: Of the robot's own field [uT/sqrt(s)].
        wander: Of the satellite error in the long run [m].
        wander_time: Its correlation time [s].
        force_walk: Of the accelerometer's bias [m/s2/sqrt(s)].
        wheels: Forward speed by encoders [m/s].
        shake: Acceleration that is not gravity, level; twice that upright [m/s2].
        compass: A magnetometer's axis [uT].
        rest: Gyro reading at rest [rad/s].
    """

    turn: float = 2e-4
    bias_walk: float = 2e-5
    slip: float = 0.01
    heave: float = 0.03
    push: float = 0.5
    drift: float = 0.012
    drift_time: float = 5.0
    iron_walk: float = 0.001
    wander: float = 0.25
    wander_time: float = 60.0
    force_walk: float = 0.003
    wheels: float = 0.05
    shake: float = 0.75
    compass: float = 0.4
    rest: float = 0.01


class Body(NamedTuple):
    """Numbers of the robot and of the place.

    Attributes:
        radius: Of the wheels [m].
        creep: See ``RobotModel``, as the next two.
        creep_slope: See there.
        pivot: See there.
        flux_x: Magnetic field to the east [uT].
        flux_y: To the north [uT].
        flux_z: Upwards [uT].
        loose: Whether the field is known only roughly: compass and fixes then correct heading,
            place and their own errors, while tilt, speeds and biases are those of gravity, gyro and
            wheels, wherever on Earth the robot is.
        period: Longest step of a prediction [s]; longer gaps are refused.
    """

    radius: float
    creep: float
    creep_slope: float
    pivot: float
    flux_x: float
    flux_y: float
    flux_z: float
    loose: bool = False
    period: float = 2.0


class Gates(NamedTuple):
    """Largest squared Mahalanobis distances that are believed.

    Chi-square limits at 0.999, and for fixes, whose detours are no noise, at 0.99.
    """

    wheels: float = 10.83
    vector: float = 16.27
    fix: float = 11.34


class Sensed(NamedTuple):
    """What was measured in a period, oldest first.

    Attributes:
        imu: Rows of stamp [s], angular velocity [rad/s], specific force [m/s2]; shape (k, 7).
        wheels: Rows of stamp, left, right wheel speed [rad/s]; shape (k, 3).
        field: Rows of stamp, flux density [uT]; shape (k, 4).
        fixes: Rows of stamp, x, y, z, horizontal and vertical sigma [m]; shape (k, 6).
    """

    imu: NDArray[np.float64]
    wheels: NDArray[np.float64]
    field: NDArray[np.float64]
    fixes: NDArray[np.float64]


class Room(NamedTuple):
    """Arrays that live as long as the filter."""

    points: NDArray[np.float64]
    deviations: NDArray[np.float64]
    factor: NDArray[np.float64]
    seen: NDArray[np.float64]
    apart: NDArray[np.float64]
    expected: NDArray[np.float64]
    innovation: NDArray[np.float64]
    spread: NDArray[np.float64]
    cross: NDArray[np.float64]
    gain: NDArray[np.float64]
    trig: NDArray[np.float64]
    angular: NDArray[np.bool_]
    flat: NDArray[np.bool_]

    @classmethod
    def make(cls) -> "Room":
        """Return fresh arrays."""
        n, p = STATES, 2 * STATES + 1
        return cls(
            np.zeros((p, n)),
            np.zeros((p, n)),
            np.zeros((n, n)),
            np.zeros((p, 3)),
            np.zeros((p, 3)),
            np.zeros(3),
            np.zeros(3),
            np.zeros((3, 3)),
            np.zeros((n, 3)),
            np.zeros((n, 3)),
            np.zeros((p, 7)),
            ANGULAR.copy(),
            np.zeros(3, dtype=np.bool_),
        )


class Weights(NamedTuple):
    """A ``Spread`` as compiled code takes it."""

    gain: float
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

    @classmethod
    def make(cls) -> "Weights":
        """Return the weights of the state's sigma points."""
        spread = Spread.merwe(STATES)
        return cls(spread.gain, spread.mean, spread.covariance)


class Belief(NamedTuple):
    """All numbers of the filter."""

    body: Body
    noise: Noise
    gates: Gates
    weights: Weights


@kernel
def _turns(body, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill what each point's attitude decides; most points share the mean's.

    That is sine and cosine of roll, pitch and yaw, and the share of the creep.
    """
    points, trig = room.points, room.trig
    n = points.shape[1]
    for k in range(points.shape[0]):
        column = (k - 1) % n
        if k == 0 or column < _ATTITUDES:
            for a in range(3):
                trig[k, 2 * a] = np.sin(points[k, a])
                trig[k, 2 * a + 1] = np.cos(points[k, a])
            trig[k, 6] = np.tanh(trig[k, 0] / body.creep_slope)
        else:
            for a in range(7):
                trig[k, a] = trig[0, a]


@kernel
def _aside(k, rate, body, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the sideways speed of a point that turns at a rate [rad/s]."""
    sliding = abs(rate) * body.creep * room.trig[k, 6] + rate * body.pivot * room.trig[k, 2]
    return room.points[k, 10] - sliding


@kernel
def predict(x, P, wx, wy, wz, dt, body, noise, weights, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Move the state by a step of ``dt`` [s] with a gyro reading [rad/s].

    Returns:
        Whether the covariance is still positive definite.
    """
    points = room.points
    if not draw_points(x, P, weights.gain, room.factor, points):
        return False
    _turns(body, room)
    fade, forget = np.exp(-dt / noise.drift_time), np.exp(-dt / noise.wander_time)
    trig = room.trig
    for k in range(points.shape[0]):
        sr, cr, sp, cp = trig[k, 0], trig[k, 1], trig[k, 2], trig[k, 3]
        sy, cy = trig[k, 4], trig[k, 5]
        p, q, r = wx - points[k, 3], wy - points[k, 4], wz - points[k, 5]
        ahead, aside = points[k, 9], _aside(k, r, body, room)
        level = cp * ahead + sp * sr * aside
        points[k, 6] += dt * (cy * level - sy * cr * aside)
        points[k, 7] += dt * (sy * level + cy * cr * aside)
        points[k, 8] += dt * (-sp * ahead + cp * sr * aside)
        lean = sr * q + cr * r
        points[k, 0] += dt * (p + lean * sp / cp)
        points[k, 1] += dt * (cr * q - sr * r)
        points[k, 2] += dt * lean / cp
        points[k, 10] *= fade
        points[k, 14] *= forget
        points[k, 15] *= forget
    combine_points(points, weights.mean, weights.covariance, room.angular, x, room.deviations, P)
    for a in range(3):
        P[a, a] += noise.turn**2 * dt
        P[3 + a, 3 + a] += noise.bias_walk**2 * dt
        P[6 + a, 6 + a] += (noise.slip if a < 2 else noise.heave) ** 2 * dt
        P[11 + a, 11 + a] += noise.iron_walk**2 * dt
    P[9, 9] += noise.push**2 * dt
    P[10, 10] += noise.drift**2 * (1 - fade * fade)
    for a in range(2):
        P[14 + a, 14 + a] += noise.wander**2 * (1 - forget * forget)
        P[16 + a, 16 + a] += noise.force_walk**2 * dt
    return True


@kernel
def _finish(x, P, z0, z1, z2, r0, r1, r2, gate, weights, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Correct with a measurement whose expectations stand in the room.

    Returns:
        The squared Mahalanobis distance.
    """
    seen, expected = room.seen, room.expected
    combine_points(
        seen, weights.mean, weights.covariance, room.flat, expected, room.apart, room.spread
    )
    cross_points(room.factor, weights.gain, weights.covariance[1], seen, room.cross)
    return _innovate(x, P, z0, z1, z2, r0, r1, r2, gate, room)


@kernel
def _innovate(x, P, z0, z1, z2, r0, r1, r2, gate, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Correct with a measurement whose expectation and covariances stand in the room."""
    room.spread[0, 0] += r0
    room.spread[1, 1] += r1
    room.spread[2, 2] += r2
    room.innovation[0] = z0 - room.expected[0]
    room.innovation[1] = z1 - room.expected[1]
    room.innovation[2] = z2 - room.expected[2]
    return correct(x, P, room.angular, room.cross, room.spread, room.innovation, gate, room.gain)


@kernel
def see_wheels(x, P, speed, noise, gate, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Correct with the encoders' forward speed [m/s]."""
    return correct_one(x, P, room.angular, 9, speed, noise.wheels**2, gate, room.gain)


@kernel
def see_gravity(x, P, imu, body, noise, gate, weights, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Correct with a specific force [m/s2]: gravity and what turning while driving adds.

    ``imu`` is stamp, angular velocity and specific force, shape (7,). Wheels on rough ground shake
    it, mostly up and down. Its length is no reason to believe it less: choosing the quiet instants
    would make gravity look smaller and lean the robot on every slope.
    """
    if not draw_points(x, P, weights.gain, room.factor, room.points):
        return np.nan
    _turns(body, room)
    for k in range(room.points.shape[0]):
        sr, cr, sp, cp = room.trig[k, 0], room.trig[k, 1], room.trig[k, 2], room.trig[k, 3]
        p, q, r = imu[1] - room.points[k, 3], imu[2] - room.points[k, 4], imu[3] - room.points[k, 5]
        ahead, aside = room.points[k, 9], _aside(k, r, body, room)
        room.seen[k, 0] = -GRAVITY * sp - r * aside + room.points[k, 16]
        room.seen[k, 1] = GRAVITY * cp * sr + r * ahead + room.points[k, 17]
        room.seen[k, 2] = GRAVITY * cp * cr + p * aside - q * ahead
    r0 = noise.shake**2
    return _finish(x, P, imu[4], imu[5], imu[6], r0, r0, 4 * r0, gate, weights, room)


@kernel
def see_field(x, P, field, body, noise, gate, weights, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Correct with a magnetic field: stamp and flux density in the base frame [uT], shape (4,)."""
    if not draw_points(x, P, weights.gain, room.factor, room.points):
        return np.nan
    _turns(body, room)
    for k in range(room.points.shape[0]):
        sr, cr, sp, cp = room.trig[k, 0], room.trig[k, 1], room.trig[k, 2], room.trig[k, 3]
        sy, cy = room.trig[k, 4], room.trig[k, 5]
        ahead = cy * body.flux_x + sy * body.flux_y
        aside = cy * body.flux_y - sy * body.flux_x
        up = sp * ahead + cp * body.flux_z
        room.seen[k, 0] = cp * ahead - sp * body.flux_z + room.points[k, 11]
        room.seen[k, 1] = cr * aside + sr * up + room.points[k, 12]
        room.seen[k, 2] = cr * up - sr * aside + room.points[k, 13]
    r0 = noise.compass**2
    return _finish(x, P, field[1], field[2], field[3], r0, r0, r0, gate, weights, room)


@kernel
def see_fix(x, P, fix, gate, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Correct with a fix: stamp, x, y, z [m], horizontal and vertical sigma [m], shape (6,).

    It is linear in the state, so that no points have to be drawn, as in ``see_rest``.
    """
    cross = room.cross
    for i in range(STATES):
        cross[i, 0] = P[i, 6] + P[i, 14]
        cross[i, 1] = P[i, 7] + P[i, 15]
        cross[i, 2] = P[i, 8]
    for j in range(3):
        room.spread[0, j] = cross[6, j] + cross[14, j]
        room.spread[1, j] = cross[7, j] + cross[15, j]
        room.spread[2, j] = cross[8, j]
    room.expected[0], room.expected[1], room.expected[2] = x[6] + x[14], x[7] + x[15], x[8]
    r0, r2 = fix[4] ** 2, fix[5] ** 2
    return _innovate(x, P, fix[1], fix[2], fix[3], r0, r0, r2, gate, room)


_MOTION = np.array([0, 1, 3, 4, 5, 9, 10, 16, 17])
"""States of the motion, which need no place on Earth: tilt, speeds, biases of gyro and
accelerometer."""


@kernel
def _keep(x, P, old_x, old_P):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Put the motion's states back as they were before a correction.

    Their covariance with the other states stays corrected: that is the filter of Schmidt (1966),
    which considers states that a measurement does not correct.
    """
    for i in _MOTION:
        x[i] = old_x[i]
        for j in _MOTION:
            P[i, j] = old_P[i, j]


@kernel
def see_rest(x, P, imu, noise, gate, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Correct the gyro's bias with what it reads while the wheels stand still."""
    for a in range(3):
        for i in range(STATES):
            room.cross[i, a] = P[i, 3 + a]
        for b in range(3):
            room.spread[a, b] = P[3 + a, 3 + b]
        room.expected[a] = x[3 + a]
    r0 = noise.rest**2
    return _innovate(x, P, imu[1], imu[2], imu[3], r0, r0, r0, gate, room)


@kernel
def _count(counts, sensor, distance, gate):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Count a measurement as believed, gated or refused: columns 0, 1 and 2."""
    if distance <= gate:
        counts[sensor, 0] += 1
    elif distance > gate:
        counts[sensor, 1] += 1
    else:
        counts[sensor, 2] += 1


@kernel
def _whole(row):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return whether all numbers of a row are finite."""
    return np.isfinite(row).all()


@kernel
def run_period(x, P, now, odometry, sensed, belief, room, counts, track):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Take in one period: predict from inertial row to inertial row, and correct in between.

    Each measurement corrects the state at the first inertial row that is not older than it: at most
    10 ms late. What is not finite, or runs back, is refused and counted.

    Args:
        x: State, changed in place, shape (18,).
        P: Covariance, changed in place, shape (18, 18).
        now: Stamp of the state [s].
        odometry: x, y, z [m] and yaw [rad] of dead reckoning, changed in place, shape (4,).
        sensed: A ``Sensed``.
        belief: A ``Belief``.
        room: Arrays to work in.
        counts: Believed, gated and refused measurements of each sensor, changed in place.
        track: Room for stamp, position and quaternion in the frame of the odometry at each
            inertial row, shape (k, 8).

    Returns:
        The state's new stamp [s], the rows of the track that were filled, and whether the
        covariance held.
    """
    imu, wheels, field, fixes = sensed
    body, noise, gates, weights = belief
    filled = 0
    w = m = f = 0
    old_x, old_P = x, P
    for i in range(len(imu)):
        dt = imu[i, 0] - now
        turning = np.isfinite(imu[i, 0]) and _whole(imu[i, 1:4])
        if not turning or not 0.0 < dt <= body.period:
            counts[IMU, 2] += 1
            continue
        if not predict(x, P, imu[i, 1], imu[i, 2], imu[i, 3], dt, body, noise, weights, room):
            return now, filled, False
        now = imu[i, 0]
        counts[IMU, 0] += 1
        still = False
        while w < len(wheels) and not wheels[w, 0] > now + 1e-9:
            if _whole(wheels[w]):
                speed = body.radius * (wheels[w, 1] + wheels[w, 2]) / 2
                still = wheels[w, 1] == 0.0 and wheels[w, 2] == 0.0
                distance = see_wheels(x, P, speed, noise, gates.wheels, room)
                _count(counts, WHEELS, distance, gates.wheels)
            else:
                counts[WHEELS, 2] += 1
            w += 1
        if _whole(imu[i]):
            distance = see_gravity(x, P, imu[i], body, noise, gates.vector, weights, room)
            _count(counts, GRAVITY_SENSE, distance, gates.vector)
            if still:
                distance = see_rest(x, P, imu[i], noise, gates.vector, room)
                _count(counts, REST, distance, gates.vector)
        while m < len(field) and not field[m, 0] > now + 1e-9:
            if _whole(field[m]):
                if body.loose:
                    old_x, old_P = x.copy(), P.copy()
                distance = see_field(x, P, field[m], body, noise, gates.vector, weights, room)
                if body.loose:
                    _keep(x, P, old_x, old_P)
                _count(counts, COMPASS, distance, gates.vector)
            else:
                counts[COMPASS, 2] += 1
            m += 1
        while f < len(fixes) and not fixes[f, 0] > now + 1e-9:
            if _whole(fixes[f]):
                if body.loose:
                    old_x, old_P = x.copy(), P.copy()
                distance = see_fix(x, P, fixes[f], gates.fix, room)
                if body.loose:
                    _keep(x, P, old_x, old_P)
                _count(counts, FIX, distance, gates.fix)
            else:
                counts[FIX, 2] += 1
            f += 1
        _reckon(x, imu[i], dt, body, odometry)
        _write(now, x, odometry, track[filled])
        filled += 1
    return now, filled, True


@kernel
def _reckon(x, imu, dt, body, odometry):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Move the odometry: it follows gyro and wheels and never jumps."""
    sr, cr, sp, cp = np.sin(x[0]), np.cos(x[0]), np.sin(x[1]), np.cos(x[1])
    rate = imu[3] - x[5]
    lean = sr * (imu[2] - x[4]) + cr * rate
    aside = x[10] - rate * body.pivot * sp
    aside -= abs(rate) * body.creep * np.tanh(sr / body.creep_slope)
    odometry[3] = turn_of(odometry[3] + dt * lean / cp)
    sy, cy = np.sin(odometry[3]), np.cos(odometry[3])
    level = cp * x[9] + sp * sr * aside
    odometry[0] += dt * (cy * level - sy * cr * aside)
    odometry[1] += dt * (sy * level + cy * cr * aside)
    odometry[2] += dt * (-sp * x[9] + cp * sr * aside)


@kernel
def _write(now, x, odometry, row):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write stamp, position and quaternion x, y, z, w of the odometry."""
    sr, cr, sp, cp = np.sin(x[0] / 2), np.cos(x[0] / 2), np.sin(x[1] / 2), np.cos(x[1] / 2)
    sy, cy = np.sin(odometry[3] / 2), np.cos(odometry[3] / 2)
    row[0] = now
    for a in range(3):
        row[1 + a] = odometry[a]
    row[4] = sr * cp * cy - cr * sp * sy
    row[5] = cr * sp * cy + sr * cp * sy
    row[6] = cr * cp * sy - sr * sp * cy
    row[7] = cr * cp * cy + sr * sp * sy
