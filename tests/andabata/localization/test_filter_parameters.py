"""Parameters of the filter: gates are quantiles."""

import pytest
from scipy.stats import chi2

from andabata.localization.filter_parameters import Gates


def test_gates_are_chi_square_quantiles():
    """Gates compare squared innovations with quantiles at 0.999, for fixes at 0.99."""
    gates = Gates()
    assert gates.wheels == pytest.approx(chi2.ppf(0.999, 1), abs=0.01)
    assert gates.vector == pytest.approx(chi2.ppf(0.999, 3), abs=0.01)
    assert gates.gnss == pytest.approx(chi2.ppf(0.99, 3), abs=0.01)
