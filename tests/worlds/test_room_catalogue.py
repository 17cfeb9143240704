"""The catalogue of rooms: every preset can be driven, judges are apart, names are checked."""

import itertools

import numpy as np
import pytest
from pydantic import ValidationError

from worlds.room_catalogue import UnknownRoomError, make_room, room_names, room_plan
from worlds.rooms import (
    RoomPlan,
    free_places,
)
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
