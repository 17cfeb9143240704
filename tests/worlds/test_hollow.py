"""Hollows: a trail between banks, with a task along it."""

import importlib

import numpy as np
import pytest

from terrain.classes import SemanticClass
from worlds.hollow import HollowConfig, make_hollow

CONFIG = HollowConfig(family=1, length=40.0)


@pytest.fixture(scope="module")
def hollow():
    return make_hollow("hollow", 0, CONFIG, 0.5, np.random.default_rng(0))


def test_the_task_leads_along_the_trail(hollow):
    """Start, middle and end are in order along x, near the trail, facing along it."""
    (task,) = hollow.tasks
    x = [task.start.x, *(goal[0] for goal in task.goals)]
    assert x == pytest.approx([-17.6, 0.0, 17.6], abs=4.5)
    assert abs(task.start.yaw) < 1.2


def test_the_trail_is_a_path_and_the_banks_are_high(hollow):
    """Ground on the trail is of class PATH, and lower than the banks beside it."""
    path = hollow.surface == SemanticClass.PATH
    rows = path[40:-40].any(axis=1)
    assert rows.all()
    heights = hollow.ground.heights[:-1, :-1]
    assert heights[~path].max() > heights[path].max() + 1.5


def test_weeds_grow_with_difficulty():
    """The number of clumps of grass is proportional to one half plus the difficulty."""
    counts = []
    for difficulty in (0.0, 1.0):
        world = make_hollow("hollow", 0, CONFIG, difficulty, np.random.default_rng(3))
        counts.append(sum(o.semantic is SemanticClass.HIGH_GRASS for o in world.objects))
    assert counts == [round(41 * 1.6 * 0.5), round(41 * 1.6 * 1.5)]


def test_banks_and_gutters_are_whole_within_the_distances_computed(hollow, monkeypatch):
    """Distances up to infinity make the same ground, bit for bit."""
    module = importlib.import_module("worlds.hollow")
    reached = module.distance_to_line
    monkeypatch.setattr(module, "distance_to_line", lambda x, y, line, reach: reached(x, y, line))
    whole = make_hollow("hollow", 0, CONFIG, 0.5, np.random.default_rng(0))
    np.testing.assert_array_equal(whole.ground.heights, hollow.ground.heights)
    np.testing.assert_array_equal(whole.surface, hollow.surface)
