"""Starts and goals: with clearance, within reach, in one region, with a safe path."""

from itertools import pairwise

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.goals import (
    PATH_CLEARANCE,
    START_CLEARANCE,
    FreeSpace,
    GoalError,
    UnsolvableWorldError,
    sample_task,
    sample_tasks,
    task_to,
)
from worlds.world import Start

WALL = box(SemanticClass.WALL, (0.0, 0.0, 1.0), (0.4, 40.0, 2.0))


@pytest.fixture(scope="module")
def divided(make_ground):
    """Return the true map of a square of 20 m with a wall from border to border."""
    return make_ground(objects=(WALL,)).truth


def test_places_have_clearance_and_fill_both_sides(divided):
    """Random places keep the clearance of a start, wherever they are."""
    space, rng = FreeSpace(divided), np.random.default_rng(0)
    places = np.array([space.sample(rng) for _ in range(300)])
    assert divided.clearance_at(*places.T).min() >= START_CLEARANCE
    assert 0.3 < (places[:, 0] > 0).mean() < 0.7
    assert np.ptp(places[:, 1]) > 13.0


def test_near_places_are_within_reach_and_on_the_same_side(divided):
    """Distances fill the stated interval; the wall is not crossed."""
    space, rng = FreeSpace(divided), np.random.default_rng(1)
    here = np.array([4.05, 1.05])
    found = np.array([space.sample_near(here, 2.0, 6.0, rng) for _ in range(300)])
    distances = np.hypot(*(found - here).T)
    assert (found[:, 0] > 0).all()
    assert divided.clearance_at(*found.T).min() >= START_CLEARANCE
    assert 2.0 <= distances.min() < 2.5
    assert 5.5 < distances.max() <= 6.0
    assert space.sample_near(here, 30.0, 40.0, rng) is None


def test_goals_follow_each_other_within_reach(divided):
    """Each goal is within reach of the one before it, on a path short enough."""
    space, rng = FreeSpace(divided), np.random.default_rng(2)
    for _ in range(20):
        task = sample_task(space, 3, (3.0, 6.0), 9.0, rng)
        if task is None:
            continue
        places = np.array([(task.start.x, task.start.y), *task.goals])
        steps = np.hypot(*np.diff(places, axis=0).T)
        assert len(task.goals) == 3
        assert ((steps >= 3.0) & (steps <= 6.0)).all()
        for a, b in pairwise(places):
            path = divided.shortest_path(a, b, PATH_CLEARANCE)
            assert np.hypot(*np.diff(path, axis=0).T).sum() <= 9.0


def test_the_start_faces_the_first_goal_within_45_degrees_or_as_stated(divided):
    """Headings spread over 45 degrees to either side of the goal's bearing."""
    rng = np.random.default_rng(3)
    tasks = sample_tasks(divided, 100, 1, (3.0, 6.0), 9.0, rng)
    errors = [
        t.start.yaw - np.arctan2(t.goals[0][1] - t.start.y, t.goals[0][0] - t.start.x)
        for t in tasks
    ]
    assert -np.pi / 4 <= min(errors) < -0.6
    assert 0.6 < max(errors) <= np.pi / 4
    fixed = sample_tasks(divided, 3, 1, (3.0, 6.0), 9.0, rng, heading=0.3)
    assert [task.start.yaw for task in fixed] == [0.3] * 3


def test_paths_longer_than_allowed_are_no_tasks(divided):
    """A bound below the straight distance leaves no task, and the error says so."""
    rng = np.random.default_rng(4)
    with pytest.raises(UnsolvableWorldError, match="expected 2 solvable tasks, got 0"):
        sample_tasks(divided, 2, 1, (3.0, 6.0), 2.0, rng)


def test_a_world_without_free_places_is_refused(make_ground):
    """Steep ground everywhere leaves no start."""
    truth = make_ground(lambda x, y: x).truth
    with pytest.raises(UnsolvableWorldError, match=r"expected a place with 1\.3 m of clearance"):
        FreeSpace(truth).sample(np.random.default_rng(0))


def test_given_goals_are_kept_in_their_order(divided):
    """A goal on the start's side with the path's clearance is taken as it is."""
    start, goals = Start(4.0, 1.0, 0.5), ((5.0, -3.0), (2.5, 6.25))
    assert task_to(divided, start, goals).goals == goals
    assert task_to(divided, start, goals).start == start


@pytest.mark.parametrize(
    ("goal", "wrong", "near"),
    [
        ((0.0, 1.0), "a solid object at 0,1", (0.8, 1.0)),
        ((0.5, 1.0), "less than 0.5 m from forbidden ground at 0.5,1", (0.8, 1.0)),
        ((-4.0, 1.0), "that no safe path leads to at -4,1", (0.8, 1.0)),
        ((4.0, 30.0), "outside x -10 to 10, y -10 to 10 at 4,30", (4.0, 8.5)),
        ((4.0, 9.5), "the border of the world at 4,9.5", (4.0, 8.5)),
    ],
)
def test_other_goals_are_refused_with_the_nearest_that_would_do(divided, goal, wrong, near):
    """The error names what is there, and its place is taken."""
    start = Start(4.0, 1.0, 0.0)
    with pytest.raises(GoalError) as caught:
        task_to(divided, start, (goal,))
    text = str(caught.value)
    assert wrong in text
    x, y = (float(word) for word in text.rsplit(" ", 1)[1].split(","))
    assert (x, y) == pytest.approx(near, abs=0.15)
    assert task_to(divided, start, ((x, y),)).goals == ((x, y),)
