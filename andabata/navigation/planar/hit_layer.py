"""Hit layer: where the beams of a 2D laser have met something, in a square around the robot.

Each cell of the square keeps the place of its hit, so that a beam clears a hit that it passes, not
a cell that it grazes: thin posts, and walls that ten beams meet here and there, stay. Ground that
no beam has met anything on counts as free (assumption).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.kernel import kernel
from traversability.cartesian.rolling_grid import PowerOfTwo, RollingGrid


class HitLayerConfig(BaseModel):
    """Settings of the hit layer.

    Attributes:
        cells: Number of cells along an edge of the square around the robot.
        cell: Edge of a cell [m].
        hit_log_odds: Log odds that a scan adds to a cell with a hit.
        miss_log_odds: Log odds that a scan takes from a cell whose hit its beams pass.
        lethal_log_odds: Log odds above which a cell is an obstacle; less than ``hit_log_odds``
            believes a single hit.
        max_log_odds: Largest log odds.
        pass_radius: Distance from a hit within which a beam passes it [m].
        pass_margin: Distance behind a hit that a beam has to reach to pass it [m]: beams that graze
            a wall end shortly behind its hits.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cells: PowerOfTwo = Field(default=256, ge=64, le=1024)
    cell: float = Field(default=0.1, gt=0)
    hit_log_odds: float = Field(default=1.0, gt=0)
    miss_log_odds: float = Field(default=0.5, ge=0)
    lethal_log_odds: float = Field(default=0.5, gt=0)
    max_log_odds: float = Field(default=2.0, gt=0)
    pass_radius: float = Field(default=0.03, gt=0)
    pass_margin: float = Field(default=0.15, ge=0)


class LaserPose(NamedTuple):
    """Pose of a laser on the robot, or in the layer's frame.

    Attributes:
        x: Position [m].
        y: Position [m].
        yaw: Heading [rad].
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def on(self, robot: "LaserPose") -> "LaserPose":
        """Return the pose in the frame of the robot's pose, which this one is relative to."""
        c, s = np.cos(robot.yaw), np.sin(robot.yaw)
        x, y = robot.x + c * self.x - s * self.y, robot.y + s * self.x + c * self.y
        return LaserPose(float(x), float(y), robot.yaw + self.yaw)


class _Gains(NamedTuple):
    """Numbers of ``HitLayerConfig`` that the compiled update depends on.

    Attributes:
        hit: Log odds that a scan adds to a cell with a hit.
        miss: Log odds that a scan takes from a cell whose hit its beams pass.
        lethal_log_odds: Log odds above which a cell is an obstacle.
        max_log_odds: Largest log odds.
        pass_radius: Distance from a hit within which a beam passes it [m].
        pass_margin: Distance behind a hit that a beam has to reach to pass it [m].
    """

    hit: float
    miss: float
    lethal_log_odds: float
    max_log_odds: float
    pass_radius: float
    pass_margin: float


class _Grid(NamedTuple):
    """Arrays of the layer, wrapped around.

    Attributes:
        log_odds: Log odds, float32, shape (n, n).
        places: Place of the hit in each cell, from the cell's corner, in cells, float32, shape
            (n, n, 2).
        nearest: Range of the nearest hit of this scan in each cell [m], infinite where it has none,
            float32, shape (n, n).
        centre: Cell of the robot, shape (2,).
        cell: Edge of a cell [m].
    """

    log_odds: NDArray[np.float32]
    places: NDArray[np.float32]
    nearest: NDArray[np.float32]
    centre: NDArray[np.int64]
    cell: float


class _Scan(NamedTuple):
    """Beams in the order of their bearings.

    Attributes:
        laser: Pose of the laser in the layer's frame.
        bearings: Bearings from the laser's heading, from -pi to pi, ascending [rad], shape (b,).
        ranges: Ranges [m], float32, shape (b,).
        max_range: Range from which on a beam has met nothing [m].
    """

    laser: LaserPose
    bearings: NDArray[np.float64]
    ranges: NDArray[np.float32]
    max_range: float


