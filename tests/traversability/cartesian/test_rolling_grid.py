"""The circular grid: cells keep their place in the frame, and those that enter are empty."""

import numpy as np
import pytest
from pydantic import BaseModel, ValidationError

from traversability.cartesian.rolling_grid import PowerOfTwo, RollingGrid, follow

CELL, N = 0.5, 8


def window(grid):
    """Return all cells of the window, counted from the origin of the frame, shape (n, n, 2)."""
    along = np.arange(-grid.n_cells // 2, grid.n_cells // 2)
    offsets = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1)
    return grid.centre + offsets


def number_of(cells):
    """Return a number of its own for each cell, never 0."""
    return (1000.0 + 32.0 * cells[..., 0] + cells[..., 1]).astype(np.float32)


def numbered(position):
    """Return a grid around a position, its one layer filled with the numbers of the cells."""
    grid = RollingGrid(CELL, N, ("number",))
    grid.follow(np.array(position))
    cells = window(grid)
    rows, columns = np.moveaxis(grid.wrap(cells), -1, 0)
    grid["number"][rows, columns] = number_of(cells)
    return grid


@pytest.mark.parametrize(
    ("shift", "kept"),
    [
        ((0, 0), 64),
        ((1, 0), 56),
        ((-1, 0), 56),
        ((0, 1), 56),
        ((0, -1), 56),
        ((3, -2), 5 * 6),
        ((-7, 7), 1),
        ((8, 0), 0),
        ((0, -8), 0),
        ((1000, 3), 0),
    ],
)
@pytest.mark.parametrize("start", [(0.0, 0.0), (-31.3, 17.9)])
def test_a_move_keeps_the_cells_of_both_windows_and_clears_the_others(start, shift, kept):
    """The old and the new window share (n - |dx|)(n - |dy|) cells, and no more are kept."""
    grid = numbered(start)
    before = window(grid).reshape(-1, 2).tolist()
    grid.follow(np.array(start) + CELL * np.array(shift))
    cells = window(grid).reshape(-1, 2)
    stored = grid["number"][tuple(grid.wrap(cells).T)]
    known = np.array([cell in before for cell in cells.tolist()])
    np.testing.assert_array_equal(stored, np.where(known, number_of(cells), 0.0))
    assert np.count_nonzero(grid.values) == kept


def test_the_window_goes_from_minus_half_to_just_below_plus_half():
    """A window of n cells contains the centre and one cell more below than above it."""
    grid = RollingGrid(CELL, N, ("a",))
    grid.follow(np.array([10 * CELL, -3.5 * CELL]))
    assert grid.centre.tolist() == [10, -4]
    np.testing.assert_allclose(grid.corner, [6 * CELL, -8 * CELL])


def test_the_window_takes_each_place_in_memory_once():
    """Wrapped indices of the window are all rows and columns, wherever it lies."""
    grid = RollingGrid(CELL, N, ("a",))
    for position in ([0.0, 0.0], [-7.7, 1234.5], [0.1, -0.1]):
        grid.follow(np.array(position))
        places = grid.wrap(window(grid)).reshape(-1, 2) @ [N, 1]
        assert sorted(places) == list(range(N * N))


def test_cells_are_counted_down_from_the_origin_too():
    """A position just below 0 lies in cell -1, stored in the last row."""
    grid = RollingGrid(CELL, N, ("a",))
    cells = grid.cells_of(np.array([[-0.01, 0.0], [0.49, 0.5], [-0.5, -0.51]]))
    assert cells.tolist() == [[-1, 0], [0, 1], [-1, -2]]
    assert grid.wrap(cells).tolist() == [[7, 0], [0, 1], [7, 6]]


def test_all_layers_roll_together_and_are_views_of_one_memory():
    """A layer is a view by name: what is written there is in ``values``."""
    grid = RollingGrid(CELL, N, ("points", "rise"))
    rise = grid["rise"]
    rise[0, 0] = 2.0
    assert np.shares_memory(rise, grid.values)
    assert grid.values[0, 0].tolist() == [0.0, 2.0]
    grid["points"][1, 0] = 3.0
    grid.follow(np.array([5 * CELL, 0.0]))  # Rows -4 to 0 leave.
    assert rise[0, 0] == 0.0
    assert grid["points"][1, 0] == 3.0
    assert grid.layers == ("points", "rise")


def test_a_reset_forgets_contents_and_centre():
    """After a reset the grid equals a new one."""
    grid = numbered((3.0, -4.0))
    grid.reset()
    assert not grid.values.any()
    assert grid.centre.tolist() == [0, 0]


def test_a_walk_of_small_steps_equals_one_leap():
    """Whatever the way, the window ends with what was never outside of it."""
    walked, leapt = numbered((0.0, 0.0)), numbered((0.0, 0.0))
    for step in range(1, 5):
        walked.follow(CELL * np.array([step, -step / 2]))
    leapt.follow(CELL * np.array([4, -2]))
    np.testing.assert_array_equal(walked.values, leapt.values)
    np.testing.assert_array_equal(walked.centre, leapt.centre)


def test_the_kernel_moves_plain_arrays_too():
    """``follow`` takes arrays of one number a cell."""
    values, centre = np.ones((N, N), np.float32), np.zeros(2, np.int64)
    follow(values, centre, np.array([CELL, 0.0]), CELL)
    assert np.flatnonzero((values == 0).all(axis=1)).tolist() == [4]  # Cell 4 replaces cell -4.
    assert np.count_nonzero(values == 0) == N
    assert centre.tolist() == [1, 0]


def test_bad_input_is_refused():
    """Errors name what was expected and what came."""
    for n_cells in (0, -4, 6, 100):
        with pytest.raises(ValueError, match=f"expected a power of 2, got {n_cells}"):
            RollingGrid(CELL, n_cells, ("a",))
    with pytest.raises(ValueError, match="expected an edge above 0 m, got 0"):
        RollingGrid(0.0, N, ("a",))
    for layers in ((), ("a", "a")):
        with pytest.raises(ValueError, match="expected one or more names, each once"):
            RollingGrid(CELL, N, layers)
    with pytest.raises(KeyError, match="expected one of a, b, got 'c'"):
        RollingGrid(CELL, N, ("a", "b"))["c"]


def test_a_configured_number_of_cells_is_a_power_of_two():
    """A config field of type ``PowerOfTwo`` refuses other numbers."""

    class Config(BaseModel):
        cells: PowerOfTwo

    assert Config(cells=256).cells == 256
    with pytest.raises(ValidationError, match="expected a power of 2, got 200"):
        Config(cells=200)
