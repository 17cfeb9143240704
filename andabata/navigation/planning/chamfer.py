"""Clearance from obstacles by the chamfer transform: diagonal steps count the root of two.

Two sweeps over the rows, each from the neighbours that it has passed (Borgefors 1986). A step along
a row would have to wait for the one before it; here all cells of the row take it at once, as often
as clearances reach, which gives the same sums to the last bit.
"""

import math

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel

_STRIDE = 3
"""Number of steps along a row that are taken between two visits to memory."""

_STRAIGHT, _DIAGONAL = np.float32(1.0), np.float32(math.sqrt(2.0))
"""Lengths of the steps to a cell's neighbours [cells]."""


@kernel
def inflate(clearance: NDArray[np.float32], far: float) -> NDArray[np.bool_]:
    """Lower the clearances around obstacles to the distance from the nearest.

    Args:
        clearance: Clearance [cells], 0 for obstacles and ``far`` for all else, changed in place,
            float32, shape (n, n).
        far: Distance from which on a clearance does not count [cells].

    Returns:
        True for the rows near obstacles, shape (n,): only there clearances are lowered.
    """
    n, reach = len(clearance), int(np.ceil(far)) - 1
    is_near = _near_obstacles(clearance, reach)
    # The columns beyond the square are as far from all as can be, and stay so.
    rows = np.full((3, n + 2 * _STRIDE), far, dtype=np.float32)
    for sweep in range(2):
        before, row, other = rows[0], rows[1], rows[2]
        before[:] = far
        for k in range(n):
            i = k if sweep == 0 else n - 1 - k
            # What is not near stays as it is; the last near row is too far off to lower the next.
            if not is_near[i]:
                continue
            _lower_from_row(clearance[i], before, row)
            for _ in range(-(-reach // (2 * _STRIDE))):
                if sweep == 0:
                    _lower_from_left(row, other)
                    _lower_from_left(other, row)
                else:
                    _lower_from_right(row, other)
                    _lower_from_right(other, row)
            for j in range(n):
                clearance[i, j] = row[j + _STRIDE]
            before, row = row, before
    return is_near


@kernel
def _near_obstacles(clearance: NDArray[np.float32], reach: int) -> NDArray[np.bool_]:
    """Return True for rows that are no farther than a reach from one with an obstacle."""
    n = len(clearance)
    is_near = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        count = 0
        for j in range(n):
            count += clearance[i, j] == 0.0
        if count > 0:
            is_near[max(i - reach, 0) : i + reach + 1] = True
    return is_near


@inlined_kernel
def _least(one: np.float32, other: np.float32) -> np.float32:
    """Return the lower of two numbers, by one instruction: ``min`` has to mind what is none."""
    return one if one < other else other


# Margins keep the indices below from being negative: numba looks up those that could be one by one.


@kernel
def _lower_from_row(
    cells: NDArray[np.float32], before: NDArray[np.float32], row: NDArray[np.float32]
) -> None:
    """Write a row's clearances, lowered from those of the row before, both between margins."""
    for j in range(len(cells)):
        aside = _least(before[j + _STRIDE - 1], before[j + _STRIDE + 1]) + _DIAGONAL
        ahead = before[j + _STRIDE] + _STRAIGHT
        row[j + _STRIDE] = _least(_least(ahead, aside), cells[j])


@kernel
def _lower_from_left(row: NDArray[np.float32], lowered: NDArray[np.float32]) -> None:
    """Write clearances lowered from the cells up to a stride before them, step by step."""
    for j in range(len(row) - 2 * _STRIDE):
        least = _least(row[j + 1], row[j] + _STRAIGHT)
        least = _least(row[j + 2], least + _STRAIGHT)
        lowered[j + _STRIDE] = _least(row[j + 3], least + _STRAIGHT)


@kernel
def _lower_from_right(row: NDArray[np.float32], lowered: NDArray[np.float32]) -> None:
    """Write clearances lowered from the cells up to a stride behind them, step by step."""
    for j in range(len(row) - 2 * _STRIDE):
        least = _least(row[j + 5], row[j + 6] + _STRAIGHT)
        least = _least(row[j + 4], least + _STRAIGHT)
        lowered[j + _STRIDE] = _least(row[j + 3], least + _STRAIGHT)
