"""White noise and slow error of a receiver, told apart by its fixes."""

import numpy as np
import pytest

from andabata.localization.receiver_error import ReceiverConfig, ReceiverError

CONFIG = ReceiverConfig()


def seen(white, seconds=300, rate=1.0, drift=0.0):
    """Return what a receiver of some white noise [m] shows, with a drift [m/s]."""
    rng, error = np.random.default_rng(0), ReceiverError(CONFIG)
    for k in range(int(seconds * rate)):
        stamp = k / rate
        error.add(stamp, drift * stamp + rng.normal(0, white, 2))
    return error


@pytest.mark.parametrize("white", [0.15, 0.25, 0.66, 2.0])
def test_white_noise_is_what_fixes_scatter_from_one_to_the_next(white):
    """Five minutes at one fix a second show the noise to a fifth, whatever is slow beside it."""
    assert seen(white).white == pytest.approx(white, rel=0.2, abs=0.05)
    assert seen(white, drift=0.02).white == pytest.approx(white, rel=0.2, abs=0.05)


def test_the_slow_error_is_the_rest_of_what_is_stated():
    """A receiver that states a metre and scatters by 0.25 m is slowly off by the rest."""
    assert seen(0.25).slow(1.0) == pytest.approx(np.sqrt(1 - 0.25**2), rel=0.05)


@pytest.mark.parametrize("stated", [1e-4, 0.05, 0.3])
def test_no_receiver_is_believed_to_be_better_than_receivers_are(stated):
    """Whatever little it states, the sum of both errors is at least the configured one."""
    error = seen(0.25)
    assert np.hypot(error.white, error.slow(stated)) == pytest.approx(CONFIG.total, rel=1e-6)
    noisy = seen(2.0)
    assert noisy.slow(stated) == CONFIG.least_slow


def test_fixes_ten_times_a_second_are_compared_over_half_a_second():
    """Smoothed fixes hardly differ from the next one: those in between are passed over."""
    error = ReceiverError(CONFIG)
    offsets = np.repeat(np.random.default_rng(1).normal(0, 1.0, (200, 2)), 5, axis=0)
    for k, offset in enumerate(offsets):
        error.add(k / 10, offset)
    assert error.white == pytest.approx(1.0, rel=0.3)


def test_outliers_and_gaps_do_not_count():
    """One jump of 700 m, and fixes after a minute of silence, change nothing much."""
    rng, error = np.random.default_rng(0), ReceiverError(CONFIG)
    for k in range(100):
        error.add(float(k) if k < 50 else k + 60.0, rng.normal(0, 0.25, 2) + 700 * (k == 30))
    assert error.white == pytest.approx(0.25, abs=0.08)
    assert ReceiverError(CONFIG).white == CONFIG.white
