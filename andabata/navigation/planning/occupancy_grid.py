"""Occupancy around the robot: what scans, squares, bumps and driving say of each cell."""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.robot import RobotModel
from andabata.navigation.controller import SweepWindow
from andabata.navigation.planning.ground_layer import GroundLayer, GroundLayerConfig
from andabata.navigation.planning.low_obstacle_layer import (
    LowObstacleLayer,
    LowObstacleLayerConfig,
    follow,
)
from terrain.kernel import kernel
from traversability.cartesian.classifier import GroundClassifier
from traversability.cartesian.elevation_grid import ElevationGrid, Wrapping
from traversability.cartesian.features import EDGE_CELLS
from traversability.grid import PolarGrid

_BEYOND = -1
_RIM = 0.02
"""The body stands on cells that are so much nearer than its sides, so that they are free [m]."""

_FOOTPRINT = 0.6
"""Remembered walls nearer than this end no range: the robot would be in them [m]."""

_KNOWN_FREE = 0.7
"""Share of certainty that seen ground can have against a wall; driven ground has all of it."""


class OccupancyGridConfig(BaseModel):
    """Numbers of the evidence.

    Attributes:
        cells: Cells along an edge of the square that is remembered around the robot.
        cell: Edge of a cell [m].
        mark_every: Looks, one a control step, between two scans that are remembered.
        surely_red: Log odds, above those from which on a cell is called forbidden, at which it is
            so for certain. Less than that moves the evidence to its share of certainty.
        surely_green: The same below them, for free cells.
        blocked: Share of its way that a forbidden cell of the scan right ahead moves the evidence.
        free: Share that a free one moves it the other way.
        void: Evidence that an empty cell of the scan adds, with nothing in front of it that could
            hide it: an edge behind which the ground falls away tells no more.
        void_reach: Empty cells farther than this mean nothing [m].
        red_reach: Red cells of the scan farther than this mean nothing where squares are judged
            [m]: they are a metre long and wide, and squares tell what stands where in them.
        fade: Evidence weighs ``1 / (1 + range / fade)``: cells of the scan grow with the range [m].
        certain: Largest evidence; from afar that weight of it. Ground that was driven has once to
            twice as much against a wall.
        trail: Looks after which ground that was driven is ground like any other: dead
            reckoning has drifted by then, the edges of the trail sooner than its middle.
        wall: Evidence above which a cell is a wall.
        squares: Numbers of what clouds say of each cell.
        bumps: Numbers of what stands out of the ground by centimetres.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cells: Wrapping = Field(default=256, ge=64, le=1024)
    cell: float = Field(default=0.2, gt=0)
    mark_every: int = Field(default=5, ge=1)
    surely_red: float = Field(default=3.6, gt=0)
    surely_green: float = Field(default=2.0, gt=0)
    blocked: float = Field(default=0.4, gt=0, le=1)
    free: float = Field(default=0.05, gt=0, le=1)
    void: float = Field(default=0.1, ge=0)
    void_reach: float = Field(default=4.0, ge=0)
    red_reach: float = Field(default=5.0, ge=0)
    fade: float = Field(default=3.0, gt=0)
    certain: float = Field(default=3.0, gt=0)
    trail: int = Field(default=600, ge=1)
    wall: float = Field(default=1.0, gt=0)
    squares: GroundLayerConfig = Field(default_factory=GroundLayerConfig)
    bumps: LowObstacleLayerConfig = Field(default_factory=LowObstacleLayerConfig)


class OccupancyGrid:
    """Remembers what was seen in a square that moves with the robot, in the frame ``odom``.

    Attributes:
        config: Numbers.
        values: For walls, above 0, or against them; 0 where nobody looked. Wrapped around, float32,
            shape (n, n).
        centre: The robot's cell, counted from the origin of ``odom``, shape (2,).
        under: Ground nearer to the middle of the robot than this is driven [m].
        squares: What clouds say of each cell; None leaves that to the scans' own cells.
    """

    def __init__(
        self,
        grid: PolarGrid,
        config: OccupancyGridConfig,
        robot: RobotModel,
        squares: GroundClassifier | None = None,
    ) -> None:
        """Begin without any.

        Args:
            grid: Of the scans.
            config: Numbers.
            robot: Whose body drives.
            squares: Judges cells by the clouds behind the scans; None leaves that to the scans' own
                cells.

        Raises:
            ValueError: If the squares are not as large as the cells.
        """
        self.config = config
        self._grid = grid
        n, cell = config.cells, config.cell
        self.values = np.zeros((n, n), dtype=np.float32)
        self.centre = np.zeros(2, dtype=np.int64)
        self.under = robot.width / 2 - _RIM
        self._tiles = ElevationGrid(cell / 2, config.bumps.cells)
        self._bumps = LowObstacleLayer(cell / 2, config.bumps)
        self.squares: GroundLayer | None = None
        self._unjudged = np.zeros((1, 1), dtype=np.float32)  # It repeats, as all that is wrapped.
        if squares is not None:
            edge = EDGE_CELLS * squares.cell
            if not math.isclose(cell, edge):
                raise ValueError(
                    f"local_planner.cell: expected {edge:g} m, as large as the squares "
                    f"that the classifier knows, got {cell:g} m; train one for these"
                )
            self.squares = GroundLayer(n, squares, config.squares)
        reach = int(grid.outer_radius / cell) + 1
        middles = np.arange(-reach, reach + 1) * cell
        # The middle of each cell and its corners, relative to the robot's own cell.
        x = middles[:, None, None] + cell / 2 * np.array([0, 1, 1, -1, -1])
        y = middles[None, :, None] + cell / 2 * np.array([0, 1, -1, 1, -1])
        ranges = np.hypot(x, y)
        rings = np.searchsorted(grid.ring_edges, ranges, side="right") - 1
        rings[(rings < 0) | (rings >= grid.n_rings)] = _BEYOND
        self._rings = rings
        self._bearings = np.arctan2(*np.broadcast_arrays(y, x)).astype(np.float32)
        ranges = ranges[:, :, 0]
        fading = 1.0 / (1.0 + ranges / config.fade)
        reaches = [ranges < config.void_reach, ranges < config.red_reach]
        self._weights = np.stack([fading, *reaches], axis=2)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.values[:] = 0.0
        self._bumps.reset()
        if self.squares is not None:
            self.squares.reset()
        self._settled = -np.inf
        self.centre[:] = 0

    def look_down(self, recent: SweepWindow | None, here: NDArray[np.float64]) -> None:
        """Remember the squares and the bumps that were measured since the last time, each once.

        Args:
            recent: What was measured last; None has none.
            here: Position of the robot in ``odom`` [m], shape (2,).
        """
        if recent is None or recent.settled <= self._settled:
            return
        points, ages, span = recent.since(self._settled)
        self._tiles.describe(points, here, ages)
        self._bumps.take(self._tiles, here, span)
        if self.squares is not None:
            self.squares.take(self._tiles, here, span)
        self._settled = recent.settled

    def mark(self, odds: NDArray[np.float32], here: NDArray[np.float64], yaw: float) -> None:
        """Remember a scan.

        Args:
            odds: Of the scan's cells, as ``VirtualScan.log_odds_of`` gives them.
            here: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Its heading there [rad].
        """
        config = self.config
        follow(self.values, self.centre, here, config.cell)
        _forget(self.values, config.certain, config.certain * config.mark_every / config.trail)
        _mark(
            self.values,
            self.centre,
            (here[0] / config.cell, here[1] / config.cell, self.under / config.cell, yaw),
            odds,
            self._rings,
            self._bearings,
            self._weights,
            (config.blocked, config.free, config.void, config.certain),
            (config.surely_red, config.surely_green),
            self.squares is not None and self._settled > -np.inf,
        )
        squares = self._unjudged
        if self.squares is not None:
            self.squares.follow(here)
            squares = self.squares.odds
            scale = config.certain / config.squares.most
            _take_over(self.values, squares, scale, config.certain)
        half, doubt = len(self._rings) // 2, config.bumps.doubt
        bumps = (self._bumps.rises, self._bumps.centre, config.wall / config.bumps.rise)
        _raise(self.values, self.centre, half, bumps, squares, config.certain, doubt)

    def shortened(
        self, ranges: NDArray[np.float32], here: NDArray[np.float64], yaw: float, reach: float
    ) -> NDArray[np.float32]:
        """Return ranges that end at remembered walls where they did not yet, shape (n,).

        Args:
            ranges: Of a scan [m], shape (n,).
            here: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Its heading there [rad].
            reach: Walls farther than this end none [m].
        """
        config = self.config
        found = ranges.astype(np.float32)
        limits = (config.cell, config.wall, reach)
        _shorten(found, self.values, self.centre, here, yaw, self._grid.bearings, limits)
        return found


@kernel
def _forget(evidence, certain, step):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Move what is known of driven ground a step towards what is known of free ground."""
    for i in range(len(evidence)):
        for j in range(len(evidence)):
            if evidence[i, j] <= -certain:
                evidence[i, j] += step


