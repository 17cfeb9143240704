"""Observations in rooms: goals, situations rendered anew, lasers drawn at random, noise."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.planar.lidar import PLANAR_LIDARS, PlanarLidarConfig
from andabata.tasks.rooms.batch import DiscRobotConfig, RoomBatch, laser_arrays, room_arrays
from andabata.tasks.rooms.kernel import MIN_RANGE
from andabata.tasks.rooms.observations import (
    EarlierScans,
    LidarRandomization,
    RoomRenderer,
    noisy,
)
from andabata.tasks.rooms.terms import RoomTerms, encoded_goals, room_observations
from worlds.rooms.catalogue import make_room
from worlds.rooms.mover_motion import Movers
from worlds.rooms.room import random_task

ROOMS = [make_room(name) for name in ("spn-env1", "spn-env6", "spn-crowded")]
LIDAR = PLANAR_LIDARS["ten-beams-forward"]
POINTS = 12


def renderer(lidars=(LIDAR,), points=POINTS, movers=1, randomization=None, encoding="cosine"):
    """Return what renders in the three rooms."""
    terms = RoomTerms(points, goal_encoding=encoding)
    return RoomRenderer(room_arrays(ROOMS), lidars, terms, movers, randomization)


def driven_batch(count=30, lidar=LIDAR):
    """Return robots in all rooms after a step, each with a post beside it, and their goals."""
    rng = np.random.default_rng(3)
    batch = RoomBatch(count, ROOMS, DiscRobotConfig(), lidar, movers=1)
    goals = np.zeros((count, 2))
    for k in range(count):
        task = random_task(ROOMS[k % 3], rng, 0.2)
        batch.place(k, k % 3, task.start)
        goals[k] = task.goal
        batch.movers.places[k, 0] = np.array([task.start.x, task.start.y]) + rng.uniform(0.4, 0.8)
    batch.movers.radii[:] = 0.1
    twists = np.column_stack([rng.uniform(0, 0.5, count), rng.uniform(-1, 1, count)])
    batch.step(twists, np.ones(count, dtype=bool))
    return batch, goals


def part(rows, name):
    """Return one term of observations."""
    spec = room_observations(RoomTerms(POINTS), 10.0, 1.1)
    return rows[:, spec.slice_of(name)].reshape(-1, *spec.term(name).shape)


@pytest.mark.parametrize("encoding", ["cosine", "polar"])
def test_a_situation_rendered_again_gives_the_observation(encoding):
    """Of 30 robots with posts, in three rooms, all bits come again."""
    batch, goals = driven_batch()
    again = renderer(encoding=encoding)
    seen = again.observe(batch.reciprocals, batch.mounted, batch.motions, goals)
    situations = again.situations(batch.places, batch.motions, goals, batch.movers)
    assert situations.dtype == np.float32
    assert situations.shape == (30, again.size) == (30, 13)
    rendered = again(situations, np.random.default_rng(0))
    assert rendered.dtype == np.float32
    np.testing.assert_array_equal(rendered, seen)
    # Rooms and posts count: others give other points.
    elsewhere = situations.copy()
    elsewhere[:, 0] = (situations[:, 0] + 1) % 3
    assert (again(elsewhere, np.random.default_rng(0)) != rendered).any(axis=1).mean() > 0.9
    alone = situations.copy()
    alone[:, 12] = 0.0
    assert (again(alone, np.random.default_rng(0)) != rendered).any(axis=1).mean() > 0.15


def test_velocity_and_goal_stand_at_the_end():
    """The last numbers are the goal as encoded, speed and yaw rate."""
    batch, goals = driven_batch(6)
    made = renderer()
    rows = made(made.situations(batch.places, batch.motions, goals, batch.movers), None)
    np.testing.assert_allclose(part(rows, "velocity"), batch.motions[:, 3:], rtol=1e-6)
    np.testing.assert_allclose(
        part(rows, "goal"), encoded_goals(batch.poses, goals, "cosine"), atol=1e-5
    )
    assert part(rows, "mask").sum(axis=1).tolist() == [10.0] * 6
    assert (part(rows, "points")[:, 10:] == 0.0).all()


def test_drawn_lasers_stay_in_their_bounds():
    """Fields of view, beams, ranges and places cover their ranges, beams evenly by octaves."""
    bounds = LidarRandomization()
    drawn = bounds.draw(np.random.default_rng(5), 2000)
    for values, (low, high) in (
        ([one.fov_deg for one in drawn], bounds.fov_deg),
        ([one.max_range for one in drawn], bounds.max_range),
        ([one.x for one in drawn], bounds.x),
        ([one.count for one in drawn], bounds.beams),
    ):
        assert low <= min(values) < low + 0.05 * (high - low)
        assert high >= max(values) > high - 0.05 * (high - low)
    beams = np.array([one.count for one in drawn])
    assert np.mean(beams < np.sqrt(10 * 1080)) == pytest.approx(0.5, abs=0.05)
    assert bounds.draw(np.random.default_rng(5), 2000) == drawn


def test_a_share_of_the_observations_has_drawn_lasers():
    """A share of 0 changes nothing, 1 everything; the same generator gives the same again."""
    batch, goals = driven_batch()
    plain = renderer()
    situations = plain.situations(batch.places, batch.motions, goals, batch.movers)
    own = plain(situations, np.random.default_rng(1))
    bank = [LIDAR, *LidarRandomization().draw(np.random.default_rng(2), 50)]
    changed = []
    for share in (0.0, 0.5, 1.0):
        made = renderer(bank, randomization=LidarRandomization(share=share))
        rows = made(situations, np.random.default_rng(1))
        np.testing.assert_array_equal(rows, made(situations, np.random.default_rng(1)))
        assert not np.array_equal(rows, made(situations, np.random.default_rng(4))) or share == 0
        np.testing.assert_array_equal(part(rows, "goal"), part(own, "goal"))
        changed.append(np.mean((abs(rows - own) > 1e-5).any(axis=1)))
    assert changed[0] == 0.0
    assert 0.2 < changed[1] < 0.8
    assert changed[2] == 1.0
    one = renderer(bank[:2], randomization=LidarRandomization(share=1.0, noise=(0.0, 0.0)))
    assert (abs(one(situations, np.random.default_rng(1)) - own) > 1e-5).any(axis=1).all()


def test_noise_is_on_what_returned_alone():
    """Ranges of returns have the robot's own deviation; silence and other robots stay as they are.

    No beam gets farther than its largest range, nor nearer than the smallest.
    """
    lasers = laser_arrays([PlanarLidarConfig(max_range=4.0)])
    ranges = np.full((3, 1080), 2.0, dtype=np.float32)
    ranges[:, 500:] = 4.0
    ranges[:, :100] = MIN_RANGE
    ranges[:, 100:200] = 3.999
    found, mounted = 1 / ranges, np.zeros(3, dtype=np.int64)
    sigma = np.array([0.0, 0.02, 0.1])
    seen = noisy(found, lasers, mounted, sigma, np.random.default_rng(0))
    assert seen.dtype == np.float32
    np.testing.assert_allclose(seen[0], found[0], rtol=1e-6)
    np.testing.assert_array_equal(seen[:, 500:], found[:, 500:])
    for k in (1, 2):
        errors = 1 / seen[k, 200:500] - 2.0
        assert errors.std() == pytest.approx(sigma[k], rel=0.15)
        assert errors.mean() == pytest.approx(0.0, abs=0.2 * sigma[k])
    assert seen.min() == np.float32(0.25)
    assert seen.max() <= np.float32(1 / MIN_RANGE) * (1 + 1e-6)
    assert (found == 1 / ranges).all()


def test_windows_as_ranges_are_those_of_the_nearest():
    """Ranges are one over the reciprocals, and never beyond the laser's largest range."""
    batch, goals = driven_batch(30, LIDAR)
    terms = RoomTerms(0, windows=20, window_fov=np.pi)
    seen = []
    for as_ranges in (False, True):
        made = RoomRenderer(
            room_arrays(ROOMS), [LIDAR], replace(terms, as_ranges=as_ranges), movers=1
        )
        rows = made.observe(batch.reciprocals, batch.mounted, batch.motions, goals)
        seen.append(rows[:, :20])
    np.testing.assert_allclose(seen[1], 1 / seen[0], rtol=1e-6)
    assert seen[1].max() == np.float32(10.0)
    assert seen[1].min() > 0.05


