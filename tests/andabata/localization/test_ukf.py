"""Unscented Kalman filter: the transform of a whole model, linear problems, angles, gating."""

import numpy as np
import pytest
from filterpy.kalman import MerweScaledSigmaPoints

from andabata.localization.ukf import (
    SigmaWeights,
    add_remainder_to_covariance,
    add_remainder_to_cross,
    allocate_transform,
    correct,
    correct_number,
    draw_sigma_points,
    is_rest_positive,
    wrap_angle,
)

N = 6
LINEAR = np.zeros(N, dtype=np.uint8)
WEIGHTS = SigmaWeights.merwe(N)


def state(seed=0):
    """Return a mean and a covariance."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(N, N))
    return rng.normal(size=N), A @ A.T + np.eye(N)


def points_of(x, P, rows=N):
    """Return the first rows of the Cholesky factor and the sigma points along them."""
    U, points = np.zeros((rows, N)), np.zeros((2 * rows + 1, N))
    assert draw_sigma_points(x, P, WEIGHTS.reach, U, points)
    return U, points


def transformed(x, P, A, remainder):
    """Return mean, covariance and cross covariance of ``A x + remainder``, from half the rows."""
    transform = allocate_transform(N, 3, 3, N)
    assert draw_sigma_points(x, P, WEIGHTS.reach, transform.U, transform.points)
    for point, row in zip(transform.points, transform.remainder, strict=True):
        row[:] = remainder(point)
    transform.cross[:], transform.linear[:] = A @ P, A @ transform.U.T
    add_remainder_to_cross(WEIGHTS, transform)
    transform.covariance[:] = A @ transform.cross.T
    add_remainder_to_covariance(WEIGHTS, transform)
    mean = A @ x + transform.remainder[0] + transform.mean
    return mean, transform.covariance, transform.cross


def test_weights_are_those_of_merwes_points():
    """Position and weights follow from filterpy's; the defaults have no negative weight."""
    for n, alpha, beta, kappa in ((18, 1.0, 2.0, 0.0), (5, 0.5, 1.0, 1.0)):
        weights, points = (
            SigmaWeights.merwe(n, alpha, beta, kappa),
            MerweScaledSigmaPoints(n, alpha, beta, kappa),
        )
        assert weights.reach**2 == pytest.approx(alpha**2 * (n + kappa))
        np.testing.assert_allclose(points.Wm[1:], weights.weight)
        assert points.Wc[0] == pytest.approx(weights.about + 2 - 2 * n * weights.weight)
        assert 2 * weights.weight * weights.reach**2 == pytest.approx(1.0)
    assert MerweScaledSigmaPoints(18, 1.0, 2.0, 0.0).Wc.min() >= 0


def test_sigma_points_lie_along_the_rows_of_the_factor():
    """Pairs lie at the reach on both sides of the mean, and the factor is the covariance's."""
    x, P = state()
    U, points = points_of(x, P)
    np.testing.assert_allclose(U.T @ U, P, atol=1e-12)
    np.testing.assert_array_equal(U, np.triu(U))
    np.testing.assert_array_equal(points[0], x)
    np.testing.assert_allclose(points[1 : N + 1] - x, WEIGHTS.reach * U, atol=1e-12)
    np.testing.assert_allclose(points[N + 1 :] - x, -WEIGHTS.reach * U, atol=1e-12)


def test_the_first_rows_leave_the_rest_of_the_covariance():
    """They are the first of the whole factor; what they leave is positive, or reported."""
    x, P = state(7)
    U, _ = points_of(x, P, 3)
    np.testing.assert_array_equal(U, points_of(x, P)[0][:3])
    assert is_rest_positive(P, U)
    for i in range(3, N):
        wrong = P.copy()
        wrong[i, i] = 0.99 * (U.T @ U)[i, i]
        assert not is_rest_positive(wrong, U)


def test_moments_are_those_of_the_whole_model_at_all_points():
    """Points along three rows of six, and a linear part, give what all 13 points give."""
    x, P = state(8)
    A = np.random.default_rng(2).normal(size=(3, N))

    def remainder(s):
        return np.array([np.sin(s[0]), s[1] * s[2], np.cos(s[2]) * s[0]])

    mean, covariance, cross = transformed(x, P, A, remainder)
    points, weights = points_of(x, P)[1], MerweScaledSigmaPoints(N, 1.0, 2.0, 0.0)
    seen = np.array([A @ s + remainder(s) for s in points])
    expected = weights.Wm @ seen
    off = seen - expected
    np.testing.assert_allclose(mean, expected, atol=1e-12)
    np.testing.assert_allclose(covariance, off.T @ (weights.Wc[:, None] * off), atol=1e-10)
    np.testing.assert_allclose(cross, off.T @ (weights.Wc[:, None] * (points - x)), atol=1e-10)
    np.testing.assert_array_equal(covariance, covariance.T)


