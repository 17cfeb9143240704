"""Monitor of a drive that ends with the robot's own word, judged by the true state."""

import math

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.strict_verdict import StrictMeasures, StrictVerdict
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState
from andabata.tasks.episode_monitor import EpisodeMonitor
from andabata.tasks.terminations import Ending, Outcome, TerminationConfig
from traversability.virtual_scan import VirtualScan
from worlds.world import World

_EDGE = 0.05
"""Distance from the world's edge at which a body has left it [m]: a kinematic one stops there, one
with physics falls from there."""


def arrival_tolerance(config: SimulatedRobotConfig) -> float:
    """Return how much farther than the goal's radius a robot may be when it declares arrival [m].

    It is the root mean square (drms) of the slow error of the robot's receiver in the plane: fixes
    that are wrong by the same for minutes are all that a robot knows of where its goal is, and no
    filter averages that out. White noise and multipath do average out and are not forgiven. A robot
    that is given the true pose with errors is forgiven these.

    Args:
        config: Robot with its receiver and its reality.
    """
    if config.localizer == "truth":
        return math.sqrt(2) * config.errors.position_sigma
    sensors = config.sensing.proprioception
    if sensors is None:
        return 0.0
    return math.sqrt(2) * math.hypot(sensors.gnss.correlated_error, config.reality.gnss_drift)


class TrialMonitor(EpisodeMonitor):
    """Watches the true state of a drive; the robot says when it is over, the truth whether it is.

    Attributes:
        arrival_error: True distance to the goal in the step in which the robot declared it reached
            [m]; None before.
    """

    def __init__(
        self,
        world: World,
        robot: RobotModel,
        config: TerminationConfig,
        tolerance: float,
        sees_scan: bool = False,
    ) -> None:
        """Take a world, a robot and the rules of its drives.

        Args:
            world: World.
            robot: Size of the body.
            config: Rules of a drive.
            tolerance: Distance beyond the goal's radius that is forgiven; see
                ``arrival_tolerance``.
            sees_scan: True if each step is judged with the virtual scan, where there is one.

        Raises:
            ValueError: If the rules need a scan and none is seen.
        """
        forgiving = config.model_copy(update={"goal_radius": config.goal_radius + tolerance})
        super().__init__(world, forgiving, sees_scan)
        # Paths are as long as they are, whatever is forgiven at their ends.
        self.goal_radius = config.goal_radius
        self._corner = robot.length / 2, robot.width / 2
        self._half = world.ground.width / 2, world.ground.depth / 2
        self._strict = StrictVerdict(world, robot)

    def begin(self, state: VehicleState, goal: NDArray[np.float64]) -> None:
        """Start measuring a drive to ``goal``, map coordinates [m], shape (2,)."""
        super().begin(state, goal)
        self._strict.begin()
        self.arrival_error: float | None = None

    def judge(
        self, state: VehicleState, has_arrived: bool, scan: VirtualScan | None = None
    ) -> Outcome | None:
        """Take in the true state after a control step; return the outcome, None before the end.

        Args:
            state: True state.
            has_arrived: True if the robot has declared the goal reached in this step.
            scan: Latest virtual scan that the controller was given; None before the first.
        """
        before = self.time
        self.update(state, has_arrived, scan)
        self._strict.update(state, self.time - before)
        if has_arrived:
            self.arrival_error = self.goal_distance(state)
        if self._has_left(state):
            self.ending = Ending.LEFT_WORLD
        return self.ending.outcome

    @property
    def strict(self) -> StrictMeasures:
        """Measures of the strict verdict so far."""
        return self._strict.measures

    def _has_left(self, state: VehicleState) -> bool:
        """Return True if the outline reaches the edge of the world's ground, or beyond it."""
        x, y = np.abs(state.pose.position[:2]).tolist()
        c, s = abs(math.cos(state.pose.yaw)), abs(math.sin(state.pose.yaw))
        ahead, aside = self._corner
        far_x, far_y = x + c * ahead + s * aside, y + s * ahead + c * aside
        return bool(far_x > self._half[0] - _EDGE or far_y > self._half[1] - _EDGE)
