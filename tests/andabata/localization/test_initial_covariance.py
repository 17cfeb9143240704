"""Covariance at the start."""

import numpy as np

from andabata.localization import filter_state as state
from andabata.localization.filter_parameters import NoiseModel
from andabata.localization.initial_covariance import initial_covariance
from andabata.localization.ukf_config import UkfConfig


def test_each_state_begins_with_the_variance_of_its_setting():
    """Position, heading and wheels as they are set, a rough start with more doubt."""
    config = UkfConfig()
    known, rough = (np.sqrt(np.diag(initial_covariance(config, r))) for r in (False, True))
    initial = config.initial_sigma
    pairs = {
        state.YAW: initial.yaw,
        state.X: initial.position,
        state.Y: initial.position,
        state.WHEEL_SCALE: initial.wheel_scale,
        state.SLOPE_SLIP: initial.slope_slip,
        state.COMPASS_ERROR: config.noise.compass_error,
    }
    for index, sigma in pairs.items():
        np.testing.assert_allclose(known[index], sigma)
    np.testing.assert_allclose(rough[state.X], config.rough_initial_sigma.position)


def test_it_is_positive_definite_without_slow_errors():
    """A sensor that is said to have no slow error has one of a millimetre or milliradian."""
    config = UkfConfig(noise=NoiseModel(gnss_error=0.0, compass_error=0.0))
    assert np.linalg.eigvalsh(initial_covariance(config, False)).min() > 0
