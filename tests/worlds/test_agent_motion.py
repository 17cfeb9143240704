"""How people, animals and vehicles go: round solids, aside for the robot, along a track."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import box, frustum
from tests.support.walking_worlds import agent, heading_east, heading_west, peopled, walker
from worlds.agents import HURRY
from worlds.walkers import solids_room
from worlds.walking import Walkers

FAR = (1e6, 1e6)


def walked(world, movers, seconds, robot=lambda t: FAR, gap=0.45):
    """Return the places of movers at each control step [m], shape (k, m, 2), and velocities."""
    walkers = Walkers(peopled(world, *movers), 100.0)
    walkers.reset(robot(0.0))
    places, velocities = [walkers.track.movers.places[-1].copy()], []
    for step in range(round(10 * seconds)):
        track = walkers.step(10, robot(step / 10), gap).movers
        places.append(track.places[-1].copy())
        velocities.append(track.velocities[-1].copy())
    return np.array(places), np.array(velocities)


def test_who_gives_way_steps_aside_for_a_robot_that_stands(make_ground):
    """Robot and person touch at 0.7 m; one gives it more room, the other walks through."""
    world = make_ground()
    near = {}
    for yields in (False, True):
        places, _ = walked(world, [heading_east(yields=yields)], 9.0, lambda _: (0.0, 0.0))
        near[yields] = np.hypot(*places[:, 0].T).min()
        assert places[-1, 0, 0] > 2.0
    assert near[False] < 0.3
    assert near[True] > 0.7


def test_who_gives_way_steps_aside_for_a_robot_that_comes(make_ground):
    """Head on at half a metre a second; to the right, as it is known from the robot's true way."""
    places, _ = walked(
        make_ground(), [heading_east(yields=True)], 6.0, lambda t: (4.0 - 0.5 * t, 0.0)
    )
    gaps = [np.hypot(*(place - [4.0 - 0.05 * k, 0.0])) for k, place in enumerate(places[:, 0])]
    assert min(gaps) > 0.7


def test_the_robot_moves_nobody_who_does_not_give_way(make_ground):
    """Where they go is the same to the bit wherever the robot is."""
    made = [
        heading_east(),
        agent("animal", (3.0, 3.0), (1.0, 0.0), speed=2.0, seed=1),
        agent("vehicle", (-5.0, 4.0), speed=1.0, track=((-5.0, 4.0), (5.0, 4.0))),
    ]
    a, b = (
        walked(make_ground(), made, 5.0, robot)[0] for robot in (lambda _: FAR, lambda _: (1, 1))
    )
    np.testing.assert_array_equal(a, b)


def test_two_people_head_on_pass_each_other(make_ground):
    """They keep to the right, and never touch."""
    places, _ = walked(make_ground(), [heading_east(), heading_west()], 8.0)
    gaps = np.hypot(*(places[:, 0] - places[:, 1]).T)
    assert gaps.min() > 0.5
    assert places[-1, 0, 0] > 2.5
    assert places[-1, 1, 0] < -2.5


def test_a_person_goes_round_a_wall_and_arrives(make_ground):
    """A wall of 4 m across the way is passed, not touched; speeds stay below the hurry."""
    wall = box(SemanticClass.WALL, (0.0, 0.3, 0.5), (0.3, 4.0, 1.0))
    places, velocities = walked(make_ground(objects=[wall]), [heading_east()], 14.0)
    outside = np.maximum(np.abs(places[:, 0] - [0.0, 0.3]) - [0.15, 2.0], 0.0)
    assert np.hypot(*outside.T).min() > 0.25 - 1e-6
    assert places[:, 0, 0].max() > 4.0
    assert np.hypot(*velocities[:, 0].T).max() <= HURRY + 1e-9


def test_a_velocity_is_taken_on_within_the_relaxation_time(make_ground):
    """From rest a fifth of what is missing is added in each control step of 0.1 s."""
    still = heading_east().plan
    made = heading_east()
    made = type(made)((-4.0, 0.0), (0.0, 0.0), still, made.behaviour)
    _, velocities = walked(make_ground(), [made], 0.5)
    np.testing.assert_allclose(
        np.hypot(*velocities[:, 0].T), 1.0 - 0.8 ** np.arange(1, 6), atol=2e-3
    )


def test_people_of_a_group_keep_together_and_apart(make_ground):
    """Three stay within a few metres among trunks and never overlap."""
    rng = np.random.default_rng(3)
    trunks = [
        frustum(SemanticClass.TRUNK, (*place, 0.0), (0.3, 0.3), 3.0)
        for place in rng.uniform(-14, 14, (40, 2))
        if np.hypot(*place) > 2.5
    ]
    slots = ((0.0, 0.0), (0.0, -0.8), (-0.8, 0.0))
    made = [
        agent("person", slot, seed=k, slot=slot, leader=0 if k else None)
        for k, slot in enumerate(slots)
    ]
    world = make_ground(objects=trunks, size=40.0)
    places, _ = walked(world, made, 60.0)
    pairs = np.array(
        [np.hypot(*(places[:, a] - places[:, b]).T) for a, b in ((0, 1), (0, 2), (1, 2))]
    )
    assert pairs.min() >= 0.5 - 1e-9
    assert np.percentile(pairs, 90) < 2.6
    assert pairs.max() < 8.0
    # And they went somewhere.
    assert np.ptp(places[:, 0], axis=0).max() > 10.0
    room = solids_room(world.ground, world.objects)
    assert room.clearance(places.reshape(-1, 2)).min() > 0.25 - 1e-6


