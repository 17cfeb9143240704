"""Local map of a 2D laser: sub-goals at doors, out of pockets, and none where the way is free."""

from itertools import pairwise

import numpy as np
import pytest
from pydantic import ValidationError

from andabata.navigation.planar.hit_layer import LaserPose
from andabata.navigation.planar.lidar_map import LidarMap, LidarMapConfig

FAR = 5.0
ORIGIN = np.zeros(2)
DENSE = np.radians(np.arange(0.0, 360.0, 0.5))
TEN = np.radians(np.arange(10) * 20.0 - 90.0)

DOOR = [((1.2, -9.0), (1.2, 1.0)), ((1.2, 2.0), (1.2, 9.0))]
"""Wall at x = 1.2 m with a door of one metre, by the ends of its segments [m]."""

POCKET = [((1.0, -1.0), (1.0, 1.0)), ((-1.0, -1.0), (1.0, -1.0)), ((-1.0, 1.0), (1.0, 1.0))]
"""Three walls around the origin, open behind."""


def scan(walls, pose, bearings):
    """Return the ranges of beams to walls, given by their ends [m]."""
    angles = pose[2] + bearings
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ranges = np.full(len(bearings), FAR)
    for a, b in np.array(walls, dtype=float).reshape(-1, 2, 2):
        along, to = b - a, a - pose[:2]
        with np.errstate(divide="ignore", invalid="ignore"):
            across = rays[:, 0] * along[1] - rays[:, 1] * along[0]
            far = (to[0] * along[1] - to[1] * along[0]) / across
            share = (to[0] * rays[:, 1] - to[1] * rays[:, 0]) / across
        met = (far > 0) & (share >= 0) & (share <= 1)
        ranges[met] = np.minimum(ranges[met], far[met])
    return ranges


def away(walls, start, end):
    """Return the least distance of a straight way from walls [m]."""
    places = start + np.linspace(0.0, 1.0, 50)[:, None] * (np.asarray(end) - start)
    least = np.inf
    for a, b in np.array(walls, dtype=float):
        shares = np.clip((places - a) @ (b - a) / np.sum((b - a) ** 2), 0.0, 1.0)
        least = min(least, np.hypot(*(places - a - shares[:, None] * (b - a)).T).min())
    return least


def drive(walls, goal, bearings, steps=400, memory=True):
    """Return the places of a robot that turns and drives straight to each sub-goal."""
    lidar, place, yaw = LidarMap(), np.zeros(2), 0.0
    goal, places = np.array(goal), [np.zeros(2)]
    for _ in range(steps):
        if not memory:
            lidar.reset()
        lidar.update((*place, yaw), bearings, scan(walls, (*place, yaw), bearings), FAR)
        ahead = lidar.subgoal(place, goal) - place
        turn = (np.arctan2(ahead[1], ahead[0]) - yaw + np.pi) % (2 * np.pi) - np.pi
        yaw += np.clip(turn, -0.2, 0.2)
        if abs(turn) < 0.2:
            place = place + min(np.hypot(*ahead), 0.1) * np.array([np.cos(yaw), np.sin(yaw)])
            places.append(place)
        if np.hypot(*(goal - place)) < 0.3:
            break
    return np.array(places)


def seen(walls, goal, bearings=DENSE, pose=(0.0, 0.0, 0.0), **settings):
    """Return the sub-goal after one scan."""
    lidar = LidarMap(LidarMapConfig(**settings))
    lidar.update(pose, bearings, scan(walls, pose, bearings), FAR)
    return lidar.subgoal(np.array(pose[:2]), np.array(goal))


@pytest.mark.parametrize("goal", [(3.0, 1.0), (40.0, -70.0), (0.0, 0.0)])
def test_where_nothing_was_seen_the_goal_itself_is_headed_for(goal):
    """With an empty scan and without one, beyond the square too."""
    np.testing.assert_array_equal(seen([], goal), goal)
    np.testing.assert_array_equal(LidarMap().subgoal(ORIGIN, np.array(goal)), goal)


