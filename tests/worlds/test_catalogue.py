"""The catalogue: same seed, same bytes; disjoint presets; every task is solvable."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from worlds.catalogue import UnknownWorldError, make_world, patch, preset_names, presets
from worlds.traversability_map import Reason

NAMES = (
    "forest",
    "hill",
    "hollow",
    "lake",
    "maze",
    "meadow",
    "meadow-rough",
    "natural",
    "natural-far",
    "natural-rough",
    "natural-row",
    "natural-test",
    "natural-walkers",
    "park",
    "plain",
    "stony",
    "terraced",
)


def fingerprint(world):
    """Return the bytes of ground, true map and objects."""
    parts = [world.ground.heights.tobytes(), world.truth.reason.tobytes()]
    parts += [each.vertices.tobytes() for each in world.objects]
    return b"".join(parts)


@pytest.fixture(scope="module", params=NAMES)
def world(request):
    return make_world(request.param, 3)


def test_the_presets_are_known():
    """The names are those that commands and documents use."""
    assert preset_names() == NAMES


def test_the_same_seed_gives_the_same_bytes(world):
    """A world is a function of its preset and seed."""
    assert fingerprint(make_world(world.name, 3)) == fingerprint(world)


def test_families_differ():
    """Every preset has random streams of its own, but for those in the worlds of another."""
    families = {name: config.family for name, config in presets().items()}
    assert families.pop("natural-walkers") == families["natural-test"]
    assert families.pop("natural-row") == families["natural"]
    assert len(set(families.values())) == len(NAMES) - 2


def test_worlds_with_goals_in_a_row_are_those_that_are_trained_in():
    """Tasks apart the two presets differ in nothing: ground, objects and true map are equal."""
    natural, row = (presets()[name] for name in ("natural", "natural-row"))
    assert row.model_copy(update={"goals": 1, "about": natural.about}) == natural
    seen, judged = (make_world(name, 0) for name in ("natural", "natural-row"))
    assert fingerprint(judged) == fingerprint(seen)
    assert [len(task.goals) for task in judged.tasks] == [3] * 4
    assert [len(task.goals) for task in seen.tasks] == [1] * 4


def test_worlds_with_walkers_pair_with_those_without():
    """Family apart, the two presets differ in nothing but walkers."""
    test, walkers = (presets()[name] for name in ("natural-test", "natural-walkers"))
    same = {"walkers": test.walkers, "about": test.about}
    assert 20 <= walkers.walkers.most_at(0.5) <= 30
    assert walkers.model_copy(update=same) == test


def test_starts_and_goals_lie_on_safe_ground_and_are_joined(world):
    """A safe path leads from each start to each goal in turn."""
    for task in world.tasks:
        here = np.array([task.start.x, task.start.y])
        assert not world.truth.forbidden_at(*here)
        for goal in task.goals:
            assert not world.truth.forbidden_at(*goal)
            assert world.truth.shortest_path(here, np.array(goal), 0.35) is not None
            here = np.array(goal)


def test_the_natural_worlds_are_as_large_as_the_papers():
    """Size and relief are those of section 5.3."""
    natural, test = make_world("natural", 0), make_world("natural-test", 0)
    assert (natural.ground.width, test.ground.width) == (pytest.approx(120), pytest.approx(100))
    assert np.ptp(natural.ground.heights) == pytest.approx(14, abs=1.5)
    assert np.ptp(test.ground.heights) == pytest.approx(16, abs=1.5)


def test_an_unknown_world_is_named():
    """The error lists the names that exist."""
    with pytest.raises(UnknownWorldError, match=r"expected one of forest, hill.*got 'moon'"):
        make_world("moon")


@pytest.mark.parametrize(("seed", "difficulty"), [(-1, None), (0, 1.5)])
def test_bounds_are_checked(seed, difficulty):
    """A negative seed and a difficulty above 1 are refused."""
    with pytest.raises(ValueError, match="expected 0"):
        make_world("maze", seed, difficulty)


def test_lamps_benches_water_and_paths_stand_where_they_should():
    """A park has furniture and paths, a lake level water."""
    park, lake = make_world("park", 3), make_world("lake", 3)
    kinds = {each.semantic for each in park.objects}
    furniture = {SemanticClass.LAMP, SemanticClass.BENCH, SemanticClass.TABLE, SemanticClass.BIN}
    assert furniture <= kinds
    assert (park.surface == SemanticClass.PATH).any()
    wet = lake.surface == SemanticClass.WATER
    assert 0.05 < wet.mean() < 0.3
    heights = lake.ground.heights
    assert np.ptp(heights[:-1, :-1][wet]) < 1e-6
    assert (lake.truth.reason == Reason.WATER).mean() == pytest.approx(wet.mean(), abs=0.03)


def test_a_patch_has_its_share_of_the_strips():
    """As many to a square metre; trails cross any square."""
    own, small = presets()["natural-rough"].ways, patch("natural-rough", 50.0, 0.25).ways
    assert (small.trails, small.roots, small.kerbs) == (own.trails, own.roots, round(own.kerbs / 4))


@pytest.mark.parametrize("name", NAMES)
def test_a_patch_is_a_small_world_of_the_same_kind(name):
    """A patch has the size asked for, and a task."""
    world = make_world(name, 3, 0.6, patch(name, 48.0, 0.25))
    assert world.ground.width == pytest.approx(48.0)
    assert (world.truth.reason != Reason.FREE).mean() < 0.8
    assert world.tasks
