"""Moving obstacles: none of them, or room for some that may come; names of contacts."""

import numpy as np

from andabata.tasks.movers import Contact, Movers, Schedules


def test_none_are_none_or_of_radius_zero():
    """Each robot has as many places as asked for, all of them empty and at rest, and its own."""
    assert [array.shape for array in Movers.none(3)] == [(3, 0, 2), (3, 0, 2), (3, 0)]
    movers = Movers.none(3, 2)
    assert [array.shape for array in movers] == [(3, 2, 2), (3, 2, 2), (3, 2)]
    assert all(array.dtype == np.float64 and not array.any() for array in movers)
    movers.places[0, 0] = 1.0
    assert not movers.velocities.any()


def test_schedules_of_none_never_begin():
    """Nothing is due, and no two arrays are one."""
    made = Schedules.none(2, 3)
    assert all(array.shape == (2, 3) for array in made)
    assert not made.radii.any()
    assert all(np.isinf(array).all() for array in made[1:])
    made.begins[0, 0] = 0.0
    assert np.isinf(made.ends).all()


def test_contacts_have_labels():
    """None is empty; the others are words for tables."""
    assert [one.label for one in Contact] == ["", "obstacle", "mover", "hit", "hit_at_rest"]
