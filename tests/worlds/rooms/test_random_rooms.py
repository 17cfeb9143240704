"""Random rooms: repeatable, connected, with as many walls as asked."""

import numpy as np
import pytest

from worlds.rooms.random_rooms import random_walled_room
from worlds.rooms.room import free_places


def test_a_seed_gives_the_same_room_and_another_another():
    """Layouts are a function of their seed."""
    one, again, other = (random_walled_room(seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.boxes, again.boxes)
    assert one.boxes.shape != other.boxes.shape or (one.boxes != other.boxes).any()


@pytest.mark.parametrize("seed", range(6))
def test_nearly_all_free_places_are_connected(seed):
    """What is clear of walls can be reached by the robot, within the boundary."""
    room = random_walled_room(seed)
    places = free_places(room, 0.2, 0.3)
    assert len(places) > 15_000
    assert np.abs(places).max() < 4.71
    assert 7 <= len(room.boxes) - 4 <= 13
    assert len(room.circles) <= 3


def test_walls_are_thin_and_have_their_lengths():
    """Each wall is 3 cm thick and as long as asked."""
    room = random_walled_room(1, walls=(5, 5), lengths=(1.0, 2.0), posts=(2, 2))
    sides = np.sort(room.boxes[4:, 2:] - room.boxes[4:, :2], axis=1)
    np.testing.assert_allclose(sides[:, 0], 0.03)
    assert ((sides[:, 1] >= 1.0) & (sides[:, 1] <= 2.0)).all()
    assert len(sides) == 5
    assert len(room.circles) == 2


def test_a_room_that_cannot_be_driven_is_refused():
    """Too many walls for a room that small are an error that says what to change."""
    with pytest.raises(ValueError, match="fewer walls"):
        random_walled_room(0, half=1.2, walls=(60, 60), lengths=(0.5, 1.0))
