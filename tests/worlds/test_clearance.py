"""Distances to forbidden cells are exact."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from worlds.clearance import clearance_map


@pytest.mark.parametrize("seed", range(20))
def test_distances_are_those_of_scipy(seed):
    """Bit for bit, on maps of any size and density."""
    rng = np.random.default_rng(seed)
    forbidden = rng.random(rng.integers(1, 60, 2)) < rng.random() ** 3
    forbidden.flat[rng.integers(forbidden.size)] = True
    expected = (distance_transform_edt(~forbidden) * 0.1).astype(np.float32)
    np.testing.assert_array_equal(clearance_map(forbidden, 0.1), expected)


def test_a_map_without_forbidden_cells_is_clear_beyond_its_size():
    """Nothing is near."""
    assert (clearance_map(np.zeros((3, 5), dtype=np.bool_), 0.5) == 4.0).all()
