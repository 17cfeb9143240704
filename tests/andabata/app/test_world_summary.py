"""Contents of a world in numbers and in words."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.app.world_summary import datum_text, size_text, world_summary, world_text
from tests.support.walking_worlds import agent, walker
from worlds.catalogue import make_world
from worlds.world import MapDatum


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
    made = (agent("person", (0.0, 0.0)), agent("animal", (1.0, 0.0)), agent("person", (2.0, 0.0)))
    data = world_summary(replace(world, movers=(*made, walker((3.0, 0.0)))))
    assert data["walkers_by_kind"] == {"person": 2, "animal": 1}
    assert "walkers: 4 (2 person, 1 animal)" in world_text(data).splitlines()


def test_the_text_has_the_most_frequent_objects_first(world):
    """Objects stand by decreasing number."""
    data = world_summary(world) | {"objects": {"rock": 1, "wall": 7}}
    lines = world_text(data).splitlines()
    assert lines[0].startswith("maze, seed 2: 80 x 80 m, relief ")
    assert lines[1] == "objects: 7 wall, 1 rock"


def test_the_place_on_earth_is_named_where_there_is_one(world):
    """With latitude, longitude and altitude; a world that is nowhere has no line of it."""
    assert world_summary(world)["datum"] is None
    assert "latitude" not in world_text(world_summary(world))
    datum = MapDatum(latitude_deg=46.5, longitude_deg=-7.25, altitude=1234.5)
    data = world_summary(replace(world, datum=datum))
    assert data["datum"] == {"latitude_deg": 46.5, "longitude_deg": -7.25, "altitude_m": 1234.5}
    line = "its middle is at latitude 46.500000, longitude -7.250000, altitude 1234.50 m"
    assert datum_text(data["datum"]) == world_text(data).splitlines()[1] == line


def test_the_size_is_one_line(world):
    """With the number of objects and tasks."""
    data = world_summary(world) | {"objects": {"rock": 3, "wall": 4}, "relief_m": 1.5, "tasks": 4}
    assert size_text(data) == "world of 80.0 x 80.0 m, relief 1.5 m, 7 objects, 4 tasks"
