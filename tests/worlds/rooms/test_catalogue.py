"""The catalogue of rooms: every preset can be driven, judges are apart, names are checked."""

import itertools

import numpy as np
import pytest
from pydantic import ValidationError

from tests.support.room_widths import coverage, has_no_way_narrower_than, share_of_largest_region
from worlds.rooms.catalogue import UnknownRoomError, make_room, room_names, room_plan
from worlds.rooms.geodesics import remaining, ways_to
from worlds.rooms.mover_placement import draw_movers
from worlds.rooms.room import RoomPlan, free_places, random_task
from worlds.world import Start


@pytest.mark.parametrize("name", room_names())
def test_every_preset_can_be_driven(name):
    """Fixed tasks of a preset lie in its largest free region, at least 0.5 m from obstacles."""
    made = make_room(name)
    places = free_places(made, 0.2, 0.2)
    for task in made.tasks:
        for place in ((task.start.x, task.start.y), task.goal):
            assert made.clearance(np.array([place]))[0] > 0.5
            assert np.hypot(*(places - place).T).min() < 0.05


def test_training_and_judging_rooms_are_apart():
    """The first four are trained in and have four tasks each; the next four judge alone."""
    for k in range(4):
        assert not make_room(f"spn-env{k}").judges
        assert len(make_room(f"spn-env{k}").tasks) == 4
        assert make_room(f"spn-env{k + 4}").judges


def test_passages_of_training_rooms_let_the_robot_turn():
    """No way of Env0 to 3 closes when the disc grows to 0.35 m: passages are 0.7 m at least."""
    for k in range(4):
        made = make_room(f"spn-env{k}")
        places = free_places(made, 0.35, 0.35)
        for task in made.tasks:
            for place in ((task.start.x, task.start.y), task.goal):
                assert np.hypot(*(places - place).T).min() < 0.05


@pytest.mark.parametrize(
    ("name", "share", "side"),
    [
        ("td3-env1", 0.21, 10),
        ("td3-env2", 0.27, 10),
        ("td3-env3", 0.23, 20),
        ("td3-env4", 0.24, 20),
    ],
)
def test_rooms_of_td3_have_the_papers_coverage(name, share, side):
    """It is within 1 % of the floor, movers included; no way is narrower than 0.8 m."""
    made = make_room(name)
    assert made.half == (side / 2, side / 2)
    moving = sum(np.pi * one.radius**2 for one in made.movers) / side**2
    assert coverage(made) + moving == pytest.approx(share, abs=0.01)
    assert has_no_way_narrower_than(made, 0.8)
    # A disc as wide as the narrowest way gets nearly everywhere.
    assert share_of_largest_region(made, 0.37) > 0.999
    assert made.judges
    assert np.abs(made.boxes[4:]).max() <= side / 2
    assert (np.abs(made.circles[:, :2]).max(axis=1) + made.circles[:, 2]).max() < side / 2


def test_the_fourth_room_of_td3_is_the_third_with_movers():
    """Four of them bounce at half a metre a second, which makes the coverage one point more."""
    third, fourth = make_room("td3-env3"), make_room("td3-env4")
    np.testing.assert_array_equal(third.boxes, fourth.boxes)
    np.testing.assert_array_equal(third.circles, fourth.circles)
    assert third.movers == ()
    assert [(one.speed, one.place) for one in fourth.movers] == [(0.5, None)] * 4
    assert sum(np.pi * one.radius**2 for one in fourth.movers) == pytest.approx(4.0, abs=0.1)


@pytest.mark.parametrize("name", ["td3-env1", "td3-env2", "td3-env3", "td3-env4", "gdae"])
def test_random_tasks_of_td3_can_be_driven_in_time(name):
    """At full speed the shortest way of a disc of 0.2 m takes less than 40 of 50 s."""
    made, rng = make_room(name), np.random.default_rng(0)
    for _ in range(4):
        task = random_task(made, rng, 0.2, 0.3, 2.0)
        length = remaining(task.start.x, task.start.y, ways_to(made, task.goal, 0.3, 0.2))
        assert 1.9 < length < 40.0


def passes(made, radius):
    """Return True if a disc gets from the start of a room to its goal."""
    places = free_places(made, radius, radius)
    (task,) = made.tasks
    ends = (task.start.x, task.start.y), task.goal
    return all(np.hypot(*(places - end).T).min() < 0.05 for end in ends)


