"""The upper bound: the robot's own planner and moves, on the true map and from the true pose."""

import math

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import Twist
from andabata.machine.pose import Pose, wrap
from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput
from andabata.navigation.planning.cost_map import CostWeights, Passage
from andabata.navigation.planning.grid_planner import GridPlanner
from andabata.navigation.planning.local_planner import LocalPlannerConfig
from andabata.navigation.planning.trajectory_rollouts import (
    TrajectoryRollouts,
    TrajectoryRolloutsConfig,
)
from andabata.navigation.reactive import StraightController
from worlds.traversability_map import Reason
from worlds.world import World

_FREE, _LETHAL, _BLOCKED = -1.0, 1.0, 1000.0
"""Log odds of free cells, from which on a cell is an obstacle, and of the true obstacles: a metre
through one costs more than any way around it."""


class OracleController:
    """Plans over the true map and selects among the moves that the robot's planner has.

    It knows what no robot knows, the true map and the true pose, and moves as ``planner`` does: the
    same arcs, turns on the spot, arcs backwards and speeds, by the same prices.
    """

    def __init__(
        self,
        world: World,
        robot: RobotModel,
        costs: LocalPlannerConfig | None = None,
        rollouts: TrajectoryRolloutsConfig | None = None,
    ) -> None:
        """Prepare for one world.

        Args:
            world: World whose true map is used.
            robot: Body, speed and limits.
            costs: Costs of a metre and distances of sub-goals: those of the robot's planner.
            rollouts: Moves and their prices: those of the robot's planner.
        """
        config = costs or LocalPlannerConfig()
        self._truth = world.truth
        self._corner = np.array([world.truth.x_min, world.truth.y_min])
        self._law = StraightController(robot.speed)
        self._rollouts = TrajectoryRollouts(robot, rollouts or TrajectoryRolloutsConfig())
        # Nothing is unknown here.
        known = config.costs.model_copy(update={"unknown_cost": 0.0})
        self._plan = GridPlanner(
            max(world.truth.reason.shape),
            world.truth.cell,
            CostWeights.of(known, _LETHAL, _BLOCKED),
            (config.min_lookahead, config.max_lookahead),
            math.inf,
            Passage(0.0, 0.0, 0.0),
        )
        self.reset()

    def reset(self) -> None:
        """Forget the goal."""
        self._goal: NDArray[np.float64] | None = None
        self._rollouts.reset()

    def act(self, situation: ControllerInput) -> Twist:
        """Return the first move of the cheapest way to the goal.

        Raises:
            ValueError: If the situation holds no true state.
        """
        if situation.truth is None:
            raise ValueError(
                "truth: expected the true state (the oracle drives in simulation only), got none"
            )
        pose = situation.truth.pose
        # Where the rest of the way leads, then the move that the robot would select.
        error = self._heading_error(pose, situation.goal)
        command = self._law.act(situation._replace(heading_error=error))
        return self._rollouts.select(
            self._plan, self._truth.cell, pose.position[:2], pose.yaw, command.angular
        )

    def _heading_error(self, pose: Pose, goal: NDArray[np.float64]) -> float:
        """Return the bearing of the sub-goal relative to the heading [rad]."""
        position = pose.position[:2]
        if self._goal is None or not np.array_equal(self._goal, goal):
            self._goal = np.array(goal, dtype=np.float64)
            self._plan.plan_known(*self._known(), self._corner, position, self._goal)
        subgoal = self._plan.subgoal(position)
        ahead = (self._goal if subgoal is None else subgoal) - position
        return wrap(math.atan2(ahead[1], ahead[0]) - pose.yaw)

    def _known(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return log odds and clearance [m] of the true map as a square, shape (n, n) each."""
        truth, n = self._truth, len(self._plan.costs)
        rows, columns = truth.reason.shape
        log_odds = np.full((n, n), _BLOCKED, dtype=np.float32)
        clearance = np.zeros((n, n), dtype=np.float32)
        log_odds[:rows, :columns][truth.reason == Reason.FREE] = _FREE
        clearance[:rows, :columns] = truth.clearance
        return log_odds, clearance
