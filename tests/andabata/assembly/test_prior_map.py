"""Laws of the sources of prior maps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from andabata.assembly.prior_map import make_prior_map, survey
from andabata.assembly.simulated_robot import SimulatedRobotConfig, with_geo_reference
from andabata.machine.geo_reference import GeoReference
from andabata.navigation.planning.prior_map import PriorMapConfig
from terrain.heightfield import Heightfield
from tests.support.elevation_models import EAST, NORTH, UTM, grid, needs_rasterio, save
from worlds.catalogue import make_world
from worlds.elevation.local_frame import WGS_84, transformed

WORLD = make_world("hill", 7300)


def robot(**settings: object) -> SimulatedRobotConfig:
    """Return a robot with settings of its prior map."""
    return SimulatedRobotConfig(prior_map=PriorMapConfig.model_validate(settings))


def test_there_is_none_by_default() -> None:
    """A robot knows nothing of the ground before the drive."""
    assert make_prior_map(SimulatedRobotConfig(), WORLD) is None


def test_a_survey_is_coarse_and_has_the_errors_that_it_states() -> None:
    """It has the world's heights at its own grid lines, and the same errors for the same world."""
    config = PriorMapConfig(source="world", cell=2.0, height_error=0.3)

    heights = survey(WORLD, config)

    true = WORLD.ground.height_at(heights.x[:, None], heights.y[None, :])
    assert heights.cell == 2.0
    assert (heights.heights - true).std() == pytest.approx(0.3, rel=0.1)
    assert (survey(WORLD, config).heights == heights.heights).all()


def test_a_survey_sees_the_ground_without_roughness() -> None:
    """Clods are too small for it: the base is what it measures."""
    base = Heightfield(np.zeros_like(WORLD.ground.heights), WORLD.ground.cell)
    rough = replace(WORLD, base=base)

    assert (survey(rough, PriorMapConfig(height_error=0.0)).heights == 0.0).all()


def test_a_world_has_a_prior_map_and_a_recording_has_none() -> None:
    """Where no world is simulated, an elevation model has to be named."""
    prior = make_prior_map(robot(source="world"), WORLD)
    assert prior is not None
    assert prior.highest > 0.0

    for source in ("world", "truth"):
        said = rf"prior_map\.source: expected an elevation model.*got '{source}'"
        with pytest.raises(ValueError, match=said):
            make_prior_map(robot(source=source), None)


def test_the_truth_bars_ground_without_room_for_the_body() -> None:
    """A cell costs where its middle is nearer to forbidden ground than half the body's width."""
    prior = make_prior_map(robot(source="truth", steep_cost=7.0), WORLD)

    assert prior is not None
    n, m = prior.extra.shape
    x, y = (np.arange(n) - (n - 1) / 2) * prior.cell, (np.arange(m) - (m - 1) / 2) * prior.cell
    room = WORLD.truth.clearance_at(*np.broadcast_arrays(x[:, None], y[None, :]))
    barred = room < SimulatedRobotConfig().robot.width / 2
    assert (prior.extra == np.where(barred, np.float32(7.0), 0.0)).all()
    assert 0.05 < barred.mean() < 0.95


def test_an_elevation_model_is_read_around_the_datum(tmp_path: Path) -> None:
    """A slope to the east of the datum in the model lies to the east of the map's origin."""
    needs_rasterio()
    x, _, numbers = grid()
    path = save(tmp_path / "dem.tif", np.maximum(x - EAST - 20, 0).astype(np.float32), numbers)
    longitude, latitude = transformed(UTM, WGS_84, np.array([EAST]), np.array([NORTH]))
    datum = GeoReference(latitude_deg=float(latitude[0]), longitude_deg=float(longitude[0]))
    config = robot(source=str(path), size=100.0)

    prior = make_prior_map(with_geo_reference(config, datum), None)

    assert prior is not None
    middle = len(prior.extra) // 2
    assert (prior.extra[: middle + 19] == 0.0).all()
    assert (prior.extra[middle + 22 :] == config.prior_map.steep_cost).all()
