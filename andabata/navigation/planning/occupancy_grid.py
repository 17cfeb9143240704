"""Occupancy grid: log odds of each cell around the robot, from scans, layers and driving."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.planning.cartesian_layers import CartesianLayers
from terrain.kernel import kernel
from traversability.cartesian.rolling_grid import PowerOfTwo, RollingGrid
from traversability.grid import PolarGrid

_OUTSIDE = -1
"""Ring of what lies beyond the polar grid."""

_RIM = 0.02
"""Distance by which the body stands on cells inside of its sides, so that they are free [m]."""

_BODY_RANGE = 0.6
"""Range below which remembered obstacles end no range: the robot would stand in them [m]."""

_FREE_SHARE = 0.7
"""Share of the largest log odds that seen ground can have against an obstacle; driven ground has
all of it."""


class OccupancyGridConfig(BaseModel):
    """Settings of the occupancy grid.

    Attributes:
        cells: Number of cells along an edge of the square around the robot.
        cell: Edge of a cell [m].
        update_every: Number of scans, one a control step, between two that are taken in.
        certain_blocked: Log odds, above those from which on a polar cell is called blocked, at
            which it is certainly so. Less moves a cell to its share of ``max_log_odds``.
        certain_free: Log odds below those at which a polar cell is certainly free.
        blocked_gain: Share of its way that a blocked polar cell right ahead moves the log odds.
        free_gain: Share that a free one moves them the other way.
        unknown_gain: Log odds that an empty polar cell adds, with nothing in front of it that could
            hide it: an edge behind which the ground falls away shows no more.
        unknown_range: Range beyond which empty polar cells do not count [m].
        blocked_range: Range beyond which blocked polar cells do not count where ground cells are
            classified [m]: they are a metre long and wide, and ground cells show what stands where
            in them.
        range_scale: Range at which a scan weighs half as much as right ahead [m]: polar cells grow
            with the range.
        max_log_odds: Largest log odds; from afar that weight of it. Ground that was driven has once
            to twice as much against an obstacle.
        driven_memory: Number of scans after which driven ground is ground like any other: dead
            reckoning has drifted by then, the edges of the trail sooner than its middle.
        lethal_log_odds: Log odds above which a cell is an obstacle.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cells: PowerOfTwo = Field(default=256, ge=64, le=1024)
    cell: float = Field(default=0.2, gt=0)
    update_every: int = Field(default=5, ge=1)
    certain_blocked: float = Field(default=3.6, gt=0)
    certain_free: float = Field(default=2.0, gt=0)
    blocked_gain: float = Field(default=0.4, gt=0, le=1)
    free_gain: float = Field(default=0.05, gt=0, le=1)
    unknown_gain: float = Field(default=0.1, ge=0)
    unknown_range: float = Field(default=4.0, ge=0)
    blocked_range: float = Field(default=5.0, ge=0)
    range_scale: float = Field(default=3.0, gt=0)
    max_log_odds: float = Field(default=3.0, gt=0)
    driven_memory: int = Field(default=600, ge=1)
    lethal_log_odds: float = Field(default=1.0, gt=0)


class PolarCells(NamedTuple):
    """Polar cells of a scan at the middle and the corners of each grid cell around the robot.

    Attributes:
        rings: Ring of the middle and the four corners, -1 outside, int64, shape (m, m, 5).
        bearings: Bearings of the same from the robot [rad], float32, shape (m, m, 5).
        weights: Weight of a scan at the middle, 1 within ``unknown_range``, 1 within
            ``blocked_range``, float64, shape (m, m, 3).
    """

    rings: NDArray[np.int64]
    bearings: NDArray[np.float32]
    weights: NDArray[np.float64]


class Gains(NamedTuple):
    """Steps of an update; see ``OccupancyGridConfig``.

    Attributes:
        blocked: Share of its way that a blocked polar cell moves the log odds.
        free: Share that a free one moves them.
        unknown: Log odds that an empty one adds.
        certain_blocked: Log odds of a polar cell that is certainly blocked.
        certain_free: Log odds against one that is certainly free.
        max_log_odds: Largest log odds.
    """

    blocked: float
    free: float
    unknown: float
    certain_blocked: float
    certain_free: float
    max_log_odds: float


