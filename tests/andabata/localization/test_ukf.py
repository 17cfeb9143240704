"""The filter against filterpy's, and the laws of the robot's model."""

import numpy as np
import pytest
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

from andabata.localization import process_model as model
from andabata.localization.process_model import ANGULAR, STATES, Body, Noise, Room, Weights
from andabata.localization.ukf import Spread, turn_of

BODY = Body(0.1, 0.18, 0.09, 0.31, 0.2, 26.0, -34.0)
GATE = 1e9


def fresh(seed=0):
    rng = np.random.default_rng(seed)
    x = np.zeros(STATES)
    x[:3] = [0.1, -0.2, 3.1]  # A heading near the seam.
    x[3:6], x[9:11] = rng.normal(0, 0.01, 3), [0.3, 0.01]
    x[11:14] = rng.normal(0, 1, 3)
    A = rng.normal(0, 0.02, (STATES, STATES))
    return x, A @ A.T + np.diag(np.linspace(1e-4, 1e-2, STATES))


def wrapped(turns):
    turns = np.array(turns)
    turns[ANGULAR] = [turn_of(t) for t in turns[ANGULAR]]
    return turns


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
    sr, cr, sp, cp, sy, cy = (f(a) for a in x[:3] for f in (np.sin, np.cos))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def aside(x, rate):
    creep = abs(rate) * BODY.creep * np.tanh(np.sin(x[0]) / BODY.creep_slope)
    return x[10] - creep - rate * BODY.pivot * np.sin(x[1])


def moved(x, dt, omega, noise):
    """Return a state a step later, as section 1 of any textbook writes it."""
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
    y[10] *= np.exp(-dt / noise.drift_time)
    y[14:16] *= np.exp(-dt / noise.wander_time)
    return y


def process_noise(dt, noise):
    Q = np.zeros(STATES)
    Q[:3], Q[3:6] = noise.turn**2 * dt, noise.bias_walk**2 * dt
    Q[6:9] = np.array([noise.slip, noise.slip, noise.heave]) ** 2 * dt
    Q[9] = noise.push**2 * dt
    Q[10] = noise.drift**2 * (1 - np.exp(-2 * dt / noise.drift_time))
    Q[11:14] = noise.iron_walk**2 * dt
    Q[14:16] = noise.wander**2 * (1 - np.exp(-2 * dt / noise.wander_time))
    Q[16:18] = noise.force_walk**2 * dt
    return np.diag(Q)


def force(x, omega):
    rate = omega - x[3:6]
    level = rotation(x).T @ [0, 0, model.GRAVITY] + np.cross(rate, [x[9], aside(x, rate[2]), 0])
    return level + np.array([x[16], x[17], 0])


def field(x):
    return rotation(x).T @ [BODY.flux_x, BODY.flux_y, BODY.flux_z] + x[11:14]


def test_a_prediction_and_every_correction_equal_filterpys():
    noise, weights, room = Noise(), Weights.make(), Room.make()
    x, P = fresh()
    ukf = oracle(x, P)
    omega = np.array([0.02, -0.05, 0.4])
    rng = np.random.default_rng(3)
    for _ in range(25):
        assert model.predict(x, P, *omega, 0.01, BODY, noise, weights, room)
        ukf.Q = process_noise(0.01, noise)
        ukf.predict(dt=0.01, fx=lambda s, dt: moved(s, dt, omega, noise))
        imu = np.array([0.0, *omega, *(force(x, omega) + rng.normal(0, 0.5, 3))])
        seen = np.array([0.0, *(field(x) + rng.normal(0, 0.5, 3))])
        fix = np.array([0.0, *(x[6:9] + rng.normal(0, 0.7, 3)), 0.66, 1.4])
        shake = noise.shake**2
        steps = (
            (
                lambda: model.see_wheels(x, P, 0.31, noise, GATE, room),
                lambda s: s[9:10],
                np.array([0.31]),
                [noise.wheels**2],
            ),
            (
                lambda i=imu: model.see_gravity(x, P, i, BODY, noise, GATE, weights, room),
                lambda s: force(s, omega),
                imu[4:],
                [shake, shake, 4 * shake],
            ),
            (
                lambda f=seen: model.see_field(x, P, f, BODY, noise, GATE, weights, room),
                field,
                seen[1:],
                [noise.compass**2] * 3,
            ),
            (
                lambda f=fix: model.see_fix(x, P, f, GATE, room),
                lambda s: s[6:9] + np.array([s[14], s[15], 0]),
                fix[1:4],
                [0.66**2, 0.66**2, 1.4**2],
            ),
            (
                lambda i=imu: model.see_rest(x, P, i, noise, GATE, room),
                lambda s: s[3:6],
                imu[1:4],
                [noise.rest**2] * 3,
            ),
        )
        for ours, hx, z, R in steps:
            distance = ours()
            ukf.sigmas_f = ukf.points_fn.sigma_points(ukf.x, ukf.P)
            ukf.update(z, R=np.diag(R), hx=hx)
            ukf.x = wrapped(ukf.x)
            assert distance == pytest.approx(ukf.mahalanobis**2, rel=1e-7)
            np.testing.assert_allclose(wrapped(x - ukf.x), 0, atol=1e-9)
            np.testing.assert_allclose(P, ukf.P, atol=1e-9)


def test_a_measurement_beyond_the_gate_changes_nothing():
    room = Room.make()
    x, P = fresh(1)
    before = x.copy(), P.copy()
    fix = np.array([0.0, *(x[6:9] + 50.0), 0.66, 1.4])
    assert model.see_fix(x, P, fix, 11.3, room) > 11.3
    np.testing.assert_array_equal(x, before[0])
    np.testing.assert_array_equal(P, before[1])


def test_a_covariance_that_is_none_is_told():
    x, P = fresh(2)
    P[4, 4] = -1.0
    assert not model.predict(x, P, 0.0, 0.0, 0.0, 0.01, BODY, Noise(), Weights.make(), Room.make())
    seen, weights, room = np.array([0.0, *field(x)]), Weights.make(), Room.make()
    assert np.isnan(model.see_field(x, P, seen, BODY, Noise(), GATE, weights, room))
    P[9, 9] = -1.0
    assert np.isnan(model.see_wheels(x, P, 0.3, Noise(), GATE, room))
    P[14, 14] = -1.0
    assert np.isnan(model.see_fix(x, P, np.array([0.0, *x[6:9], 0.1, 0.1]), GATE, room))


def test_the_covariance_stays_symmetric_and_positive():
    noise, weights, room = Noise(), Weights.make(), Room.make()
    x, P = fresh(4)
    rng = np.random.default_rng(5)
    for k in range(4000):
        omega = rng.normal(0, 0.5, 3)
        assert model.predict(x, P, *omega, 0.01, BODY, noise, weights, room)
        model.see_wheels(x, P, 0.3, noise, 10.83, room)
        if k % 10 == 0:
            seen = np.array([0.0, *(field(x) + rng.normal(0, 0.5, 3))])
            model.see_field(x, P, seen, BODY, noise, 16.27, weights, room)
        x[0], x[1] = np.clip(x[:2], -0.5, 0.5)
    np.testing.assert_array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > 0


def test_the_weights_sum_to_one_and_none_is_negative():
    spread = Spread.merwe(STATES)
    assert spread.mean.sum() == pytest.approx(1.0)
    assert spread.mean.min() >= 0
    assert spread.covariance.min() >= 0
    assert spread.gain == pytest.approx(np.sqrt(STATES))
