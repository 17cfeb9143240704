"""Wheels against fixes: speed, direction, and a mean of nothing."""

import numpy as np
import pytest

from andabata.records.frames.driving_check import DrivingCheck

METRE = 1 / 111_195


def driven(speed=1.0, heading=0.5, reported=None, fixes=20, sigma=0.5):
    """Return a check of a drive in a wide arc with a fix a second, and noise of 0.2 m."""
    check, rng = DrivingCheck(), np.random.default_rng(0)
    place, yaw = 0j, heading
    reported = speed if reported is None else reported
    for k in range(10 * fixes):
        t = k / 10
        yaw += 0.005
        place += 0.1 * speed * np.exp(1j * yaw)
        imu = np.array([[t, 0, 0, 0.05, 0, 0, 9.8]])
        north = np.exp(1j * (np.pi / 2 - yaw))
        mag = np.array([[t, 30 * north.real, 30 * north.imag, -40]])
        noise = rng.normal(0, 0.2, 2)
        fix = [t, 36 + (place.imag + noise[0]) * METRE, 0.0, 0.0, sigma**2]
        fix[2] = (place.real + noise[1]) * METRE / np.cos(np.deg2rad(36))
        gnss = np.array([fix]) if k % 10 == 0 else None
        check.add(imu, np.array([[t, reported]]), mag, gnss)
    return check


def test_a_healthy_drive_fits():
    """Scale 1, the heading of the start, and nothing to say."""
    fit = driven().fit
    assert fit.scale == pytest.approx(1.0, abs=0.05)
    assert fit.heading == pytest.approx(0.5, abs=0.05)
    assert fit.correlation > 0.99
    assert driven().remarks == []


@pytest.mark.parametrize(
    ("reported", "words"),
    [(0.0, "mean speed"), (10.0, "of the way that"), (-1.0, "--unit wheels=-1")],
)
def test_wheels_that_contradict_the_fixes_are_named(reported, words):
    """Wheels that stand, another unit, and another direction."""
    (text,) = driven(reported=reported).remarks
    assert words in text
    assert text.startswith("wheels: ")


def test_few_near_or_poor_fixes_say_nothing():
    """Fixes that spread less than their noise decide nothing."""
    assert driven(reported=0.0, fixes=4).remarks == []
    assert driven(speed=0.1, reported=0.0).remarks == []
    assert driven(reported=0.0, sigma=10.0).remarks == []
    assert DrivingCheck().remarks == []