class Stance(NamedTuple):
    """Pose of the robot in the grid.

    Attributes:
        x: Position in ``odom`` [cells].
        y: Position in ``odom`` [cells].
        yaw: Heading [rad].
        radius: Distance from the middle within which ground counts as driven [cells].
    """

    x: float
    y: float
    yaw: float
    radius: float


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
        # Log odds of no ground layer: one cell repeats, as all that is wrapped around.
        self._no_ground = np.zeros((1, 1), dtype=np.float32)
        self._polar = _polar_cells(grid, config)
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
        _fade_driven(self.log_odds, most, most * config.update_every / config.driven_memory)
        x, y = position[0] / config.cell, position[1] / config.cell
        stance = Stance(x, y, yaw, self.driven_radius / config.cell)
        ground = None if layers is None else layers.ground
        has_ground = layers is not None and ground is not None and layers.is_measured
        centre = self.centre
        _add_scan(self.log_odds, centre, stance, odds, self._polar, self._gains, has_ground)
        if ground is not None:
            ground.follow(position)
            scale = most / ground.max_log_odds
            _take_ground(self.log_odds, ground.log_odds, scale, most)
        if layers is not None:
            self._raise_low_obstacles(layers)

    def _raise_low_obstacles(self, layers: CartesianLayers) -> None:
        """Raise the log odds where low obstacles stand, or beside them."""
        low, config = layers.low_obstacles, self.config
        ground = self._no_ground if layers.ground is None else layers.ground.log_odds
        _add_low_obstacles(
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
        found = ranges.astype(np.float32)
        _end_ranges(
            *(found, self.log_odds, self.centre, position, yaw, self._bearings),
            *(config.cell, config.lethal_log_odds, reach),
        )
        return found


def _polar_cells(grid: PolarGrid, config: OccupancyGridConfig) -> PolarCells:
    """Return the polar cells of each grid cell, relative to the robot's own."""
    cell = config.cell
    reach = int(grid.outer_radius / cell) + 1
    middles = np.arange(-reach, reach + 1) * cell
    x = middles[:, None, None] + cell / 2 * np.array([0, 1, 1, -1, -1])
    y = middles[None, :, None] + cell / 2 * np.array([0, 1, -1, 1, -1])
    ranges = np.hypot(x, y)
    rings = np.searchsorted(grid.ring_edges, ranges, side="right") - 1
    rings[(rings < 0) | (rings >= grid.n_rings)] = _OUTSIDE
    bearings = np.arctan2(*np.broadcast_arrays(y, x)).astype(np.float32)
    ranges = ranges[:, :, 0]
    reaches = [ranges < config.unknown_range, ranges < config.blocked_range]
    weights = np.stack([1.0 / (1.0 + ranges / config.range_scale), *reaches], axis=2)
    return PolarCells(rings, bearings, weights)


@kernel
def _fade_driven(log_odds: NDArray[np.float32], max_log_odds: float, step: float) -> None:
    """Move the log odds of driven ground a step towards those of free ground."""
    for i in range(len(log_odds)):
        for j in range(len(log_odds)):
            if log_odds[i, j] <= -max_log_odds:
                log_odds[i, j] += step


@kernel
def _add_scan(
    log_odds: NDArray[np.float32],
    centre: NDArray[np.int64],
    stance: Stance,
    odds: NDArray[np.float32],
    polar: PolarCells,
    gains: Gains,
    has_ground: bool,
) -> None:
    """Add what a scan shows of each cell around the robot.

    Args:
        log_odds: Log odds, wrapped around, changed in place, shape (n, n).
        centre: Cell of the robot, shape (2,).
        stance: Pose of the robot.
        odds: Log odds of the scan's cells for being blocked, NaN where empty, shape (sectors,
            rings).
        polar: Polar cells of the grid cells.
        gains: Steps of the update.
        has_ground: True if ground cells show what stands where in far blocked cells.
    """
    n, half, sectors = len(log_odds), len(polar.rings) // 2, len(odds)
    beside = int(stance.radius) + 1
    nearest = _first_blocked(odds)
    for a in range(2 * half + 1):
        i = (centre[0] + a - half) & (n - 1)
        for b in range(2 * half + 1):
            j = (centre[1] + b - half) & (n - 1)
            if max(abs(a - half), abs(b - half)) <= beside:
                # The nearer the robot's middle was, the more clearance the body had.
                dx, dy = centre[0] + a - half + 0.5, centre[1] + b - half + 0.5
                far = np.hypot(dx - stance.x, dy - stance.y)
                if far < stance.radius:
                    driven = -gains.max_log_odds * (2.0 - far / stance.radius)
                    log_odds[i, j] = min(log_odds[i, j], driven)
                    continue
            ring = polar.rings[a, b, 0]
            if ring == _OUTSIDE:
                continue
            sector = _sector_of(polar.bearings[a, b, 0], stance.yaw, sectors)
            seen, weight = odds[sector, ring], polar.weights[a, b, 0]
            known, most = log_odds[i, j], gains.max_log_odds * weight
            if seen < 0:
                # An object in a corner makes its own polar cell blocked, and not this one.
                for k in range(1, 5):
                    sector = _sector_of(polar.bearings[a, b, k], stance.yaw, sectors)
                    if polar.rings[a, b, k] >= 0:
                        seen = max(seen, odds[sector, polar.rings[a, b, k]])
                if seen < 0:
                    there = most * max(seen / gains.certain_free, -1.0)
                    moved = known - gains.free * weight * (known - there)
                    log_odds[i, j] = min(known, moved)
            elif known <= -most:
                continue  # It was seen free from nearer.
            elif seen >= 0 and (polar.weights[a, b, 2] > 0 or not has_ground):
                there = most * min(seen / gains.certain_blocked, 1.0)
                log_odds[i, j] = max(known, known + gains.blocked * weight * (there - known))
            elif np.isnan(seen) and ring < nearest[sector]:
                # Nothing came back, and nothing stands before it: the ground may fall away.
                raised = known + gains.unknown * polar.weights[a, b, 1]
                log_odds[i, j] = max(known, min(raised, most))


@kernel
def _first_blocked(odds: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return the first blocked ring of each sector, the number of rings for none."""
    first = np.full(len(odds), odds.shape[1])
    for sector in range(len(odds)):
        for ring in range(odds.shape[1]):
            if odds[sector, ring] >= 0:
                first[sector] = ring
                break
    return first


@kernel
def _sector_of(bearing: float, yaw: float, sectors: int) -> int:
    """Return the sector of a bearing in ``odom`` [rad] for a heading [rad]; sector 0 is behind."""
    return int((bearing - yaw + 3 * np.pi) / (2 * np.pi) * sectors) % sectors


@kernel
def _take_ground(
    log_odds: NDArray[np.float32], ground: NDArray[np.float32], scale: float, max_log_odds: float
) -> None:
    """Write the ground layer over what polar cells have shown, except where the robot has driven.

    Ground cells are finer and know the clouds themselves.
    """
    n = len(log_odds)
    least = -_FREE_SHARE * max_log_odds
    for i in range(n):
        for j in range(n):
            if ground[i, j] != 0.0 and log_odds[i, j] > -max_log_odds:
                log_odds[i, j] = min(max(scale * ground[i, j], least), max_log_odds)


class LowObstacles(NamedTuple):
    """Low obstacles for the compiled update.

    Attributes:
        heights: Heights, in cells of half the size, wrapped around [m], float32, shape (m, m).
        centre: Cell of the robot at the last cloud, shape (2,).
        ground: Log odds of the ground layer, wrapped around, float32, shape (k, k).
        half: Number of cells to either side of the robot that are looked at.
        gain: Log odds for each metre of height [1/m].
        free_log_odds: Log odds of the ground layer below minus this that overrule.
    """

    heights: NDArray[np.float32]
    centre: NDArray[np.int64]
    ground: NDArray[np.float32]
    half: int
    gain: float
    free_log_odds: float


@kernel
def _add_low_obstacles(
    log_odds: NDArray[np.float32],
    centre: NDArray[np.int64],
    low: LowObstacles,
    max_log_odds: float,
) -> None:
    """Raise the log odds where low obstacles stand, or beside them.

    Beside them, because obstacles and the gaps between them are known by the middles of cells.
    Driven ground and ground cells that are surely free have no low obstacles.
    """
    n, m, k = len(log_odds), len(low.heights), len(low.ground)
    half = min(low.half, m // 4 - 1)
    # Obstacles are few: each raises the cells that it lies in or beside, instead of each cell
    # looking at the four half cells inside and one more around.
    for u in range(2 * (centre[0] - half) - 1, 2 * (centre[0] + half) + 3):
        row = low.heights[u & (m - 1)]
        for v in range(2 * (centre[1] - half) - 1, 2 * (centre[1] + half) + 3):
            height = row[v & (m - 1)]
            if not height > 0 or max(abs(u - low.centre[0]), abs(v - low.centre[1])) >= m // 2:
                continue
            raised = min(low.gain * height, max_log_odds)
            for a in range(u // 2 - 1 + u % 2, u // 2 + 1 + u % 2):
                for b in range(v // 2 - 1 + v % 2, v // 2 + 1 + v % 2):
                    if max(abs(a - centre[0]), abs(b - centre[1])) > half:
                        continue
                    i, j = a & (n - 1), b & (n - 1)
                    is_free = low.ground[i & (k - 1), j & (k - 1)] < -low.free_log_odds
                    if log_odds[i, j] > -max_log_odds and not is_free:
                        log_odds[i, j] = max(log_odds[i, j], raised)


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
