"""Two truths of labelled cells."""

import numpy as np
import pytest

from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.two_truths import FIRST, SECOND, has_step, truth_scores, two_truths

GRID, STEP = PolarGrid(), 0.05


def cell_points(heights):
    """Return points of one cell, 2 m ahead, at given heights [m]."""
    return np.column_stack(
        [np.full(len(heights), 2.0), np.full(len(heights), 0.1), heights]
    ).astype(np.float32)


def states(heights, bad=None, known=None):
    """Return the state of the cell by both truths."""
    bad = np.zeros(len(heights), bool) if bad is None else bad
    known = np.ones(len(heights), bool) if known is None else known
    found = two_truths(cell_points(heights), bad, known, GRID, STEP)
    assert (found.first != CellState.EMPTY).sum() <= 1
    return found.first.max(), found.second.max()


def by_the_book(f, max_step):
    """Return whether the heights of one cell hold a step, one cell at a time."""
    if len(f) < 10:
        return False
    f = np.sort(f)
    gap, margin = np.diff(f), len(f) // 5
    j = int(np.argmax(gap[margin:-margin])) + margin
    low, high = f[: j + 1], f[j + 1 :]
    rise = np.median(high) - np.median(low)
    return rise >= max_step and low.std() < rise / 4 and high.std() < rise / 4


@pytest.mark.parametrize(
    ("share", "first", "second"),
    [
        (0.0, CellState.TRAVERSABLE, CellState.TRAVERSABLE),
        (0.02, CellState.TRAVERSABLE, CellState.TRAVERSABLE),
        (0.03, CellState.TRAVERSABLE, CellState.EMPTY),
        (0.14, CellState.TRAVERSABLE, CellState.EMPTY),
        (0.15, CellState.NON_TRAVERSABLE, CellState.NON_TRAVERSABLE),
        (1.0, CellState.NON_TRAVERSABLE, CellState.NON_TRAVERSABLE),
    ],
)
def test_the_share_of_bad_points_decides(share, first, second):
    """From 15 % on a cell is blocked in both truths; 3 to 15 % are left out of the second."""
    assert states(np.zeros(100), np.arange(100) < round(100 * share)) == (first, second)


def test_a_step_between_smooth_levels_leaves_a_free_cell_out():
    """A kerb from the limit on is left out of the second truth; a lower one, or a slope, is not."""
    for step, second in ((0.06, CellState.EMPTY), (0.04, CellState.TRAVERSABLE)):
        assert states(np.repeat([0.0, step], 20)) == (CellState.TRAVERSABLE, second)
    assert states(np.linspace(0, 0.5, 40)) == (CellState.TRAVERSABLE, CellState.TRAVERSABLE)


def test_a_step_in_a_blocked_cell_changes_nothing():
    """Blocked cells stay in the second truth, with a step of their free points or without."""
    heights, bad = np.repeat([0.0, 0.2], 20), np.arange(40) % 4 == 0
    assert states(heights, bad) == (CellState.NON_TRAVERSABLE, CellState.NON_TRAVERSABLE)


def test_steps_are_those_of_each_cell_by_itself():
    """Any heights in any order give the steps of the rule applied to one cell after the other."""
    rng = np.random.default_rng(0)
    cell = rng.integers(0, 60, 2000)
    cell[cell == 7] = 8
    heights = 0.02 * rng.standard_normal(2000) + rng.uniform(0, 0.3, 60)[cell] * rng.integers(
        0, 2, 2000
    )
    expected = [by_the_book(heights[cell == k], STEP) for k in range(60)]
    assert has_step(heights, cell, 60, STEP).tolist() == expected
    assert 5 < sum(expected) < 55
    assert not has_step(np.zeros(0), np.zeros(0, np.int64), 3, STEP).any()


def test_cells_with_few_labelled_points_are_not_judged():
    """Half of the points, and the grid's least number, have to be labelled; others count not."""
    known = np.arange(20) < 10
    assert states(np.zeros(20), known=known)[0] == CellState.TRAVERSABLE
    assert states(np.zeros(21), known=np.arange(21) < 10)[0] == CellState.EMPTY
    assert states(np.zeros(4))[0] == CellState.EMPTY
    assert states(np.zeros(20), ~known, known)[0] == CellState.TRAVERSABLE


def test_points_above_the_robot_do_not_count():
    """Bad points higher than the grid's height over the base plane do not block."""
    heights = np.concatenate([np.zeros(20), np.full(20, GRID.max_height + 0.1)])
    assert states(heights, heights > 1)[0] == CellState.TRAVERSABLE
    assert states(heights - 0.2, heights > 1)[0] == CellState.NON_TRAVERSABLE


def test_labels_of_another_length_are_refused():
    """A wrong number of labels is an error that names the column."""
    points = cell_points(np.zeros(5))
    with pytest.raises(ValueError, match="bad: expected shape"):
        two_truths(points, np.zeros(4, bool), np.ones(5, bool), GRID, STEP)
    with pytest.raises(ValueError, match="known: expected shape"):
        two_truths(points, np.zeros(5, bool), np.ones(6, bool), GRID, STEP)


def test_scores_are_given_for_both_truths():
    """A false alarm in a cell that the second truth leaves out counts in the first alone."""
    free, blocked, empty = (int(state) for state in (1, 2, 0))
    first, second = np.uint8([[free, blocked]]), np.uint8([[empty, blocked]])
    scores = truth_scores(first, second, np.uint8([[blocked, blocked]]))
    assert [scores[name]["precision"] for name in (FIRST, SECOND)] == [0.5, 1.0]
