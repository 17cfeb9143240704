"""Corrections, and predictions between them, against filterpy's filter; gates; signs."""

import numpy as np
import pytest

from andabata.localization import measurement_models as model
from andabata.localization.filter_parameters import NoiseModel
from andabata.localization.filter_state import PITCH, ROLL, STATES
from andabata.localization.process_model import predict
from andabata.localization.sigma_points import Workspace
from andabata.machine.proprioception import GRAVITY
from tests.support.textbook_filter import (
    GATED,
    OPEN,
    field,
    force,
    fresh,
    gyro,
    moved,
    oracle,
    process_noise,
    wrapped,
)


def test_a_prediction_and_every_correction_equal_filterpys():
    """State, covariance and NIS are filterpy's, step by step."""
    noise, workspace = NoiseModel(), Workspace.allocate()
    x, P = fresh()
    ukf = oracle(x, P)
    omega = np.array([0.02, -0.05, 0.4])
    rng = np.random.default_rng(3)
    for _ in range(25):
        assert predict(x, P, gyro(omega), 0.01, OPEN, workspace)
        ukf.Q = process_noise(0.01, noise)
        ukf.predict(dt=0.01, fx=lambda s, dt: moved(s, dt, omega, noise))
        imu = np.array([0.0, *omega, *(force(x, omega) + rng.normal(0, 0.5, 3))])
        mag = np.array([0.0, *(field(x) + rng.normal(0, 0.5, 3))])
        fix = np.array([0.0, *(x[6:9] + rng.normal(0, 0.7, 3)), 0.66, 1.4])
        vibration = noise.vibration**2
        steps = (
            (
                lambda: model.correct_wheels(x, P, 0.31, OPEN, workspace),
                lambda s: s[9:10],
                np.array([0.31]),
                [noise.wheel_speed**2],
            ),
            (
                lambda i=imu: model.correct_gravity(x, P, i, OPEN, workspace),
                lambda s: force(s, omega),
                imu[4:],
                [vibration, vibration, 4 * vibration],
            ),
            (
                lambda f=mag: model.correct_mag(x, P, f, OPEN, workspace),
                field,
                mag[1:],
                [noise.mag**2] * 3,
            ),
            (
                lambda f=fix: model.correct_gnss(x, P, f, OPEN, workspace),
                lambda s: s[6:9] + np.array([s[14], s[15], 0]),
                fix[1:4],
                [0.66**2, 0.66**2, 1.4**2],
            ),
            (
                lambda i=imu: model.correct_zero_rate(x, P, i, OPEN, workspace),
                lambda s: s[3:6],
                imu[1:4],
                [noise.zero_rate**2] * 3,
            ),
        )
        for ours, hx, z, R in steps:
            nis = ours()
            ukf.sigmas_f = ukf.points_fn.sigma_points(ukf.x, ukf.P)
            ukf.update(z, R=np.diag(R), hx=hx)
            ukf.x = wrapped(ukf.x)
            assert nis == pytest.approx(ukf.mahalanobis**2, rel=1e-7)
            np.testing.assert_allclose(wrapped(x - ukf.x), 0, atol=1e-9)
            np.testing.assert_allclose(P, ukf.P, atol=1e-9)


def test_the_gate_lies_at_the_root_of_its_number_of_standard_deviations():
    """A fix just within sqrt(gate) standard deviations is accepted, one just beyond is not."""
    workspace = Workspace.allocate()
    for share, moved_state in ((0.99, True), (1.01, False)):
        x, P = fresh(1)
        sigma = np.sqrt(P[6, 6] + 2 * P[6, 14] + P[14, 14] + 0.66**2)
        fix = np.array([0.0, *x[6:9], 1.0, 1.0])
        fix[4:6] = 0.66, 1e6
        # Without correlation to y the NIS is the squared number of standard deviations.
        P[7, :], P[:, 7] = 0.0, 0.0
        P[15, :], P[:, 15] = 0.0, 0.0
        P[7, 7] = P[15, 15] = 1e-4
        fix[1] += share * np.sqrt(GATED.gates.gnss) * sigma
        before = x.copy()
        nis = model.correct_gnss(x, P, fix, GATED, workspace)
        assert nis == pytest.approx(share**2 * GATED.gates.gnss, rel=1e-6)
        assert np.array_equal(x, before) is not moved_state


def test_a_measurement_beyond_the_gate_changes_nothing():
    """A gated fix returns its NIS and leaves state and covariance as they are."""
    workspace = Workspace.allocate()
    x, P = fresh(1)
    before = x.copy(), P.copy()
    fix = np.array([0.0, *(x[6:9] + 50.0), 0.66, 1.4])
    assert model.correct_gnss(x, P, fix, GATED, workspace) > GATED.gates.gnss
    np.testing.assert_array_equal(x, before[0])
    np.testing.assert_array_equal(P, before[1])


def test_corrections_report_a_covariance_that_is_not_positive_definite():
    """They return NaN if the covariance is invalid."""
    workspace = Workspace.allocate()
    x, P = fresh(2)
    P[1, 1] = -1.0
    mag = np.array([0.0, *field(x)])
    assert np.isnan(model.correct_mag(x, P, mag, GATED, workspace))
    P[9, 9] = -1.0
    assert np.isnan(model.correct_wheels(x, P, 0.3, GATED, workspace))
    P[14, 14] = -1.0
    fix = np.array([0.0, *x[6:9], 0.1, 0.1])
    assert np.isnan(model.correct_gnss(x, P, fix, GATED, workspace))


def test_gravity_at_rest_levels_the_robot():
    """A specific force that leans to the left raises the roll, one ahead lowers the pitch."""
    workspace = Workspace.allocate()
    for axis, index, sign in ((5, ROLL, 1), (4, PITCH, -1)):
        x, P = np.zeros(STATES), np.diag(np.full(STATES, 1e-2))
        imu = np.array([0.0, 0, 0, 0, 0, 0, GRAVITY])
        imu[axis] = 0.5
        model.correct_gravity(x, P, imu, OPEN, workspace)
        assert sign * x[index] > 0.01
