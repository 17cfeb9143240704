"""Occupancy grid: log odds of each cell around the robot, from scans, layers and driving."""

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planning.cartesian_layers import CartesianLayers
from andabata.navigation.planning.low_obstacle_layer import LowObstacleLayer
from andabata.navigation.planning.occupancy_config import OccupancyGridConfig
from andabata.navigation.planning.occupancy_layers import (
    LowObstacles,
    Stance,
    add_low_obstacles,
    drive_over,
    take_ground,
    vacate,
)
from andabata.navigation.planning.occupancy_scan import Gains, add_scan, polar_cells
from terrain.kernel import kernel
from traversability.cartesian.rolling_grid import RollingGrid
from traversability.grid import PolarGrid

_RIM = 0.02
"""Distance by which the body stands on cells inside of its sides, so that they are free [m]."""

_BODY_RANGE = 0.6
"""Range below which remembered obstacles end no range: the robot would stand in them [m]."""


class OccupancyGrid:
    """Remembers what was seen in a square that moves with the robot, in ``odom``.

    Attributes:
        config: Settings.
        log_odds: Log odds of each cell for an obstacle; 0 where nothing was seen. Wrapped around,
            float32, shape (n, n).
        driven_radius: Distance from the robot's middle within which ground counts as driven [m].
    """

    def __init__(self, grid: PolarGrid, config: OccupancyGridConfig, robot_width: float) -> None:
        """Begin empty.

        Args:
            grid: Polar grid of the scans.
            config: Settings.
            robot_width: Width of the body [m].
        """
        self.config = config
        self._bearings = grid.bearings
        self._rolling = RollingGrid(config.cell, config.cells, ("log_odds",))
        self.log_odds = self._rolling["log_odds"]
        self.driven_radius = robot_width / 2 - _RIM
        self._no_ground = np.zeros((config.cells, config.cells), dtype=np.float32)
        self._polar = polar_cells(grid, config)
        self._gains = Gains(
            blocked=config.blocked_gain,
            free=config.free_gain,
            unknown=config.unknown_gain,
            certain_blocked=config.certain_blocked,
            certain_free=config.certain_free,
            max_log_odds=config.max_log_odds,
        )
        self.reset()

    @property
    def centre(self) -> NDArray[np.int64]:
        """Cell of the robot, counted from the origin of ``odom``, shape (2,)."""
        return self._rolling.centre

    def reset(self) -> None:
        """Forget everything."""
        self._rolling.reset()

    def update(
        self,
        odds: NDArray[np.float32],
        position: NDArray[np.float64],
        yaw: float,
        layers: CartesianLayers | None = None,
    ) -> None:
        """Take in a scan and what the layers know by now.

        Args:
            odds: Log odds of the scan's cells, as ``VirtualScan.log_odds_of`` gives them.
            position: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Heading there [rad].
            layers: Layers of the ground; None without clouds.
        """
        config, most = self.config, self.config.max_log_odds
        self._rolling.follow(position)
        ground, scale = self._no_ground, 1.0
        is_measured = False
        if layers is not None and layers.ground is not None:
            layers.ground.follow(position)
            ground, scale = layers.ground.log_odds, most / layers.ground.max_log_odds
            is_measured = layers.is_measured
        # What ground cells and driving tell is surer than a scan, which leaves it as it is.
        fading = most * config.update_every / config.driven_memory
        take_ground(self.log_odds, ground, scale, most, fading)
        x, y = (position / config.cell).tolist()
        drive_over(self.log_odds, self.centre, Stance(x, y, self.driven_radius / config.cell), most)
        add_scan(
            *(self.log_odds, self.centre, yaw, odds),
            *(self._polar, self._gains, ground, is_measured),
        )
        if layers is not None and layers.movers is not None:
            # What moves is no wall, and what clouds still show of it where it was is not there.
            vacate(self.log_odds, self.centre, layers.movers.transient_places, config.cell)
        if layers is not None:
            self._raise_low_obstacles(layers.low_obstacles, ground)

    def _raise_low_obstacles(self, low: LowObstacleLayer, ground: NDArray[np.float32]) -> None:
        """Raise the log odds where low obstacles stand, or beside them."""
        config = self.config
        add_low_obstacles(
            self.log_odds,
            self.centre,
            LowObstacles(
                low.heights,
                low.centre,
                ground,
                len(self._polar.rings) // 2,
                config.lethal_log_odds / low.config.min_height,
                low.config.free_log_odds,
            ),
            config.max_log_odds,
        )

    def end_ranges(
        self, ranges: NDArray[np.float32], position: NDArray[np.float64], yaw: float, reach: float
    ) -> NDArray[np.float32]:
        """Return ranges that end at remembered obstacles where they did not yet, shape (n,).

        Args:
            ranges: Ranges of a scan [m], shape (n,).
            position: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Heading there [rad].
            reach: Range beyond which obstacles do not count [m].
        """
        config = self.config
        ends = ranges.astype(np.float32)
        _end_ranges(
            *(ends, self.log_odds, self.centre, position, yaw, self._bearings),
            *(config.cell, config.lethal_log_odds, reach),
        )
        return ends


@kernel
def _end_ranges(
    ranges: NDArray[np.float32],
    log_odds: NDArray[np.float32],
    centre: NDArray[np.int64],
    position: NDArray[np.float64],
    yaw: float,
    bearings: NDArray[np.float64],
    cell: float,
    lethal_log_odds: float,
    reach: float,
) -> None:
    """End ranges where one of three rays through their sector meets an obstacle."""
    n, half = len(log_odds), len(log_odds) // 2 - 1
    width = 2 * np.pi / len(ranges)
    for sector in range(len(ranges)):
        for ray in range(3):
            angle = yaw + bearings[sector] + (ray - 1) * width / 3
            c, s = np.cos(angle), np.sin(angle)
            far = _BODY_RANGE
            while far < reach and not ranges[sector] <= far:  # NaN is no limit.
                i = int(np.floor((position[0] + far * c) / cell))
                j = int(np.floor((position[1] + far * s) / cell))
                if abs(i - centre[0]) > half or abs(j - centre[1]) > half:
                    break
                if log_odds[i & (n - 1), j & (n - 1)] > lethal_log_odds:
                    ranges[sector] = far
                    break
                far += cell / 2
