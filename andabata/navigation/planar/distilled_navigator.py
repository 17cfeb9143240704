"""Navigator that drives by a policy distilled from the sampling MPC, behind a brake shield or not.

It keeps no map. Like the MPC it identifies how the robot follows its commands while it drives: the
policy sees that, and the shield brakes by it.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.navigation.planar.brake_shield import BrakeShield
from andabata.navigation.planar.distilled_observation import (
    COMMANDS,
    check_distilled,
    command_of,
    observe,
)
from andabata.navigation.planar.dynamics import MotionState, observed
from andabata.navigation.planar.dynamics_identification import (
    DynamicsIdentification,
    DynamicsIdentificationConfig,
)
from andabata.navigation.planar.recent_hits import RecentHits
from rl.policy import Policy


class DistilledObserver:
    """Makes observations of a drive's readings, whoever drives.

    Attributes:
        hits: Places of hits in the robot's frame [m], shape (k, 2).
        past: Commands of the periods before, the oldest first: speed [m/s] and yaw rate [rad/s],
            shape (p, 2).
        dynamics: Dynamics as far as they are identified.
    """

    def __init__(self, period: float) -> None:
        """Prepare for a control period [s]."""
        self._period = period
        self._identification = DynamicsIdentification(DynamicsIdentificationConfig(), period)
        self._recent = RecentHits()
        periods = round(_MEMORY / period)
        self.past, self._speeds = np.zeros((periods, 2)), np.zeros((periods + 1, 2))
        self.reset(PlanarLidarConfig(), (0.0, 0.0))

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Forget the last drive, and its dynamics; see ``PlanarNavigator``."""
        self._recent.reset(lidar)
        self._identification.reset()
        self.past[:], self._speeds[:] = 0.0, 0.0
        self._goal, self._is_first = goal, True
        self.dynamics = self._identification.estimate().mean
        self.hits = np.zeros((0, 2))

    def observe(self, readings: PlanarReadings) -> NDArray[np.float32]:
        """Return the observation of a period, float32, shape (``OBSERVATIONS.size``,).

        Args:
            readings: Measurements at its begin.
        """
        velocity = readings.velocity
        self._speeds[:-1] = self._speeds[1:].copy()
        self._speeds[-1] = velocity.linear, velocity.angular
        if not self._is_first:
            self._identification.update(Twist(*self.past[-1].tolist()), velocity)
            self.dynamics = self._identification.estimate().mean
        self._is_first = False
        self.hits = self._recent.update(readings)
        return observe(self.hits, readings, self._goal, self.past[-COMMANDS:], self.dynamics)

    def took(self, command: Twist) -> None:
        """Take note of the command of the period that was observed."""
        self.past[:-1] = self.past[1:].copy()
        self.past[-1] = command.linear, command.angular

    def motion(self) -> MotionState:
        """Return the motion at the begin of the period that was observed, in the robot's frame."""
        return observed(0.0, 0.0, 0.0, self.past, self._speeds, self.dynamics, self._period)


class DistilledNavigator:
    """Drives to a goal by a policy.

    Attributes:
        policy: Policy.
        shield: Brake shield, None without one.
    """

    def __init__(
        self,
        vehicle: PlanarVehicleConfig,
        policy: Policy,
        has_shield: bool = False,
        name: str = "policy",
    ) -> None:
        """Prepare for a robot.

        Args:
            vehicle: Outline, limits and period of the robot; its dynamics are identified.
            policy: Policy.
            has_shield: True to drive behind a brake shield.
            name: Name of the policy, for errors.

        Raises:
            ValueError: If the policy reads or gives something else.
        """
        self.policy = check_distilled(policy, name)
        self.shield = BrakeShield(vehicle) if has_shield else None
        self._vehicle, self._observer = vehicle, DistilledObserver(vehicle.period)

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Forget the last drive, and its dynamics; see ``PlanarNavigator``."""
        self._observer.reset(lidar, goal)
        self.policy.reset()
        if self.shield is not None:
            self.shield.reset()

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the command of this period.

        Raises:
            ValueError: If the pose or the speeds are not finite.
        """
        observer = self._observer
        actions = self.policy.act(observer.observe(readings))
        command = self._vehicle.limited(command_of(actions))
        if self.shield is not None:
            command = self.shield.safe(
                command, observer.hits, observer.motion(), observer.past, observer.dynamics
            )
        observer.took(command)
        return command


_MEMORY = 1.0
"""Time over which commands and speeds are kept to find what the robot's controller asks for [s]."""
