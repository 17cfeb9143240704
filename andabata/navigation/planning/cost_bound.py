"""Lower bound of the cost of the way between the robot and a cell, by which the search is guided.

The way is at least as long as the straight line, and a cell's length costs at least one. Most of
the square is unknown and costs more: of such ground the way crosses at least as much as lies
between the cell and an octagon around all that costs less.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel

_ASIDE = np.float32(0.4142)
"""Cost of a diagonal step beyond that of a straight one, rounded down: the sum of a way's costs is
rounded, and a bound must not exceed it."""

_ACROSS = np.float32(0.7071)
"""Cost for each line of the octagon's slanting sides that is crossed, rounded down."""

SIDES = 8
"""Number of an octagon's sides: least row, column, row + column and row - column, and greatest."""


class Bound(NamedTuple):
    """Numbers that the bound of a cell depends on, in the order of their use.

    Attributes:
        row: Row of the robot's cell.
        column: Column of the robot's cell.
        extra: Cost of a cell's length beyond the octagon that exceeds one.
        least: Least row, column, row + column and row - column of the octagon.
        greatest: Greatest of them.
    """

    row: int
    column: int
    extra: np.float32
    least: tuple[int, int, int, int]
    greatest: tuple[int, int, int, int]


@kernel
def surround(
    costs: NDArray[np.float32],
    unknown: float,
    first: NDArray[np.int64],
    octagon: NDArray[np.int64],
) -> None:
    """Write the octagon around the robot and all cells that cost less than unknown ones.

    It is a step larger: a step costs the mean of its cells, and the one into a cheap cell less than
    a step over unknown ground.

    Args:
        costs: Cost of a cell's length in each cell, float32, shape (n, n).
        unknown: Cost of a cell's length that all other cells cost at least.
        first: Cell of the robot, shape (2,).
        octagon: Result, shape (8,).
    """
    n, lowest = len(costs), np.float32(unknown)
    _enclose(octagon[:4], octagon[4:], first[0], first[1], True)
    for i in range(n):
        count = 0
        for j in range(n):
            count += costs[i, j] < lowest
        # Few rows have any; in these the outermost ones count.
        if count > 0:
            begin, end = 0, n - 1
            while not costs[i, begin] < lowest:
                begin += 1
            while not costs[i, end] < lowest:
                end -= 1
            _enclose(octagon[:4], octagon[4:], i, begin, False)
            _enclose(octagon[:4], octagon[4:], i, end, False)


@kernel
def _enclose(
    least: NDArray[np.int64], greatest: NDArray[np.int64], i: int, j: int, is_first: bool
) -> None:
    """Let an octagon enclose a cell and its neighbours, or these alone."""
    values, steps = (i, j, i + j, i - j), (1, 1, 2, 2)
    for side in range(4):
        low, high = values[side] - steps[side], values[side] + steps[side]
        least[side] = low if is_first else min(least[side], low)
        greatest[side] = high if is_first else max(greatest[side], high)


@inlined_kernel
def bound_of(first: NDArray[np.int64], octagon: NDArray[np.int64], unknown: float) -> Bound:
    """Return the numbers of a bound, which stay in registers.

    Args:
        first: Cell of the robot, shape (2,).
        octagon: Octagon as ``surround`` writes it, shape (8,).
        unknown: Least cost of a cell's length beyond it.
    """
    return Bound(
        first[0],
        first[1],
        np.float32(unknown - 1.0),
        (octagon[0], octagon[1], octagon[2], octagon[3]),
        (octagon[4], octagon[5], octagon[6], octagon[7]),
    )


@inlined_kernel
def least_cost(bound: Bound, row: int, column: int) -> float:
    """Return a cost that the way between the robot and a cell has at least.

    From a cell to its neighbour it changes by no more than the step between them costs.
    """
    rows, columns = row - bound.row, column - bound.column
    length = np.sqrt(np.float32(rows * rows + columns * columns))
    least, greatest = bound.least, bound.greatest
    rows = max(least[0] - row, row - greatest[0], 0)
    columns = max(least[1] - column, column - greatest[1], 0)
    total, apart = row + column, row - column
    slanting = max(least[2] - total, total - greatest[2], least[3] - apart, apart - greatest[3])
    beyond = max(max(rows, columns) + _ASIDE * min(rows, columns), _ACROSS * slanting)
    return length + bound.extra * np.float32(beyond)
