"""The field suite: drawn lasers, fields in turns with free ground, labelled by the true world."""

from collections import Counter

import numpy as np
import pytest

from andabata.datasets.field_suite import FIELD, FREE_KINDS, field_cases, field_cloud
from andabata.machine.lidar_models import sensor_names
from worlds.splits import JudgingSeedError, judging_world


def test_the_suite_has_as_many_fields_as_cases_of_free_ground():
    """In turns, each kind of free ground as often, lasers and heights drawn."""
    cases = list(field_cases(120))
    counts = Counter(case.kind for case in cases)
    assert counts == {FIELD: 120} | dict.fromkeys(FREE_KINDS, 20)
    assert all((case.field is not None) == (case.kind == FIELD) for case in cases)
    assert {case.sensor for case in cases} == set(sensor_names())
    heights = [case.height for case in cases]
    assert 0.5 <= min(heights) < 0.6
    assert 1.7 < max(heights) <= 1.8
    assert list(field_cases(120)) == cases
    assert list(field_cases(120, seed=1)) != cases


def test_a_field_is_blocked_from_its_edge_on():
    """Points of plants that are too high are labelled; none lies before the edge."""
    case = next(c for c in field_cases(60, 1) if c.field and c.field.height > 0.6)
    cloud, yaw = field_cloud(case, 1)
    blocked = cloud.points[cloud.nontraversable]
    ahead = blocked[:, :2] @ [np.cos(case.bearing - yaw), np.sin(case.bearing - yaw)]
    assert len(blocked) > 50
    assert case.field.distance - 0.4 < ahead.min() < case.field.distance + 2.5


@pytest.mark.parametrize("kind", FREE_KINDS)
def test_free_ground_has_no_blocked_point(kind):
    """Whatever covers it; without noise level ground is level to the last digit."""
    case = next(c for c in field_cases(60, 1) if c.kind == kind)
    cloud, _ = field_cloud(case, 1)
    assert len(cloud) > 300
    assert not cloud.nontraversable.any()
    if kind == "noiseless":
        # But for the spot of a grazing beam, which the paper's laser has.
        assert np.quantile(np.abs(cloud.points[:, 2]), 0.99) < 1e-4
    if kind in ("grass", "undulation"):
        assert cloud.points[:, 2].std() > 0.005


def test_a_suite_that_judges_is_for_its_release():
    """Without it, none of its cases is drawn."""
    seed = judging_world("0.2.0", 0)
    for release in (None, "0.2.1"):
        with pytest.raises(JudgingSeedError, match=r"which judges 0\.2\.0"):
            next(field_cases(1, seed, release))


def test_a_release_has_its_suite(monkeypatch):
    """With its name the cases are those of the seed."""
    monkeypatch.setattr("worlds.splits.JUDGING_START", 1)
    judged = list(field_cases(2, 1, "0.0.0"))
    with pytest.raises(JudgingSeedError):
        next(field_cases(2, 1))
    monkeypatch.undo()
    assert judged == list(field_cases(2, 1))
