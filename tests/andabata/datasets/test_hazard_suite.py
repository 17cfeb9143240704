"""The hazard suite: each hazard at each distance and slope, from several sides, labelled."""

from collections import Counter

import numpy as np
import pytest

from andabata.datasets.hazard_suite import (
    BARE_SLOPES_DEG,
    BLIND_EDGE,
    DISTANCES,
    SLOPES_DEG,
    HazardCase,
    hazard_cases,
    hazard_cloud,
)
from worlds.hazards import HAZARDS


def test_the_suite_is_complete():
    """Every hazard has every distance, slope and side; numbers are unique."""
    cases = list(hazard_cases(4))
    assert [case.number for case in cases] == list(range(len(cases)))
    counts = Counter(case.hazard for case in cases)
    assert set(counts) == set(HAZARDS)
    for hazard, count in counts.items():
        slopes = BARE_SLOPES_DEG if hazard == "bare_ground" else SLOPES_DEG
        slopes = (0.0,) if hazard == "drivable_slope" else slopes
        assert count == len(slopes) * len(DISTANCES) * 4
        assert {case.slope_deg for case in cases if case.hazard == hazard} == set(slopes)
    others = {case.distance for case in cases if case.hazard != "drop"}
    assert others == set(DISTANCES)


def test_a_drop_begins_at_the_blind_cone():
    """Drops lie at the edge of the blind cone, a little further for each distance."""
    drops = sorted({case.distance for case in hazard_cases(1) if case.hazard == "drop"})
    assert drops == pytest.approx([BLIND_EDGE + 0.05 * distance for distance in DISTANCES])


def test_sides_are_spread_round_the_robot():
    """The bearings of one place are a full turn apart in equal steps."""
    for sides in (1, 3, 4):
        bearings = np.array([case.bearing for case in hazard_cases(sides)][:sides])
        steps = np.diff(bearings) - 2 * np.pi * 0.13 / sides
        np.testing.assert_allclose(steps, 2 * np.pi / sides)


def test_a_case_is_a_labelled_cloud_of_its_hazard():
    """A trunk is seen where its case has it, and forbids; the same case gives the same cloud."""
    case = HazardCase("fallen_trunk", 2.0, 0.7, 0.0, 5)
    cloud = hazard_cloud(case)
    blocked = cloud.points[cloud.nontraversable]
    assert len(blocked) > 20
    assert np.hypot(blocked[:, 0], blocked[:, 1]).min() == pytest.approx(2.0, abs=0.25)
    np.testing.assert_array_equal(cloud.points, hazard_cloud(case).points)
    assert cloud.points.shape != hazard_cloud(case, seed=1).points.shape


def test_a_harmless_case_forbids_nothing():
    """Bare ground on a slope has points and no non-traversable one."""
    cloud = hazard_cloud(HazardCase("bare_ground", 2.0, 0.0, 10.0, 6))
    assert len(cloud) > 1000
    assert not cloud.nontraversable.any()
    assert np.ptp(cloud.points[:, 2]) > 0.5
