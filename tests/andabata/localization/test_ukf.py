"""Unscented Kalman filter: exact on linear problems, angles across the seam, gating."""

import numpy as np
import pytest

from andabata.localization.ukf import (
    SigmaWeights,
    correct,
    correct_state,
    cross_covariance,
    draw_sigma_points,
    unscented_transform,
    wrap_angle,
)

N = 5
LINEAR = np.zeros(N, dtype=np.bool_)
WEIGHTS = SigmaWeights.merwe(N)


def state(seed=0):
    """Return a mean and a covariance."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(N, N))
    return rng.normal(size=N), A @ A.T + np.eye(N)


def points_of(x, P):
    """Return Cholesky factor and sigma points."""
    U, points = np.zeros((N, N)), np.zeros((2 * N + 1, N))
    assert draw_sigma_points(x, P, WEIGHTS.reach, U, points)
    return U, points


def transformed(points, angular):
    """Return mean and covariance of points."""
    m = points.shape[1]
    mean, deviations, P = np.zeros(m), np.zeros_like(points), np.zeros((m, m))
    unscented_transform(points, WEIGHTS, angular, mean, deviations, P)
    return mean, P


def test_the_weights_sum_to_one_and_none_is_negative():
    """Weights of the mean sum to one; with the defaults none is negative."""
    weights = SigmaWeights.merwe(18)
    assert weights.mean.sum() == pytest.approx(1.0)
    assert weights.mean.min() >= 0
    assert weights.covariance.min() >= 0
    assert weights.reach == pytest.approx(np.sqrt(18))


def test_sigma_points_carry_mean_and_covariance():
    """The transform of unchanged points is the mean and covariance that they were drawn from."""
    x, P = state()
    U, points = points_of(x, P)
    np.testing.assert_allclose(np.triu(U).T @ np.triu(U), P, atol=1e-12)
    np.testing.assert_allclose(points[1] - x, WEIGHTS.reach * U[0])
    np.testing.assert_allclose(points[1 + N] - x, -WEIGHTS.reach * U[0])
    mean, covariance = transformed(points, LINEAR)
    np.testing.assert_allclose(mean, x, atol=1e-12)
    np.testing.assert_allclose(covariance, P, atol=1e-10)


def test_the_first_rows_leave_the_rest_of_the_covariance():
    """Points along some rows carry the mean, and ``U' U``: all that concerns the first states."""
    x, P = state(7)
    U, points = np.zeros((2, N)), np.zeros((5, N))
    assert draw_sigma_points(x, P, WEIGHTS.reach, U, points)
    mean, covariance = transformed(points, LINEAR)
    np.testing.assert_allclose(mean, x, atol=1e-12)
    np.testing.assert_allclose(covariance, U.T @ U, atol=1e-10)
    np.testing.assert_allclose(covariance[:2], P[:2], atol=1e-10)
    np.testing.assert_array_equal(U, points_of(x, P)[0][:2])
    assert np.linalg.eigvalsh((P - U.T @ U)[2:, 2:]).min() > 0


def test_pairs_that_are_not_drawn_count_in_the_spread_about_the_mean():
    """The transform of a square is the same with and without the points that it does not move."""
    x, P = state(8)
    whole = points_of(x, P)[1]
    some = np.concatenate([whole[:3], whole[1 + N : 3 + N]])
    square = [np.stack([p[:, 0] ** 2, p[:, 0] * p[:, 1]], axis=1) for p in (whole, some)]
    for full, part in zip(*(transformed(p, LINEAR[:2]) for p in square), strict=True):
        np.testing.assert_allclose(part, full, atol=1e-9)


def test_a_linear_map_is_transformed_exactly():
    """Mean, covariance and cross covariance of a linear measurement are H x, H P H', P H'."""
    x, P = state(1)
    H = np.random.default_rng(2).normal(size=(3, N))
    U, points = points_of(x, P)
    seen = points @ H.T
    mean, S = transformed(seen, np.zeros(3, dtype=np.bool_))
    cross = np.zeros((3, N))
    cross_covariance(U, WEIGHTS, seen, cross)
    np.testing.assert_allclose(mean, H @ x, atol=1e-10)
    np.testing.assert_allclose(S, H @ P @ H.T, atol=1e-9)
    np.testing.assert_allclose(cross, H @ P, atol=1e-9)


def test_angles_are_averaged_across_the_seam():
    """The mean of angles on both sides of pi is near pi, with a small covariance."""
    x, P = np.full(N, np.pi - 0.01), np.diag(np.full(N, 0.1**2))
    _, points = points_of(x, P)
    points = np.array([[wrap_angle(a) for a in row] for row in points])
    mean, covariance = transformed(points, np.ones(N, dtype=np.bool_))
    np.testing.assert_allclose(mean, x, atol=1e-9)
    np.testing.assert_allclose(covariance, P, atol=1e-9)


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
    S, gain = H @ P @ H.T + R, np.zeros((3, N))
    nis = correct(x, P, LINEAR, H @ P, S, z - H @ x, 1e9, gain)
    assert nis == pytest.approx(expected[2])
    np.testing.assert_allclose(x, expected[0], atol=1e-10)
    np.testing.assert_allclose(P, expected[1], atol=1e-10)


def test_a_state_is_corrected_as_a_linear_measurement_of_it():
    """Correcting one state equals the Kalman filter with a row of the identity."""
    x, P = state(5)
    H = np.eye(N)[2:3]
    expected = kalman(x, P, H, np.array([[0.3]]), np.array([0.7]))
    nis = correct_state(x, P, LINEAR, 2, 0.7, 0.3, 1e9, np.zeros((3, N)))
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
            nis = correct_state(x, P, LINEAR, 2, y, variance, gate, np.zeros((1, N)))
        else:
            S, cross = np.array([[1 + variance]]), np.eye(N)[2:3]
            gain = np.zeros((1, N))
            nis = correct(x, P, LINEAR, cross, S, np.array([y]), gate, gain)
        assert nis == pytest.approx(share**2 * gate)
        assert (x[2] != 0.0) == (share < 1)
        assert (P[2, 2] < 1.0) == (share < 1)


def test_a_covariance_that_is_not_positive_definite_has_no_points_and_no_correction():
    """Drawing returns false, correcting NaN, and the state stays as it is."""
    x, P = state(6)
    P[1, 1] = -5.0
    assert not draw_sigma_points(x, P, 1.0, np.zeros((N, N)), np.zeros((2 * N + 1, N)))
    before = x.copy()
    S = -np.eye(1)
    nis = correct(x, P, LINEAR, np.ones((1, N)), S, np.ones(1), 1e9, np.zeros((1, N)))
    assert np.isnan(nis)
    np.testing.assert_array_equal(x, before)