def test_a_situation_holds_what_moves_and_what_was():
    """Place, velocity and radius of what is there; then the earlier pose, place and radius."""
    terms = RoomTerms(0, earlier_scan=3)
    made = RoomRenderer(room_arrays(ROOMS), [LIDAR], terms, movers=2)
    movers = Movers(
        np.array([[[1.0, 2.0], [9.0, 9.0]]]),
        np.array([[[0.5, -0.5], [9.0, 9.0]]]),
        np.array([[0.25, 0.0]]),
    )
    then = EarlierScans(
        np.zeros((1, 10), dtype=np.float32),
        np.array([[0.5, 1.5, 2.5]]),
        np.array([[[9.0, 9.0], [3.0, 4.0]]]),
        np.array([[0.0, 0.75]]),
    )
    motions, targets = np.arange(5.0)[None], np.array([[6.0, 7.0]])
    row = made.situations(np.array([2]), motions, targets, movers, then)[0].tolist()
    assert row[:8] == [2.0, 0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 7.0]
    assert row[8:18] == [1.0, 2.0, 0.5, -0.5, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert row[18:] == [0.5, 1.5, 2.5, 0.0, 0.0, 0.0, 3.0, 4.0, 0.75]
    assert made.size == len(row)


def test_tracked_movers_stand_behind_all_else():
    """They are kept at the end of a situation as they are, and rendered behind the velocity."""
    terms = RoomTerms(0, earlier_scan=3, tracked_movers=2)
    made = RoomRenderer(room_arrays(ROOMS), [LIDAR], terms, movers=1)
    without = RoomRenderer(room_arrays(ROOMS), [LIDAR], replace(terms, tracked_movers=0), movers=1)
    batch, goals = driven_batch(6)
    then = batch.poses, batch.movers.places, batch.movers.radii
    earlier = EarlierScans(batch.reciprocals, *then)
    seen = np.random.default_rng(0).normal(size=(6, 2, 6)).astype(np.float32)
    state = batch.places, batch.motions, goals, batch.movers, earlier
    situations, bare = made.situations(*state, seen), without.situations(*state)
    assert made.size == without.size + 12
    np.testing.assert_array_equal(situations, np.hstack([bare, seen.reshape(6, 12)]))
    rows, rest = (one(sight, None) for one, sight in ((made, situations), (without, bare)))
    np.testing.assert_array_equal(rows, np.hstack([rest, seen.reshape(6, 12)]))


def test_situations_without_movers_end_with_the_goal():
    """Eight numbers: room, pose, speeds, goal."""
    made = renderer(movers=0)
    motions, targets = np.arange(5.0)[None], np.array([[6.0, 7.0]])
    rows = made.situations(np.array([2]), motions, targets, Movers.none(1))
    assert rows.tolist() == [[2.0, 0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 7.0]]


def test_both_ends_of_a_decision_are_seen_by_one_laser():
    """In a call for decisions the second half has the lasers of the first, in its order."""
    bank = [LIDAR, *LidarRandomization().draw(np.random.default_rng(1), 40)]
    noiseless = LidarRandomization(share=0.8, noise=(0.0, 0.0))
    made = renderer(bank, points=1200, randomization=noiseless)
    batch, goals = driven_batch()
    situations = made.situations(batch.places, batch.motions, goals, batch.movers)
    both = made(np.concatenate([situations, situations]), np.random.default_rng(2))
    np.testing.assert_array_equal(both[:30], both[30:])
    assert len({int(row[2 * 1200 : 3 * 1200].sum()) for row in both}) > 10
