"""Prediction: what it does to a covariance."""

import numpy as np

from andabata.localization.filter_state import STATES
from andabata.localization.measurement_models import correct_heading, correct_wheels
from andabata.localization.process_model import predict
from andabata.localization.sigma_points import Workspace
from tests.support.textbook_filter import GATED, field, fresh, gyro


def test_the_covariance_stays_symmetric_and_positive():
    """Thousands of steps leave the covariance symmetric and positive definite."""
    workspace = Workspace.allocate()
    x, P = fresh(4)
    rng = np.random.default_rng(5)
    for k in range(4000):
        omega = rng.normal(0, 0.5, 3)
        assert predict(x, P, gyro(omega), 0.01, GATED, workspace)
        correct_wheels(x, P, 0.3, GATED, workspace)
        if k % 10 == 0:
            mag = np.array([0.0, *(field(x) + rng.normal(0, 0.5, 3))])
            correct_heading(x, P, mag, GATED, workspace)
        x[0], x[1] = np.clip(x[:2], -0.5, 0.5)
    np.testing.assert_array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > 0


def test_a_covariance_that_is_not_positive_definite_is_reported():
    """Prediction returns false if any state's variance is invalid."""
    workspace = Workspace.allocate()
    x, P = fresh(2)
    for i in range(STATES):
        wrong = P.copy()
        wrong[i, i] = -1.0
        assert not predict(x, wrong, gyro(np.zeros(3)), 0.01, GATED, workspace)