class HitLayer:
    """Remembers the hits of a 2D laser in a square that moves with the robot, in a fixed frame.

    Attributes:
        config: Settings.
        log_odds: Log odds of each cell for an obstacle, 0 where nothing was hit; wrapped around,
            float32, shape (n, n).
        places: Place of the last hit in each cell with log odds, from the cell's corner, in cells;
            wrapped around, float32, shape (n, n, 2).
    """

    def __init__(self, config: HitLayerConfig | None = None) -> None:
        """Begin empty.

        Args:
            config: Settings.
        """
        self.config = config = config or HitLayerConfig()
        self._odds = RollingGrid(config.cell, config.cells, ("log_odds",))
        self.log_odds = self._odds["log_odds"]
        # A place is written with the hit that gives its cell log odds: nothing has to be cleared.
        self.places = np.zeros((config.cells, config.cells, 2), dtype=np.float32)
        self._nearest = np.zeros_like(self.log_odds)
        self._gains = _Gains(
            hit=config.hit_log_odds,
            miss=config.miss_log_odds,
            lethal_log_odds=config.lethal_log_odds,
            max_log_odds=config.max_log_odds,
            pass_radius=config.pass_radius,
            pass_margin=config.pass_margin,
        )

    @property
    def centre(self) -> NDArray[np.int64]:
        """Cell of the robot, counted from the origin of the frame, shape (2,)."""
        return self._odds.centre

    @property
    def obstacles(self) -> NDArray[np.float64]:
        """Places of the hits that are obstacles [m], shape (k, 2)."""
        low = self.centre - self.config.cells // 2
        wrapped = np.argwhere(self.log_odds > self.config.lethal_log_odds)
        cells = low + ((wrapped - low) & (self.config.cells - 1))
        return np.asarray((cells + self.places[tuple(wrapped.T)]) * self.config.cell)

    def reset(self) -> None:
        """Forget everything."""
        self._odds.reset()

    def follow(self, position: NDArray[np.float64]) -> None:
        """Move the square to the robot.

        Args:
            position: Position of the robot [m], shape (2,).
        """
        self._odds.follow(position)

    def update(
        self,
        laser: LaserPose,
        bearings: NDArray[np.floating],
        ranges: NDArray[np.floating],
        max_range: float,
    ) -> NDArray[np.float64]:
        """Take in a scan. The order of its beams does not matter.

        Args:
            laser: Pose of the laser in the layer's frame.
            bearings: Bearing of each beam from the laser's heading [rad], shape (b,).
            ranges: Range of each beam [m], shape (b,). NaN and what is not above 0 measured
                nothing.
            max_range: Range from which on a beam has met nothing [m].

        Returns:
            Places of hits that have become obstacles by this scan [m], shape (k, 2).
        """
        angles = _wrapped(bearings.astype(np.float64))
        order = np.argsort(angles)
        scan = _Scan(laser, angles[order], ranges[order].astype(np.float32), max_range)
        self._nearest.fill(np.inf)
        grid = _Grid(self.log_odds, self.places, self._nearest, self.centre, self.config.cell)
        hits = _add_hits(grid, scan, self._gains)
        _take_misses(grid, scan, self._gains)
        return hits

    def clear(self, position: NDArray[np.float64], radius: float) -> None:
        """Forget hits around a place where nothing can stand, such as under the robot.

        Args:
            position: Middle of the free ground [m], shape (2,).
            radius: Distance from it within which hits are forgotten [m].
        """
        grid = _Grid(self.log_odds, self.places, self._nearest, self.centre, self.config.cell)
        _clear(grid, position, radius)


