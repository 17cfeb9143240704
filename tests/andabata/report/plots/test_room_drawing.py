"""Drawing of rooms: where walls and posts stand, and what is solid."""

import numpy as np
from matplotlib.figure import Figure

from andabata.report.plots.room_drawing import draw_room
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import Room, RoomPlan

ROOM = make_room("spn-env0")


def drawn(room):
    """Return axes with a room."""
    axes = Figure().subplots()
    draw_room(axes, room)
    return axes


def test_rooms_are_drawn_in_metres():
    """Each box and circle is where it stands; the room is in view with equal scales."""
    axes = drawn(ROOM)
    boxes = [patch.get_bbox().extents for patch in axes.patches[: len(ROOM.boxes)]]
    np.testing.assert_allclose(boxes, ROOM.boxes)
    circles = [(*patch.center, patch.radius) for patch in axes.patches[len(ROOM.boxes) :]]
    np.testing.assert_allclose(circles, ROOM.circles)
    assert axes.get_aspect() == 1
    assert axes.get_xlim()[0] <= -4 < 4 <= axes.get_xlim()[1]


def test_outlines_are_drawn_solid_but_for_their_holes():
    """What is solid is filled, by any winding; a wall of two corners is a line."""
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    hole = ((0.4, 0.4), (0.4, 0.6), (0.6, 0.6), (0.6, 0.4))
    outlines = (square, hole, ((-1.0, -1.0), (-0.5, -0.5)))
    made = Room.of("r", RoomPlan(about="", half=(2.0, 2.0), outlines=outlines))
    (patch,) = drawn(made).patches[len(made.boxes) :]
    path = patch.get_path()
    starts = path.vertices[path.codes == path.MOVETO]
    np.testing.assert_allclose(starts, [each[0] for each in outlines])
    assert len(path.vertices) == 5 + 5 + 3
    assert path.contains_points([(0.2, 0.2), (1.2, 0.2)]).tolist() == [True, False]
