"""Counter-based random numbers: known outputs, distribution and independence."""

import numpy as np
from numba import njit
from scipy import stats

from terrain.counter_rng import normal, uniform


@njit
def _many(key, count):
    """Return the first uniform numbers of a key."""
    found = np.empty(count)
    for k in range(count):
        found[k] = uniform(key, np.uint64(k))
    return found


@njit
def _normals(shares):
    """Return the normal quantiles at some probabilities."""
    found = np.empty(len(shares))
    for k in range(len(shares)):
        found[k] = normal(shares[k])
    return found


def test_they_are_splitmix64():
    """Numbers are those of the published generator."""
    # The first outputs of the published generator, seeded with 1234567.
    first = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    np.testing.assert_array_equal(
        _many(np.uint64(1234567), 3), [(z >> 11) * 2.0**-53 for z in first]
    )


def test_they_are_even_and_neighbours_know_nothing_of_each_other():
    """Numbers are uniform and uncorrelated, within a key and between keys."""
    for key in (0, 1, 2**63 - 1):
        draws = _many(np.uint64(key), 200_000)
        assert stats.kstest(draws, "uniform").pvalue > 1e-3
        for lag in (1, 2, 3, 1081):
            assert abs(np.corrcoef(draws[:-lag], draws[lag:])[0, 1]) < 0.01
    several = np.array([_many(np.uint64(key), 1000) for key in range(100)])
    assert abs(np.corrcoef(several)[np.triu_indices(100, 1)]).max() < 0.2


def test_normal_numbers_are_the_inverse_of_the_distribution():
    """Normal numbers are scipy's quantiles to seven figures, finite at 0 and 1."""
    shares = np.concatenate([np.logspace(-15, -0.31, 500), 1 - np.logspace(-15, -0.31, 500)])
    np.testing.assert_allclose(_normals(shares), stats.norm.ppf(shares), rtol=2e-6, atol=2e-7)
    assert np.isfinite(_normals(np.array([0.0, 1.0]))).all()
