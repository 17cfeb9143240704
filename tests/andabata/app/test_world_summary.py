"""Contents of a world in numbers and in words."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.app.world_summary import world_summary, world_text
from tests.support.walking_worlds import walker
from worlds.catalogue import make_world


@pytest.fixture(scope="module")
def world():
    """Return a maze."""
    return make_world("maze", 2, None)


def test_a_world_is_counted_and_measured(world):
    """Counts add up to the objects, shares of the ground to one."""
    data = world_summary(world)
    assert (data["name"], data["seed"], data["width_m"], data["depth_m"]) == ("maze", 2, 80.0, 80.0)
    assert sum(data["objects"].values()) == len(world.objects)
    assert sum(data["share_of_ground"].values()) == pytest.approx(1.0)
    assert data["relief_m"] == pytest.approx(float(np.ptp(world.ground.heights)))
    assert (data["tasks"], data["goals_per_task"]) == (
        len(world.tasks),
        len(world.tasks[0].goals),
    )


def test_walkers_are_counted_where_there_are_any(world):
    """A world without any has no line of them."""
    assert world_summary(world)["walkers"] == 0
    assert not any("walkers" in line for line in world_text(world_summary(world)).splitlines())
    data = world_summary(replace(world, movers=(walker((0.0, 0.0)),) * 3))
    assert "walkers: 3" in world_text(data).splitlines()


def test_the_text_has_the_most_frequent_objects_first(world):
    """Objects stand by decreasing number."""
    data = world_summary(world) | {"objects": {"rock": 1, "wall": 7}}
    lines = world_text(data).splitlines()
    assert lines[0].startswith("maze, seed 2: 80 x 80 m, relief ")
    assert lines[1] == "objects: 7 wall, 1 rock"
