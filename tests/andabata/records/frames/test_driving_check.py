"""Wheels against fixes: speed, direction, and a mean of nothing."""

import numpy as np
import pytest

from andabata.records.frames.driving_check import DrivingCheck

METRE = 1 / 111_195


def driven(
    speed=1.0, heading=0.5, reported=None, fixes=20, sigma=0.5, turned=lambda k: 0.0, east=0.0
):
    """Return a check of a drive in a wide arc from a longitude [deg], a fix a second, 0.2 m noise.

    The compass is turned to the left by a function of the period [deg].
    """
    check, rng = DrivingCheck(), np.random.default_rng(0)
    place, yaw = 0j, heading
    reported = speed if reported is None else reported
    for k in range(10 * fixes):
        t = k / 10
        yaw += 0.005
        place += 0.1 * speed * np.exp(1j * yaw)
        imu = np.array([[t, 0, 0, 0.05, 0, 0, 9.8]])
        north = np.exp(1j * (np.pi / 2 - yaw - np.deg2rad(turned(k))))
        mag = np.array([[t, 30 * north.real, 30 * north.imag, -40]])
        noise = rng.normal(0, 0.2, 2)
        fix = [t, 36 + (place.imag + noise[0]) * METRE, 0.0, 0.0, sigma**2]
        longitude = east + (place.real + noise[1]) * METRE / np.cos(np.deg2rad(36))
        fix[2] = (longitude + 180.0) % 360.0 - 180.0
        gnss = np.array([fix]) if k % 10 == 0 else None
        check.add(imu, np.array([[t, reported]]), mag, gnss)
    return check


@pytest.mark.parametrize("east", [0.0, 179.99999, -180.0])
def test_a_healthy_drive_fits(east):
    """Scale 1, the heading of the start, and nothing to say, across the antimeridian too."""
    fit = driven(east=east).fit
    assert fit.scale == pytest.approx(1.0, abs=0.05)
    assert fit.heading == pytest.approx(0.5, abs=0.05)
    assert fit.correlation > 0.99
    assert driven(east=east).remarks == []


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


@pytest.mark.parametrize("degrees", [-130, 130, 180, -75, 75, -105, 105, 0])
def test_only_a_heading_opposite_to_the_compass_is_backwards(degrees):
    """Opposite means by more than 120 degrees, on either side."""
    remarks = driven(turned=lambda _: degrees).remarks
    assert any("move backwards" in text for text in remarks) == (abs(degrees) > 120)


def test_an_unsteady_compass_says_nothing_about_backwards():
    """It is opposite for more than a half of the drive, and right for the rest."""
    assert driven(turned=lambda k: 180 * (k % 5 < 3)).remarks == []
    assert driven(turned=lambda k: 180 + 20 * (k % 2)).remarks != []


def test_the_scale_may_be_half_or_twice():
    """Beyond it the unit or the radius is wrong; the number is that of the fixes."""
    for reported in (0.55, 1.8):
        assert driven(reported=reported).remarks == []
    for reported, share in ((0.4, "2.5"), (2.5, "0.4")):
        (text,) = driven(reported=reported).remarks
        assert f"move by {share} of the way" in text


def test_fixes_without_a_place_or_outside_of_the_drive_do_not_count():
    """Five fixes within the path are needed."""
    check = driven()
    late = np.array([[1e3 + k, 36.1, 0.0, 0.0, 0.25] for k in range(30)])
    before = check.fit
    check.add(None, None, None, late)
    check.add(None, None, None, np.array([[5.0, np.nan, 0.0, 0.0, 0.25]]))
    assert check.fit == before
