"""A light local map with a replanned sub-goal: the way out of traps.

A scan sees 10 m and remembers nothing; a robot that steers by it alone cannot leave a deep dead end
(goal 3 of Sanchez et al. 2023). The map remembers where scans saw a way and where not, and near the
robot what clouds say of each of its cells; it plans a path over that to the goal, and names the
farthest point of the path that the robot can head for straight away (assumption: the paper has
nothing of the kind).
"""

import math
from dataclasses import replace
from typing import Self

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.pose import Pose, wrap
from andabata.machine.robot import RobotModel
from andabata.navigation.bumps import Bumps, BumpsConfig, follow
from andabata.navigation.local_plan import EVERYWHERE, LocalPlan, Prices
from andabata.navigation.square_map import SquareMap, SquareMapConfig
from andabata.navigation.view import Area, View
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid
from traversability.square_forest import SquareForest
from traversability.squares import SQUARE
from traversability.tiles import Tiles, Wrapping

_BEYOND = -1
_RIM = 0.02
"""The body stands on cells that are so much nearer than its sides, so that they are free [m]."""

_PASSAGE = 0.2
"""Where the middle of the robot has been there is this much room around the body [m]."""

_FOOTPRINT = 0.6
"""Remembered walls nearer than this end no range: the robot would be in them [m]."""

_KNOWN_FREE = 0.7
"""Share of certainty that seen ground can have against a wall; driven ground has all of it."""

_ANOTHER_GOAL = 3.0
"""A goal that jumps farther than this is another one [m]."""


