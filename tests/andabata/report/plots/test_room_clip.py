"""Moving pictures of drives in rooms: where robots are, and what failing looks like."""

import numpy as np

from andabata.evaluation.room_drives import room_attempt
from andabata.report.plots import room_clip
from andabata.report.plots.room_clip import room_film
from andabata.tasks.terminations import Outcome
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import RoomTask
from worlds.world import Start

ROOM = make_room("spn-env0")


def drive(outcome=Outcome.GOAL, steps=20, y=0.0):
    """Return a drive along x from -2 m to 2 m."""
    path = np.zeros((steps + 1, 3))
    path[:, 0], path[:, 1] = np.linspace(-2, 2, steps + 1), y
    return room_attempt(RoomTask(Start(-2.0, y, 0.0), (2.0, y)), outcome, path)


def reddest(picture):
    """Return the mean place of the pixels in the colour of a failure."""
    pixels = np.asarray(picture).astype(int)
    there = np.argwhere((np.abs(pixels - room_clip._FAILED) < 3).all(axis=2))
    return there.mean(axis=0) if len(there) else None


def test_robots_begin_together_and_stay_where_they_ended():
    """The shorter drive waits; one that failed turns red at its end alone."""
    failed = drive(Outcome.COLLISION, steps=10, y=1.0)
    pictures = room_film({"reactive": [drive(), failed]}, ROOM, 0.2)
    assert len(pictures) == 21 + room_clip._STANDING
    assert reddest(pictures[5]) is None
    row, column = reddest(pictures[-1])
    _, places = room_clip._panels(["reactive"], ROOM)
    x, y = places[0] @ [2.0, 1.0, 1.0]
    assert abs(column - x) < 2
    assert abs(row - y) < 2
    np.testing.assert_array_equal(reddest(pictures[12]), reddest(pictures[-1]))


def test_each_driver_has_a_panel_and_long_drives_few_pictures():
    """Pictures have a limit, whatever the number of steps."""
    pictures = room_film({"reactive": [drive(steps=500)], "with map": [drive()]}, ROOM, 0.2)
    assert len(pictures) == room_clip._FRAMES + room_clip._STANDING
    assert pictures[0].size[0] > 1.5 * pictures[0].size[1]
    assert np.asarray(pictures[0]).std() > 0


def test_movers_are_where_they_are_at_each_step_and_one_robot_is_among_them():
    """A mover is drawn at its place of the step, one of radius 0 is not, and one drive is shown."""
    movers = np.zeros((21, 2, 3))
    movers[:, 0] = np.column_stack([np.linspace(-1, 1, 21), np.full(21, 1.5), np.full(21, 0.3)])
    drives = [drive(), drive(Outcome.COLLISION, y=-1.0)]
    pictures = room_film({"reactive": drives}, ROOM, 0.2, {"reactive": movers})
    _, places = room_clip._panels(["reactive"], ROOM)
    for step in (0, 20):
        pixels = np.asarray(pictures[step]).astype(int)
        there = np.argwhere((np.abs(pixels - np.array([120, 94, 160])) < 3).all(axis=2))
        x, y = places[0] @ [movers[step, 0, 0], 1.5, 1.0]
        np.testing.assert_allclose(there.mean(axis=0), [y, x], atol=1.0)
    assert reddest(pictures[-1]) is None
