"""Features of each polar cell: the paper's five, the shape of the ground, and the neighbours'.

The paper's features are a principal component analysis of a cell's own points (Sanchez et al. 2023,
section 3.3). They cannot tell a drop, whose far side nobody sees, or a step between two cells. So
the ground's shape is looked at on the scale of a wheelbase around each quarter of a cell, and each
cell knows its neighbours' features (assumption).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.binning import fill_quarters, polar_tables
from traversability.cell_shape import FEW, describe_cells
from traversability.grid import PolarGrid

PAPER_FEATURES = ("roughness", "orientation", "planarity", "min_height", "height_difference")
"""The paper's five features."""

SHAPE_FEATURES = (
    "mean_above_lowest",
    "quarter_height",
    "tilt",
    "slope_max",
    "slope_mean",
    "step_max",
    "step_second",
    "step_mean",
    "above_plane",
    "below_plane",
    "lowest_around",
    "highest_around",
    "gap_after",
    "gap_after_mean",
    "gap_before",
    "bend",
    "rise_before",
    "rise_after",
    "distance",
    "bump",
    "bump_third",
    "bump_points",
    "spacing",
    "seen_beyond",
    "depth",
)
"""What a cell and the ground around it look like; bumps are searched for in near cells only.

Gaps are those over the median of the ring, ``spacing``, which is the laser's own; ``seen_beyond``
is the share of the sectors in which something is seen beyond the ring, ``depth`` how far outwards a
cell's points reach [m]."""

SHARED = (0, 1, 4, 6, 7, 8, 10, 12)
"""Features that neighbours tell each other, none of them negative: roughness, orientation, height
difference, quarter height, tilt, slope, step, mean step."""

CONTEXT = (
    "two_before",
    "before",
    "after",
    "two_after",
    "sides_low",
    "sides_high",
    "before_sides_low",
    "before_sides_high",
    "after_sides_low",
    "after_sides_high",
    "next_sides_high",
)
"""Where neighbours are: before and after on the way outwards, to the sides and beyond them; of two,
the lower and the higher value."""

OWN_FEATURES = PAPER_FEATURES + SHAPE_FEATURES

ALL_FEATURES = OWN_FEATURES + tuple(
    f"{place}:{OWN_FEATURES[number]}" for place in CONTEXT for number in SHARED
)
"""Names of all features, in the order of the last axis of ``CellFeatures.values``."""

NOTHING = np.float32(-1.0)
"""A neighbour's feature where there is no neighbour."""


@dataclass(frozen=True)
class CellFeatures:
    """What is known about each cell.

    Attributes:
        values: Features in the order of ``ALL_FEATURES``, float32, shape (n_sectors, n_rings, f);
            zero where a cell has fewer than three points.
        counts: Points of each cell, int32, shape (n_sectors, n_rings).
    """

    values: NDArray[np.float32]
    counts: NDArray[np.int32]


def cell_features(points: NDArray[np.float32], grid: PolarGrid) -> CellFeatures:
    """Return the features of each cell.

    The paper names its five features only; the formulas are an assumption:

    * roughness: ``sqrt(l3)``, the deviation from the cell's plane [m];
    * orientation: ``|n_z|`` of the plane's normal, 1 on level ground and 0 on a wall;
    * planarity: ``(l2 - l3) / l1``, 1 for a disc and 0 for a line or a ball;
    * minimum height above the base plane [m];
    * height difference between the highest and the lowest point [m].

    Args:
        points: Points in ``base_footprint`` [m], float32, shape (n, 3). Those beyond the rings, too
            high for the robot or not finite are left out.
        grid: The cells.

    Raises:
        ValueError: If ``points`` has another shape or type.
    """
    quarters = fill_quarters(points, grid)
    counts = np.empty((grid.n_sectors, grid.n_rings), dtype=np.int32)
    values = np.zeros((*counts.shape, len(ALL_FEATURES)), dtype=np.float32)
    means = np.empty((*quarters.sums.shape[:2], 6))
    planes = np.empty((*quarters.sums.shape[:2], 3))
    middles = polar_tables(grid).middles
    describe_cells(points, quarters.bins, quarters.sums, means, planes, counts, middles, values)
    for sector in range(grid.n_sectors):
        for ring in range(grid.n_rings):
            gather_neighbours(sector, ring, counts, values)
    return CellFeatures(values, counts)


@kernel
def gather_neighbours(sector, ring, counts, values):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Write the neighbours' features of a cell; their own must be there."""
    if counts[sector, ring] < FEW:
        return
    sectors, rings = counts.shape
    left = sector + 1 if sector + 1 < sectors else 0
    right = sector - 1 if sector > 0 else sectors - 1
    place = _OWN
    for offset in (-2, -1, 1, 2):
        here = ring + offset
        known = 0 <= here < rings and counts[sector, here] >= FEW
        for k in range(_SHARED):
            values[sector, ring, place + k] = values[sector, here, SHARED[k]] if known else NOTHING
        place += _SHARED
    for offset in (0, -1, 1):
        _of_two(left, right, ring + offset, counts, values, sector, ring, place, True)
        place += 2 * _SHARED
    left, right = (sector + 2) % sectors, (sector - 2) % sectors
    _of_two(left, right, ring, counts, values, sector, ring, place, False)


_OWN = len(OWN_FEATURES)
_SHARED = len(SHARED)


@kernel
def _of_two(left, right, there, counts, values, sector, ring, place, both):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the lower (if ``both``) and the higher of two cells' features from ``place`` on."""
    inside = 0 <= there < counts.shape[1]
    on_left = inside and counts[left, there] >= FEW
    on_right = inside and counts[right, there] >= FEW
    skip = _SHARED if both else 0
    for k in range(_SHARED):
        a = values[left, there, SHARED[k]] if on_left else NOTHING
        b = values[right, there, SHARED[k]] if on_right else NOTHING
        if both:
            values[sector, ring, place + k] = min(a, b) if on_left and on_right else max(a, b)
        values[sector, ring, place + skip + k] = max(a, b)