class LocalMapConfig(BaseModel):
    """Numbers of the map.

    Attributes:
        cells: Cells along an edge of the square that is remembered around the robot.
        cell: Edge of a cell [m].
        mark_every: Looks, one a control step, between two scans that are remembered.
        plan_every: Looks between two plans.
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
        unseen: Extra cost of a metre where no scan has seen anything.
        doubt: Extra cost of a metre with almost enough evidence for a wall.
        sure: Extra cost of a metre with as much evidence again: a wall that was seen from near is
            not tried twice.
        fade: Evidence weighs ``1 / (1 + range / fade)``: cells of the scan grow with the range [m].
        certain: Largest evidence; from afar that weight of it. Ground that was driven has once to
            twice as much against a wall.
        trail: Looks after which ground that was driven is ground like any other: dead
            reckoning has drifted by then, the edges of the trail sooner than its middle.
        wall: Evidence above which a cell is a wall.
        room: Distance from walls that the path keeps where it can [m].
        shy: Distance from walls at which a metre costs no more [m].
        tight: Extra cost of a metre nearer to walls than ``room``.
        crowd: Extra cost of a metre at ``room``, falling to none at ``shy``.
        near: Nearest sub-goal [m]: what lies within the turning circle cannot be headed for.
        reach: Farthest sub-goal [m].
        squares: Numbers of what clouds say of each cell.
        bumps: Numbers of what stands out of the ground by centimetres.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cells: Wrapping = Field(default=256, ge=64, le=1024)
    cell: float = Field(default=0.2, gt=0)
    mark_every: int = Field(default=5, ge=1)
    plan_every: int = Field(default=5, ge=1)
    surely_red: float = Field(default=3.6, gt=0)
    surely_green: float = Field(default=2.0, gt=0)
    blocked: float = Field(default=0.4, gt=0, le=1)
    free: float = Field(default=0.05, gt=0, le=1)
    void: float = Field(default=0.1, ge=0)
    void_reach: float = Field(default=4.0, ge=0)
    red_reach: float = Field(default=5.0, ge=0)
    unseen: float = Field(default=0.5, ge=0)
    doubt: float = Field(default=3.0, ge=0)
    sure: float = Field(default=50.0, ge=0)
    fade: float = Field(default=3.0, gt=0)
    certain: float = Field(default=3.0, gt=0)
    trail: int = Field(default=600, ge=1)
    wall: float = Field(default=1.0, gt=0)
    room: float = Field(default=0.5, ge=0)
    shy: float = Field(default=1.3, gt=0)
    tight: float = Field(default=15.0, ge=0)
    crowd: float = Field(default=2.0, ge=0)
    near: float = Field(default=1.5, ge=0)
    reach: float = Field(default=5.0, gt=0)
    squares: SquareMapConfig = Field(default_factory=SquareMapConfig)
    bumps: BumpsConfig = Field(default_factory=BumpsConfig)

    def looking_every(self, steps: int) -> Self:
        """Return the same map for a robot that looks every so many control steps."""
        counts = ("mark_every", "plan_every", "trail")
        return self.model_copy(update={n: max(getattr(self, n) // steps, 1) for n in counts})


class LocalMap:
    """Remembers scans in a square that moves with the robot, in the frame ``odom``.

    Attributes:
        target: Where the robot was told to head for last, sub-goal or goal, in ``odom`` [m], shape
            (2,).
        plan: The last one.
    """

    def __init__(
        self,
        grid: PolarGrid,
        config: LocalMapConfig | None = None,
        robot: RobotModel | None = None,
        around: float = 0.0,
        squares: SquareForest | None = None,
    ) -> None:
        """Lay out an empty map.

        Args:
            grid: Of the scans.
            config: Numbers.
            robot: Whose body drives.
            around: The way to the goal is known wherever it costs no more than the best one and
                this [m]: what rollouts look up.
            squares: Judges cells of the map by the clouds behind the scans; None leaves that to the
                scans' own cells.

        Raises:
            ValueError: If the squares are no cells of the map.
        """
        self.config = config or LocalMapConfig()
        self._grid = grid
        robot = robot or RobotModel()
        n, cell = self.config.cells, self.config.cell
        self._evidence = np.zeros((n, n), dtype=np.float32)
        self._tiles = Tiles(cell / 2, self.config.bumps.cells)
        self._bumps = Bumps(cell / 2, self.config.bumps)
        self._unjudged = np.zeros((n, n), dtype=np.float32)
        self._squares: SquareMap | None = None
        if squares is not None:
            edge = SQUARE * squares.cell
            if not math.isclose(cell, edge):
                raise ValueError(
                    f"local_map.cell: expected {edge:g} m, as large as the squares "
                    f"that the classifier knows, got {cell:g} m; train one for these"
                )
            self._squares = SquareMap(n, squares, self.config.squares)
        prices = Prices(**{name: getattr(self.config, name) for name in Prices._fields})
        under = robot.width / 2 - _RIM
        passage = (robot.half_radius + _PASSAGE, under, robot.length)
        spans = (self.config.near, self.config.reach)
        self.plan = LocalPlan(n, cell, prices, spans, around, passage)
        reach = int(grid.outer_radius / cell) + 1
        middles = np.arange(-reach, reach + 1) * cell
        # The middle of each cell and its corners, relative to the robot's own cell.
        x = middles[:, None, None] + cell / 2 * np.array([0, 1, 1, -1, -1])
        y = middles[None, :, None] + cell / 2 * np.array([0, 1, -1, 1, -1])
        ranges = np.hypot(x, y)
        rings = np.searchsorted(grid.ring_edges, ranges, side="right") - 1
        rings[(rings < 0) | (rings >= grid.n_rings)] = _BEYOND
        self._rings = rings
        self._under = under
        self._bearings = np.arctan2(*np.broadcast_arrays(y, x)).astype(np.float32)
        ranges = ranges[:, :, 0]
        fading = 1.0 / (1.0 + ranges / self.config.fade)
        reaches = [ranges < self.config.void_reach, ranges < self.config.red_reach]
        self._weights = np.stack([fading, *reaches], axis=2)
        self._centre = np.zeros(2, dtype=np.int64)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._evidence[:] = 0.0
        self._bumps.reset()
        if self._squares is not None:
            self._squares.reset()
        self._cloud: PointCloud | None = None
        self._centre[:] = 0
        self._looks = 0
        self._subgoal: NDArray[np.float64] | None = None
        self._aim = np.full(2, np.inf)
        self._fence = EVERYWHERE
        self.target: NDArray[np.float64] = np.zeros(2)
        self.plan.reset()

    def guide(self, view: View) -> View:
        """Remember what a view holds, and return it with the sub-goal in the goal's place.

        The ranges of its scan end at the walls that are remembered, edges among them.
        """
        # What was seen keeps its place in odom.
        odds, there = view.scan.odds_of(self._grid), view.odometry
        here, yaw = there.position[:2], there.yaw
        self.look_down(view.cloud, here)
        self.keep_inside(view.area, view.pose, view.odometry)
        bearing = self.bearing(odds, here, yaw, view.heading_error, view.goal_distance)
        ranges = self.shortened(view.scan.ranges, here, yaw)
        return replace(view, heading_error=bearing, scan=replace(view.scan, ranges=ranges))

    def look_down(self, cloud: PointCloud | None, here: NDArray[np.float64]) -> None:
        """Remember the squares and the bumps of a cloud, once.

        Args:
            cloud: In ``odom``; None has none.
            here: Position of the robot there [m], shape (2,).
        """
        if cloud is not None and cloud is not self._cloud:
            self._tiles.describe(cloud.points, here)
            self._bumps.take(self._tiles, here)
            if self._squares is not None:
                self._squares.take(self._tiles, here)
            self._cloud = cloud

    def keep_inside(
        self, area: Area | None, pose: Pose | None = None, odometry: Pose | None = None
    ) -> None:
        """Put a fence around an area.

        Args:
            area: In the map; None takes the fence away.
            pose: The robot's in the map; None where map and ``odom`` are the same.
            odometry: The same in ``odom``.
        """
        self._fence = EVERYWHERE
        if area is None:
            return
        c, s, shift = 1.0, 0.0, np.zeros(2)
        if pose is not None and odometry is not None:
            c, s = math.cos(pose.yaw - odometry.yaw), math.sin(pose.yaw - odometry.yaw)
            x, y = odometry.position[:2]
            shift = pose.position[:2] - [c * x - s * y, s * x + c * y]
        self._fence = np.array([c, s, *shift, *area])

    def bearing(
        self,
        odds: NDArray[np.float32],
        here: NDArray[np.float64],
        yaw: float,
        bearing: float,
        distance: float,
    ) -> float:
        """Remember a scan and return the bearing to head for, relative to the heading [rad].

        Args:
            odds: Of the scan's cells, as ``VirtualScan.odds_of`` gives them.
            here: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Its heading there [rad].
            bearing: Bearing of the goal relative to the heading [rad].
            distance: Of the goal [m].
        """
        config = self.config
        if self._looks % config.mark_every == 0:
            self.mark(odds, here, yaw)
        goal = here + distance * np.array([math.cos(yaw + bearing), math.sin(yaw + bearing)])
        if self._looks % config.plan_every == 0 or math.dist(goal, self._aim) > _ANOTHER_GOAL:
            self._subgoal, self._aim = self.subgoal(here, goal), goal
        self._looks += 1
        self.target = goal if self._subgoal is None else self._subgoal
        if self._subgoal is None:
            return bearing
        ahead = self._subgoal - here
        return wrap(math.atan2(ahead[1], ahead[0]) - yaw)

    def shortened(
        self, ranges: NDArray[np.float32], here: NDArray[np.float64], yaw: float
    ) -> NDArray[np.float32]:
        """Return ranges that end at remembered walls where they did not yet, shape (n,).

        Args:
            ranges: Of a scan [m], shape (n,).
            here: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Its heading there [rad].
        """
        config = self.config
        found = ranges.astype(np.float32)
        limits = (config.cell, config.wall, config.reach)
        _shorten(found, self._evidence, self._centre, here, yaw, self._grid.bearings, limits)
        return found

    def mark(self, odds: NDArray[np.float32], here: NDArray[np.float64], yaw: float) -> None:
        """Remember a scan.

        Args:
            odds: Of the scan's cells, as ``VirtualScan.odds_of`` gives them.
            here: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Its heading there [rad].
        """
        config = self.config
        follow(self._evidence, self._centre, here, config.cell)
        _forget(self._evidence, config.certain, config.certain * config.mark_every / config.trail)
        _mark(
            self._evidence,
            self._centre,
            (here[0] / config.cell, here[1] / config.cell, self._under / config.cell, yaw),
            odds,
            self._rings,
            self._bearings,
            self._weights,
            (config.blocked, config.free, config.void, config.certain),
            (config.surely_red, config.surely_green),
            self._squares is not None and self._cloud is not None,
        )
        squares = self._unjudged
        if self._squares is not None:
            self._squares.follow(here)
            squares = self._squares.odds
            _take_over(
                self._evidence, squares, config.certain / config.squares.most, config.certain
            )
        half, doubt = len(self._rings) // 2, config.bumps.doubt
        bumps = (self._bumps.rises, self._bumps.centre, config.wall / config.bumps.rise)
        _raise(self._evidence, self._centre, half, bumps, squares, config.certain, doubt)

    def subgoal(
        self, here: NDArray[np.float64], goal: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Return where to head for in ``odom`` [m]; None is the goal itself, straight and free.

        Args:
            here: Position of the robot in ``odom`` [m], shape (2,).
            goal: Goal in ``odom`` [m], shape (2,).

        Raises:
            ValueError: If one of them is no place: it would be looked up beyond the square.
        """
        if not (np.isfinite(here).all() and np.isfinite(goal).all()):
            raise ValueError(f"goal: expected finite places in odom [m], got {goal} from {here}")
        return self.plan.make(self._evidence, self._centre, self._fence, here, goal)


