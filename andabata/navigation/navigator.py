"""The robot's story, one control step at a time."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.localization.localizer import Health, Localizer
from andabata.machine.kinematics import SkidSteer, apply_dead_zone
from andabata.machine.pose import Pose, wrap
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.navigation.controller import Controller, ControllerInput
from andabata.navigation.perception import Perception
from worlds.world import Geofence

STANDSTILL = WheelSpeeds(0.0, 0.0)


@dataclass(frozen=True)
class Step:
    """One control step, for whoever watches.

    Attributes:
        readings: What came in.
        view: What was made of it; None before the first scan.
        goal: Where to [m], shape (2,).
        wheels: What went out.
        speed: Forward speed of it [m/s].
        steering: Yaw rate of it [rad/s].
    """

    readings: SensorReadings
    view: ControllerInput | None
    goal: NDArray[np.float64]
    wheels: WheelSpeeds
    speed: float
    steering: float


class Navigator:
    """Sensor readings in, wheel speeds out: the same in simulation, in training and on a record.

    The vehicle keeps the paper's constant longitudinal speed, or the share of it that its
    controller asks for; it stands still until there is a first scan.

    Attributes:
        start: Pose in the map and stamp [s] that the last ``reset`` was told, None before.
        geofence: Where the robot may be; see ``ControllerInput``.
    """

    def __init__(
        self,
        robot: RobotModel,
        localizer: Localizer,
        perception: Perception,
        controller: Controller | None = None,
    ) -> None:
        """Put a robot's mind together.

        Args:
            robot: Speed, steering limit and dead zone.
            localizer: Where am I.
            perception: How far is it free.
            controller: Where to steer; None when a learner drives through ``listen``, ``look`` and
                ``command``.
        """
        self._robot = robot
        self._kinematics = SkidSteer(robot)
        self._localizer = localizer
        self._perception = perception
        self._controller = controller
        self._goal = np.zeros(2)
        self._answer = (0.0, 1.0)
        self._stands = 0
        self.start: tuple[Pose, float] | None = None
        self._previous = (0.0, 0.0)
        self._watcher: Callable[[Step], None] | None = None
        self.geofence: Geofence | None = None

    def watch(self, watcher: Callable[[Step], None] | None) -> None:
        """Call ``watcher`` after every step; it sees everything and changes nothing.

        For it the navigator looks at each step, also where no decision is due.
        """
        self._watcher = watcher

    def reset(self, pose: Pose, stamp: float, rough: bool = False) -> None:
        """Forget everything and start at a pose at ``stamp`` [s]; ``rough`` if senses told it."""
        self.start = (pose, stamp)
        self._localizer.reset(pose, stamp, rough)
        self._perception.reset()
        self._previous = (0.0, 0.0)
        self._stands = 0
        if self._controller is not None:
            self._controller.reset()

    def set_goal(self, goal: NDArray[np.float64]) -> None:
        """Head for ``goal``, map coordinates [m], shape (2,)."""
        if not np.array_equal(goal, self._goal):
            self._goal = np.array(goal, dtype=np.float64)
            self._stands = 0

    def step(self, readings: SensorReadings) -> WheelSpeeds:
        """Turn one control period of senses into wheel speeds.

        Raises:
            ValueError: If the navigator has no controller.
        """
        self.listen(readings)
        return self.decide(readings)

    def listen(self, readings: SensorReadings) -> None:
        """Take in senses: where am I, and what is around."""
        self._localizer.update(readings)
        self._perception.take(readings, self._localizer)

    def decide(self, readings: SensorReadings) -> WheelSpeeds:
        """Return the wheel speeds at the end of a control period whose senses were listened to.

        Raises:
            ValueError: If the navigator has no controller.
        """
        if self._controller is None:
            raise ValueError("controller: expected one, got None; use look and command instead")
        due, wheels = self._stands == 0, STANDSTILL
        view = self.look(readings) if due or self._watcher is not None else None
        if due and view is not None:
            self._answer = self._controller.steer(view), self._controller.pace
            self._stands = self._controller.hold
        if self._stands > 0:
            self._stands -= 1
            wheels = self.command(*self._answer)
        if self._watcher is not None:
            still = wheels is STANDSTILL
            pace = self._robot.speed * self._answer[1]
            speed, steering = (0.0, 0.0) if still else (pace, self._previous[0])
            self._watcher(Step(readings, view, self._goal, wheels, speed, steering))
        return wheels

    def look(self, readings: SensorReadings) -> ControllerInput | None:
        """Return the situation after senses that were listened to, None before the first scan."""
        scan = self._perception.look(readings.stamp, self._localizer)
        if scan is None:
            return None
        pose = self._localizer.pose
        to_goal = self._goal - pose.position[:2]
        return ControllerInput(
            stamp=readings.stamp,
            scan=scan,
            heading_error=wrap(float(np.arctan2(to_goal[1], to_goal[0])) - pose.yaw),
            goal_distance=float(np.hypot(*to_goal)),
            previous_steering=self._previous,
            pose=pose,
            odometry=self._localizer.odometry,
            goal=self._goal,
            truth=readings.truth,
            geofence=self.geofence,
            recent=self._perception.recent,
        )

    def command(self, steering: float, pace: float = 1.0) -> WheelSpeeds:
        """Return the wheel speeds for a wanted yaw rate, after limits and dead zone.

        A robot that is lost holds still.

        Args:
            steering: Wanted yaw rate [rad/s].
            pace: Share of the robot's speed.

        Raises:
            ValueError: If the steering is not a finite number.
        """
        if not np.isfinite(steering):
            raise ValueError(f"steering: expected a finite yaw rate [rad/s], got {steering}")
        if self._localizer.health is Health.LOST:
            self._previous = (0.0, self._previous[0])
            return STANDSTILL
        limit = self._robot.max_steering
        executed = apply_dead_zone(min(max(steering, -limit), limit), self._robot.dead_zone)
        self._previous = (executed, self._previous[0])
        return self._kinematics.wheel_speeds(self._robot.speed * pace, executed)
