"""Bumps: points of near cells that rise over the plane of the ground around.

A rock that stops a wheel is low beside what a slope rises in a cell, and has few points beside the
cell's own: moments do not show it. One point over the plane is noise; the third highest of a
quarter is not.
"""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.cells.columns import BUMP, BUMP_POINTS, BUMP_THIRD, MIN_DESCRIBED, CellWorkspace
from traversability.cells.relief import FIRST, N_ABOVE, THIRD

BUMP_RANGE = 3.2
"""Cells whose middle is nearer than this are searched for bumps [m]."""


@kernel
def rings_with_bumps(middles: NDArray[np.float64]) -> int:
    """Return the number of rings that are searched for bumps.

    Args:
        middles: Middle of each ring [m], shape (n_rings,).
    """
    rings = 0
    while rings < len(middles) and middles[rings] < BUMP_RANGE:
        rings += 1
    return rings


@kernel
def write_bumps(tops: NDArray[np.float64], rings: int, cells: CellWorkspace) -> None:
    """Write to each near cell the highest bump of its quarters, and the points of all.

    Args:
        tops: Highest points of each quarter, as ``examine_relief`` returns them.
        rings: Number of rings that are written to.
        cells: Counts of the cells; bumps are written to their features.
    """
    columns = 2 * cells.counts.shape[1]
    for sector in range(cells.counts.shape[0]):
        for ring in range(rings):
            if cells.counts[sector, ring] < MIN_DESCRIBED:
                continue
            out = cells.values[sector, ring]
            out[BUMP] = out[BUMP_THIRD] = out[BUMP_POINTS] = 0.0
            for a in range(2):
                for b in range(2):
                    top = tops[(2 * sector + a) * columns + 2 * ring + b]
                    out[BUMP] = max(out[BUMP], top[FIRST])
                    out[BUMP_THIRD] = max(out[BUMP_THIRD], top[THIRD])
                    out[BUMP_POINTS] += top[N_ABOVE]
