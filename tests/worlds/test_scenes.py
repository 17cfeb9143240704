"""Scenes: made once, dropped in order of use."""

import pytest

from worlds import scenes as scenes_module
from worlds.scenes import SceneCache


@pytest.fixture
def made(monkeypatch):
    """Replace worlds by their keys, and return the list of those made."""
    keys = []
    monkeypatch.setattr(scenes_module, "make_world", lambda *key, release: keys.append(key) or key)
    monkeypatch.setattr(scenes_module, "RayScene", lambda world: world)
    return keys


def test_a_scene_is_made_once(made):
    """The same preset, seed and difficulty give the same object; each of them counts."""
    scenes = SceneCache()
    first = scenes.get("maze", 1)
    assert scenes.get("maze", 1) is first
    for other in (("plain", 1), ("maze", 2), ("maze", 1, 0.3)):
        assert scenes.get(*other) is not first
    assert made == [("maze", 1, None), ("plain", 1, None), ("maze", 2, None), ("maze", 1, 0.3)]


def test_the_scene_used_longest_ago_is_dropped_first(made):
    """A full cache keeps the scenes used last, not those made last."""
    scenes = SceneCache(2)
    for seed in (1, 2, 1, 3):
        scenes.get("maze", seed)
    made.clear()
    scenes.get("maze", 1)
    scenes.get("maze", 3)
    assert made == []
    scenes.get("maze", 2)
    assert made == [("maze", 2, None)]


def test_a_scene_of_a_release_is_not_another_ones(made):
    """What was made to judge a release is not handed out for another purpose."""
    scenes = SceneCache()
    judged = scenes.get("maze", 1, release="0.2.0")
    assert scenes.get("maze", 1, release="0.2.0") is judged
    assert scenes.get("maze", 1) is not judged
    assert len(made) == 2
