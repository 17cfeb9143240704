"""Fields of moving cylinders: the same for a seed, within the rules of their level."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from worlds.rooms.moving_fields import LEVELS, MOVER_RADIUS, SIDE, TASK, moving_field
from worlds.splits import JUDGING_START, JudgingSeedError

SEEDS = range(7300, 7306)


def legs(mover):
    """Return the lengths [m] and speeds [m/s] of the legs of a course."""
    rows = np.array(mover.course)
    ways = np.hypot(*np.diff(rows[:, 1:], axis=0).T)
    return ways, ways / np.diff(rows[:, 0])


@pytest.mark.parametrize("level", LEVELS)
def test_movers_are_within_the_rules_of_their_level(level):
    """As many, as fast, and inside of the square, which each crosses on half of its edge."""
    config = LEVELS[level]
    for seed in SEEDS:
        movers = moving_field(seed, level).room.movers
        assert config.count[0] <= len(movers) <= config.count[1]
        for mover in movers:
            places = np.array(mover.course)[:, 1:]
            ways, speeds = legs(mover)
            assert np.abs(places).max() <= SIDE + 1e-9
            assert ways.sum() >= SIDE
            assert config.speeds[0] - 1e-9 <= speeds.min()
            assert speeds.max() <= config.speeds[1] + 1e-9
            assert mover.radius == MOVER_RADIUS


def test_a_course_begins_and_ends_at_the_border():
    """Both of its ends are within a tenth of a metre of a side, or where a steep curve left it."""
    ends = [
        np.array(mover.course)[k, 1:]
        for seed in SEEDS
        for mover in moving_field(seed, "easy").room.movers
        for k in (0, -1)
    ]
    away = SIDE - np.abs(ends).max(axis=1)
    assert np.median(away) < 0.1
    assert away.max() < 1.5


def test_courses_are_polynomials_of_their_order():
    """Of the easy level of order 2 at most: the third differences of y over even x vanish."""
    for mover in moving_field(7300, "easy").room.movers:
        x, y = np.array(mover.course)[:, 1:].T
        factors = np.polynomial.polynomial.polyfit(x, y, 2)
        np.testing.assert_allclose(np.polynomial.polynomial.polyval(x, factors), y, atol=1e-6)


def test_speeds_change_from_leg_to_leg_around_one_of_their_own():
    """Their spread in a mover is less than that between movers."""
    movers = [m for seed in SEEDS for m in moving_field(seed, "medium").room.movers]
    speeds = [legs(mover)[1] for mover in movers]
    assert all(len(set(np.round(each, 9))) > 1 for each in speeds)
    within = np.mean([each.std() for each in speeds])
    assert 0.03 < within < 0.5 * np.std([each.mean() for each in speeds])


def test_the_same_seed_makes_the_same_field():
    """Another seed or level makes another; the way is the straight one of 20 m."""
    world = moving_field(7300, "hard")
    assert moving_field(7300, "hard").room.movers == world.room.movers
    assert moving_field(7301, "hard").room.movers != world.room.movers
    assert moving_field(7300, "easy").room.movers[0] != world.room.movers[0]
    assert world.room.name == "barn-moving-hard-7300"
    assert (world.room.tasks, world.optimal_time) == ((TASK,), 10.0)


def test_the_way_in_is_open_and_the_goal_is_free():
    """Walls stand on three sides; nobody begins where the robot does."""
    room = moving_field(7300, "easy").room
    (task,) = room.tasks
    clear = room.clearance(np.array([(task.start.x, task.start.y), task.goal, (10.0, 0.0)]))
    np.testing.assert_allclose(clear, (9.75, 0.75, 9.75), atol=0.3)
    for seed in SEEDS:
        for mover in moving_field(seed, "hard").room.movers:
            for here, there in pairwise(mover.course):
                assert max(here[1], there[1]) + MOVER_RADIUS < task.start.x - 0.254


def test_fields_that_judge_are_refused():
    """Their seeds belong to a release."""
    with pytest.raises(JudgingSeedError):
        moving_field(JUDGING_START, "easy")


def earliest(world, step=0.25, radius=0.333, speed=2.0):
    """Return the time at which a disc that knows the future is at the goal [s], None if never.

    It drives along x or y, a cell in a step, and keeps away from where movers are at both of its
    ends and in the middle.
    """
    xs, ys = np.arange(-9.25, 11.9, step), np.arange(-9.25, 9.4, step)
    x, y = np.meshgrid(xs, ys, indexing="ij")
    (task,) = world.room.tasks
    reached = (np.abs(x - task.start.x) < step / 2) & (np.abs(y - task.start.y) < step / 2)
    at_goal = np.hypot(x - task.goal[0], y - task.goal[1]) < 1.0
    courses = [np.array(mover.course) for mover in world.room.movers]
    for k in range(1, 400):
        free = np.ones_like(reached)
        for now in ((k - 0.5) * step / speed, k * step / speed):
            for rows in courses:
                at = now % rows[-1, 0]
                place = [np.interp(at, rows[:, 0], rows[:, axis]) for axis in (1, 2)]
                free &= np.hypot(x - place[0], y - place[1]) > MOVER_RADIUS + radius
        reached = binary_dilation(reached) & free
        if (reached & at_goal).any():
            return k * step / speed
    return None


def test_fields_can_be_crossed():
    """By a disc around the robot that knows the future, at its largest speed: in little more than
    the time of the straight line, which it does not drive."""
    for seed in SEEDS[:2]:
        time = earliest(moving_field(seed, "hard"))
        assert time is not None
        assert 9.0 <= time < 15.0
