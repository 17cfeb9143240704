"""Worlds: same seed, same bytes; other presets have no twins; every task is solvable."""

import numpy as np
import pytest

from worlds.catalogue import UnknownWorldError, make_world, preset_names, presets

NAMES = ("hollow", "maze", "natural", "natural-test")


def fingerprint(world):
    parts = [world.ground.heights.tobytes(), world.truth.reason.tobytes()]
    parts += [thing.vertices.tobytes() for thing in world.objects]
    return b"".join(parts)


@pytest.fixture(scope="module", params=NAMES)
def world(request):
    return make_world(request.param, 3)


def test_the_presets_are_known():
    assert preset_names() == NAMES


def test_the_same_seed_gives_the_same_bytes(world):
    assert fingerprint(make_world(world.name, 3)) == fingerprint(world)


def test_families_differ():
    assert len({config.family for config in presets().values()}) == len(NAMES)


def test_starts_and_goals_lie_on_safe_ground_and_are_joined(world):
    for task in world.tasks:
        here = np.array([task.start.x, task.start.y])
        assert not world.truth.forbidden_at(*here)
        for goal in task.goals:
            assert not world.truth.forbidden_at(*goal)
            assert world.truth.shortest_path(here, np.array(goal), 0.35) is not None
            here = np.array(goal)


def test_the_natural_worlds_are_as_large_as_the_papers():
    natural, test = make_world("natural", 0), make_world("natural-test", 0)
    assert (natural.ground.width, test.ground.width) == (pytest.approx(120), pytest.approx(100))
    assert np.ptp(natural.ground.heights) == pytest.approx(14, abs=1.5)
    assert np.ptp(test.ground.heights) == pytest.approx(16, abs=1.5)


def test_an_unknown_world_is_named():
    with pytest.raises(UnknownWorldError, match=r"expected one of hollow, maze.*got 'moon'"):
        make_world("moon")


@pytest.mark.parametrize(("seed", "difficulty"), [(-1, None), (0, 1.5)])
def test_bounds_are_checked(seed, difficulty):
    with pytest.raises(ValueError, match="expected 0"):
        make_world("maze", seed, difficulty)
