"""Pictures of worlds and drives."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Circle

from andabata.machine.pose import Pose
from andabata.report.plots import drives
from andabata.tasks.episode_monitor import Outcome
from tests.support.walking_worlds import walker
from traversability.grid import PolarGrid
from worlds.catalogue import make_world


@pytest.fixture(scope="module")
def world():
    """Return a maze."""
    return make_world("maze", 1, None)


def line(axes, label):
    """Return the points of a labelled line, shape (k, 2)."""
    (found,) = [each for each in axes.lines if each.get_label() == label]
    return np.column_stack(found.get_data())


def test_every_reason_and_class_has_a_colour():
    """Forbidden ground has a colour for each reason; free ground is transparent."""
    assert set(drives._REASON_COLOURS) == set(drives.Reason)
    transparent = [r for r, colour in drives._REASON_COLOURS.items() if colour.endswith("00000000")]
    assert transparent == [drives.Reason.FREE]


def test_forbidden_ground_lies_where_the_truth_has_it(world):
    """The picture's x is east and its y is north."""
    figure = drives.world_figure(world)
    above = figure.axes[0]
    image = above.images[-1]
    half_x, half_y = world.ground.width / 2, world.ground.depth / 2
    assert image.get_extent() == [-half_x, half_x, -half_y, half_y]
    assert image.origin == "lower"
    shown = image.get_array()
    np.testing.assert_array_equal(shown.data, world.truth.reason.T)
    np.testing.assert_array_equal(shown.mask, world.truth.reason.T == drives.Reason.FREE)


def test_the_legend_of_a_world_is_what_is_drawn_and_nothing_is_cut(world):
    """Reasons that are there, starts and goals, and walkers where there are some."""
    figure = drives.world_figure(replace(world, movers=(walker((1.0, 2.0)),)))
    there = [drives.Reason(value) for value in np.unique(world.truth.reason)]
    words = [drives._REASON_WORDS[each] for each in there if each is not drives.Reason.FREE]
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == [*words, "start", "goal", "walker"]
    FigureCanvasAgg(figure).draw()
    above, aslant = figure.axes
    shown = (above.title, above.xaxis.label, above.yaxis.label, aslant.title, *figure.legends)
    for text in shown:
        box = text.get_window_extent()
        assert min(box.x0, box.y0) >= 0
        assert box.x1 <= figure.bbox.x1
        assert box.y1 <= figure.bbox.y1


def test_a_panorama_shows_the_whole_world(world):
    """Each edge of the picture is paper, and a third of it is the world."""
    picture = drives.panorama(world, (180, 148))
    assert picture.shape == (148, 180, 3)
    rim = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
    assert (rim == 255).all()
    assert (picture != 255).any(axis=2).mean() > 0.33


def test_the_legend_of_a_drive_has_the_reasons_in_view():
    """A solid object far from the drive is not named."""
    world = make_world("maze", 1, None)
    reason = np.full_like(world.truth.reason, drives.Reason.FREE)
    reason[-4:, -4:], reason[reason.shape[0] // 2, reason.shape[1] // 2] = (
        drives.Reason.SOLID,
        drives.Reason.LOW,
    )
    world = replace(world, truth=replace(world.truth, reason=reason))
    figure = drives.drive_figure(world, np.zeros((2, 3)), [(1.0, 1.0)], "title")
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == [drives._REASON_WORDS[drives.Reason.LOW]]


def test_a_drive_shows_the_ways_of_walkers(world):
    """A line for each while it is there, and a disc where it is in the end."""
    rows = np.zeros((3, 2, 5))
    rows[:, 0, :2], rows[:, 0, 3] = [[0, 0], [1, 0], [2, 0]], 0.25
    rows[:2, 1, :2], rows[:2, 1, 3] = [[5, 5], [5, 6]], 0.3
    path = np.zeros((2, 3))
    figure = drives.drive_figure(world, path, [(8.0, -4.0)], "title", walkers=rows)
    (axes,) = figure.axes
    np.testing.assert_array_equal(line(axes, "walkers"), [[0, 0], [1, 0], [2, 0]])
    (disc,) = axes.patches
    assert (disc.center, disc.radius) == ((2.0, 0.0), 0.25)
    gone = [one for one in axes.lines if len(one.get_xdata()) == 3 and one.get_xdata()[0] == 5.0]
    assert np.isnan(gone[0].get_xdata()[2])


