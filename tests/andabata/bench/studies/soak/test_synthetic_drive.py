"""The computed drive: a circle that the filter follows, with gaps where they are asked for."""

import numpy as np
import pytest

from andabata.bench.studies.soak.synthetic_drive import (
    RADIUS,
    SPEED,
    fresh_localizer,
    synthetic_readings,
)
from andabata.localization.localizer import Health


def test_the_filter_follows_the_circle():
    """After a minute pose and health are right: all senses agree."""
    localizer = fresh_localizer()
    for readings in synthetic_readings(600):
        localizer.update(readings)
    angle = readings.stamp * SPEED / RADIUS
    place = RADIUS * np.array([np.cos(angle), np.sin(angle)])
    assert localizer.pose.position[:2] == pytest.approx(place, abs=0.5)
    assert localizer.health is Health.OK
    assert localizer.counts["imu"] == (6000, 0, 0)


def test_gaps_silence_compass_and_fixes():
    """Four of forty seconds; without gaps there are none."""
    for gaps, silent in ((True, 40), (False, 0)):
        drive = list(synthetic_readings(400, gaps=gaps))
        assert sum(readings.mag is None for readings in drive) == silent
        assert sum(readings.gnss is not None for readings in drive) == 40 - silent // 10


def test_the_same_seed_gives_the_same_readings():
    """And another one others."""
    first, same, other = (next(synthetic_readings(1, seed)).imu for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert (first[:, 1:] != other[:, 1:]).all()
