"""Disc robots by the batch: each does what it would do alone, in its own room."""

import numpy as np
import pytest

from andabata.machine.planar_lidar import PlanarLidarConfig
from andabata.tasks.room_batch import DiscRobotConfig, RoomBatch, room_arrays
from worlds.room_catalogue import make_room
from worlds.rooms import Room, RoomPlan
from worlds.world import Start

FOUR = PlanarLidarConfig(resolution_deg=90.0)
EMPTY = Room.of("empty", RoomPlan(about="test", half=(3.0, 2.0)))
WALL = Room.of("wall", RoomPlan(about="test", half=(3.0, 2.0), boxes=[(1.0, -2.0, 1.2, 2.0)]))


def step(batch, *twists):
    """Drive all robots for a period."""
    return batch.step(np.array(twists, dtype=np.float64), np.ones(len(twists), bool))


def test_robots_drive_in_their_own_rooms():
    """Of two robots with the same twist the one before a wall touches it and stays."""
    batch = RoomBatch(2, [EMPTY, WALL], DiscRobotConfig(), FOUR)
    for k in range(2):
        batch.place(k, k, Start(0.5, 0.0, 0.0))
    for _ in range(4):
        state = step(batch, (0.5, 0.0), (0.5, 0.0))
    np.testing.assert_allclose(state.poses[:, 0], [0.9, 0.85], atol=0.051)
    assert state.contacts.tolist() == [False, True]
    assert not state.tipped.any()


def test_reciprocals_are_those_of_the_distances():
    """Beams go behind, right, ahead and left; beyond the largest range stands that range."""
    batch = RoomBatch(1, [EMPTY], DiscRobotConfig(), FOUR.model_copy(update={"max_range": 2.5}))
    batch.place(0, 0, Start(1.0, 0.5, 0.0))
    batch.observe(np.ones(1, bool))
    np.testing.assert_allclose(1 / batch.reciprocals[0], [2.5, 2.5, 2.0, 1.5], rtol=1e-6)


def test_stamps_count_the_steps_of_robots_that_move():
    """A robot that is not chosen has no time pass, and its laser does not turn."""
    batch = RoomBatch(2, [EMPTY], DiscRobotConfig(period=0.25), FOUR)
    for k in range(2):
        batch.place(k, 0, Start(0.0, 0.0, 0.0))
    before = batch.reciprocals.copy()
    for _ in range(3):
        batch.step(np.array([[0.4, 0.0], [0.4, 0.0]]), np.array([True, False]))
    assert batch.stamps.tolist() == [0.75, 0.0]
    assert batch.poses[:, 0].tolist() == pytest.approx([0.3, 0.0])
    assert batch.motions[:, 3].tolist() == [0.4, 0.0]
    np.testing.assert_array_equal(batch.reciprocals[1], before[1])


def test_a_robot_that_is_put_down_anew_is_at_rest_and_alone():
    """Its speed, time, contact and the obstacles that came to it are gone."""
    batch = RoomBatch(1, [WALL], DiscRobotConfig(), FOUR, movers=1)
    batch.place(0, 0, Start(0.79, 0.0, 0.0))
    batch.movers.places[0, 0], batch.movers.radii[0, 0] = (0.0, 0.0), 0.3
    assert step(batch, (0.5, 0.3)).contacts[0]
    batch.place(0, 0, Start(-1.0, 0.0, 1.0))
    state = batch.observe(np.ones(1, bool))
    assert not state.contacts[0]
    assert batch.stamps[0] == 0.0
    assert batch.movers.radii[0, 0] == 0.0
    np.testing.assert_array_equal(batch.motions[0], [-1.0, 0.0, 1.0, 0.0, 0.0])


def test_a_step_by_the_batch_is_a_step_alone():
    """Sixteen robots of three rooms end where each of them ends alone, to the last bit."""
    rooms = [make_room(name) for name in ("spn-env0", "spn-env3", "spn-env6")]
    rng = np.random.default_rng(0)
    starts = [Start(*rng.uniform(-0.5, 0.5, 2), rng.uniform(-3, 3)) for _ in range(16)]
    twists = np.column_stack([rng.uniform(0, 0.5, 16), rng.uniform(-1, 1, 16)])
    batch = RoomBatch(16, rooms, DiscRobotConfig(), PlanarLidarConfig())
    for k, start in enumerate(starts):
        batch.place(k, k % 3, start)
    for _ in range(5):
        together = step(batch, *twists)
    for k, start in enumerate(starts):
        single = RoomBatch(1, [rooms[k % 3]], DiscRobotConfig(), PlanarLidarConfig())
        single.place(0, 0, start)
        for _ in range(5):
            alone = step(single, twists[k])
        np.testing.assert_array_equal(together.poses[k], alone.poses[0])
        np.testing.assert_array_equal(batch.reciprocals[k], single.reciprocals[0])


def test_rooms_are_padded_to_the_fullest():
    """Counts say what of the padded arrays is a room's."""
    wall = RoomPlan(about="", half=(1.0, 1.0), outlines=(((0.0, 0.0), (0.3, 0.4)),))
    rooms = [EMPTY, WALL, make_room("spn-env7"), Room.of("slanted", wall)]
    arrays = room_arrays(rooms)
    assert arrays.box_counts.tolist() == [4, 5, len(rooms[2].boxes), 4]
    assert arrays.circle_counts.tolist() == [0, 0, 3, 0]
    assert arrays.edge_counts.tolist() == [0, 0, 0, 2]
    for k, room in enumerate(rooms):
        np.testing.assert_array_equal(arrays.boxes[k, : len(room.boxes)], room.boxes)
        np.testing.assert_array_equal(arrays.circles[k, : len(room.circles)], room.circles)
        np.testing.assert_array_equal(arrays.edges[k, : len(room.edges)], room.edges)
