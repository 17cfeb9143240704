"""Walkers of a world: what they turn back at, where they begin, and that they cost nothing else."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box, frustum
from worlds.catalogue import make_world, patch
from worlds.walkers import WalkerConfig, draw_walkers, solids_room
from worlds.world import Start, Task

GROUND = Heightfield(np.zeros((121, 81), dtype=np.float32), 0.5)


def test_solids_are_circles_or_outlines_and_the_border_walls():
    """A trunk is round and a wall is not; stones and grass stop nobody."""
    objects = (
        frustum(SemanticClass.TRUNK, (3.0, 2.0, 0.0), (0.3, 0.1), 3.0, 20),
        box(SemanticClass.WALL, (-4.0, 1.0, 0.5), (4.0, 0.2, 1.0), 0.5),
        box(SemanticClass.STONE, (0.0, 0.0, 0.0), (0.2, 0.2, 0.05)),
        box(SemanticClass.HIGH_GRASS, (0.0, 5.0, 0.0), (1.0, 1.0, 0.5)),
    )
    room = solids_room(GROUND, objects)
    assert room.half == (29.0, 19.0)
    np.testing.assert_allclose(room.circles, [[3.0, 2.0, 0.3]], atol=1e-6)
    assert len(room.edges) == 4
    places = [[3.0, 2.5], [-4.0, 1.0], [-4.0 - 0.5 * np.sin(0.5), 1.0 + 0.5 * np.cos(0.5)]]
    found = room.clearance(np.array([*places, [0.0, 0.0], [0.0, 5.0], [28.5, 0.0]]))
    np.testing.assert_allclose(found[[0, 2, 5]], [0.2, 0.4, 0.5], atol=1e-5)
    assert found[1] < 0.0
    assert (found[3:5] > 1.0).all()


def test_walkers_begin_at_free_places_away_from_starts():
    """Sizes and speeds are within their bounds; a share comes and goes."""
    room = solids_room(GROUND, [frustum(SemanticClass.TRUNK, (9.0, 9.0, 0.0), (4.0, 4.0), 3.0)])
    tasks = [Task(Start(0.0, 0.0, 0.0), ((9.0, 0.0),)), Task(Start(-20.0, 5.0, 0.0), ())]
    config = WalkerConfig(count=100, passing=0.3)
    found = draw_walkers(config, room, tasks, np.random.default_rng(0))
    assert len(found) == 100
    places = np.array([one.place for one in found])
    for task in tasks:
        away = np.hypot(*(places - [task.start.x, task.start.y]).T)
        assert (away > 6.0 + 0.2).all()
    assert (room.clearance(places) > 0.2).all()
    speeds = np.array([np.hypot(*one.velocity) for one in found])
    for values, (low, high) in (
        (speeds, config.speed),
        (np.array([one.plan.radius for one in found]), config.radius),
        (np.array([one.plan.height for one in found]), config.height),
    ):
        assert low <= values.min() < values.max() <= high
    passing = [one for one in found if one.plan.duration is not None]
    assert 20 <= len(passing) <= 40
    assert all(one.plan.appears_at > 0.0 for one in passing)
    staying = [one for one in found if one.plan.duration is None]
    assert {one.plan.appears_at for one in staying} == {0.0}


def test_walkers_do_not_change_the_rest_of_a_world():
    """A small world with walkers is the one without, and its seed gives the same walkers again."""
    config = patch("natural-walkers", 40.0, 0.25)
    assert config.walkers.count == 4
    bare = config.model_copy(update={"walkers": WalkerConfig()})
    with_them, again = (make_world("natural-walkers", 3, config=config) for _ in range(2))
    without = make_world("natural-walkers", 3, config=bare)
    assert len(with_them.movers) == 4
    assert with_them.movers == again.movers
    assert without.movers == ()
    assert with_them.tasks == without.tasks
    np.testing.assert_array_equal(with_them.ground.heights, without.ground.heights)
    np.testing.assert_array_equal(with_them.truth.reason, without.truth.reason)
    assert len(with_them.objects) == len(without.objects)


@pytest.mark.parametrize("share", [-0.1, 1.1])
def test_a_share_out_of_bounds_is_refused(share):
    """Shares are from 0 to 1."""
    with pytest.raises(ValueError, match="passing"):
        WalkerConfig(passing=share)
