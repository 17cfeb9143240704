"""Seams of the navigator: what a controller and a planner are given, and what they answer."""

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import Twist
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import VehicleState
from andabata.navigation.map_crops import RobotMap
from andabata.navigation.planning.cartesian_layers import CartesianLayers
from traversability.virtual_scan import VirtualScan
from worlds.world import Geofence


class ControllerInput(NamedTuple):
    """The situation as the robot knows it.

    Attributes:
        stamp: Time [s].
        perceived: Virtual scan as perception gives it, in ``base_footprint``.
        scan: Virtual scan for the controller: the planner ends its ranges at remembered obstacles.
        heading_error: Bearing of the goal, or of the planner's sub-goal, relative to the heading
            [rad], (-pi, pi].
        goal_distance: Estimated horizontal distance to the goal [m].
        previous_steering: The last two executed yaw rates, newest first [rad/s].
        pose: Estimated pose in the map.
        odometry: Estimated pose in ``odom``, which drifts and never jumps.
        goal: Goal in the map [m], shape (2,).
        truth: True state, for the oracle alone (simulation only).
        geofence: Bounds in the map that a field robot is given with its goals, or None.
        previous_speed: Last executed speed [m/s].
        stalled_time: Time since the robot was last nearer to the goal than before [s].
        around: Map of the planner, valid until its next scan; None without a planner.
    """

    stamp: float
    perceived: VirtualScan
    scan: VirtualScan
    heading_error: float
    goal_distance: float
    previous_steering: tuple[float, float]
    pose: Pose
    odometry: Pose
    goal: NDArray[np.float64]
    truth: VehicleState | None = None
    geofence: Geofence | None = None
    previous_speed: float = 0.0
    stalled_time: float = 0.0
    around: RobotMap | None = None


class Controller(Protocol):
    """Decides how to move: a policy, a law, the oracle."""

    def reset(self) -> None:
        """Forget the last drive."""

    def act(self, situation: ControllerInput) -> Twist:
        """Return the wanted twist; the robot applies limits and dead zone."""


class Planner(Protocol):
    """Leads a controller: names a sub-goal before it acts, and checks its command after."""

    def reset(self) -> None:
        """Forget the last drive."""

    def guide(self, situation: ControllerInput, layers: CartesianLayers | None) -> ControllerInput:
        """Return the situation with the sub-goal in the goal's place.

        Args:
            situation: Situation with the goal itself.
            layers: Layers of the ground around the robot; None without clouds.
        """

    def select(self, situation: ControllerInput, command: Twist) -> Twist:
        """Return the controller's command, or a safer one."""


class NoPlanner:
    """Leaves the goal and the command as they are."""

    def reset(self) -> None:
        """Nothing is remembered."""

    def guide(self, situation: ControllerInput, layers: CartesianLayers | None) -> ControllerInput:
        """Return the situation as it is."""
        return situation

    def select(self, situation: ControllerInput, command: Twist) -> Twist:
        """Return the command as it is."""
        return command


@dataclass(frozen=True)
class Steering:
    """What steers a robot.

    Attributes:
        controller: Source of commands; None for a learner that drives from outside.
        planner: Source of sub-goals and safer commands.
        action_repeat: Number of control steps between two decisions.
        knows_truth: True for the oracle, which drives by the true pose and arrives by it, too.
    """

    controller: Controller | None = None
    planner: Planner = field(default_factory=NoPlanner)
    action_repeat: int = 1
    knows_truth: bool = False
