"""Two truths of labelled cells: all of them, and those alone that the labels decide.

Labels of points say what a thing is, not whether a wheel climbs it: a free cell may hold a kerb
that stops the robot, or the edge of a bush. The second truth leaves such cells out.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from traversability.binning import cells_of_quarters, fill_quarters
from traversability.grid import PolarGrid
from traversability.labels import MIN_SHARE, CellState
from traversability.scores import CellScores

DOUBT_SHARE = 0.03
"""Share of bad points from which on a free cell is a doubtful one."""

_KNOWN_SHARE = 0.5
"""Share of a cell's points that have to be labelled."""

_STEP_POINTS = 10
"""Number of free points from which on a step is searched for."""

_GROUP_SHARE = 5
"""A group above or below a step holds at least one in so many of the cell's free points."""

_SMOOTH = 4.0
"""Ratio of a step to the largest standard deviation of height of the groups that it parts."""

FIRST, SECOND = "points_15_percent", "steps_and_doubt_left_out"
"""Names of the two truths."""

TRUTH_NAMES = {FIRST: "15 % of points", SECOND: "no steps, no doubt"}
"""Short names of the two truths in tables."""


class TwoTruths(NamedTuple):
    """True states of the cells of a cloud by two truths.

    Attributes:
        first: ``CellState`` of each cell, non-traversable from ``MIN_SHARE`` of bad points on,
            ``EMPTY`` where too few of its points are labelled; uint8, shape (n_sectors, n_rings).
        second: ``CellState`` of each cell as in ``first``, ``EMPTY`` also where a free cell holds a
            step or is doubtful.
    """

    first: NDArray[np.uint8]
    second: NDArray[np.uint8]


def two_truths(
    points: NDArray[np.float32],
    bad: NDArray[np.bool_],
    known: NDArray[np.bool_],
    grid: PolarGrid,
    max_step: float,
) -> TwoTruths:
    """Return the true states of cells by both truths.

    Points up to the grid's ``max_height`` over the base plane count, whatever its cut.

    Args:
        points: Points in ``base_footprint`` [m], float32, shape (n, 3).
        bad: True for points of something that the robot must not drive on, shape (n,).
        known: True for labelled points, shape (n,).
        grid: Polar grid of cells.
        max_step: Largest step that the robot climbs [m].

    Raises:
        ValueError: If the numbers of labels and points differ.
    """
    for name, column in (("bad", bad), ("known", known)):
        if column.shape != (len(points),):
            raise ValueError(f"{name}: expected shape {(len(points),)}, got {column.shape}")
    over_base = grid.model_copy(update={"cut": "base"})
    quarters = fill_quarters(points, over_base).bins[: len(points)]
    inside = quarters >= 0
    cell = cells_of_quarters(grid)[quarters[inside]]
    bad, known = bad[inside], known[inside]
    size = grid.n_sectors * grid.n_rings
    labelled = np.bincount(cell[known], minlength=size)
    share = np.bincount(cell[known & bad], minlength=size) / np.maximum(labelled, 1)
    judged = (labelled >= grid.min_points) & (
        labelled >= _KNOWN_SHARE * np.bincount(cell, minlength=size)
    )
    blocked = share >= MIN_SHARE
    free = known & ~bad
    stepped = has_step(points[inside, 2][free].astype(np.float64), cell[free], size, max_step)
    doubtful = ~blocked & (stepped | (share >= DOUBT_SHARE))
    states = np.where(blocked, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE).astype(np.uint8)
    first = np.where(judged, states, CellState.EMPTY).astype(np.uint8)
    second = np.where(doubtful, CellState.EMPTY, first).astype(np.uint8)
    shape = (grid.n_sectors, grid.n_rings)
    return TwoTruths(first.reshape(shape), second.reshape(shape))


