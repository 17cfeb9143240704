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
from numpy.typing import NDArray
from pydantic import Field

from andabata.machine.pose import Pose, wrap
from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput
from andabata.navigation.planning.grid_planner import EVERYWHERE, CostWeights, GridPlanner
from andabata.navigation.planning.occupancy_grid import OccupancyGrid, OccupancyGridConfig
from traversability.cartesian.classifier import GroundClassifier
from traversability.grid import PolarGrid
from worlds.world import Geofence

_PASSAGE = 0.2
"""Where the middle of the robot has been there is this much room around the body [m]."""

_ANOTHER_GOAL = 3.0
"""A goal that jumps farther than this is another one [m]."""


class LocalPlannerConfig(OccupancyGridConfig):
    """Numbers of the map, beside those of its evidence.

    Attributes:
        plan_every: Looks between two plans.
        unseen: Extra cost of a metre where no scan has seen anything.
        doubt: Extra cost of a metre with almost enough evidence for a wall.
        sure: Extra cost of a metre with as much evidence again: a wall that was seen from near is
            not tried twice.
        room: Distance from walls that the path keeps where it can [m].
        shy: Distance from walls at which a metre costs no more [m].
        tight: Extra cost of a metre nearer to walls than ``room``.
        crowd: Extra cost of a metre at ``room``, falling to none at ``shy``.
        near: Nearest sub-goal [m]: what lies within the turning circle cannot be headed for.
        reach: Farthest sub-goal [m].
    """

    plan_every: int = Field(default=5, ge=1)
    unseen: float = Field(default=0.5, ge=0)
    doubt: float = Field(default=3.0, ge=0)
    sure: float = Field(default=50.0, ge=0)
    room: float = Field(default=0.5, ge=0)
    shy: float = Field(default=1.3, gt=0)
    tight: float = Field(default=15.0, ge=0)
    crowd: float = Field(default=2.0, ge=0)
    near: float = Field(default=1.5, ge=0)
    reach: float = Field(default=5.0, gt=0)

    def looking_every(self, steps: int) -> Self:
        """Return the same map for a robot that looks every so many control steps."""
        counts = ("mark_every", "plan_every", "trail")
        return self.model_copy(update={n: max(getattr(self, n) // steps, 1) for n in counts})


class LocalPlanner:
    """Plans a way to the goal over the evidence around the robot, in the frame ``odom``.

    Attributes:
        evidence: What it remembers.
        target: Where the robot was told to head for last, sub-goal or goal, in ``odom`` [m], shape
            (2,).
        plan: The last one.
    """

    def __init__(
        self,
        grid: PolarGrid,
        config: LocalPlannerConfig | None = None,
        robot: RobotModel | None = None,
        around: float = 0.0,
        ground_classifier: GroundClassifier | None = None,
    ) -> None:
        """Lay out an empty map.

        Args:
            grid: Of the scans.
            config: Numbers.
            robot: Whose body drives.
            around: The way to the goal is known wherever it costs no more than the best one and
                this [m]: what rollouts look up.
            ground_classifier: Judges cells of the map by the clouds behind the scans; None leaves that to the
                scans' own cells.

        Raises:
            ValueError: If the squares are not as large as the map's cells.
        """
        self.config = config or LocalPlannerConfig()
        self._grid = grid
        robot = robot or RobotModel()
        self.evidence = OccupancyGrid(grid, self.config, robot, ground_classifier)
        prices = CostWeights(**{name: getattr(self.config, name) for name in CostWeights._fields})
        passage = (robot.half_radius + _PASSAGE, self.evidence.under, robot.length)
        spans = (self.config.near, self.config.reach)
        self.plan = GridPlanner(self.config.cells, self.config.cell, prices, spans, around, passage)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.evidence.reset()
        self._looks = 0
        self._subgoal: NDArray[np.float64] | None = None
        self._aim = np.full(2, np.inf)
        self._fence = EVERYWHERE
        self.target: NDArray[np.float64] = np.zeros(2)
        self.plan.reset()

    def guide(self, view: ControllerInput) -> ControllerInput:
        """Remember what a view holds, and return it with the sub-goal in the goal's place.

        The ranges of its scan end at the walls that are remembered, edges among them.
        """
        # What was seen keeps its place in odom.
        odds, there = view.scan.log_odds_of(self._grid), view.odometry
        here, yaw = there.position[:2], there.yaw
        if self._looks % self.config.mark_every == 0:
            self.evidence.look_down(view.recent, here)
        self.keep_inside(view.geofence, view.pose, view.odometry)
        bearing = self.bearing(odds, here, yaw, view.heading_error, view.goal_distance)
        ranges = self.evidence.shortened(view.scan.ranges, here, yaw, self.config.reach)
        return replace(view, heading_error=bearing, scan=replace(view.scan, ranges=ranges))

    def keep_inside(
        self, geofence: Geofence | None, pose: Pose | None = None, odometry: Pose | None = None
    ) -> None:
        """Put a fence around an geofence.

        Args:
            geofence: In the map; None takes the fence away.
            pose: The robot's in the map; None where map and ``odom`` are the same.
            odometry: The same in ``odom``.
        """
        self._fence = EVERYWHERE
        if geofence is None:
            return
        c, s, shift = 1.0, 0.0, np.zeros(2)
        if pose is not None and odometry is not None:
            c, s = math.cos(pose.yaw - odometry.yaw), math.sin(pose.yaw - odometry.yaw)
            x, y = odometry.position[:2]
            shift = pose.position[:2] - [c * x - s * y, s * x + c * y]
        self._fence = np.array([c, s, *shift, *geofence])

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
            odds: Of the scan's cells, as ``VirtualScan.log_odds_of`` gives them.
            here: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Its heading there [rad].
            bearing: Bearing of the goal relative to the heading [rad].
            distance: Of the goal [m].
        """
        config = self.config
        if self._looks % config.mark_every == 0:
            self.evidence.mark(odds, here, yaw)
        goal = here + distance * np.array([math.cos(yaw + bearing), math.sin(yaw + bearing)])
        if self._looks % config.plan_every == 0 or math.dist(goal, self._aim) > _ANOTHER_GOAL:
            self._subgoal, self._aim = self.subgoal(here, goal), goal
        self._looks += 1
        self.target = goal if self._subgoal is None else self._subgoal
        if self._subgoal is None:
            return bearing
        ahead = self._subgoal - here
        return wrap(math.atan2(ahead[1], ahead[0]) - yaw)

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
        evidence = self.evidence
        return self.plan.make(evidence.values, evidence.centre, self._fence, here, goal)
