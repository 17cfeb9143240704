"""Worlds of real terrain: its ground, a preset's plants, and objects at given places."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from worlds.catalogue import UnknownWorldError, presets
from worlds.elevation.objects_file import PlacedObject
from worlds.elevation.square import GroundSquare
from worlds.elevation.world import BARE, config_on, ground_presets, world_on
from worlds.goals import UnsolvableWorldError
from worlds.splits import JUDGING_START, JudgingSeedError
from worlds.traversability_map import Reason
from worlds.world import MapDatum
from worlds.world_files import world_to_bytes

DATUM = MapDatum(latitude_deg=46.0, longitude_deg=7.0, altitude=812.5)


def square(rise=0.1, size=60.0):
    """Return a square of ground that rises to the east."""
    x = np.linspace(-size / 2, size / 2, round(size / 0.25) + 1)
    heights = np.repeat(rise * x[:, None], len(x), axis=1).astype(np.float32)
    return GroundSquare(Heightfield(heights, 0.25), DATUM, "EPSG:32632", (1.0, 1.0), ())


@pytest.fixture(scope="module")
def rough():
    """Return a world of rough ground and its square."""
    return world_on("valley", square(), "natural-rough", 7, 0.3)


def test_the_ground_is_the_models_under_the_presets_roughness(rough):
    """The true map is built of the model, but for trails; a few centimetres lie on it."""
    fine = square().ground.refined(3)
    away = distance_transform_edt(rough.surface != SemanticClass.PATH) * fine.cell > 1.5
    assert away.mean() > 0.5
    same = rough.base.heights[:-1, :-1] == fine.heights[:-1, :-1]
    assert same[away].all()
    assert not same.all()
    assert rough.ground.cell == fine.cell
    difference = np.abs(rough.ground.heights - fine.heights)
    assert 0.001 < difference.mean() < difference.max() < 0.2
    assert rough.cover.any()


def test_plants_objects_and_tasks_are_the_presets(rough):
    """As many to a square metre, and as many goals."""
    config = presets()["natural-rough"]
    bushes = sum(each.semantic is SemanticClass.BUSH for each in rough.objects)
    assert bushes == pytest.approx(config.bushes * 60.0**2 * 0.8, rel=0.5)
    assert len(rough.tasks) == config.tasks
    assert len(rough.tasks[0].goals) == config.goals
    assert (rough.name, rough.seed, rough.difficulty, rough.datum) == ("valley", 7, 0.3, DATUM)


def test_the_same_arguments_give_the_same_bytes(rough):
    """Another seed gives others."""
    again = world_on("valley", square(), "natural-rough", 7, 0.3)
    assert world_to_bytes(again) == world_to_bytes(rough)
    other = world_on("valley", square(), "natural-rough", 8, 0.3)
    assert not np.array_equal(other.ground.heights, rough.ground.heights)


def test_a_bare_world_holds_what_is_placed():
    """Nothing else stands on it; the true map knows it."""
    tree = PlacedObject("tree", 10.0, -5.0, {"radius": 0.5})
    world = world_on("bare", square(), BARE, placed=[tree])
    assert [each.semantic.name for each in world.objects] == ["TRUNK", "FOLIAGE"]
    middle = np.mean([world.objects[0].vertices.min(0), world.objects[0].vertices.max(0)], axis=0)
    assert middle[:2] == pytest.approx([10.0, -5.0], abs=1e-3)
    assert world.objects[0].vertices[:, 2].min() == pytest.approx(0.1 * 10.0 - 0.3, abs=1e-3)
    assert world.truth.reason_at(10.0, -5.0) == Reason.SOLID
    assert world.base is None
    assert len(world.tasks) == 4


def test_placed_objects_stand_on_the_rough_ground(rough):
    """Where it is farthest from the model's, too."""
    difference = np.abs(rough.ground.heights - square().ground.refined(3).heights)
    i, j = np.unravel_index(difference[50:-50, 50:-50].argmax(), (621, 621))
    x, y = float(rough.ground.x[i + 50]), float(rough.ground.y[j + 50])
    placed = [PlacedObject("tree", x, y, {})]
    world = world_on("valley", square(), "natural-rough", 7, 0.3, placed)
    assert len(world.objects) == len(rough.objects) + 2
    foot = world.objects[-2].vertices[:, 2].min() + 0.3
    assert foot == pytest.approx(float(rough.ground.height_at(x, y)), abs=1e-4)
    assert abs(foot - square().ground.height_at(x, y)) > 0.01


def test_numbers_of_a_preset_go_with_the_area():
    """Densities stay, dead ends and ruts are as many to a square metre, goals are nearer."""
    config, own = config_on("natural-rough", 50.0), presets()["natural-rough"]
    assert (config.traps, config.roughness.ruts) == (round(own.traps / 4), own.roughness.ruts // 4)
    assert config.ways == own.ways.scaled(0.25)
    assert (config.size, config.near, config.trees) == (50.0, 12.5, own.trees)
    walkers = presets()["natural-walkers"].walkers
    assert config_on("natural-walkers", 50.0).walkers == walkers.scaled(0.25)
    assert config_on("natural-test", 120.0).near == presets()["natural-test"].near


def test_only_natural_presets_go_on_any_ground():
    """A maze is no plants; the names are in the error."""
    assert {"natural-test", "meadow", BARE} < set(ground_presets())
    for name in ("maze", "hollow", "nothing"):
        with pytest.raises(UnknownWorldError, match=f"natural-test.*none, got '{name}'"):
            config_on(name, 60.0)


def test_ground_that_is_too_steep_is_an_error_that_says_so():
    """With the share of it, and the place; where objects are in the way, with fewer of them."""
    with pytest.raises(UnsolvableWorldError, match=r"46\.0.*100% of the bare .*: take another"):
        world_on("wall", square(0.8, 40.0), BARE)
    walls = [PlacedObject("rock", x, 0.0, {"radius": 9.0, "height": 3.0}) for x in range(-20, 21)]
    walls += [replace(each, y=y) for each in walls for y in (-12.0, 12.0)]
    with pytest.raises(UnsolvableWorldError, match=r" 0% of the bare .*: take a lower difficulty"):
        world_on("full", square(0.0, 40.0), BARE, placed=walls)


def test_a_seed_that_judges_is_refused():
    """As for every world of a seed."""
    with pytest.raises(JudgingSeedError):
        world_on("valley", replace(square()), BARE, JUDGING_START)