@njit(cache=True, nogil=True, error_model="numpy")
def _forget(evidence, certain, step):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Move what is known of driven ground a step towards what is known of free ground."""
    for i in range(len(evidence)):
        for j in range(len(evidence)):
            if evidence[i, j] <= -certain:
                evidence[i, j] += step


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def _take_over(evidence, odds, scale, certain):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write what is known of squares over what cells of the scan told, where nobody has driven."""
    n = len(evidence)
    least = -_KNOWN_FREE * certain
    for i in range(n):
        for j in range(n):
            if odds[i, j] != 0.0 and evidence[i, j] > -certain:
                evidence[i, j] = min(max(scale * odds[i, j], least), certain)


@njit(cache=True, nogil=True, error_model="numpy")
def _raise(evidence, centre, half, bumps, squares, certain, doubt):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Raise the evidence where the ground has bumps, or beside them, and nobody has driven.

    Beside them, because bumps and the gaps between walls are told by the middles of cells. Squares
    that are surely free have no bumps.
    """
    rises, middle, steepness = bumps
    n, m = len(evidence), len(rises)
    half = min(half, m // 4 - 1)
    for a in range(centre[0] - half, centre[0] + half + 1):
        for b in range(centre[1] - half, centre[1] + half + 1):
            i, j = a & (n - 1), b & (n - 1)
            if evidence[i, j] <= -certain or squares[i, j] < -doubt:
                continue
            for u in range(2 * a - 1, 2 * a + 3):
                for v in range(2 * b - 1, 2 * b + 3):
                    rise = rises[u & (m - 1), v & (m - 1)]
                    if rise > 0 and max(abs(u - middle[0]), abs(v - middle[1])) < m // 2:
                        evidence[i, j] = max(evidence[i, j], min(steepness * rise, certain))


@njit(cache=True, nogil=True, error_model="numpy")
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
