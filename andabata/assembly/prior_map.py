"""Prior maps by their source: a survey of the simulated world, or an elevation model."""

from pathlib import Path

import numpy as np

from andabata.assembly.navigator import NavigatorConfig
from andabata.navigation.planning.prior_map import PriorMap, PriorMapConfig
from terrain.heightfield import Heightfield
from worlds.elevation.square import read_square
from worlds.world import World

_SURVEY = 17
"""Stream of the errors of a survey, beside those of the world itself."""

_READ_CELL = 0.5
"""Distance between the heights that are read from an elevation model [m]."""


def make_prior_map(config: NavigatorConfig, world: World | None) -> PriorMap | None:
    """Return what a planner knows of the ground before the drive, None for nothing.

    Args:
        config: Source, datum of the map and costs.
        world: Simulated world; None for a recording or a real robot.

    Raises:
        ElevationError: If the elevation model cannot be used, or does not cover the drive.
        MissingRasterioError: If it is one, and rasterio is not installed.
        OSError: If it cannot be read.
        ValueError: If the source is ``world`` and there is none.
    """
    prior = config.prior_map
    if prior.source == "none":
        return None
    if prior.source != "world":
        heights = _read(config)
    elif world is not None:
        heights = survey(world, prior)
    else:
        raise ValueError(
            "prior_map.source: expected an elevation model (GeoTIFF) where no world is simulated, "
            "got 'world'; name a file, or plan without one: --set prior_map.source=none"
        )
    return PriorMap(heights, prior, 1.0 + config.local_planner.costs.unknown_cost)


def survey(world: World, config: PriorMapConfig) -> Heightfield:
    """Return the heights of a world as a survey has them: coarse, with errors, without objects.

    Args:
        world: Simulated world.
        config: Distance and errors of the heights.
    """
    ground = world.base or world.ground
    errors = np.random.default_rng([world.seed, _SURVEY])
    return _coarse(ground, config.cell, config.height_error, errors)


def _read(config: NavigatorConfig) -> Heightfield:
    """Return the heights of an elevation model around the datum of the map."""
    datum, prior = config.sensing.geo_reference, config.prior_map
    at = (datum.latitude_deg, datum.longitude_deg)
    square = read_square(Path(prior.source), at, prior.size, min(prior.cell, _READ_CELL))
    return _coarse(square.ground, prior.cell, 0.0, np.random.default_rng(0))


def _coarse(
    ground: Heightfield, cell: float, error: float, rng: np.random.Generator
) -> Heightfield:
    """Return heights on grid lines of another distance, with errors."""
    x, y = (
        (np.arange(n) - (n - 1) / 2) * cell
        for n in (int(ground.width / cell) + 1, int(ground.depth / cell) + 1)
    )
    heights = ground.height_at(x[:, None], y[None, :])
    noise = error * rng.standard_normal(heights.shape)
    return Heightfield((heights + noise).astype(np.float32), cell)