def has_step(
    heights: NDArray[np.float64], cell: NDArray[np.int64], n_cells: int, max_step: float
) -> NDArray[np.bool_]:
    """Return which cells hold two smooth levels with a step between them, bool, shape (n_cells,).

    The levels are parted at the widest gap of the sorted heights that leaves a fifth of the points
    on each side. Each has a standard deviation below a quarter of the step between their medians.

    Args:
        heights: Heights of the points [m], shape (n,).
        cell: Cell of each point, shape (n,).
        n_cells: Number of cells.
        max_step: Step from which on a cell counts [m].
    """
    is_stepped = np.zeros(n_cells, dtype=np.bool_)
    order = np.lexsort((heights, cell))
    z, cell = heights[order], cell[order]
    begin = np.searchsorted(cell, np.arange(n_cells))
    count = np.bincount(cell, minlength=n_cells)
    chosen = np.flatnonzero(count >= _STEP_POINTS)
    if not len(chosen):
        return is_stepped
    first, n = begin[chosen], count[chosen]
    cut = _widest_gap(z, first, n)
    rise = _median(z, cut + 1, first + n) - _median(z, first, cut + 1)
    low, high = _deviation(z, first, cut + 1), _deviation(z, cut + 1, first + n)
    is_stepped[chosen] = (rise >= max_step) & (np.maximum(low, high) < rise / _SMOOTH)
    return is_stepped


def _widest_gap(
    z: NDArray[np.float64], first: NDArray[np.int64], n: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the index of the last height below the widest gap of each group, shape (g,).

    Args:
        z: Heights, sorted within each group [m], shape (m,).
        first: Index of each group's first height, shape (g,).
        n: Number of heights of each group, shape (g,).
    """
    gaps = np.diff(z, append=np.inf)
    margin = n // _GROUP_SHARE
    begin, end = first + margin, first + n - 1 - margin
    groups = np.repeat(np.arange(len(first)), end - begin)
    places = np.arange(len(groups)) - np.repeat(np.cumsum(end - begin) - (end - begin), end - begin)
    places += begin[groups]
    # By group, then by falling gap; of equal gaps the first one.
    order = np.lexsort((places, -gaps[places], groups))
    return np.asarray(places[order][np.searchsorted(groups, np.arange(len(first)))])


def _median(
    z: NDArray[np.float64], begin: NDArray[np.int64], end: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the medians of sorted stretches of heights [m], shape (g,)."""
    n = end - begin
    return np.asarray((z[begin + (n - 1) // 2] + z[begin + n // 2]) / 2)


def _deviation(
    z: NDArray[np.float64], begin: NDArray[np.int64], end: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the standard deviations of stretches of heights [m], shape (g,)."""
    n = end - begin
    groups = np.repeat(np.arange(len(n)), n)
    places = np.arange(len(groups)) - np.repeat(np.cumsum(n) - n, n) + begin[groups]
    values = z[places]
    mean = np.bincount(groups, values, len(n)) / n
    return np.asarray(np.sqrt(np.bincount(groups, (values - mean[groups]) ** 2, len(n)) / n))


def truth_scores(
    first: NDArray[np.uint8], second: NDArray[np.uint8], called: NDArray[np.uint8]
) -> dict[str, Any]:
    """Return the scores of both truths by name, ready for JSON.

    Args:
        first: True states by the first truth, any shape.
        second: True states by the second truth, the same shape.
        called: Predicted states, the same shape.
    """
    pairs = {FIRST: first, SECOND: second}
    return {name: CellScores.of(truth, called).as_dict() for name, truth in pairs.items()}


def truth_lines(truths: Mapping[str, Any]) -> list[str]:
    """Return a table of the scores by the two truths, side by side."""
    names = {"precision": "precision", "recall": "recall", "specificity": "specificity"}
    names["f1_red"] = "F1"
    lines = [f"{'truth':20}" + "".join(f"{name:>13}" for name in names.values())]
    for truth, scores in truths.items():
        row = "".join(f"{_share(scores[name]):>13}" for name in names)
        lines.append(f"  {TRUTH_NAMES[truth]:18}{row}")
    return lines


def _share(share: float) -> str:
    """Return a share in three digits, "none" for NaN."""
    return "none" if np.isnan(share) else f"{share:.3f}"