def test_an_animal_runs_pauses_and_turns(make_ground):
    """It goes at its speed or stands; its heading jumps between runs of 1 to 4 s."""
    made = agent("animal", (0.0, 0.0), (2.0, 0.0), speed=2.0, radius=0.3, seed=4)
    _, velocities = walked(make_ground(size=120.0), [made], 60.0)
    speeds = np.hypot(*velocities[:, 0].T)
    assert set(np.round(np.unique(speeds), 6)) == {0.0, 2.0}
    assert 0.05 < (speeds == 0.0).mean() < 0.5
    runs = velocities[speeds > 0.0, 0]
    headings = np.unwrap(np.arctan2(runs[:, 1], runs[:, 0]))
    jumps = np.abs(np.diff(headings))
    assert 10 < (jumps > 1e-6).sum() < 40
    assert np.deg2rad(45) < jumps.max() < np.deg2rad(120) + 1e-6


def test_a_vehicle_drives_to_and_fro_on_its_track(make_ground):
    """After 3 m and 4 m at 1 m/s it is at the end, 7 s later where it began; it cuts no corner."""
    track = ((0.0, 0.0), (3.0, 0.0), (3.0, 4.0))
    made = agent("vehicle", track[0], (1.0, 0.0), radius=0.9, track=track)
    places, _ = walked(make_ground(), [made], 20.0)
    for second, expected in ((3, (3, 0)), (5, (3, 2)), (7, (3, 4)), (11, (3, 0)), (14, (0, 0))):
        np.testing.assert_allclose(places[10 * second, 0], expected, atol=1e-9)
    np.testing.assert_allclose(places[170, 0], (3, 0), atol=1e-9)


def test_a_vehicle_waits_for_who_stands_on_its_track(make_ground):
    """It stops where they touch, and leaves the track by nothing."""
    made = agent("vehicle", (0.0, 0.0), radius=0.9, track=((0.0, 0.0), (8.0, 0.0)))
    places, velocities = walked(make_ground(), [made, walker((4.0, 0.1))], 6.0)
    np.testing.assert_array_equal(places[:, 0, 1], 0.0)
    assert places[-1, 0, 0] == pytest.approx(4.0 - (1.15**2 - 0.1**2) ** 0.5, abs=0.011)
    np.testing.assert_array_equal(velocities[-1, 0], 0.0)


def test_nobody_overlaps_in_a_crowd(make_ground):
    """People, animals, a vehicle and one who goes straight, in a small square with trunks."""
    trunks = [frustum(SemanticClass.TRUNK, (x, 5.0, 0.0), (0.4, 0.4), 3.0) for x in (-6, 0, 6)]
    kinds = ["person"] * 6 + ["animal"] * 3
    made = [
        agent(kind, (2.5 * (k % 5) - 5, -6.0 + 3 * (k // 5)), seed=k, speed=1.5)
        for k, kind in enumerate(kinds)
    ]
    made += [agent("vehicle", (-7, 1), radius=0.9, track=((-7, 1), (7, 1))), walker((0, 7), (1, 0))]
    world = make_ground(objects=trunks)
    places, _ = walked(world, made, 40.0, lambda t: (3 * np.sin(t), 0.0))
    radii = np.array([each.plan.radius for each in made])
    away = np.hypot(*(places[:, :, None] - places[:, None]).transpose(3, 0, 1, 2))
    away += 1e3 * np.eye(len(made))
    assert (away - radii[:, None] - radii).min() > -1e-9
    room = solids_room(world.ground, world.objects)
    clear = room.clearance(places.reshape(-1, 2)).reshape(places.shape[:2])
    assert (clear - radii).min() > -1e-6


@pytest.mark.parametrize("kind", ["person", "animal"])
def test_decisions_follow_from_the_seed(make_ground, kind):
    """The same seed gives the same way to the bit, another seed another one."""
    first, again, other = (
        walked(make_ground(), [agent(kind, (0.0, 0.0), seed=seed)], 8.0)[0] for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1.0


def test_a_second_drive_is_the_first(make_ground):
    """Putting the robot down anew puts the walkers back, with their decisions."""
    walkers = Walkers(peopled(make_ground(), agent("person", (0.0, 0.0), seed=2)), 100.0)
    runs = []
    for _ in range(2):
        walkers.reset(FAR)
        for _ in range(60):
            track = walkers.step(10, FAR, 0.0)
        runs.append(track.movers.places[-1].copy())
    np.testing.assert_array_equal(*runs)
