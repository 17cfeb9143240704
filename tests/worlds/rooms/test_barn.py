"""Fields of cylinders after the rules of BARN: grids, ways, paths, and the same for a seed."""

import numpy as np
import pytest
from scipy.ndimage import label

from worlds.rooms import barn
from worlds.rooms.barn import (
    MIDDLE,
    NARROW,
    PUBLISHED,
    RADIUS,
    TASK,
    BarnFieldConfig,
    BarnWorld,
    barn_room,
    barn_world,
)
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import Room, free_places

SEEDS = range(6)


def grid(world):
    """Return the filled cells of a world's field, from its circles, shape (30, 30)."""
    cells = np.round((world.room.circles[:, :2] - (-2.175, -1.825)) / 0.15).astype(int)
    found = np.zeros((30, 30), bool)
    inside = cells[cells[:, 1] >= 0]
    found[tuple(inside.T)] = True
    return found


def widest(cells):
    """Return the width of the widest square of free cells that passes a field [cells]."""
    for width in range(1, 30):
        free = np.pad(~cells, ((0, 0), (width, width)), constant_values=True)
        windows = np.lib.stride_tricks.sliding_window_view(free, (width, width))
        regions, _ = label(windows.all(axis=(2, 3)), np.ones((3, 3)))
        if not set(regions[:, 0]) & set(regions[:, -1]) - {0}:
            return width - 1
    return 29


@pytest.mark.parametrize("seed", SEEDS)
def test_a_square_of_five_cells_passes_each_field(seed):
    """The first and the last row are walls, and what is between lets the square through."""
    cells = grid(barn_world(seed))
    assert cells[[0, -1]].all()
    assert widest(cells) >= 5


@pytest.mark.parametrize("seed", SEEDS[:3])
def test_the_widest_way_of_harder_fields_is_four_cells(seed):
    """Four free cells pass, five do not: 0.60 m."""
    assert widest(grid(barn_world(seed, NARROW))) == 4


def test_smoothed_cells_have_the_neighbours_that_the_rules_ask_for():
    """Once smoothed, no cell with 5 filled neighbours is free where the rules ask for 5 of 5."""
    config = BarnFieldConfig(fills=(0.25,), smoothings=(30,), passage=1)
    cells = grid(barn_world(0, config))
    around = sum(
        np.roll(np.pad(cells, 1), (i, j), (0, 1))[1:-1, 1:-1]
        for i in (-1, 0, 1)
        for j in (-1, 0, 1)
        if (i, j) != (0, 0)
    )[1:-1]
    inner = cells[1:-1]
    # Thirty times is enough to come to rest.
    assert inner[around >= 5].all()
    assert not inner[around <= 1].any()


def test_corridor_field_and_task_are_where_the_benchmark_has_them():
    """In its own frame: walls from y = 0.075 to 9.525, start (-2.25, 3), goal 10 m ahead."""
    circles = barn_world(0).room.circles
    np.testing.assert_allclose(circles[:, :2].min(axis=0) + MIDDLE, (-4.425, 0.075))
    np.testing.assert_allclose(circles[:, :2].max(axis=0) + MIDDLE, (-0.075, 9.525))
    assert (circles[:, 2] == RADIUS).all()
    assert (TASK.start.x + MIDDLE[0], TASK.start.y + MIDDLE[1]) == (-2.25, 3.0)
    assert TASK.goal == (TASK.start.x, TASK.start.y + 10.0)
    assert len(np.unique(circles, axis=0)) == len(circles)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_path_is_free_and_crosses_the_field(seed):
    """It begins in the first column, ends in the last, and keeps 0.3 m clear of everything."""
    world = barn_world(seed)
    assert world.path[0, 1] == pytest.approx(-1.825)
    assert world.path[-1, 1] == pytest.approx(2.525)
    # A square of five cells has 0.375 m around its middle, a cylinder at its corner 0.35 m.
    assert world.room.clearance(world.path).min() > 0.3
    assert np.hypot(*np.diff(world.path, axis=0).T).max() < 0.22
    assert world.optimal_time >= 5.0


def test_the_optimal_time_is_that_of_a_known_way():
    """Start, a place 3 m aside half the way, goal: 11.66 m at 2 m/s."""
    room = Room("r", (5.0, 7.0), np.zeros((0, 4)), np.zeros((0, 3)), (TASK,))
    world = BarnWorld(room, np.array([[3.0, 1.0]]))
    assert world.optimal_time == pytest.approx(2 * np.hypot(3, 5) / 2)


def test_the_same_seed_is_the_same_field():
    """Circles and path to the bit; another seed differs."""
    one, same, other = barn_world(3), barn_world(3), barn_world(4)
    np.testing.assert_array_equal(one.room.circles, same.room.circles)
    np.testing.assert_array_equal(one.path, same.path)
    assert one.room.circles.shape != other.room.circles.shape


def test_rooms_to_train_in_are_closed_and_have_names():
    """The catalogue has both kinds, with the same cylinders and walls around."""
    room = make_room("barn-2")
    np.testing.assert_array_equal(room.circles, barn_world(2).room.circles)
    assert (room.name, len(room.boxes), room.tasks) == ("barn-2", 4, (TASK,))
    assert make_room("barn-narrow-2").name == "barn-narrow-2"
    places = free_places(barn_room(2), 0.2, 0.3)
    for place in ((TASK.start.x, TASK.start.y), TASK.goal):
        assert np.hypot(*(places - place).T).min() < 0.05


def test_rules_that_no_field_meets_are_refused(monkeypatch):
    """More filled than can be passed."""
    monkeypatch.setattr(barn, "_ATTEMPTS", 5)
    config = PUBLISHED.model_copy(update={"fills": (1.0,)})
    with pytest.raises(ValueError, match="expected a field that 5 free cells can pass"):
        barn_world(0, config)