def test_to_a_goal_beyond_the_square_the_sub_goal_leads_around_a_wall():
    """As to one inside, as far as the lookahead."""
    place = seen(DOOR, (60.0, 0.0))
    assert 0.3 < np.hypot(*place) <= 1.5
    assert place[1] > 0.5


GAP = [((1.2, -1.5), (1.2, -0.3)), ((1.2, 0.3), (1.2, 9.0)), ((1.2, -9.0), (1.2, -3.0))]
"""Wall at x = 1.2 m with a gap of 0.6 m straight ahead, and a door of 1.5 m to the right."""


@pytest.mark.parametrize(("radius", "passes"), [(0.2, True), (0.35, False)])
def test_a_gap_is_one_for_a_body_that_fits(radius, passes):
    """A body of 0.4 m is led through a gap of 0.6 m, one of 0.7 m to the door beside it."""
    lidar = LidarMap(radius=radius)
    lidar.update((0.0, 0.0, 0.0), DENSE, scan(GAP, (0.0, 0.0, 0.0), DENSE), FAR)
    place = lidar.subgoal(ORIGIN, np.array([3.0, 0.0]))
    assert (abs(place[1]) < 0.2) == passes
    assert passes or place[1] < -0.5


def test_costs_leave_the_same_room_beside_every_body():
    """Radii grow by what the body is wider; a radius that is named stays, and so do its costs."""
    plain = LidarMapConfig()
    assert plain.for_robot(0.2).costs == plain.costs
    wide = plain.for_robot(0.35)
    assert wide.robot_radius == 0.35
    radii = wide.costs.inscribed_radius, wide.costs.inflation_radius
    assert radii == pytest.approx((0.26 + 0.15, 0.46 + 0.15))
    assert wide.costs.inscribed_cost == plain.costs.inscribed_cost
    named = LidarMapConfig(robot_radius=0.3)
    assert named.for_robot(0.35) == named
    small = plain.for_robot(0.02).costs
    assert (small.inscribed_radius, small.inflation_radius) == pytest.approx((0.08, 0.28))


def test_the_ground_under_the_body_is_free():
    """What lay within its radius is gone where the robot stands."""
    for radius, is_free in ((0.2, False), (0.35, True)):
        lidar = LidarMap(radius=radius)
        lidar.update((0.0, 0.0, 0.0), np.zeros(1), np.array([0.3]), FAR)
        lidar.update((0.0, 0.0, 0.0), np.zeros(0), np.zeros(0), FAR)
        assert (len(lidar.hits.obstacles) == 0) == is_free


def test_a_wall_beside_the_way_changes_nothing():
    """The goal itself is headed for along a wall at a distance."""
    np.testing.assert_array_equal(seen([((-1.0, 0.6), (9.0, 0.6))], (4.0, 0.0)), [4.0, 0.0])


def test_behind_a_wall_the_sub_goal_leads_to_its_door():
    """It lies within the lookahead, in sight, and nearer to the door."""
    place = seen(DOOR, (3.0, 0.0))
    assert 0.3 < np.hypot(*place) <= 1.5
    assert away(DOOR, ORIGIN, place) > 0.2
    assert np.hypot(*(place - [1.2, 1.5])) < 0.6


@pytest.mark.parametrize("bearings", [DENSE, TEN])
def test_the_robot_comes_through_the_door(bearings):
    """It reaches the goal, and does not touch the wall."""
    places = drive(DOOR, (3.0, 0.0), bearings)
    assert np.hypot(*(places[-1] - [3.0, 0.0])) < 0.3
    assert min(away(DOOR, *pair) for pair in pairwise(places)) > 0.2


@pytest.mark.parametrize("bearings", [DENSE, TEN])
def test_a_pocket_is_left(bearings):
    """The map leads out behind and around; ten beams find the walls one after the other."""
    goal = np.array([3.0, 0.0])
    places = drive(POCKET, goal, bearings)
    assert np.hypot(*(places[-1] - goal)) < 0.3
    assert places[:, 0].min() < -1.0
    assert min(away(POCKET, *pair) for pair in pairwise(places)) > 0.2


