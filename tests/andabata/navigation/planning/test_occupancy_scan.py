"""Update of an occupancy grid by a scan: where it looks, and where it need not look."""

import numpy as np
import pytest

from andabata.navigation.planning.occupancy_config import OccupancyGridConfig
from andabata.navigation.planning.occupancy_layers import take_ground
from andabata.navigation.planning.occupancy_scan import Gains, add_scan, polar_cells
from tests.support.situations import GRID

CONFIG = OccupancyGridConfig()
POLAR = polar_cells(GRID, CONFIG)
MOST = CONFIG.max_log_odds
GAINS = Gains(
    blocked=CONFIG.blocked_gain,
    free=CONFIG.free_gain,
    unknown=CONFIG.unknown_gain,
    certain_blocked=CONFIG.certain_blocked,
    certain_free=CONFIG.certain_free,
    max_log_odds=MOST,
)
SHAPE = (CONFIG.cells, CONFIG.cells)


def random_grid(rng, most, share):
    """Return random log odds up to a largest value, float32, of which a share is not 0."""
    values = rng.uniform(-most, most, SHAPE) * (rng.uniform(size=SHAPE) < share)
    return values.astype(np.float32)


@pytest.mark.parametrize("seed", range(5))
def test_where_the_ground_layer_knows_the_scan_need_not_be_looked_at(seed):
    """The grid is, to the last bit, that of a scan added everywhere with the ground written over.

    Driven ground, which fades, and ground that is almost driven are among the cells.
    """
    rng = np.random.default_rng(seed)
    looked, everywhere = np.zeros(SHAPE, dtype=np.float32), np.zeros(SHAPE, dtype=np.float32)
    nothing = np.zeros(SHAPE, dtype=np.float32)
    for _ in range(4):
        driven = random_grid(rng, 2.0 * MOST, 0.2)
        centre, yaw = rng.integers(-300, 300, 2), rng.uniform(-np.pi, np.pi)
        odds = rng.uniform(-4.0, 5.0, (GRID.n_sectors, GRID.n_rings)).astype(np.float32)
        odds[rng.uniform(size=odds.shape) < 0.3] = np.nan
        ground = random_grid(rng, 4.0, 0.6)
        for log_odds in (looked, everywhere):
            np.minimum(log_odds, driven, out=log_odds)
        take_ground(looked, ground, 0.75, MOST, 0.025)
        add_scan(looked, centre, yaw, odds, POLAR, GAINS, ground, True)
        take_ground(everywhere, nothing, 0.75, MOST, 0.025)
        add_scan(everywhere, centre, yaw, odds, POLAR, GAINS, nothing, True)
        take_ground(everywhere, ground, 0.75, MOST, 0.0)
        np.testing.assert_array_equal(looked, everywhere)


def test_only_cells_within_the_polar_grid_change():
    """Those whose middle is farther away, or nearer than its first ring, stay unknown."""
    log_odds = np.zeros(SHAPE, dtype=np.float32)
    odds = np.full((GRID.n_sectors, GRID.n_rings), -np.inf, dtype=np.float32)
    add_scan(log_odds, np.zeros(2, dtype=np.int64), 0.4, odds, POLAR, GAINS, log_odds * 0, True)
    i, j = np.mgrid[: SHAPE[0], : SHAPE[1]]
    far = CONFIG.cell * np.hypot(*((k + 128) % 256 - 128 for k in (i, j)))
    inside = (far >= GRID.ring_edges[0]) & (far < GRID.outer_radius)
    np.testing.assert_array_equal(log_odds < 0, inside)