@kernel
def _wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return angles from -pi to pi [rad]."""
    return np.pi - (np.pi - angles) % (2 * np.pi)


@kernel
def _add_hits(grid: _Grid, scan: _Scan, gains: _Gains) -> NDArray[np.float64]:
    """Raise the log odds of cells with hits, once a scan, and remember where in the cell they lie.

    Of several hits in a cell the nearest stays: it borders the ground that the robot can reach.

    Returns:
        Places of new obstacles [m], shape (k, 2).
    """
    n, laser, cell = len(grid.log_odds), scan.laser, grid.cell
    hits, count = np.empty((len(scan.ranges), 2)), 0
    for b in range(len(scan.ranges)):
        far = scan.ranges[b]
        if not 0.0 < far < scan.max_range:
            continue
        x = laser.x + far * np.cos(laser.yaw + scan.bearings[b])
        y = laser.y + far * np.sin(laser.yaw + scan.bearings[b])
        p, q = int(np.floor(x / cell)), int(np.floor(y / cell))
        row, column = p - grid.centre[0] + n // 2, q - grid.centre[1] + n // 2
        if not (0 <= row < n and 0 <= column < n):
            continue  # Beyond the square.
        i, j = p & (n - 1), q & (n - 1)
        if np.isinf(grid.nearest[i, j]):
            before = grid.log_odds[i, j]
            grid.log_odds[i, j] = min(before + gains.hit, gains.max_log_odds)
            if before <= gains.lethal_log_odds < grid.log_odds[i, j]:
                hits[count, 0], hits[count, 1] = x, y
                count += 1
        if far < grid.nearest[i, j]:
            grid.nearest[i, j] = far
            grid.places[i, j, 0], grid.places[i, j, 1] = x / cell - p, y / cell - q
    return hits[:count]


@kernel
def _take_misses(grid: _Grid, scan: _Scan, gains: _Gains) -> None:
    """Lower the log odds of remembered hits that this scan's beams pass.

    Free ground needs no beams to be free: only hits have anything to clear, and each looks up the
    beams beside it.
    """
    n, laser = len(grid.log_odds), scan.laser
    low0, low1 = grid.centre[0] - n // 2, grid.centre[1] - n // 2
    for i in range(n):
        for j in range(n):
            # What this scan has hit a beam ends at: it need not be looked up.
            if grid.log_odds[i, j] <= 0.0 or grid.nearest[i, j] < np.inf:
                continue
            # Cell of the frame that is kept in this row and column.
            p, q = low0 + ((i - low0) & (n - 1)), low1 + ((j - low1) & (n - 1))
            x = (p + grid.places[i, j, 0]) * grid.cell - laser.x
            y = (q + grid.places[i, j, 1]) * grid.cell - laser.y
            far = np.hypot(x, y)
            if far + gains.pass_margin > scan.max_range:
                continue
            bearing = np.pi - (np.pi - np.arctan2(y, x) + laser.yaw) % (2 * np.pi)
            if _is_passed(bearing, far, scan, gains):
                grid.log_odds[i, j] = max(grid.log_odds[i, j] - gains.miss, 0.0)


@kernel
def _is_passed(bearing: float, far: float, scan: _Scan, gains: _Gains) -> bool:
    """Return True if beams come near a place, and all that do go on behind it.

    Along a wall, beams on one side of a hit go on and those on the other end before it: one that
    ends is enough to keep it.
    """
    count, beyond = len(scan.bearings), far + gains.pass_margin
    width = np.arcsin(gains.pass_radius / far) if far > gains.pass_radius else 0.5 * np.pi
    after = np.searchsorted(scan.bearings, bearing)
    passed = False
    for side in range(2):
        for k in range(count):
            # Bearings go round: after the last comes the first.
            b = (after + k) % count if side == 0 else (after - 1 - k) % count
            off = scan.bearings[b] - bearing if side == 0 else bearing - scan.bearings[b]
            if off < 0.0:
                off += 2 * np.pi
            if off > width:
                break
            # Nothing measured, NaN or 0, neither keeps nor clears.
            if 0.0 < scan.ranges[b] < beyond:
                return False
            passed = passed or scan.ranges[b] >= beyond
    return passed


@kernel
def _clear(grid: _Grid, position: NDArray[np.float64], radius: float) -> None:
    """Forget hits within a distance of a place [m]."""
    n = len(grid.log_odds)
    half = int(radius / grid.cell) + 1
    p0, q0 = int(np.floor(position[0] / grid.cell)), int(np.floor(position[1] / grid.cell))
    for p in range(p0 - half, p0 + half + 1):
        for q in range(q0 - half, q0 + half + 1):
            i, j = p & (n - 1), q & (n - 1)
            x = (p + grid.places[i, j, 0]) * grid.cell - position[0]
            y = (q + grid.places[i, j, 1]) * grid.cell - position[1]
            if np.hypot(x, y) < radius:
                grid.log_odds[i, j] = min(grid.log_odds[i, j], 0.0)
