"""Wind in leaves: which cells change, how often, and that nothing else decides on it."""

import numpy as np
import pytest

from terrain.counter_rng import uniform
from worlds.rays.wind import Wind, stirred_chance

CELLS = np.arange(4000, dtype=np.uint64)
KEY = np.uint64(7)


def chances(time, share=0.25, period=20.0, key=KEY):
    """Return the random numbers of many cells at a time [s]."""
    wind = Wind(share, period, key)
    return np.array([stirred_chance(2.0, cell, wind, time) for cell in CELLS])


def test_the_share_of_cells_moves_and_the_others_keep_their_number():
    """Those that move have numbers from 0 to 1, evenly."""
    found = chances(3.0)
    moved = found[found != 2.0]
    assert len(moved) / len(found) == pytest.approx(0.25, abs=0.02)
    assert np.histogram(moved, 4, (0.0, 1.0))[0] / len(moved) == pytest.approx(0.25, abs=0.04)
    np.testing.assert_array_equal(found, chances(3.0))
    assert (found != chances(3.0, key=np.uint64(8))).mean() > 0.3


def test_cells_change_one_by_one_each_once_a_period():
    """After a quarter of it a quarter of the moving cells is another, after a whole one all are."""
    moving = chances(0.0) != 2.0
    begin = chances(0.0)[moving]
    quarter, whole = (chances(time)[moving] for time in (5.0, 20.0))
    assert (quarter != begin).mean() == pytest.approx(0.25, abs=0.05)
    assert (whole != begin).all()
    assert abs(np.corrcoef(whole, begin)[0, 1]) < 0.1
    assert abs(np.corrcoef(begin, [uniform(KEY, c) for c in CELLS[moving]])[0, 1]) < 0.1