def test_without_memory_ten_beams_do_not_leave_the_pocket():
    """A map that forgets each scan turns to and fro between walls that lie between its beams."""
    places = drive(POCKET, (3.0, 0.0), TEN, memory=False)
    assert np.abs(places).max() < 1.0


def test_clearances_are_those_from_the_hits_and_not_from_their_cells():
    """The nearest hit on a wall at 1.27 m is 22 cm ahead and 5 cm beside the middle of a cell."""
    lidar, pose = LidarMap(), (0.0, 0.0, 0.0)
    wall = [((1.27, -1.0), (1.27, 1.0))]
    lidar.update(pose, DENSE, scan(wall, pose, DENSE), FAR)
    lidar.subgoal(ORIGIN, np.array([3.0, 0.0]))
    i, j = np.floor((np.array([1.05, 0.05]) - lidar.plan.corner) / 0.1).astype(int)
    assert lidar.plan.clearance[i, j] == pytest.approx(np.hypot(2.2, 0.5), abs=0.01)


@pytest.mark.parametrize(("width", "is_free"), [(0.6, True), (0.3, False)])
def test_a_gap_that_is_wide_enough_is_taken(width, is_free):
    """A way around costs more than a gap of 0.6 m, and less than one of 0.3 m."""
    walls = [((1.0, 0.05 + s * width / 2), (1.0, s * 1.5)) for s in (1, -1)]
    place = seen(walls, (2.0, 0.05))
    assert (abs(place[1]) < 0.1) == is_free


def test_the_order_of_the_beams_changes_no_sub_goal():
    """Scans of shuffled beams give the same sub-goals to the bit."""
    rng = np.random.default_rng(0)
    one, other = LidarMap(), LidarMap()
    for k in range(8):
        pose = (0.05 * k, 0.02 * k, 0.1 * k)
        order, ranges = rng.permutation(len(DENSE)), scan(DOOR, pose, DENSE)
        one.update(pose, DENSE, ranges, FAR)
        other.update(pose, DENSE[order], ranges[order], FAR)
        place, goal = np.array(pose[:2]), np.array([3.0, 0.0])
        np.testing.assert_array_equal(one.subgoal(place, goal), other.subgoal(place, goal))


def test_the_map_does_not_depend_on_where_the_frame_begins():
    """Shifted by whole cells, sub-goals are shifted as much."""
    shift = np.array([512.0, -256.0])
    moved = [(np.array(a) + shift, np.array(b) + shift) for a, b in DOOR]
    place = seen(moved, (515.0, -256.0), pose=(*shift, 0.0))
    np.testing.assert_allclose(place - shift, seen(DOOR, (3.0, 0.0)), atol=1e-6)


def test_a_laser_beside_the_middle_shows_walls_where_they_are():
    """The same hits lie in the map, wherever the laser is mounted and faces."""
    laser, pose = LaserPose(0.1, -0.05, 2.0), (0.2, 0.3, 0.7)
    lidar = LidarMap()
    lidar.update(pose, DENSE, scan(DOOR, laser.on(LaserPose(*pose)), DENSE), FAR, laser)
    assert len(lidar.hits.obstacles) > 20
    np.testing.assert_allclose(lidar.hits.obstacles[:, 0], 1.2, atol=1e-5)


def test_a_plan_stays_until_it_is_due():
    """A sub-goal is kept for five scans, though the robot has moved by then."""
    lidar, goal = LidarMap(), np.array([3.0, 0.0])
    found = []
    for k in range(6):
        pose = (0.0, 0.08 * k, 0.0)
        lidar.update(pose, DENSE, scan(DOOR, (0.0, 0.0, 0.0), DENSE), FAR)
        found.append(lidar.subgoal(np.array(pose[:2]), goal))
    for place in found[1:5]:
        np.testing.assert_array_equal(place, found[0])
    assert (found[5] != found[0]).any()


