"""Exact Euclidean distances to forbidden cells of a grid map, in time linear in its size."""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel


@kernel
def clearance_map(forbidden: NDArray[np.bool_], cell: float) -> NDArray[np.float32]:
    """Return the distance from the centre of each cell to that of the nearest forbidden one [m].

    First the distances along x, then for each row the lower envelope of the parabolas that these
    begin: distances are roots of whole numbers until they are scaled.

    Args:
        forbidden: Which cells are forbidden, shape (n, m).
        cell: Edge of a cell [m].

    Returns:
        Distances [m], float32, shape (n, m), 0 in forbidden cells; n + m cells in each if none is.

    Source: Meijster, Roerdink and Hesselink 2000, "A general algorithm for computing distance
    transforms in linear time".
    """
    n, m = forbidden.shape
    gaps = _gaps_along_x(forbidden)
    distances = np.empty((n, m), dtype=np.float32)
    # Parabolas of the envelope: the column of each one's apex, and the first column where it is
    # the lowest.
    apexes, begins = np.empty(m, dtype=np.int64), np.empty(m, dtype=np.int64)
    for i in range(n):
        squares = gaps[i] * gaps[i]
        last = apexes[0] = begins[0] = 0
        for j in range(1, m):
            # Parabolas that are above the new one already where they begin are never the lowest.
            while last >= 0:
                apart = begins[last] - apexes[last]
                height = apart * apart + squares[apexes[last]]
                if height <= (begins[last] - j) ** 2 + squares[j]:
                    break
                last -= 1
            if last < 0:
                last, apexes[0], begins[0] = 0, j, 0
                continue
            before = apexes[last]
            rise = j * j - before * before + squares[j] - squares[before]
            begin = 1 + rise // (2 * (j - before))
            if begin < m:
                last += 1
                apexes[last], begins[last] = j, begin
        for j in range(m - 1, -1, -1):
            square = (j - apexes[last]) ** 2 + squares[apexes[last]]
            distances[i, j] = np.sqrt(np.float64(square)) * cell
            if j == begins[last]:
                last -= 1
    return distances


@kernel
def _gaps_along_x(forbidden: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the distance along x to the nearest forbidden cell [cells], n + m at most."""
    n, m = forbidden.shape
    gaps = np.empty((n, m), dtype=np.int64)
    for j in range(m):
        gaps[0, j] = 0 if forbidden[0, j] else n + m
    # Row after row, so that all columns of a row are done at once.
    for i in range(1, n):
        for j in range(m):
            gaps[i, j] = 0 if forbidden[i, j] else min(gaps[i - 1, j] + 1, n + m)
    for i in range(n - 2, -1, -1):
        for j in range(m):
            gaps[i, j] = min(gaps[i, j], gaps[i + 1, j] + 1)
    return gaps
