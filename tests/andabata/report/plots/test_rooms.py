"""Pictures of drives in rooms: where things are drawn, and what markers and bars say."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.patches import Circle

from andabata.evaluation.room_drives import room_attempt
from andabata.evaluation.support_points import SupportPoints
from andabata.machine.planar.mover_contact import Contact
from andabata.report.plots import rooms
from andabata.report.plots.room_drawing import END_STYLES, HIT_STYLE
from andabata.tasks.terminations import Outcome
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import RoomTask
from worlds.world import Start

ROOM = make_room("spn-env0")
GREEN, RED, ORANGE = (style["color"] for style in END_STYLES.values())


def drive(outcome=Outcome.GOAL, steps=10, y=0.0, speed=0.1):
    path = np.zeros((steps + 1, 3))
    path[:, 0], path[:, 1] = speed * np.arange(steps + 1) - 1, y
    return room_attempt(RoomTask(Start(-1.0, y, 0.0), (1.0, y)), outcome, path)


def markers(axes, colour):
    """Return places of the markers of a colour, shape (k, 2)."""
    lines = [each for each in axes.lines if each.get_linestyle() == "None"]
    found = [np.ravel(each.get_data()) for each in lines if to_hex(each.get_color()) == colour]
    return np.array(found)


def test_paths_end_with_the_markers_of_the_paper():
    """Green where the goal was reached, red in a crash, orange in a time-out, a panel a cell."""
    mixed = [drive(), drive(Outcome.COLLISION, y=1.0), drive(Outcome.TIMEOUT, y=2.0)]
    cells = {("a", ROOM.name): mixed, ("b", ROOM.name): [drive(), drive(y=1.5)]}
    figure = rooms.trajectories_figure(cells, [ROOM], "title")
    first, second = figure.axes
    for colour, y in ((GREEN, 0.0), (RED, 1.0), (ORANGE, 2.0)):
        np.testing.assert_allclose(markers(first, colour), [[0.0, y]], atol=1e-12)
    assert first.get_title() == f"{ROOM.name}, a\n1 of 3 goals reached, 1 crash, 1 time-out"
    assert second.get_title() == f"{ROOM.name}, b\n2 of 2 goals reached"
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["goal reached", "crash", "time-out"]


def test_the_longest_title_of_paths_stays_above_its_own_room():
    """Two rooms side by side; neither title reaches the other or the edge of the picture."""
    mixed = [drive() for _ in range(20)]
    mixed += [drive(Outcome.COLLISION), drive(Outcome.COLLISION), drive(Outcome.TIMEOUT)]
    name = "laser ten-beams-forward"
    rooms_of_two = [replace(ROOM, name="spn-env2"), replace(ROOM, name="spn-env3")]
    cells = {(name, room.name): mixed for room in rooms_of_two}
    figure = rooms.trajectories_figure(cells, rooms_of_two, "title")
    figure.draw_without_rendering()
    first, second = (axes.title.get_window_extent() for axes in figure.axes)
    assert first.x1 < second.x0
    assert second.x1 < figure.bbox.x1


def test_hits_by_movers_have_a_marker_and_a_bar_of_their_own():
    """What a mover caused is no crash of the robot's; the legend tells it where there is some."""
    hit = replace(drive(Outcome.COLLISION, y=1.0), contact=Contact.HIT_AT_REST)
    figure = rooms.trajectories_figure({("trained", ROOM.name): [drive(), hit]}, [ROOM], "title")
    purple = HIT_STYLE["color"]
    np.testing.assert_allclose(markers(figure.axes[0], purple), [[0.0, 1.0]], atol=1e-12)
    cell = {"room": "r", "lidar": "trained", "memory": "map", "trials": 10, "successes": 4}
    row = cell | {"collisions": 5, "timeouts": 1, "hit_by_mover": 1, "hit_at_rest": 2}
    ends = rooms.ends_figure([row], "title")
    bars = {to_hex(bar.get_facecolor()): bar.get_height() for bar in ends.axes[0].patches}
    assert bars == pytest.approx({GREEN: 0.4, RED: 0.2, purple: 0.3, ORANGE: 0.1})
    for each in (figure, ends):
        assert "hit by a mover" in [text.get_text() for text in each.legends[0].get_texts()]


def test_movers_of_the_first_drive_are_shown_with_its_path_in_bold():
    """The legend names them where there are some, and only there."""
    movers = np.tile([1.0, 2.0, 0.3], (11, 1, 1))
    cells = {("a", ROOM.name): [drive(), drive(y=1.0)], ("b", ROOM.name): [drive()]}
    figure = rooms.trajectories_figure(cells, [ROOM], "title", {("a", ROOM.name): movers})
    first, second = figure.axes
    assert ((1.0, 2.0), 0.3) in [
        (each.center, each.radius) for each in first.patches if isinstance(each, Circle)
    ]
    (bold,) = [each for each in first.lines if each.get_linewidth() > 2]
    np.testing.assert_array_equal(bold.get_ydata(), drive().path[:, 1])
    assert not [each for each in second.lines if each.get_linewidth() > 2]
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["goal reached", rooms.track_legend().get_label()]


