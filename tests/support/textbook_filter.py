"""The filter's models as textbooks write them, a state to start from, and filterpy's filter."""

import numpy as np
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

from andabata.localization.filter_parameters import BodyParameters, FilterModel, Gates, NoiseModel
from andabata.localization.filter_state import ANGULAR, STATES
from andabata.localization.ukf import SigmaWeights, wrap_angle
from andabata.machine.proprioception import GRAVITY

BODY = BodyParameters(0.1, 0.18, 0.09, 0.31, 0.2, 26.0, -34.0)
GATED = FilterModel(BODY, NoiseModel(), Gates(), SigmaWeights.merwe(STATES), 0.5)
OPEN = GATED._replace(gates=Gates(1e9, 1e9, 1e9, 1e9, 1e9))
HEADING_ONLY = GATED._replace(body=BODY._replace(heading_only=True))


def gyro(omega):
    """Return an inertial row with an angular velocity [rad/s]."""
    return np.array([0.0, *omega, 0.0, 0.0, 0.0])


def fresh(seed=0):
    """Return a state near the seam of the heading, and a full covariance."""
    rng = np.random.default_rng(seed)
    x = np.zeros(STATES)
    x[:3] = [0.1, -0.2, 3.1]  # A heading near the seam.
    x[3:6], x[9:11] = rng.normal(0, 0.01, 3), [0.3, 0.01]
    x[11:13], x[13] = rng.normal(0, 1, 2), 0.05
    x[18:20] = 0.02, 0.1
    A = rng.normal(0, 0.02, (STATES, STATES))
    return x, A @ A.T + np.diag(np.linspace(1e-4, 1e-2, STATES))


def wrapped(angles):
    """Return a state whose angles are wrapped."""
    angles = np.array(angles)
    angles[ANGULAR] = [wrap_angle(a) for a in angles[ANGULAR]]
    return angles


def oracle(x, P):
    """Return filterpy's filter with the same points, means and residuals."""

    def mean(points, weights):
        turns = np.array([wrapped(point - points[0]) for point in points])
        return wrapped(points[0] + weights @ turns)

    ukf = UnscentedKalmanFilter(
        dim_x=STATES,
        dim_z=3,
        dt=0.01,
        hx=None,
        fx=None,
        points=MerweScaledSigmaPoints(STATES, 1.0, 2.0, 0.0),
        x_mean_fn=mean,
        residual_x=lambda a, b: wrapped(a - b),
    )
    ukf.x, ukf.P = x.copy(), P.copy()
    return ukf


def rotation(x):
    """Return the rotation matrix from base to map of a state."""
    sr, cr, sp, cp, sy, cy = (f(a) for a in x[:3] for f in (np.sin, np.cos))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def aside(x, rate):
    """Return the lateral speed of a state at a yaw rate."""
    creep = abs(rate) * BODY.creep * np.tanh(np.sin(x[0]) / BODY.creep_slope)
    return x[10] - creep - rate * BODY.pivot * np.sin(x[1])


def moved(x, dt, omega, noise):
    """Return a state a step later, as any textbook writes it."""
    rate = omega - x[3:6]
    roll, pitch = x[:2]
    T = np.array(
        [
            [1, np.sin(roll) * np.tan(pitch), np.cos(roll) * np.tan(pitch)],
            [0, np.cos(roll), -np.sin(roll)],
            [0, np.sin(roll) / np.cos(pitch), np.cos(roll) / np.cos(pitch)],
        ]
    )
    y = x.copy()
    y[6:9] += dt * rotation(x) @ [x[9], aside(x, rate[2]), 0.0]
    y[:3] += dt * T @ rate
    y[10] *= np.exp(-dt / noise.lateral_speed_time)
    y[13] *= np.exp(-dt / noise.compass_error_time)
    y[14:16] *= np.exp(-dt / noise.gnss_error_time)
    return y


def process_noise(dt, noise):
    """Return the covariance of the process noise of a step."""
    Q = np.zeros(STATES)
    Q[:3], Q[3:6] = noise.gyro**2 * dt, noise.gyro_bias_walk**2 * dt
    Q[6:9] = np.array([noise.position_walk, noise.position_walk, noise.height_walk]) ** 2 * dt
    Q[9] = noise.speed_walk**2 * dt
    Q[10] = noise.lateral_speed**2 * (1 - np.exp(-2 * dt / noise.lateral_speed_time))
    Q[11:13] = noise.hard_iron_walk**2 * dt
    Q[13] = noise.compass_error**2 * (1 - np.exp(-2 * dt / noise.compass_error_time))
    Q[14:16] = noise.gnss_error**2 * (1 - np.exp(-2 * dt / noise.gnss_error_time))
    Q[16:18] = noise.accel_bias_walk**2 * dt
    Q[18:20] = noise.wheel_scale_walk**2 * dt, noise.slope_slip_walk**2 * dt
    return np.diag(Q)


def force(x, omega):
    """Return the specific force that a state expects."""
    rate = omega - x[3:6]
    level = rotation(x).T @ [0, 0, GRAVITY] + np.cross(rate, [x[9], aside(x, rate[2]), 0])
    return level + np.array([x[16], x[17], 0])


def field(x):
    """Return the magnetic field that a state expects."""
    earth = rotation(x).T @ [BODY.flux_east, BODY.flux_north, BODY.flux_up]
    return earth + np.array([x[11], x[12], 0.0])


def levelled(field, tilt):
    """Return a field of the base turned level by roll and pitch."""
    return rotation([*tilt, 0.0]) @ field


def bearing(x, mean):
    """Return the compass bearing that a state expects, levelled by roll and pitch of the mean.

    It is linear in the hard iron about the mean's.
    """
    ahead, aside, _ = levelled(field([*x[:11], *mean[11:13]]), mean[:2])
    along, across, _ = levelled(field(mean), mean[:2])
    iron_ahead, iron_aside, _ = levelled(np.array([*(x[11:13] - mean[11:13]), 0.0]), mean[:2])
    turn = (along * iron_aside - across * iron_ahead) / (along**2 + across**2)
    return np.array([np.arctan2(aside, ahead) + turn - x[13]])


def wheel_speed(x, speed, pitch):
    """Return the speed by wheels that a state expects where they read some speed at a pitch."""
    return np.array([x[9] + speed * x[18] - speed * np.sin(pitch) * x[19]])
