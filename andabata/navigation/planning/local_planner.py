"""Local planner: an occupancy grid, a shortest path over it, a sub-goal, and rollouts.

A scan sees 10 m and remembers nothing; a robot that steers by it alone cannot leave a deep dead end
(goal 3 of Sanchez et al. 2023). The occupancy grid remembers where scans saw a way and where not,
and near the robot what clouds show of each of its cells; the grid planner finds a path over it to
the goal, and the farthest point of the path that can be headed for straight away is the sub-goal
(assumption: the paper has nothing of the kind).
"""

import math
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.pose import Pose, wrap
from andabata.machine.robot import RobotModel
from andabata.navigation.arrival import ARRIVAL_DISTANCE
from andabata.navigation.controller import ControllerInput
from andabata.navigation.map_crops import RobotMap
from andabata.navigation.mover_tracks import TrackedMovers
from andabata.navigation.planning.cartesian_layers import CartesianLayers
from andabata.navigation.planning.cost_map import CostConfig, CostWeights, Passage
from andabata.navigation.planning.geofence_bounds import EVERYWHERE, geofence_in_odom
from andabata.navigation.planning.grid_planner import GridPlanner
from andabata.navigation.planning.ground_layer import GroundLayerConfig
from andabata.navigation.planning.low_obstacle_layer import LowObstacleLayerConfig
from andabata.navigation.planning.map_transform import MapTransform, transform_of
from andabata.navigation.planning.occupancy_config import OccupancyGridConfig
from andabata.navigation.planning.occupancy_grid import OccupancyGrid
from andabata.navigation.planning.prior_map import PriorMap
from andabata.navigation.planning.trajectory_rollouts import (
    TrajectoryRollouts,
    TrajectoryRolloutsConfig,
)
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan
from worlds.world import Geofence

_PASSAGE = 0.2
"""Clearance around the body where the middle of the robot has been [m]."""

_ANOTHER_GOAL = 3.0
"""Distance by which a goal has to jump to count as another one [m]."""


