"""Moving obstacles: none of them, or room for some that may come."""

import numpy as np

from andabata.tasks.movers import Movers


def test_none_are_none_or_of_radius_zero():
    """Each robot has as many places as asked for, all of them empty and at rest, and its own."""
    assert [array.shape for array in Movers.none(3)] == [(3, 0, 2), (3, 0, 2), (3, 0)]
    movers = Movers.none(3, 2)
    assert [array.shape for array in movers] == [(3, 2, 2), (3, 2, 2), (3, 2)]
    assert all(array.dtype == np.float64 and not array.any() for array in movers)
    movers.places[0, 0] = 1.0
    assert not movers.velocities.any()
