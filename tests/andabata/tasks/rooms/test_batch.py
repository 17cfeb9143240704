"""Disc robots by the batch: each does what it would do alone, in its own room."""

import numpy as np
import pytest

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.tasks.rooms.batch import DiscRobotConfig, RoomBatch, as_kept, room_arrays
from andabata.tasks.rooms.planar_movers import PlanarMovers
from worlds.rooms.catalogue import make_room
from worlds.rooms.mover_placement import draw_movers
from worlds.rooms.movers import Mover, MoverPlan
from worlds.rooms.room import Room, RoomPlan
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
    assert batch.contacts.tolist() == [Contact.OBSTACLE]
    batch.place(0, 0, Start(-1.0, 0.0, 1.0))
    state = batch.observe(np.ones(1, bool))
    assert not state.contacts[0]
    assert batch.contacts.tolist() == [Contact.NONE]
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


def mover(x, y, velocity=(0.0, 0.0), **plan):
    """Return a mover of 0.3 m."""
    made = MoverPlan.model_validate({"radius": 0.3, "speed": np.hypot(*velocity)} | plan)
    return Mover((x, y), velocity, made)


def test_movers_are_seen_and_move_with_their_robot():
    """A mover put down with a robot is in its first scan, and nearer after a step."""
    batch = RoomBatch(2, [EMPTY], DiscRobotConfig(), FOUR, movers=2)
    batch.place(0, 0, Start(-1.0, 0.0, 0.0), [mover(1.0, 0.0, (-0.5, 0.0))])
    batch.place(1, 0, Start(-1.0, 0.0, 0.0))
    batch.observe(np.ones(2, bool))
    np.testing.assert_allclose(1 / batch.reciprocals[:, 2], [1.7, 4.0], rtol=1e-6)
    step(batch, (0.0, 0.0), (0.0, 0.0))
    np.testing.assert_allclose(1 / batch.reciprocals[:, 2], [1.6, 4.0], rtol=1e-6)


def test_movers_come_and_go_by_their_plan():
    """One waits for its time and lasts, one for the robot, one goes: in the step that is due."""
    batch = RoomBatch(1, [EMPTY], DiscRobotConfig(period=0.25), FOUR, movers=3)
    late = mover(0.0, 1.0, appears_at=0.5, duration=0.5)
    near = mover(1.5, 0.0, when_within=1.0, place=(1.5, 0.0))
    short = mover(0.0, -1.0, duration=0.75)
    batch.place(0, 0, Start(0.0, 0.0, 0.0), [late, near, short])
    found = [(batch.movers.radii[0] > 0).tolist()]
    for _ in range(6):
        step(batch, (0.5, 0.0))
        found.append((batch.movers.radii[0] > 0).tolist())
    # The robot is 1.075 m from the second one's edge after one step, 0.95 m after two.
    first = [False, False, False, True, True, False, False]
    second = [False, False, False, True, True, True, True]
    third = [True, True, True, True, False, False, False]
    assert np.array(found).T.tolist() == [first, second, third]
    # Put down anew it is all as at the beginning.
    batch.place(0, 0, Start(0.0, 0.0, 0.0), [short])
    assert (batch.movers.radii[0] > 0).tolist() == [True, False, False]
    for _ in range(6):
        step(batch, (0.0, 0.0))
    assert not batch.movers.radii.any()


def test_who_hit_whom_stands_in_contacts():
    """A robot at rest is hit, one drives into a mover, one into a wall; each is in contact."""
    batch = RoomBatch(3, [EMPTY, WALL], DiscRobotConfig(), FOUR, movers=1)
    batch.place(0, 0, Start(0.0, 0.0, 0.0), [mover(0.56, 0.0, (-0.5, 0.0))])
    batch.place(1, 0, Start(0.0, 0.0, 0.0), [mover(0.56, 0.0)])
    batch.place(2, 1, Start(0.76, 0.0, 0.0))
    state = step(batch, (0.0, 0.5), (0.5, 0.0), (0.5, 0.0))
    assert batch.contacts.tolist() == [Contact.HIT_AT_REST, Contact.MOVER, Contact.OBSTACLE]
    assert state.contacts.tolist() == [True, True, True]


def test_too_many_and_too_fast_movers_are_refused():
    """There is room for as many as asked for; none may pass through thin walls in a sub-step."""
    batch = RoomBatch(1, [EMPTY], DiscRobotConfig(), FOUR, movers=1)
    with pytest.raises(ValueError, match="movers: expected at most 1, got 2"):
        batch.place(0, 0, Start(0.0, 0.0, 0.0), [mover(1.0, 0.0)] * 2)
    batch.place(0, 0, Start(0.0, 0.0, 0.0), [mover(1.0, 0.0, (2.99, 0.0))])
    with pytest.raises(ValueError, match=r"at most 3 m/s of a mover of 0.3 m, got 3.01"):
        batch.place(0, 0, Start(0.0, 0.0, 0.0), [mover(1.0, 0.0, (3.01, 0.0))])


