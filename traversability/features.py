"""Features of each polar cell: the paper's five, the shape of the ground, and the neighbours'.

The paper's features are a principal component analysis of a cell's own points (Sanchez et al. 2023,
section 3.3). They do not show a drop, whose far side no beam reaches, or a step between two cells.
So the ground's shape is measured on the scale of a wheelbase around each quarter of a cell, and
features of the neighbouring cells are added (assumption).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.binning import fill_quarters, polar_tables
from traversability.cells.columns import (
    COVER_100,
    COVER_OVER_QUARTILE,
    HEIGHT_DIFFERENCE,
    MIN_DESCRIBED,
    ORIENTATION,
    QUARTER_HEIGHT,
    ROUGHNESS,
    SCATTER,
    SLOPE_MAX,
    STEP_MAX,
    STEP_MEAN,
    TILT,
    make_workspace,
)
from traversability.cells.shape import describe_cells
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
"""Shape of a cell and of the ground around it; bumps are searched for in near cells only.

Gaps are those over the median of the ring, ``spacing``, which is the laser's own; ``seen_beyond``
is the share of the sectors with points beyond the ring, ``depth`` the extent of a cell's points
outwards [m]."""

HEIGHT_FEATURES = (
    "scatter",
    "scatter_least",
    "smooth_step",
    "cover_67",
    "cover_100",
    "cover_133",
    "cover_200",
    "cover_300",
    "cover_over_quartile",
    "height_low",
    "height_median",
    "height_high",
    "mean_over_way",
    "low_over_way",
)
"""Scatter about the ground, steps between smooth parts, and heights over the local ground.

``cover_133`` is the share of a cell's points more than 133 % of the plants' limit over the ground,
``cover_over_quartile`` that of points more than the limit over the cell's own lower quartile;
heights are in limits. Those over the way are in metres over the ground that is extrapolated from
nearer rings."""

SHARED = (
    ROUGHNESS,
    ORIENTATION,
    HEIGHT_DIFFERENCE,
    QUARTER_HEIGHT,
    TILT,
    SLOPE_MAX,
    STEP_MAX,
    STEP_MEAN,
    SCATTER,
    COVER_100,
    COVER_OVER_QUARTILE,
)
"""Columns of the features that a cell takes over from its neighbours, none of them negative."""

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
"""Positions of neighbours: before and after along the sector, in the sectors to both sides,
and in the next ones to both sides; of two cells, the lower and the higher value of a feature."""

OWN_FEATURES = PAPER_FEATURES + SHAPE_FEATURES + HEIGHT_FEATURES
"""Names of a cell's own features, in the order of the columns of ``cells.columns``."""

ALL_FEATURES = OWN_FEATURES + tuple(
    f"{place}:{OWN_FEATURES[number]}" for place in CONTEXT for number in SHARED
)
"""Names of all features, in the order of the last axis of ``CellFeatures.values``."""

NO_NEIGHBOUR = np.float32(-1.0)
"""Value of a neighbour's feature if there is no neighbour."""

_N_OWN = len(OWN_FEATURES)
_N_SHARED = len(SHARED)


@dataclass(frozen=True)
class CellFeatures:
    """Features and number of points of each cell.

    Attributes:
        values: Features in the order of ``ALL_FEATURES``, float32, shape (n_sectors, n_rings, f);
            zero where a cell has fewer than three points.
        counts: Number of points of each cell, int32, shape (n_sectors, n_rings).
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
        grid: Polar grid of cells.

    Raises:
        ValueError: If ``points`` has another shape or type.
    """
    quarters = fill_quarters(points, grid)
    cells = make_workspace(grid, len(ALL_FEATURES))
    tables = polar_tables(grid)
    describe_cells(quarters, tables.middles, tables.halves, grid.max_traversable_vegetation, cells)
    for sector in range(grid.n_sectors):
        for ring in range(grid.n_rings):
            gather_neighbours(sector, ring, cells.counts, cells.values)
    return CellFeatures(cells.values, cells.counts)


@kernel
def gather_neighbours(
    sector: int, ring: int, counts: NDArray[np.int32], values: NDArray[np.float32]
) -> None:
    """Write the neighbours' features of one cell; the own features of all cells must be there.

    Args:
        sector: Sector of the cell.
        ring: Ring of the cell.
        counts: Number of points of each cell, shape (n_sectors, n_rings).
        values: Features of each cell, changed in place, shape (n_sectors, n_rings, f).
    """
    if counts[sector, ring] < MIN_DESCRIBED:
        return
    sectors, rings = counts.shape
    place = _N_OWN
    # Single cells along the sector, two before to two after.
    for offset in (-2, -1, 1, 2):
        here = ring + offset
        known = 0 <= here < rings and counts[sector, here] >= MIN_DESCRIBED
        for k in range(_N_SHARED):
            value = values[sector, here, SHARED[k]] if known else NO_NEIGHBOUR
            values[sector, ring, place + k] = value
        place += _N_SHARED
    # Pairs to the left and right, beside the cell, before it and after it.
    left = sector + 1 if sector + 1 < sectors else 0
    right = sector - 1 if sector > 0 else sectors - 1
    out = values[sector, ring]
    for offset in (0, -1, 1):
        _gather_pair(left, right, ring + offset, counts, values, out[place:], True)
        place += 2 * _N_SHARED
    left, right = (sector + 2) % sectors, (sector - 2) % sectors
    _gather_pair(left, right, ring, counts, values, out[place:], False)


@kernel
def _gather_pair(
    left: int,
    right: int,
    ring: int,
    counts: NDArray[np.int32],
    values: NDArray[np.float32],
    out: NDArray[np.float32],
    both: bool,
) -> None:
    """Write the lower and the higher value of two cells' features, or the higher alone.

    Args:
        left: Sector of one cell.
        right: Sector of the other cell.
        ring: Ring of both; it need not exist.
        counts: Number of points of each cell.
        values: Features of each cell.
        out: Output, the lower values (if ``both``), then the higher ones.
        both: True if the lower values are written, too.
    """
    inside = 0 <= ring < counts.shape[1]
    on_left = inside and counts[left, ring] >= MIN_DESCRIBED
    on_right = inside and counts[right, ring] >= MIN_DESCRIBED
    skip = _N_SHARED if both else 0
    for k in range(_N_SHARED):
        a = values[left, ring, SHARED[k]] if on_left else NO_NEIGHBOUR
        b = values[right, ring, SHARED[k]] if on_right else NO_NEIGHBOUR
        # A missing cell counts as -1, less than any value: it must not become the lower one.
        if both:
            out[k] = min(a, b) if on_left and on_right else max(a, b)
        out[skip + k] = max(a, b)
