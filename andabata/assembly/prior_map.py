"""Prior maps by their source: the simulated world, surveyed or as it is, or an elevation model."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.navigator import NavigatorConfig
from andabata.navigation.planning.prior_map import PriorMap, PriorMapConfig, slope_costs
from terrain.heightfield import Heightfield
from worlds.elevation.square import read_square
from worlds.world import World

TRUTH = "truth"
"""Source of a prior map that has all that stands and lies in the simulated world."""

_SIMULATED = ("world", TRUTH)

_SURVEY = 17
"""Stream of the errors of a survey, beside those of the world itself."""

_TRUE_CELL = 0.4
"""Edge of the cells of the true map in a prior map [m]: two ground cells."""

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
        ValueError: If the source is ``world`` or ``truth`` and there is none.
    """
    prior, unknown = config.prior_map, 1.0 + config.local_planner.costs.unknown_cost
    if prior.source == "none":
        return None
    if prior.source not in _SIMULATED:
        heights = _read(config)
    elif world is None:
        raise ValueError(
            "prior_map.source: expected an elevation model (GeoTIFF) where no world is simulated, "
            f"got {prior.source!r}; name a file, or plan without one: --set prior_map.source=none"
        )
    elif prior.source == TRUTH:
        costs = prior.steep_cost * _is_barred(world, config.robot.width / 2)
        return PriorMap(costs, _TRUE_CELL, unknown)
    else:
        heights = survey(world, prior)
    return PriorMap(slope_costs(heights, prior), heights.cell, unknown)


def survey(world: World, config: PriorMapConfig) -> Heightfield:
    """Return the heights of a world as a survey has them: coarse, with errors, without objects.

    Args:
        world: Simulated world.
        config: Distance and errors of the heights.
    """
    ground = world.base or world.ground
    errors = np.random.default_rng([world.seed, _SURVEY])
    return _coarse(ground, config.cell, config.height_error, errors)


def _is_barred(world: World, clearance: float) -> NDArray[np.bool_]:
    """Return where a body has no room in the true map, in cells centred on it, shape (nx, ny).

    Args:
        world: Simulated world.
        clearance: Distance from forbidden ground below which it has none [m].
    """
    ground = world.base or world.ground
    x, y = (
        (np.arange(n) - (n - 1) / 2) * _TRUE_CELL
        for n in (int(ground.width / _TRUE_CELL), int(ground.depth / _TRUE_CELL))
    )
    there = np.broadcast_arrays(x[:, None], y[None, :])
    return np.asarray(world.truth.clearance_at(*there) < clearance)


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