def test_a_step_with_movers_by_the_batch_is_a_step_alone():
    """Robots with movers of their own end where each ends alone, movers and beams too."""
    rng = np.random.default_rng(0)
    starts = [Start(*rng.uniform(-1.0, 1.0, 2), rng.uniform(-3, 3)) for _ in range(8)]
    crowds = [
        [mover(2.3, y, tuple(rng.uniform(-0.6, 0.6, 2))) for y in (-1.5, 1.5)] for _ in range(8)
    ]
    batch = RoomBatch(8, [EMPTY, WALL], DiscRobotConfig(), PlanarLidarConfig(), movers=2)
    for k, start in enumerate(starts):
        batch.place(k, 0, start, crowds[k])
    twists = np.column_stack([rng.uniform(0, 0.5, 8), rng.uniform(-1, 1, 8)])
    for _ in range(40):
        step(batch, *twists)
    for k, start in enumerate(starts):
        single = RoomBatch(1, [EMPTY], DiscRobotConfig(), PlanarLidarConfig(), movers=2)
        single.place(0, 0, start, crowds[k])
        for _ in range(40):
            step(single, twists[k])
        np.testing.assert_array_equal(batch.poses[k], single.poses[0])
        np.testing.assert_array_equal(batch.movers.places[k], single.movers.places[0])
        np.testing.assert_array_equal(batch.reciprocals[k], single.reciprocals[0])


def test_beams_are_cast_from_where_situations_keep_robots_and_movers():
    """Rounded to float32, poses and movers give the same bits; rounding moves nothing itself."""
    rng, lidar = np.random.default_rng(2), PlanarLidarConfig(resolution_deg=0.5, max_range=9.0)
    rooms = [make_room("spn-env0"), make_room("spn-env5")]
    exact, rounded = (RoomBatch(20, rooms, DiscRobotConfig(), lidar, movers=1) for _ in range(2))
    for k in range(20):
        start = Start(*rng.uniform(-0.7, 0.7, 2), rng.uniform(-3, 3))
        bearing, velocity = rng.uniform(-3, 3), tuple(rng.uniform(-0.5, 0.5, 2).tolist())
        place = 1.2 * np.cos(bearing), 1.2 * np.sin(bearing)
        for batch in (exact, rounded):
            batch.place(k, k % 2, start, [mover(*place, velocity)])
    step(exact, *np.column_stack([rng.uniform(0, 0.5, 20), rng.uniform(-1, 1, 20)]))
    kept = as_kept(exact.motions)
    assert (kept[:, :3] != exact.motions[:, :3]).all()
    np.testing.assert_allclose(kept, exact.motions, rtol=1e-7)
    np.testing.assert_array_equal(as_kept(kept), kept)
    rounded.motions[:], rounded.movers.places[:] = kept, exact.movers.places
    rounded.observe(np.ones(20, bool))
    np.testing.assert_array_equal(rounded.reciprocals, exact.reciprocals)
    rounded.movers.places[:] = as_kept(exact.movers.places)
    rounded.observe(np.ones(20, bool))
    np.testing.assert_array_equal(rounded.reciprocals, exact.reciprocals)


def test_people_in_a_batch_go_as_those_of_one_robot():
    """The same law: to the bit beside a robot of the same size, way and period, in any room."""
    room = make_room("crowd-5-7300")
    movers = draw_movers(room, np.random.default_rng(3), room.tasks[0], 0.2)
    robot = DiscRobotConfig(radius=0.2, period=0.1, substeps=2)
    batch = RoomBatch(3, [EMPTY, room], robot, FOUR, movers=6)
    for k, place in enumerate((Start(0.0, 0.0, 0.0), room.tasks[0].start, Start(0.0, 0.0, 0.0))):
        batch.place(k, k % 2, place, movers if k == 1 else ())
    alone = PlanarMovers(room, movers, PlanarVehicleConfig(period=0.1, substeps=2))
    for _ in range(25):
        start = PlanarPose(*batch.poses[1].tolist())
        step(batch, (0.0, 0.0), (0.4, 0.2), (0.0, 0.0))
        alone.step(start, 0.4, 0.2)
    np.testing.assert_array_equal(batch.movers.places[1, :5], alone.state.places[0])
    np.testing.assert_array_equal(batch.movers.velocities[1, :5], alone.state.velocities[0])
    assert np.hypot(*(alone.state.places[0] - [m.place for m in movers]).T).min() > 0.3


def test_robots_in_a_room_with_people_may_be_without_any():
    """A room of the same batch has movers that go straight, or none."""
    movers = [Mover((2.0, 0.0), (-1.0, 0.0), MoverPlan(radius=0.3, speed=1.0))]
    batch = RoomBatch(2, [EMPTY, make_room("crowd-5-7300")], DiscRobotConfig(), FOUR, movers=5)
    for k in range(2):
        batch.place(k, 0, Start(-2.0, 0.0, 0.0), movers if k else ())
    step(batch, (0.0, 0.0), (0.0, 0.0))
    np.testing.assert_allclose(batch.movers.places[1, 0], (1.8, 0.0))
    assert not batch.movers.radii[0].any()
