"""Chamfer transform: that of plain sweeps, cell by cell, to the last bit."""

import numpy as np
import pytest

from andabata.navigation.planning.chamfer import inflate

CELLS = 64


def swept(obstacles, far):
    """Return the chamfer transform of obstacles by two sweeps, as float32 rounds them."""
    found = np.where(np.pad(obstacles, 1), 0.0, far).astype(np.float32)
    steps = {(1, 0): 1.0, (0, 1): 1.0, (1, 1): np.sqrt(2.0), (1, -1): np.sqrt(2.0)}
    for sign in (1, -1):
        for i in range(1, CELLS + 1)[::sign]:
            for j in range(1, CELLS + 1)[::sign]:
                for (p, q), length in steps.items():
                    before = found[i - sign * p, j - sign * q] + np.float32(length)
                    found[i, j] = min(found[i, j], before)
    return found[1:-1, 1:-1]


def inflated(obstacles, far):
    """Return the clearances around obstacles."""
    found = np.where(obstacles, 0.0, far).astype(np.float32)
    inflate(found, far)
    return found


@pytest.mark.parametrize("far", [0.7, 3.0, 6.5, 14.2])
@pytest.mark.parametrize("share", [0.0, 0.001, 0.02, 0.3])
def test_clearances_are_those_of_plain_sweeps_to_the_last_bit(share, far):
    """Around single obstacles, clusters, in rows far from others, and at the edges."""
    obstacles = np.random.default_rng(3).uniform(size=(CELLS, CELLS)) < share
    np.testing.assert_array_equal(inflated(obstacles, far), swept(obstacles, far))


@pytest.mark.parametrize("place", [(0, 0), (63, 0), (0, 63), (63, 63), (20, 30)])
def test_a_single_obstacle_has_the_sweeps_clearances_around_it(place):
    """In the corners, too; the rows within its reach are named."""
    obstacles = np.zeros((CELLS, CELLS), dtype=bool)
    obstacles[place] = True
    found = np.where(obstacles, 0.0, 6.5).astype(np.float32)
    is_near = inflate(found, 6.5)
    np.testing.assert_array_equal(is_near, np.abs(np.arange(CELLS) - place[0]) <= 6)
    np.testing.assert_array_equal(found, swept(obstacles, 6.5))
    i, j = np.abs(np.mgrid[:CELLS, :CELLS] - np.array(place)[:, None, None])
    chamfer = np.maximum(i, j) + (np.sqrt(2.0) - 1.0) * np.minimum(i, j)
    np.testing.assert_allclose(found, np.minimum(chamfer, 6.5), rtol=1e-6)