def test_titles_and_legends_lie_inside_the_figure():
    """No text is cut, whatever is drawn."""
    hits = [drive(), drive(Outcome.TIMEOUT), replace(drive(), contact=Contact.HIT)]
    movers = {("laser of its training", ROOM.name): np.tile([1.0, 2.0, 0.3], (11, 1, 1))}
    cells = {("laser of its training", ROOM.name): hits}
    figure = rooms.trajectories_figure(cells, [ROOM], "policy shipped, without a memory", movers)
    FigureCanvasAgg(figure).draw()
    for text in [*figure.texts, *figure.legends, *(each.title for each in figure.axes)]:
        box = text.get_window_extent()
        assert box.x0 >= 0
        assert box.x1 <= figure.bbox.x1
        assert box.y0 >= 0
        assert box.y1 <= figure.bbox.y1


def row(room, lidar, memory, ends, trials=10):
    names = ("successes", "collisions", "timeouts")
    cell = {"room": room, "lidar": lidar, "memory": memory, "trials": trials}
    return cell | dict(zip(names, ends, strict=True))


def test_bars_are_the_shares_of_ends():
    """Rows of several policies add up; bars stand one on top of the other."""
    rows = [
        row("r", "ten-beams", "reactive", (6, 3, 1)),
        row("r", "ten-beams", "reactive", (10, 0, 0)),
        row("r", "180|1|5|0", "reactive", (0, 10, 0)),
        row("r", "ten-beams", "map", (10, 0, 0)),
        row("r", "180|1|5|0", "map", (9, 0, 1)),
    ]
    figure = rooms.ends_figure(rows, "title")
    reactive, mapped = figure.axes
    heights = [patch.get_height() for patch in reactive.patches]
    np.testing.assert_allclose(heights, [0.8, 0.15, 0.05, 0.0, 1.0, 0.0])
    bottoms = [patch.get_y() for patch in reactive.patches]
    np.testing.assert_allclose(bottoms, [0, 0.8, 0.95, 0, 0, 1.0])
    assert [text.get_text() for text in reactive.texts] == ["80 %", "0 %"]
    assert (reactive.get_title(), mapped.get_title()) == ("r, without a memory", "r, with the map")
    labels = [text.get_text() for text in mapped.get_xticklabels()]
    assert labels == ["ten-beams\n180|20|10|0", "180|1|5|0"]


def moment(step, counts, is_return=True):
    places = np.array([[0.5 * k, 2.0] for k in range(len(counts))])
    seen = np.full(len(counts), is_return)
    return SupportPoints(step, np.array([0.1 * step, 0.0, 0.0]), places, np.array(counts), seen)


def test_support_points_grow_with_their_features():
    """Markers tell the goal, areas the count; late moments are left out, open ends are hollow."""
    first = (drive(), [moment(0, [1, 4]), moment(20, [2], is_return=False), moment(180, [9])])
    second = (drive(y=1.0), [moment(0, [3])])
    figure = rooms.support_points_figure({"K = 5": [first, second]}, ROOM, "title")
    axes = figure.axes[0]
    points = [each for each in axes.lines if each.get_zorder() == 3]
    assert [each.get_marker() for each in points] == ["o", "o", "o", "s"]
    areas = np.array([each.get_markersize() for each in points]) ** 2
    np.testing.assert_allclose(areas / areas[0], [1, 4, 2, 3])
    assert [each.get_markerfacecolor() == "none" for each in points] == [False, False, True, False]
    assert to_hex(points[0].get_markeredgecolor()) == "#000000"  # The start is black.
    names = [text.get_text() for text in axes.texts]
    assert names == ["G0", "G1", "S0", "S1"]


def test_a_tour_names_its_goals_and_counts_them():
    """Each leg has its goal; the title says how many were reached in how many steps."""
    room = make_room("spn-crowded")
    legs = [drive(), drive(Outcome.COLLISION, steps=7, y=1.0)]
    figure = rooms.tour_figure({"reactive": legs}, room, "title")
    (axes,) = figure.axes
    assert axes.get_title() == "reactive: 1 of 5 goals in 17 steps"
    assert [text.get_text() for text in axes.texts] == ["G1", "G2", "S"]
    np.testing.assert_allclose(markers(axes, RED), [[-0.3, 1.0]], atol=1e-12)


def test_an_obstacle_appears_where_the_robot_is_near_enough():
    """The moment is the first step within its distance; one that never came is dotted."""
    room = make_room("spn-sudden")
    near = room_attempt(
        room.tasks[0],
        Outcome.COLLISION,
        np.stack([0.1 * np.arange(41) - 3.2, *np.zeros((2, 41))], axis=1),
    )
    first, second = room.appearances
    # The circle of 0.3 m at the origin appears within 1.3 m of its edge: from x = -1.6 on.
    assert rooms.moment_of(near, first) == 17
    assert rooms.moment_of(near, second) is None
    figure = rooms.sudden_figure({"reactive": near}, room, "title")
    (axes,) = figure.axes
    texts = [text.get_text() for text in axes.texts]
    assert texts == ["O1", "O1 appears\nafter 17 steps", "O2", "G", "S"]
    assert axes.get_title() == "reactive: crash after 40 steps"
    dotted = [patch for patch in axes.patches if patch.get_linestyle() == ":"]
    assert [patch.center for patch in dotted] == [second.circle[:2]]