def test_a_new_obstacle_on_the_way_brings_a_plan_at_once():
    """One beside it does not."""
    wall = [((1.0, -1.0), (1.0, 1.0))]
    beside = [((1.0, 1.0), (1.0, 3.0))]
    for walls, is_new in ((wall, True), (beside, False)):
        lidar, goal, pose = LidarMap(), np.array([2.5, 0.0]), (0.0, 0.0, 0.0)
        lidar.update(pose, DENSE, scan([], pose, DENSE), FAR)
        np.testing.assert_array_equal(lidar.subgoal(ORIGIN, goal), goal)
        lidar.update(pose, DENSE, scan(walls, pose, DENSE), FAR)
        assert (lidar.subgoal(ORIGIN, goal) != goal).any() == is_new


def test_another_goal_brings_a_plan_at_once():
    """The first call after it is for the new goal."""
    lidar, pose = LidarMap(), (0.0, 0.0, 0.0)
    lidar.update(pose, DENSE, scan(DOOR, pose, DENSE), FAR)
    assert lidar.subgoal(ORIGIN, np.array([3.0, 0.0]))[0] > 0.5
    np.testing.assert_array_equal(lidar.subgoal(ORIGIN, np.array([-2.0, 0.0])), [-2.0, 0.0])


def test_a_sub_goal_that_is_reached_gives_way_to_the_next():
    """Nearer than the least lookahead, the robot is given another place."""
    lidar, pose, goal = LidarMap(), (0.0, 0.0, 0.0), np.array([3.0, 0.0])
    lidar.update(pose, DENSE, scan(DOOR, pose, DENSE), FAR)
    place = lidar.subgoal(ORIGIN, goal)
    here = place - [0.1, 0.1]
    assert np.hypot(*(lidar.subgoal(here, goal) - here)) > 0.3


def test_hits_under_the_robot_are_forgotten():
    """Where it stands nothing stands."""
    lidar = LidarMap()
    lidar.update((0.0, 0.0, 0.0), DENSE, np.full(len(DENSE), 0.15), FAR)
    assert len(lidar.hits.obstacles) == 0


def test_what_a_caller_writes_into_a_sub_goal_stays_there():
    """The map's own sub-goal is another array, and so is the caller's goal."""
    lidar, pose, goal = LidarMap(), (0.0, 0.0, 0.0), np.array([3.0, 0.0])
    lidar.update(pose, DENSE, scan(DOOR, pose, DENSE), FAR)
    first = lidar.subgoal(ORIGIN, goal)
    kept = first.copy()
    first += 1.0
    np.testing.assert_array_equal(lidar.subgoal(ORIGIN, goal), kept)
    free = LidarMap().subgoal(ORIGIN, goal)
    free += 1.0
    np.testing.assert_array_equal(goal, [3.0, 0.0])


def test_reset_forgets_everything():
    """A map that was reset gives the goal itself again."""
    lidar, pose, goal = LidarMap(), (0.0, 0.0, 0.0), np.array([3.0, 0.0])
    lidar.update(pose, DENSE, scan(DOOR, pose, DENSE), FAR)
    assert (lidar.subgoal(ORIGIN, goal) != goal).any()
    lidar.reset()
    np.testing.assert_array_equal(lidar.subgoal(ORIGIN, goal), goal)


def test_what_is_not_finite_or_does_not_fit_is_refused():
    """Poses, bearings, goals, and ranges of another number."""
    lidar, beams = LidarMap(), np.zeros(3)
    with pytest.raises(ValueError, match="expected one for each bearing"):
        lidar.update((0.0, 0.0, 0.0), beams, np.zeros(2), FAR)
    with pytest.raises(ValueError, match="expected finite poses"):
        lidar.update((0.0, np.nan, 0.0), beams, beams, FAR)
    with pytest.raises(ValueError, match="expected finite poses"):
        lidar.update((0.0, 0.0, 0.0), np.array([0.0, np.inf, 0.0]), beams, FAR)
    with pytest.raises(ValueError, match="expected finite places"):
        lidar.subgoal(ORIGIN, np.array([np.inf, 0.0]))
    with pytest.raises(ValidationError, match="power of 2"):
        LidarMapConfig(hits={"cells": 100})