@pytest.mark.parametrize(
    ("name", "width"),
    [
        ("td3-corridor", 1.0),
        ("td3-bend", 1.0),
        ("td3-gate-060", 0.6),
        ("td3-gate-080", 0.8),
        ("td3-gate-100", 1.0),
    ],
)
def test_ways_of_the_scenes_have_their_width(name, width):
    """A disc 6 cm narrower gets through, one 6 cm wider does not."""
    made = make_room(name)
    assert passes(made, width / 2 - 0.03)
    assert not passes(made, width / 2 + 0.03)
    assert made.judges


def test_the_wall_stands_between_start_and_goal():
    """It is 4 m long, a way round is longer than 4 m, and all else is at least 5 m away."""
    made = make_room("td3-wall")
    (task,) = made.tasks
    straight = np.linspace((task.start.x, task.start.y), task.goal, 101)
    assert made.clearance(straight).min() < 0.0
    assert np.ptp(made.boxes[4, [1, 3]]) == 4.0
    length = remaining(task.start.x, task.start.y, ways_to(made, task.goal, 0.3, 0.2))
    assert 6.0 < length < 8.0
    assert 8.0 - np.abs([task.start.x, task.start.y]).max() > 5.0


@pytest.mark.parametrize(
    "name", ["td3-corridor", "td3-bend", "td3-gate-060", "td3-gate-080", "td3-gate-100", "td3-wall"]
)
def test_runs_of_a_scene_differ(name):
    """A hundred starts are scattered, clear of all obstacles, and face more than one way."""
    made, rng = make_room(name), np.random.default_rng(0)
    tasks = [random_task(made, rng, 0.2) for _ in range(100)]
    starts = np.array([(task.start.x, task.start.y) for task in tasks])
    assert made.clearance(starts).min() > 0.3
    assert len({tuple(start) for start in starts.tolist()}) == 100
    assert np.ptp([task.start.yaw for task in tasks]) > 1.4
    assert {task.goal for task in tasks} == {made.tasks[0].goal}


def test_four_obstacles_of_gdae_change_places():
    """They stand, at other places in each episode; the room is walled, 11 m wide and no judge."""
    made = make_room("gdae")
    assert (made.half, made.judges) == ((5.5, 5.5), False)
    assert [one.speed for one in made.movers] == [0.0] * 4
    assert has_no_way_narrower_than(made, 0.8)
    tasks = [random_task(made, np.random.default_rng(k), 0.2) for k in range(20)]
    drawn = [draw_movers(made, np.random.default_rng(k), tasks[k], 0.2) for k in range(20)]
    assert {len(movers) for movers in drawn} == {4}
    assert len({movers[0].place for movers in drawn}) == 20


def test_a_plan_may_be_like_another():
    """What it does not say is that of the other; what it says is its own."""
    third, fourth = room_plan("td3-env3"), room_plan("td3-env4")
    assert fourth.about != third.about
    changes = {"about": third.about, "movers": ()}
    assert fourth.model_copy(update=changes) == third


def test_a_tour_goes_on_where_it_came_to():
    """Each task of the crowded room starts at the last goal, and the last ends at the start."""
    tasks = make_room("spn-crowded").tasks
    for before, after in itertools.pairwise(tasks):
        assert (after.start.x, after.start.y) == before.goal
    assert tasks[-1].goal == (tasks[0].start.x, tasks[0].start.y)
    assert tasks[0].start == Start(-3.3, -2.3, 0.0)


def test_unknown_rooms_and_fields_are_refused():
    """A name without a room lists those there are; a plan has no other fields."""
    with pytest.raises(UnknownRoomError, match="spn-env0"):
        room_plan("spn-env9")
    with pytest.raises(ValidationError, match="wals"):
        RoomPlan.model_validate({"about": "", "half": (1, 1), "wals": []})


def test_random_rooms_have_names():
    """A kind and a seed name a random room; other endings and kinds are refused."""
    for kind in ("random", "clutter", "clutter-movers"):
        assert make_room(f"{kind}-3") is make_room(f"{kind}-3")
        assert make_room(f"{kind}-3").name == f"{kind}-3"
        with pytest.raises(UnknownRoomError, match="random-K, clutter-K, clutter-movers-K"):
            make_room(f"{kind}-x")
    for wrong in ("movers-3", "clutter", "-3", "clutter-", "3"):
        with pytest.raises(UnknownRoomError, match="room: expected one of"):
            make_room(wrong)