@kernel
def _mark(evidence, centre, at, odds, rings, bearings, weights, gains, sure, has_squares):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Add what a scan says of each cell around the robot."""
    n, half, sectors = len(evidence), len(rings) // 2, len(odds)
    blocked, free, void, certain = gains
    x, y, under, yaw = at
    beside = int(under) + 1
    firsts = np.full(sectors, odds.shape[1])
    for s in range(sectors):
        for ring in range(odds.shape[1]):
            if odds[s, ring] >= 0:
                firsts[s] = ring
                break
    for a in range(2 * half + 1):
        i = (centre[0] + a - half) & (n - 1)
        for b in range(2 * half + 1):
            ring = rings[a, b, 0]
            j = (centre[1] + b - half) & (n - 1)
            if max(abs(a - half), abs(b - half)) <= beside:
                # The nearer the middle was, the more room there was for the body.
                far = np.hypot(centre[0] + a - half + 0.5 - x, centre[1] + b - half + 0.5 - y)
                if far < under:
                    evidence[i, j] = min(evidence[i, j], -certain * (2.0 - far / under))
                    continue
            if ring == _BEYOND:
                continue
            s = int((bearings[a, b, 0] - yaw + 3 * np.pi) / (2 * np.pi) * sectors) % sectors
            belief, weight = odds[s, ring], weights[a, b, 0]
            known, most = evidence[i, j], certain * weight
            if belief < 0:
                # A thing in a corner makes its own polar cell red, and not this one.
                for k in range(1, 5):
                    s = int((bearings[a, b, k] - yaw + 3 * np.pi) / (2 * np.pi) * sectors) % sectors
                    if rings[a, b, k] >= 0:
                        belief = max(belief, odds[s, rings[a, b, k]])
                if belief < 0:
                    there = most * max(belief / sure[1], -1.0)
                    evidence[i, j] = min(known, known - free * weight * (known - there))
            elif known <= -most:
                continue  # It was seen free from nearer.
            elif belief >= 0 and (weights[a, b, 2] > 0 or not has_squares):
                there = most * min(belief / sure[0], 1.0)
                evidence[i, j] = max(known, known + blocked * weight * (there - known))
            elif np.isnan(belief) and ring < firsts[s]:
                evidence[i, j] = max(known, min(known + void * weights[a, b, 1], most))


@kernel
def _take_over(evidence, odds, scale, certain):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write what is known of squares over what cells of the scan told, where nobody has driven."""
    n = len(evidence)
    least = -_KNOWN_FREE * certain
    for i in range(n):
        for j in range(n):
            if odds[i, j] != 0.0 and evidence[i, j] > -certain:
                evidence[i, j] = min(max(scale * odds[i, j], least), certain)