def test_a_world_shows_who_is_there_at_the_begin(world):
    """Walkers that come later are left out."""
    made = walker((1.0, 2.0), (1.0, 0.0)), walker((3.0, 4.0), appears_at=9.0)
    figure = drives.world_figure(replace(world, movers=made))
    circles = [each for each in figure.axes[0].patches if isinstance(each, Circle)]
    assert [each.center for each in circles] == [(1.0, 2.0)]


def test_a_drive_shows_its_path_goals_and_others(world):
    """All of the path and of the goals is in view, with equal scales."""
    path = np.array([[0.0, 0.0, 9.0], [5.0, 20.0, 9.0]])
    figure = drives.drive_figure(world, path, [(8.0, -4.0)], "title", {"oracle": path[:, :2] + 1})
    (axes,) = figure.axes
    np.testing.assert_allclose(line(axes, "driven"), path[:, :2])
    np.testing.assert_allclose(line(axes, "oracle"), path[:, :2] + 1)
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    assert x1 - x0 == pytest.approx(y1 - y0)
    assert x0 < 0 < 8 < x1
    assert y0 < -4 < 20 < y1


def test_a_failed_attempt_ends_in_a_cross(world):
    """Only attempts that missed their goal have a cross, at their last place."""

    def attempt(outcome, end):
        return SimpleNamespace(outcome=outcome, path=np.array([[0.0, 0.0, 0.0], [*end, 0.0]]))

    attempts = [attempt(Outcome.GOAL, (1, 2)), attempt(Outcome.TIMEOUT, (3, 4))]
    figure = drives.tests_figure(world, {"seed 0": attempts}, "title")
    crosses = [each for each in figure.axes[0].lines if each.get_marker() == "x"]
    assert [np.ravel(each.get_data()).tolist() for each in crosses] == [[3.0, 4.0]]


def test_a_sight_is_centred_on_its_robot(world):
    """The view reaches a little beyond the grid around the robot."""
    grid = PolarGrid()
    scan = SimpleNamespace(ranges=np.full(grid.n_sectors, 2.0, dtype=np.float32))
    pose = Pose.from_euler(np.array([3.0, -4.0, 0.0]), 0.0, 0.0, 0.5)
    figure = drives.sights_figure({"one": (world, pose, scan)}, grid)
    (axes,) = figure.axes
    reach = 1.1 * grid.outer_radius
    assert axes.get_xlim() == pytest.approx((3 - reach, 3 + reach))
    assert axes.get_ylim() == pytest.approx((-4 - reach, -4 + reach))


def test_a_failure_is_named_after_world_controller_and_goal(world, tmp_path):
    """The picture of a failure has a file name of its own, and both reaches."""
    grid = PolarGrid()
    failure = SimpleNamespace(
        world=world,
        attempt=SimpleNamespace(
            scenario="maze",
            contender="reactive",
            outcome="collision",
            path=np.zeros((2, 3)),
            detail=SimpleNamespace(world_seed=1, goal=2, cause="wall"),
        ),
        pose=Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0),
        scan=SimpleNamespace(ranges=np.full(grid.n_sectors, np.inf, dtype=np.float32)),
        goal=np.array([20.0, 0.0]),
        grid=grid,
        walkers=np.array([[[1.0, 2.0, 0.0, 0.3, 1.7]], [[1.5, 2.0, 0.0, 0.3, 1.7]]]),
    )
    name, data = drives.failure_picture(failure)
    assert (name, data[:4]) == ("maze_1_reactive_goal2.png", b"\x89PNG")
    figure = drives.failure_figure(failure, "title")
    for axes in figure.axes:
        (walker,) = axes.patches
        assert (walker.center, walker.radius) == ((1.5, 2.0), 0.3)
    left, right = figure.axes
    assert left.get_xlim() == pytest.approx((-24.0, 24.0))
    assert right.get_xlim() == pytest.approx((-6.0, 6.0))
