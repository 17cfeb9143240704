"""Columns of a cell's own features, and the memory that they are written to."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from traversability.grid import PolarGrid

(
    ROUGHNESS,
    ORIENTATION,
    PLANARITY,
    MIN_HEIGHT,
    HEIGHT_DIFFERENCE,
    MEAN_ABOVE_LOWEST,
    QUARTER_HEIGHT,
    TILT,
    SLOPE_MAX,
    SLOPE_MEAN,
    STEP_MAX,
    STEP_SECOND,
    STEP_MEAN,
    ABOVE_PLANE,
    BELOW_PLANE,
    LOWEST_AROUND,
    HIGHEST_AROUND,
    GAP_AFTER,
    GAP_AFTER_MEAN,
    GAP_BEFORE,
    BEND,
    RISE_BEFORE,
    RISE_AFTER,
    DISTANCE,
    BUMP,
    BUMP_THIRD,
    BUMP_POINTS,
    SPACING,
    SEEN_BEYOND,
    DEPTH,
    SCATTER,
    SCATTER_LEAST,
    SMOOTH_STEP,
    COVER_67,
    COVER_100,
    COVER_133,
    COVER_200,
    COVER_300,
    COVER_OVER_QUARTILE,
    HEIGHT_LOW,
    HEIGHT_MEDIAN,
    HEIGHT_HIGH,
    MEAN_OVER_WAY,
    LOW_OVER_WAY,
) = range(44)
"""Columns of a cell's own features, in the order of ``features.OWN_FEATURES``."""

MIN_DESCRIBED = 3
"""Cells with fewer points have no features: three points make a plane."""

MAX_SLOPE = 3.0
"""Largest slope and gap that features hold: beyond, they carry no more information."""

LAYERS = 32
"""Number of layers of height over the ground that points are counted in."""


class CellWorkspace(NamedTuple):
    """Arrays that cell descriptions are written to; one instance serves all clouds of a robot.

    Attributes:
        counts: Number of points of each cell, int32, shape (n_sectors, n_rings).
        values: Features of each cell, own ones first, float32, shape (n_sectors, n_rings, f); left
            as they are where a cell has fewer than ``MIN_DESCRIBED`` points.
        means: Weight, mean x, y, z, lowest and highest z [m] of each quarter, float64, shape
            (2 n_sectors, 2 n_rings, 6).
        planes: Gradient along x and y and height at the origin [m] of the plane around each
            quarter, float64, shape (2 n_sectors, 2 n_rings, 3).
        scatter: Standard deviation of each quarter's heights along its plane [m], float64, shape
            (2 n_sectors, 2 n_rings).
        levels: Level of the ground under the mean point of each quarter [m], infinite where none
            is known, float64, shape (2 n_sectors, 2 n_rings).
        layers: Number of points of each cell by their height over the ground; see ``heights``.
            int32, shape (n_sectors, n_rings, LAYERS).
    """

    counts: NDArray[np.int32]
    values: NDArray[np.float32]
    means: NDArray[np.float64]
    planes: NDArray[np.float64]
    scatter: NDArray[np.float64]
    levels: NDArray[np.float64]
    layers: NDArray[np.int32]


def make_workspace(grid: PolarGrid, n_features: int) -> CellWorkspace:
    """Return a zeroed workspace for the cells of a grid.

    Args:
        grid: Polar grid of cells.
        n_features: Number of features of a cell.
    """
    sectors, rings = grid.n_sectors, grid.n_rings
    return CellWorkspace(
        counts=np.zeros((sectors, rings), dtype=np.int32),
        values=np.zeros((sectors, rings, n_features), dtype=np.float32),
        means=np.zeros((2 * sectors, 2 * rings, 6)),
        planes=np.zeros((2 * sectors, 2 * rings, 3)),
        scatter=np.zeros((2 * sectors, 2 * rings)),
        levels=np.zeros((2 * sectors, 2 * rings)),
        layers=np.zeros((sectors, rings, LAYERS), dtype=np.int32),
    )