class LocalPlannerConfig(BaseModel):
    """Settings of the local planner.

    Attributes:
        occupancy: Settings of the occupancy grid.
        ground: Settings of the ground layer.
        low_obstacles: Settings of the low obstacle layer.
        costs: Costs of a metre.
        replan_every: Number of scans, one a control step, between two plans.
        min_lookahead: Distance of the nearest sub-goal [m]: what lies within the turning circle
            cannot be headed for.
        max_lookahead: Distance of the farthest sub-goal [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    occupancy: OccupancyGridConfig = Field(default_factory=OccupancyGridConfig)
    ground: GroundLayerConfig = Field(default_factory=GroundLayerConfig)
    low_obstacles: LowObstacleLayerConfig = Field(default_factory=LowObstacleLayerConfig)
    costs: CostConfig = Field(default_factory=CostConfig)
    replan_every: int = Field(default=5, ge=1)
    min_lookahead: float = Field(default=1.5, ge=0)
    max_lookahead: float = Field(default=5.0, gt=0)

    def decimated(self, steps: int) -> Self:
        """Return the settings for a robot that scans once in a number of control steps."""
        occupancy = self.occupancy
        counts = ("update_every", "driven_memory")
        fewer = {name: max(getattr(occupancy, name) // steps, 1) for name in counts}
        return self.model_copy(
            update={
                "occupancy": occupancy.model_copy(update=fewer),
                "replan_every": max(self.replan_every // steps, 1),
            }
        )


class LocalPlanner:
    """Plans a way to the goal over the occupancy grid around the robot, in ``odom``.

    Attributes:
        config: Settings.
        occupancy: Occupancy grid.
        plan: Costs and cost to go of the last plan.
        target: Sub-goal, or goal, of the last plan in ``odom`` [m], shape (2,).
    """

    def __init__(
        self,
        grid: PolarGrid,
        config: LocalPlannerConfig | None = None,
        robot: RobotModel | None = None,
        rollouts: TrajectoryRolloutsConfig | None = None,
        goal_radius: float = ARRIVAL_DISTANCE,
        prior: PriorMap | None = None,
        only_checks: bool = False,
    ) -> None:
        """Begin with an empty grid.

        Args:
            grid: Polar grid of the scans.
            config: Settings, counted in scans.
            robot: Body, speed and limits.
            rollouts: Settings of the rollouts that check commands; None lets them pass.
            goal_radius: Distance from the goal at which the robot stops [m].
            prior: Costs of the ground that were known beforehand; None for none.
            only_checks: True for controllers that command their own speed: the rollouts replace
                their commands only where the body has no room, or after ``rollouts.patience``.
        """
        self.config = config or LocalPlannerConfig()
        self._grid = grid
        robot = robot or RobotModel()
        occupancy = self.config.occupancy
        self.occupancy = OccupancyGrid(grid, occupancy, robot.width)
        self._only_checks = only_checks
        self._rollouts = None
        if rollouts is not None:
            self._rollouts = TrajectoryRollouts(robot, rollouts, goal_radius)
        self.plan = GridPlanner(
            occupancy.cells,
            occupancy.cell,
            CostWeights.of(self.config.costs, occupancy.lethal_log_odds, occupancy.max_log_odds),
            (self.config.min_lookahead, self.config.max_lookahead),
            0.0,
            Passage(robot.half_radius + _PASSAGE, self.occupancy.driven_radius, robot.length),
            prior,
        )
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.occupancy.reset()
        self.plan.reset()
        if self._rollouts is not None:
            self._rollouts.reset()
        self._scans = 0
        self._subgoal: NDArray[np.float64] | None = None
        self._planned_for = np.full(2, np.inf)
        self._geofence = EVERYWHERE
        self._movers: TrackedMovers | None = None
        self.target: NDArray[np.float64] = np.zeros(2)

    def guide(self, situation: ControllerInput, layers: CartesianLayers | None) -> ControllerInput:
        """Remember a scan, and return the situation with the sub-goal in the goal's place.

        The ranges of its scan end at the obstacles that are remembered.

        Args:
            situation: Situation with the goal itself.
            layers: Layers of the ground around the robot; None without clouds.
        """
        # What was seen keeps its place in odom; the map's pose may jump.
        scan, odometry = situation.scan, situation.odometry
        position, yaw = odometry.position[:2], odometry.yaw
        if layers is not None and self._scans % self.config.occupancy.update_every == 0:
            layers.update(position)
        self._movers = None
        if layers is not None and layers.movers is not None:
            self._movers = layers.movers.movers
        self.keep_inside(situation.geofence, situation.pose, odometry)
        odds, goal_distance = scan.log_odds_of(self._grid), situation.goal_distance
        bearing = self.bearing(odds, position, yaw, situation.heading_error, goal_distance, layers)
        reach = self.config.max_lookahead
        ranges = self.occupancy.end_ranges(scan.ranges, position, yaw, reach)
        ended = VirtualScan(ranges, scan.max_range, scan.log_odds)
        return situation._replace(heading_error=bearing, scan=ended, around=self.around)

    @property
    def around(self) -> RobotMap:
        """Map around the robot, valid until the next scan."""
        config, plan = self.config, self.plan
        return RobotMap(
            log_odds=self.occupancy.log_odds,
            centre=self.occupancy.centre,
            clearance=plan.clearance,
            corner=plan.corner,
            cell=config.occupancy.cell,
            lethal_log_odds=config.occupancy.lethal_log_odds,
            max_log_odds=config.occupancy.max_log_odds,
            far_clearance=config.costs.inflation_radius / config.occupancy.cell,
            target=self.target,
        )

    def select(self, situation: ControllerInput, command: Twist) -> Twist:
        """Return the controller's command, or a safer one by the rollouts."""
        if self._rollouts is None:
            return command
        odometry, cell = situation.odometry, self.config.occupancy.cell
        at = (self.plan, cell, odometry.position[:2], odometry.yaw)
        if self._only_checks:
            return self._rollouts.check(*at, command, situation.stalled_time, self._movers)
        return self._rollouts.select(*at, command.angular, self._movers)

    def keep_inside(
        self, geofence: Geofence | None, pose: Pose | None = None, odometry: Pose | None = None
    ) -> None:
        """Plan inside a geofence.

        Args:
            geofence: Bounds in the map, or None.
            pose: Pose of the robot in the map; None where map and ``odom`` are the same.
            odometry: Pose of the robot in ``odom``.
        """
        if pose is None or odometry is None:
            self._geofence = geofence_in_odom(geofence, MapTransform())
            return
        self.plan.map_of_odom = transform_of(pose, odometry)
        self._geofence = geofence_in_odom(geofence, self.plan.map_of_odom)

    def bearing(
        self,
        odds: NDArray[np.float32],
        position: NDArray[np.float64],
        yaw: float,
        bearing: float,
        distance: float,
        layers: CartesianLayers | None = None,
    ) -> float:
        """Remember a scan and return the bearing to head for, relative to the heading [rad].

        Args:
            odds: Log odds of the scan's cells, as ``VirtualScan.log_odds_of`` gives them.
            position: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Heading there [rad].
            bearing: Bearing of the goal relative to the heading [rad].
            distance: Distance of the goal [m].
            layers: Layers of the ground around the robot; None without clouds.
        """
        config = self.config
        if self._scans % config.occupancy.update_every == 0:
            self.occupancy.update(odds, position, yaw, layers)
        goal = position + distance * np.array([math.cos(yaw + bearing), math.sin(yaw + bearing)])
        is_due = self._scans % config.replan_every == 0
        if is_due or math.dist(goal, self._planned_for) > _ANOTHER_GOAL:
            self._subgoal, self._planned_for = self.subgoal(position, goal), goal
        self._scans += 1
        self.target = goal if self._subgoal is None else self._subgoal
        if self._subgoal is None:
            return bearing
        ahead = self._subgoal - position
        return wrap(math.atan2(ahead[1], ahead[0]) - yaw)

    def subgoal(
        self, position: NDArray[np.float64], goal: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Return the sub-goal in ``odom`` [m]; None is the goal itself, straight and free.

        Args:
            position: Position of the robot in ``odom`` [m], shape (2,).
            goal: Goal in ``odom`` [m], shape (2,).

        Raises:
            ValueError: If one of them is not finite: it would be looked up beyond the square.
        """
        if not all(map(math.isfinite, (*position.tolist(), *goal.tolist()))):
            raise ValueError(
                f"goal: expected finite places in odom [m], got {goal} from {position}"
            )
        grid = self.occupancy
        return self.plan.plan(grid.log_odds, grid.centre, self._geofence, position, goal)
