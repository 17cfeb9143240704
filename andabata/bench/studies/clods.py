"""Measures how many low rocks the low obstacle layer finds among clods, and its false alarms.

``python -m andabata.bench.studies.clods`` prints a Markdown table: recall by the height of rocks,
one row a relief, and the false share of all cells. Ground, rocks and points are drawn at random,
and nothing drives: every rock is seen twice, as densely as from 2 m away. It is the layer's own
bound, without the ground classifier and the map; ``rocks`` measures those along drives.
"""

import argparse
import sys
import tomllib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from andabata.bench.table import Row, markdown_table
from andabata.navigation.planning.low_obstacle_layer import (
    LowObstacleLayer,
    LowObstacleLayerConfig,
)
from terrain.relief import roughness
from traversability.cartesian.elevation_grid import ElevationGrid

RELIEFS = (0.0, 0.01, 0.02, 0.03)
"""Standard deviations of the clods' heights [m]."""

HEIGHTS = (0.05, 0.06, 0.07, 0.08, 0.1, 0.12)
"""Heights of rocks [m]."""

_CELL, _GRID = 0.1, 0.05
"""Edges of the layer's cells and of the grid of the clods [m]."""

_HALF = 4.0
"""Half the edge of the square that has points [m], and the largest range of the layer."""

_BETWEEN = 1.2
"""Distance between neighbouring rocks [m]: none lies in the surroundings of another."""

_NEAR, _FAR = 1.0, 3.2
"""Distances from the robot between which rocks lie [m]."""

_SPACING, _NOISE, _CLOUDS = 0.045, 0.012, 2
"""Distance between points [m], standard deviation of their heights [m], and number of clouds."""

_BESIDE, _AWAY = 0.2, 0.35
"""Distance from a rock up to which a cell is its own, and from which it is a false alarm [m]."""


class Plot(NamedTuple):
    """A plot of rough ground with rocks on it.

    Attributes:
        clods: Heights of the ground on a grid [m], shape (n, n).
        rocks: x, y, height, and half-axes along x and y of half-buried ellipsoids [m], shape
            (k, 5).
    """

    clods: NDArray[np.float64]
    rocks: NDArray[np.float64]


class Tally(NamedTuple):
    """What the layer found on one plot.

    Attributes:
        heights: Heights of the rocks [m], shape (k,).
        is_found: True for each rock that it found, shape (k,).
        false_share: Share of all cells that are false alarms.
    """

    heights: NDArray[np.float64]
    is_found: NDArray[np.bool_]
    false_share: float


def draw_plot(relief: float, rng: np.random.Generator) -> Plot:
    """Return a plot with clods of a standard deviation [m] and rocks as wide as those of worlds."""
    n = round(2 * (_HALF + _GRID) / _GRID) + 1
    clods = relief * roughness((n, n), _GRID, rng)
    places = (np.indices((5, 5)).reshape(2, -1).T - 2) * _BETWEEN
    far = np.hypot(*places.T)
    places = places[(far > _NEAR) & (far < _FAR)]
    places += rng.uniform(-_CELL, _CELL, places.shape)
    heights = rng.choice(HEIGHTS, (len(places), 1))
    axes = heights * rng.uniform(0.7, 1.4, (len(places), 2))
    return Plot(clods, np.concatenate([places, heights, axes], axis=1))


def draw_cloud(plot: Plot, rng: np.random.Generator) -> NDArray[np.float32]:
    """Return points of a plot in random places, float32, shape (n, 3)."""
    places = rng.uniform(-_HALF, _HALF, (round((2 * _HALF / _SPACING) ** 2), 2))
    z = map_coordinates(plot.clods, (places.T + _HALF + _GRID) / _GRID, order=1)
    for x, y, height, *axes in plot.rocks:
        inside = 1.0 - (((places - [x, y]) / axes) ** 2).sum(axis=1)
        z += height * np.sqrt(np.maximum(inside, 0.0))
    z += rng.normal(0.0, _NOISE, len(z))
    return np.concatenate([places, z[:, None]], axis=1).astype(np.float32)


def tally(config: LowObstacleLayerConfig, relief: float, rng: np.random.Generator) -> Tally:
    """Return what the layer finds on a new plot.

    Args:
        config: Settings of the layer.
        relief: Standard deviation of the clods' heights [m].
        rng: Source of randomness.
    """
    plot = draw_plot(relief, rng)
    layer, elevation, here = LowObstacleLayer(_CELL, config), ElevationGrid(_CELL), np.zeros(2)
    for _ in range(_CLOUDS):
        elevation.describe(draw_cloud(plot, rng), here)
        layer.update(elevation, here)
    n = len(layer.heights)
    # The robot stands at the origin: cells beyond half of the window lie at negative places.
    cells = (np.argwhere(layer.heights) + n // 2) % n - n // 2
    beside = np.abs((cells[:, None] + 0.5) * _CELL - plot.rocks[:, :2]).max(axis=2)
    false = np.count_nonzero((beside > _AWAY).all(axis=1))
    ring = np.pi * (config.max_range**2 - config.min_range**2) / _CELL**2
    return Tally(plot.rocks[:, 2], (beside < _BESIDE).any(axis=0), false / ring)


def relief_row(config: LowObstacleLayerConfig, relief: float, plots: int) -> Row:
    """Return found rocks of all rocks by height, and the false share, over some plots."""
    tallies = [tally(config, relief, np.random.default_rng(seed)) for seed in range(plots)]
    heights = np.concatenate([each.heights for each in tallies])
    is_found = np.concatenate([each.is_found for each in tallies])
    row: Row = {"relief [m]": relief}
    for height in HEIGHTS:
        found = is_found[heights == height]
        row[f"{height} m"] = f"{found.sum()} of {len(found)}"
    row["false cells"] = float(np.mean([each.false_share for each in tallies]))
    return row


def main(argv: Sequence[str] | None = None) -> None:
    """Draw plots and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plots", type=int, default=30, help="Number of plots of each relief.")
    parser.add_argument(
        "--set", action="append", default=[], metavar="A=B", help="Setting of the layer, TOML."
    )
    options = parser.parse_args(argv)
    settings = tomllib.loads("\n".join(options.set))
    config = LowObstacleLayerConfig.model_validate(settings)
    rows = [relief_row(config, relief, options.plots) for relief in RELIEFS]
    sys.stdout.write(markdown_table(rows))


if __name__ == "__main__":
    main()
