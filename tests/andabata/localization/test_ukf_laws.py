"""Laws of the filter for any state: certainty after a correction, and measurements in any order."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from andabata.localization.ukf import (
    SigmaWeights,
    correct,
    correct_number,
    draw_sigma_points,
    is_rest_positive,
)
from tests.support.properties import law

N = 6
FREE = np.zeros(N, dtype=np.uint8)
WEIGHTS = SigmaWeights.merwe(N)


@st.composite
def problems(draw):
    """Return a state, its covariance, a linear measurement, its noise, and what was measured."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    root = rng.normal(size=(N, N)) * 10 ** draw(st.floats(-2.0, 2.0, allow_subnormal=False))
    P = root @ root.T + 1e-3 * np.eye(N)
    return rng.normal(size=N), P, rng.normal(size=(3, N)), rng.uniform(0.1, 2.0, 3), rng


def corrected(x, P, H, variances, z, gate=np.inf):
    """Return state, covariance and NIS after a measurement of three numbers."""
    x, P = x.copy(), P.copy()
    S = H @ P @ H.T + np.diag(variances)
    nis = correct(x, P, FREE, H @ P, S, z - H @ x, gate)
    return x, P, nis


@law
@given(problems())
def test_a_correction_takes_uncertainty_away(problem):
    """The covariance stays symmetric and positive, and no direction becomes less certain."""
    x, P, H, variances, rng = problem
    _, after, nis = corrected(x, P, H, variances, rng.normal(size=3))
    assert nis >= 0.0
    scale = np.abs(P).max()
    np.testing.assert_allclose(after, after.T, atol=1e-9 * scale)
    assert np.linalg.eigvalsh(after).min() > -1e-9 * scale
    assert np.linalg.eigvalsh(P - after).min() > -1e-9 * scale


@law
@given(problems(), st.floats(0.0, 0.999, allow_subnormal=False))
def test_beyond_the_gate_nothing_changes(problem, share):
    """Not a bit of state and covariance; below it something does."""
    x, P, H, variances, rng = problem
    z = H @ x + rng.normal(size=3)
    _, _, nis = corrected(x, P, H, variances, z)
    same_x, same_P, _ = corrected(x, P, H, variances, z, gate=share * nis)
    assert same_x.tobytes() == x.tobytes()
    assert same_P.tobytes() == P.tobytes()
    assert corrected(x, P, H, variances, z, gate=1.001 * nis)[0].tobytes() != x.tobytes()


@law
@given(problems())
def test_what_is_measured_as_expected_moves_nothing(problem):
    """The state stays, the covariance does not."""
    x, P, H, variances, _ = problem
    same, after, nis = corrected(x, P, H, variances, H @ x)
    assert nis == 0.0
    np.testing.assert_array_equal(same, x)
    assert np.trace(after) < np.trace(P)


@law
@given(problems())
def test_the_order_of_measurements_is_no_matter(problem):
    """Three numbers one after the other, in any order, are the three together."""
    x, P, H, variances, rng = problem
    z = rng.normal(size=3)
    expected, covariance, _ = corrected(x, P, H, variances, z)
    for order in ([0, 1, 2], [2, 0, 1], [1, 2, 0]):
        y, Q = x.copy(), P.copy()
        for k in order:
            s = float(H[k] @ Q @ H[k] + variances[k])
            correct_number(y, Q, FREE, Q @ H[k], s, float(z[k] - H[k] @ y), np.inf)
        scale = np.abs(P).max()
        np.testing.assert_allclose(y, expected, atol=1e-7 * max(scale, 1.0))
        np.testing.assert_allclose(Q, covariance, atol=1e-8 * scale)


@law
@given(problems())
def test_sigma_points_have_mean_and_covariance_of_the_state(problem):
    """Weighed, they give back both; a covariance that is not positive has none."""
    x, P, _, _, _ = problem
    U, points = np.zeros((N, N)), np.zeros((2 * N + 1, N))
    assert draw_sigma_points(x, P, WEIGHTS.reach, U, points)
    assert is_rest_positive(P, U[:3])
    off = points - x
    np.testing.assert_allclose(off.sum(axis=0), 0.0, atol=1e-9 * np.abs(P).max())
    spread = WEIGHTS.weight * off.T @ off
    np.testing.assert_allclose(spread, P, atol=1e-9 * np.abs(P).max())
    assert not draw_sigma_points(x, -P, WEIGHTS.reach, U, points)


@law
@given(st.integers(1, 40))
def test_weights_add_up(n):
    """Those of all points sum up to one, with the reach that the covariance needs."""
    weights = SigmaWeights.merwe(n)
    assert 2 * weights.weight * weights.reach**2 == pytest.approx(1.0)
    assert weights.reach**2 == pytest.approx(n)
