"""Laws of the filter over many steps, in their short form, and that they notice a wrong filter."""

import numpy as np
import pytest

from andabata.bench.studies.soak import filter_laws
from andabata.bench.studies.soak.filter_laws import (
    LinearFilter,
    covariance_stays_positive,
    filter_is_the_kalman_filter,
    gate_rejects_its_share,
)


def test_the_gate_rejects_its_share(tmp_path):
    """One in a thousand in each number of dimensions."""
    outcome = gate_rejects_its_share(4000, tmp_path)
    assert (outcome.trials, outcome.failed) == (12_000, 0)


def test_another_gate_is_noticed(tmp_path, monkeypatch):
    """A gate of another share rejects too many or too few."""
    monkeypatch.setattr(filter_laws.chi2, "isf", lambda share, numbers: 6.0)
    assert gate_rejects_its_share(4000, tmp_path).failed == 3


def test_on_a_linear_problem_it_is_the_kalman_filter(tmp_path):
    """At every step, within 1e-8."""
    outcome = filter_is_the_kalman_filter(300, tmp_path)
    assert (outcome.trials, outcome.failed) == (300, 0)


def test_another_filter_is_noticed(tmp_path, monkeypatch):
    """A little more process noise is another filter."""
    monkeypatch.setattr(LinearFilter, "Q", 4.001e-4 * np.eye(6))
    monkeypatch.setattr(filter_laws, "_reference", _with_other_noise(filter_laws._reference))
    assert filter_is_the_kalman_filter(20, tmp_path).failed > 0


def _with_other_noise(make):
    """Return what makes a reference with the noise that the filter had."""

    def made():
        reference = make()
        reference.Q = 4e-4 * np.eye(6)
        return reference

    return made


def test_the_covariance_stays_positive(tmp_path):
    """Over a minute with a gap of compass and fixes, every inertial row accepted."""
    outcome = covariance_stays_positive(6000, tmp_path)
    assert (outcome.trials, outcome.failed) == (6000, 0)


def test_an_eigenvalue_of_zero_is_noticed(tmp_path, monkeypatch):
    """Positive is more than zero."""
    monkeypatch.setattr(np.linalg, "eigvalsh", lambda P: np.zeros(len(P)))
    assert covariance_stays_positive(20, tmp_path).failed == 2


def test_a_covariance_that_is_not_positive_has_no_prediction():
    """It is an error, and not a filter that goes on."""
    linear = LinearFilter()
    linear.P = -np.eye(6)
    with pytest.raises(ValueError, match="positive definite"):
        linear.predict()