def test_a_linear_remainder_is_transformed_exactly():
    """What is not told as the linear part is found as slopes: H x, H P H', H P."""
    x, P = state(1)
    A, B = np.random.default_rng(2).normal(size=(2, 3, N))
    B[:, 3:] = 0.0
    mean, S, cross = transformed(x, P, A, lambda s: B @ s)
    H = A + B
    np.testing.assert_allclose(mean, H @ x, atol=1e-10)
    np.testing.assert_allclose(S, H @ P @ H.T, atol=1e-9)
    np.testing.assert_allclose(cross, H @ P, atol=1e-9)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [(0.0, 0.0), (np.pi, np.pi), (-np.pi, np.pi), (3.5 * np.pi, -0.5 * np.pi), (-4.0, 2.2831853)],
)
def test_angles_are_wrapped_to_the_half_open_interval(angle, wrapped):
    """Angles are wrapped to (-pi, pi]."""
    assert wrap_angle(angle) == pytest.approx(wrapped)


def kalman(x, P, H, R, z):
    """Return the textbook's corrected mean and covariance, and the NIS."""
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    y = z - H @ x
    return x + K @ y, P - K @ S @ K.T, float(y @ np.linalg.inv(S) @ y)


def test_a_correction_is_the_kalman_filters():
    """On a linear measurement mean, covariance and NIS equal those of the Kalman filter."""
    x, P = state(3)
    rng = np.random.default_rng(4)
    H, R, z = rng.normal(size=(3, N)), np.diag([0.5, 1.0, 2.0]), rng.normal(size=3)
    expected = kalman(x, P, H, R, z)
    nis = correct(x, P, LINEAR, H @ P, H @ P @ H.T + R, z - H @ x, 1e9)
    assert nis == pytest.approx(expected[2])
    np.testing.assert_allclose(x, expected[0], atol=1e-10)
    np.testing.assert_allclose(P, expected[1], atol=1e-10)


def test_one_number_corrects_as_a_linear_measurement():
    """Correcting with one number equals the Kalman filter with a row of the identity."""
    x, P = state(5)
    H = np.eye(N)[2:3]
    expected = kalman(x, P, H, np.array([[0.3]]), np.array([0.7]))
    nis = correct_number(x, P, LINEAR, P[2].copy(), P[2, 2] + 0.3, 0.7 - x[2], 1e9)
    assert nis == pytest.approx(expected[2])
    np.testing.assert_allclose(x, expected[0], atol=1e-12)
    np.testing.assert_allclose(P, expected[1], atol=1e-12)


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_the_gate_compares_the_squared_innovation(share):
    """An innovation of sqrt(gate) standard deviations is the limit, in both corrections."""
    gate, variance = 7.0, 0.3
    for single in (True, False):
        x, P = np.zeros(N), np.eye(N)
        y = share * np.sqrt(gate * (1 + variance))
        if single:
            nis = correct_number(x, P, LINEAR, np.eye(N)[2], 1 + variance, y, gate)
        else:
            S, cross = (1 + variance) * np.eye(3), np.eye(N)[2:5]
            nis = correct(x, P, LINEAR, cross, S, np.array([y, 0.0, 0.0]), gate)
        assert nis == pytest.approx(share**2 * gate)
        assert (x[2] != 0.0) == (share < 1)
        assert (P[2, 2] < 1.0) == (share < 1)


def test_a_covariance_that_is_not_positive_definite_has_no_points_and_no_correction():
    """Drawing returns false, correcting NaN, and the state stays as it is."""
    x, P = state(6)
    P[1, 1] = -5.0
    assert not draw_sigma_points(x, P, 1.0, np.zeros((N, N)), np.zeros((2 * N + 1, N)))
    before = x.copy()
    nis = correct(x, P, LINEAR, np.ones((3, N)), -np.eye(3), np.ones(3), 1e9)
    assert np.isnan(nis)
    np.testing.assert_array_equal(x, before)