@kernel
def _raise(evidence, centre, half, bumps, squares, certain, doubt):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Raise the evidence where the ground has bumps, or beside them, and nobody has driven.

    Beside them, because bumps and the gaps between walls are told by the middles of cells. Squares
    that are surely free have no bumps.
    """
    rises, middle, steepness = bumps
    n, m, k = len(evidence), len(rises), len(squares)
    half = min(half, m // 4 - 1)
    for a in range(centre[0] - half, centre[0] + half + 1):
        for b in range(centre[1] - half, centre[1] + half + 1):
            i, j = a & (n - 1), b & (n - 1)
            if evidence[i, j] <= -certain or squares[i & (k - 1), j & (k - 1)] < -doubt:
                continue
            for u in range(2 * a - 1, 2 * a + 3):
                for v in range(2 * b - 1, 2 * b + 3):
                    rise = rises[u & (m - 1), v & (m - 1)]
                    if rise > 0 and max(abs(u - middle[0]), abs(v - middle[1])) < m // 2:
                        evidence[i, j] = max(evidence[i, j], min(steepness * rise, certain))


@kernel
def _shorten(ranges, evidence, centre, here, yaw, bearings, limits):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """End ranges where one of three rays through their sector meets a wall."""
    n, half = len(evidence), len(evidence) // 2 - 1
    cell, wall, reach = limits
    width = 2 * np.pi / len(ranges)
    for sector in range(len(ranges)):
        for ray in range(3):
            angle = yaw + bearings[sector] + (ray - 1) * width / 3
            c, s = np.cos(angle), np.sin(angle)
            far = _FOOTPRINT
            while far < reach and not ranges[sector] <= far:  # NaN is no limit.
                i = int(np.floor((here[0] + far * c) / cell))
                j = int(np.floor((here[1] + far * s) / cell))
                if abs(i - centre[0]) > half or abs(j - centre[1]) > half:
                    break
                if evidence[i & (n - 1), j & (n - 1)] > wall:
                    ranges[sector] = far
                    break
                far += cell / 2
