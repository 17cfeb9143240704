"""Local planners that have seen something, for tests."""

import numpy as np

from andabata.navigation.planning.occupancy_config import OccupancyGridConfig
from tests.support.situations import GRID, ORIGIN, odds_of

AHEAD = np.array([8.0, 0.0])
OCCUPANCY = OccupancyGridConfig()


def wall_ahead(distance=3.0, half_width=4.0):
    """Return the log odds of a scan with a wall across the way."""
    bearings = GRID.bearings
    reach = np.where(np.cos(bearings) > 0.05, distance / np.maximum(np.cos(bearings), 0.05), np.inf)
    hit = np.abs(reach * np.sin(bearings)) < half_width
    return odds_of(np.where(hit & (reach < 10), reach, np.inf))


def seen(planner, odds, times=12, position=ORIGIN, yaw=0.0):
    """Return a planner whose grid has taken in some scans from one place."""
    for _ in range(times):
        planner.occupancy.update(odds, position, yaw)
    return planner


def scans(planner, given, count, layers=None):
    """Return the situations that a planner gives for the same one, again and again."""
    return [planner.guide(given, layers) for _ in range(count)]


def cell_of(planner, place):
    """Return the cell of a place [m] in the square of the plan."""
    corner, cell = planner.plan.corner, planner.config.occupancy.cell
    return tuple(np.floor((np.array(place) - corner) / cell).astype(int))
